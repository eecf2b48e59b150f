"""Which joints of a URDF are wheels, and how large they are."""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnistep._rigid_masses import Mass
from omnistep._urdf_tree import Joint, Robot, Round, shown
from omnistep.errors import ConfigError

_Floats = NDArray[np.float64]

_NAMES = re.compile(r"wheel|whl|tyre|tire|mecanum|omni", re.IGNORECASE)
_CASTER = re.compile(r"caster|castor", re.IGNORECASE)
#: An axle with less than this sine to the ground is level.
_LEVEL = 0.1
#: Radii [m]: no wheel with rollers is larger, and in a file in millimetres all are.
RADII_M = (0.001, 2.0)
#: Radii of wheels that are sold [m]: others are of a file in inches, decimetres or the like.
_USUAL_RADII_M = (0.01, 0.5)
#: Masses of a body or a wheel [kg] that a vehicle file accepts.
_MASSES_KG = (0.001, 10000.0)
#: Largest distance from the origin, in radii: a file with radii in metres and positions in millimetres exceeds it.
_FAR = 200.0
#: Largest height of a wheel above the lowest, in radii: of parts named as wheels, and of other round parts.
_HIGH_WHEEL, _HIGH_PART = 0.25, 0.1


class Wheel(NamedTuple):
    """A wheel in the frame of the root.

    Attributes:
        axis: unit vector of its axle: it turns forward about it, (3,).
        middle_m: its middle, (3,).
        mass: of all that turns with it.
        notes: by key of the vehicle file, what was guessed.
    """

    joint: Joint
    axis: _Floats
    middle_m: _Floats
    radius_m: float
    mass: Mass
    notes: dict[str, str]

    @property
    def name(self) -> str:
        """Its link."""
        return self.joint.child

    @property
    def low_m(self) -> float:
        """Height of its lowest point above the root [m]."""
        return float(self.middle_m[2]) - self.radius_m


def find_wheels(
    robot: Robot, radius_m: float | None, not_wheels: Collection[str] = ()
) -> tuple[list[Wheel], list[Joint]]:
    """Find the wheels of a robot, and the joints of round parts on the ground that are not named as its wheels are.

    Args:
        robot: the robot.
        radius_m: radius of all wheels; None derives it from their shapes.
        not_wheels: links or joints that are no wheels.

    Raises:
        ConfigError: there are no wheels, or one lacks a radius or a mass, or is off the ground.
    """
    joints = [joint for joint in _left(robot, not_wheels) if _is_wheel(robot, joint)]
    wheels, others = _standing(robot, [_wheel(robot, joint, radius_m) for joint in joints])
    for wheel in wheels:
        _check(robot, wheel)
        if radius_m is None and not _USUAL_RADII_M[0] <= wheel.radius_m <= _USUAL_RADII_M[1]:
            noted(wheel.notes, "radius_m", "wheels of 0.01 to 0.5 m are usual: is the URDF in metres?")
    if not wheels:
        fixed = sum(joint.kind == "fixed" and bool(_NAMES.search(joint.child)) for joint in robot.joints)
        also = f" ({fixed} fixed ones are named so)" if fixed else ""
        raise ConfigError(
            f"{robot.file}: no wheels among {len(robot.joints)} joints, allowed: continuous joints about a level axis, "
            f'with "wheel" in the name{also} or a cylinder about it',
            file=robot.file,
        )
    if not 3 <= len(wheels) <= 8:
        names = ", ".join(shown(wheel.name) for wheel in wheels[:4]) + (", ..." if len(wheels) > 4 else "")
        also = "; --not-wheel NAME leaves one out" if len(wheels) > 8 else ""
        if others:
            also = f"; not named as wheels: {', '.join(shown(joint.child) for joint in others[:2])}"
        what = f"{robot.file}: {len(wheels)} wheels ({names})"
        raise ConfigError(f"{what}, allowed: 3 to 8 omni or mecanum wheels{also}", file=robot.file)
    return wheels, others


def noted(notes: dict[str, str], key: str, note: str) -> None:
    """Add a note to those on a key."""
    notes[key] = f"{notes[key]}; {note}" if key in notes else note


def leave_out(name: str) -> str:
    """Return the text with which an error names the option for a part that is not a wheel."""
    return f"; --not-wheel {shown(name)} leaves it out"


def turns(joint: Joint) -> bool:
    """Whether a joint turns without end, however the file says it."""
    if joint.kind == "revolute" and joint.range_rad is not None:
        return joint.range_rad[1] - joint.range_rad[0] >= math.tau
    return joint.kind == "continuous"


def _outermost(robot: Robot) -> list[Joint]:
    """Return the joints that turn without end about a level axis, but not those on another: rollers of a wheel."""
    found = {
        joint.name: joint
        for joint in robot.joints
        if turns(joint) and abs(robot.axis(joint)[2]) < _LEVEL and not _CASTER.search(joint.name + joint.child)
    }
    reached = set(robot.carried(robot.root, past={name for name, joint in found.items() if _looks(robot, joint)}))
    return [joint for joint in found.values() if joint.parent in reached]


def _left(robot: Robot, not_wheels: Collection[str]) -> list[Joint]:
    """Return the outermost joints that look like wheels without those that are none."""
    joints = [joint for joint in _outermost(robot) if _looks(robot, joint)]
    known = {name for joint in joints for name in (joint.name, joint.child)}
    for name in not_wheels:
        if name not in known:
            allowed = ", ".join(shown(joint.child) for joint in joints[:4]) + (", ..." if len(joints) > 4 else "")
            raise ConfigError(
                f"--not-wheel {shown(name)}: {robot.file} has no such wheel, allowed: {allowed or 'none'}",
                key="not-wheel",
            )
    return [joint for joint in joints if not {joint.name, joint.child} & set(not_wheels)]


def _looks(robot: Robot, joint: Joint) -> bool:
    return bool(_NAMES.search(joint.name) or _NAMES.search(joint.child) or _about_axle(robot, joint))


def _is_wheel(robot: Robot, joint: Joint) -> bool:
    """Whether what looks like a wheel is not under a swivel of a caster."""
    for above in robot.above(joint.parent):
        if above.kind != "fixed" and abs(robot.axis(above)[2]) > 0.7:
            if _CASTER.search(above.name + above.child):
                return False
            what = f'wheel "{shown(joint.child)}" is steered by "{shown(above.name)}"'
            allowed = "omni or mecanum wheels on axles that do not turn about the vertical"
            raise ConfigError(f"{robot.file}: {what}, allowed: {allowed}{leave_out(joint.child)}", file=robot.file)
    return True


def _shapes(robot: Robot, joint: Joint) -> list[list[Round]]:
    """Return the round shapes of a wheel in the frame of the root: those that collide, and those that are seen."""
    found: list[list[Round]] = [[], []]
    for name in robot.rigid(joint.child):
        place, link = robot.places[name], robot.links[name]
        for kind, shapes in enumerate((link.touched, link.seen)):
            for shape in shapes:
                axis = None if shape.axis is None else place.turn @ shape.axis
                found[kind].append(Round(shape.radius_m, place.point(shape.middle_m), axis))
    return found


def _about_axle(robot: Robot, joint: Joint) -> Round | None:
    """Return the largest cylinder or sphere about an axle: one that collides, else one that is only seen."""
    axis, at_m = robot.axis(joint), robot.places[joint.child].at_m
    for shapes in _shapes(robot, joint):
        fitting = []
        for shape in shapes:
            arm_m = shape.middle_m - at_m
            off_m = float(np.linalg.norm(arm_m - axis * (axis @ arm_m)))
            along = shape.axis is None or abs(float(shape.axis @ axis)) > 0.99
            if along and off_m < 0.1 * shape.radius_m:
                fitting.append(shape)
        if fitting:
            return max(fitting, key=lambda shape: shape.radius_m)
    return None


def _wheel(robot: Robot, joint: Joint, radius_m: float | None) -> Wheel:
    """Return a wheel with all that turns with it."""
    mass = Mass.joined(robot.links[name].mass.moved(robot.places[name]) for name in robot.carried(joint.child))
    axis, at_m, notes = robot.axis(joint), robot.places[joint.child].at_m, dict[str, str]()
    if abs(axis[2]) > 1e-3:
        notes["rolling_direction"] = (
            f"its axle, {math.degrees(math.asin(abs(axis[2]))):.1f} degrees off level, is level"
        )
    shape = _about_axle(robot, joint)
    if shape is None:
        heaviest = max(robot.rigid(joint.child), key=lambda name: robot.links[name].mass.mass_kg)
        com_m = robot.places[heaviest].point(robot.links[heaviest].mass.com_m)
        arm_m = float(axis @ (com_m - at_m))
        if abs(arm_m) > 1e-6:
            notes["position_m"] = f"in the middle of its mass, {1000 * abs(arm_m):.1f} mm along the axle"
    else:
        arm_m = float(axis @ (shape.middle_m - at_m))
    if radius_m is None:
        radius_m = _radius(robot, joint, shape, notes)
    return Wheel(joint, axis, at_m + axis * arm_m, radius_m, mass, notes)


def _check(robot: Robot, wheel: Wheel) -> None:
    """Refuse a wheel without mass, and one in millimetres."""
    where = f'{robot.file}: wheel "{shown(wheel.name)}"'
    low, high = RADII_M
    if not low <= wheel.radius_m <= high:
        allowed = f"{low} to {high:g}; is the file in millimetres?"
        raise ConfigError(f"{where}: radius {wheel.radius_m:g} m, allowed: {allowed}", file=robot.file)
    if (far_m := float(np.linalg.norm(wheel.middle_m))) > _FAR * wheel.radius_m:
        what = f"{where}: {far_m:g} m from the origin"
        raise ConfigError(f"{what}, allowed: {_FAR:g} radii; are places in millimetres?", file=robot.file)
    check_mass(robot, f'wheel "{shown(wheel.name)}"', wheel.mass)


def check_mass(robot: Robot, what: str, mass: Mass) -> None:
    """Reject a part that is lighter or heavier than a vehicle file accepts."""
    low, high = _MASSES_KG
    if not low <= mass.mass_kg <= high:
        allowed = f"{low} to {high:g}: an inertial with its mass"
        raise ConfigError(f"{robot.file}: {what}: mass {mass.mass_kg:g} kg, allowed: {allowed}", file=robot.file)


def _radius(robot: Robot, joint: Joint, shape: Round | None, notes: dict[str, str]) -> float:
    """Return a wheel's radius by its shapes."""
    if shape is None:
        across = [each for shapes in _shapes(robot, joint) for each in shapes if each.axis is not None]
        if not across:
            what = f'{robot.file}: wheel "{shown(joint.child)}": no cylinder or sphere about its axle'
            raise ConfigError(f"{what}, allowed: --radius in m", file=robot.file)
        shape = max(across, key=lambda each: each.radius_m)
        notes["radius_m"] = "of a cylinder that is not about the axle"
    return shape.radius_m


def _standing(robot: Robot, wheels: list[Wheel]) -> tuple[list[Wheel], list[Joint]]:
    """Return the wheels that stand on the ground, and the joints of other round parts on it.

    If some parts are named wheels, other parts are not wheels: a support ball, a brush, a drum.
    """
    if not wheels:
        return [], []
    named = [wheel for wheel in wheels if _NAMES.search(wheel.joint.name + wheel.name)]
    ground_m = min(wheel.low_m for wheel in named or wheels)
    found, others = [], []
    for wheel in wheels:
        off_m = wheel.low_m - ground_m
        is_named = any(wheel is each for each in named)
        if is_named and off_m > _HIGH_WHEEL * wheel.radius_m:
            what = f'{robot.file}: wheel "{shown(wheel.name)}" is {off_m:.3f} m above the lowest'
            allowed = f"{_HIGH_WHEEL * wheel.radius_m:.3f}, all on one ground"
            raise ConfigError(f"{what}, allowed: {allowed}{leave_out(wheel.name)}", file=robot.file)
        if not is_named and abs(off_m) > _HIGH_PART * wheel.radius_m:
            continue
        if named and not is_named:
            others.append(wheel.joint)
            continue
        if not named:
            noted(wheel.notes, "name", "a round part that touches the ground; if it is no wheel, use --not-wheel")
        if abs(off_m) > 1e-4:
            noted(wheel.notes, "position_m", f"it stands on the ground, not {1000 * off_m:.1f} mm above it")
        found.append(wheel)
    return found, others
