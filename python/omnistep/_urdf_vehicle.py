"""From a URDF to the tables of a vehicle file, with a note on every value that was guessed."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable
from typing import Any, NamedTuple

import numpy as np

from omnistep._rigid_masses import Mass
from omnistep._urdf_contradictions import note_contradictions
from omnistep._urdf_tree import Joint, Robot, shown
from omnistep._urdf_wheels import Wheel, check_mass, find_wheels, leave_out, noted, turns
from omnistep.errors import ConfigError

#: Of a hinge without damping: a dry plain bearing, as of chugo7.
_DAMPING_N_M_S_RAD = 0.3
_MOST_LIMIT_RAD = 3.0
_MOST_HINGES = 15
_LEAST_INERTIA_KG_M2 = 1e-10
#: Edges of a box [m] that a vehicle file accepts.
_EDGES_M = (0.001, 100.0)
#: Thrust of all wheels over the weight, and top speed [m/s]: of mecanum4, and the allowed range from joint limits.
_THRUST, _TOP_M_S = 2 / 3, 2.3
_THRUSTS, _TOPS_M_S = (0.02, 8.0), (0.05, 20.0)


class Table(NamedTuple):
    """A table of a vehicle file: its keys, and notes on those that were guessed."""

    kind: str
    keys: dict[str, Any]
    notes: dict[str, str]


def vehicle_tables(
    robot: Robot, *, kind: str | None, radius_m: float | None, not_wheels: Collection[str] = ()
) -> list[Table]:
    """Describe a robot as bodies, hinges, couplings, motor, rollers and wheels.

    Args:
        robot: the robot.
        kind: of its wheels, ``mecanum`` or ``omni``; None decides by their axles.
        radius_m: radius of all wheels; None derives it from their shapes.
        not_wheels: links or joints that are no wheels.

    Raises:
        ConfigError: it is no vehicle on omni or mecanum wheels.
    """
    wheels, others = find_wheels(robot, radius_m, not_wheels)
    ground_m = min(wheel.low_m for wheel in wheels)
    hinges = _hinges(robot, wheels)
    owner = _owners(robot, wheels, hinges)
    bodies = _names(robot, [robot.root, *(hinge.child for hinge in hinges)])
    tables = [_body(robot, link, name, owner, wheels, others, ground_m) for link, name in bodies.items()]
    names = _names(robot, [hinge.name for hinge in hinges])
    for hinge in hinges:
        ends = bodies[owner[hinge.parent]], bodies[hinge.child]
        tables.append(_hinge(robot, hinge, names[hinge.name], ends, ground_m))
    tables += _couplings(robot, hinges, names)
    angles, notes = _roller_angles(robot, wheels, kind)
    note_contradictions(robot, wheels, parallel=any(angles))
    tables += [_motor(wheels, sum(table.keys.get("mass_kg", 0.0) for table in tables)), _rollers(wheels, angles)]
    short = _short_names(robot, [wheel.name for wheel in wheels])
    for wheel, angle in zip(wheels, angles, strict=True):
        tables.append(_wheel(wheel, short[wheel.name], bodies[owner[wheel.joint.parent]], angle, notes))
    return tables


def _hinges(robot: Robot, wheels: list[Wheel]) -> list[Joint]:
    """Return the passive joints between the root and its wheels."""
    passed = {above.name for wheel in wheels for above in robot.above(wheel.joint.parent)}
    hinges = [joint for joint in robot.joints if joint.name in passed and _is_hinge(joint)]
    if len(hinges) > _MOST_HINGES:
        what = f"{robot.file}: {len(hinges)} passive joints carry wheels"
        raise ConfigError(f"{what}, allowed: {_MOST_HINGES}", file=robot.file)
    return hinges


def _is_hinge(joint: Joint) -> bool:
    if joint.kind == "revolute" and joint.range_rad is not None:
        return joint.range_rad[0] < joint.range_rad[1]
    return joint.kind in ("revolute", "continuous")


def _owners(robot: Robot, wheels: list[Wheel], hinges: list[Joint]) -> dict[str, str]:
    """Return the link of the body that each link belongs to; wheel links belong to no body."""
    cut = {wheel.joint.name for wheel in wheels} | {hinge.name for hinge in hinges}
    return {name: body for body in (robot.root, *(h.child for h in hinges)) for name in robot.carried(body, past=cut)}


def _names(robot: Robot, names: list[str]) -> dict[str, str]:
    """Return names that a vehicle file accepts, each of them once."""
    found: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_-]", "_", name)[:40]
        if plain in found.values():
            plain = f"{plain[:36]}_{len(found)}"
        found[name] = plain
    if len(set(found.values())) < len(found):
        raise ConfigError(f"{robot.file}: names that begin alike, allowed: 40 different letters", file=robot.file)
    return found


def _short_names(robot: Robot, names: list[str]) -> dict[str, str]:
    """Return the names of wheels without their common parts, as far as each name remains unique."""
    short = [re.sub(r"(^|[_-])(wheel|link|joint)(?=$|[_-])", "", name).strip("_-") for name in names]
    if all(short) and len(set(short)) == len(short):
        return dict(zip(names, _names(robot, short).values(), strict=True))
    return _names(robot, names)


def _body(
    robot: Robot,
    link: str,
    name: str,
    owner: dict[str, str],
    wheels: list[Wheel],
    others: list[Joint],
    ground_m: float,
) -> Table:
    """Return a body: all that is fixed to a link, as one mass."""
    own = [each for each, body in owner.items() if body == link]
    mass = Mass.joined(robot.links[each].mass.moved(robot.places[each]) for each in own)
    check_mass(robot, f'body "{shown(link)}"', mass)
    notes = dict[str, str]()
    held = [
        joint.name for joint in robot.joints if joint.kind != "fixed" and joint.child in own and joint.child != link
    ]
    for part in (joint.child for joint in others if joint.child in own):
        noted(notes, "mass_kg", f"with {shown(part)}, which touches the ground, but is not named as the wheels are")
    if held:
        held_note = f"joints held at 0: {held[0]}{f' and {len(held) - 1} more' if len(held) > 1 else ''}"
        noted(notes, "mass_kg", held_note)
    inertia_box_m = _box(mass, [wheel for wheel in wheels if owner[wheel.joint.parent] == link] or wheels, notes)
    com_m = mass.com_m - [0.0, 0.0, ground_m]
    if com_m[2] <= 0.0:
        notes["com_m"] = "not above the ground: are the places and the inertial right?"
    return Table(
        "[body]", {"name": name, "mass_kg": mass.mass_kg, "com_m": com_m, "inertia_box_m": inertia_box_m}, notes
    )


def _box(mass: Mass, wheels: list[Wheel], notes: dict[str, str]) -> list[float]:
    """Return the edges of the box that has a body's moments of inertia."""
    inertia = mass.inertia_kg_m2
    if not inertia.any():
        notes["inertia_box_m"] = "no inertia in the URDF: as large as the wheels' places"
        places = np.array([wheel.middle_m for wheel in wheels])
        edges = np.maximum(np.ptp(places, axis=0), 2.0 * wheels[0].radius_m)
        return [float(edge) for edge in edges]
    products = float(np.abs(inertia - np.diag(np.diag(inertia))).max())
    if products > 0.01 * np.diag(inertia).max():
        notes["inertia_box_m"] = f"products of inertia, up to {products:.2g} kg.m^2, are left out"
    squares = mass.box_squares_m2()
    edges = np.clip(np.sqrt(np.maximum(squares, 0.0)), *_EDGES_M)
    if np.abs(edges**2 - squares).max() > 1e-6 * np.abs(squares).max():
        notes["inertia_box_m"] = "the nearest: no body has this inertia"
    return [float(edge) for edge in edges]


def _hinge(robot: Robot, joint: Joint, name: str, ends: tuple[str, str], ground_m: float) -> Table:
    notes = dict[str, str]()
    limit = _limit(robot, joint, notes)
    damping = joint.damping_n_m_s_rad
    if damping is None:
        damping, notes["damping_n_m_s_rad"] = _DAMPING_N_M_S_RAD, "a dry plain bearing; none in the URDF"
    keys = {
        "name": name,
        "parent": ends[0],
        "child": ends[1],
        "axis": robot.axis(joint),
        "anchor_m": robot.places[joint.child].at_m - [0.0, 0.0, ground_m],
        "limit_rad": limit,
        "damping_n_m_s_rad": damping,
    }
    return Table("[hinge]", keys, notes)


def _limit(robot: Robot, joint: Joint, notes: dict[str, str]) -> float:
    """Return the stop of a hinge, equal on both sides."""
    if joint.range_rad is None or turns(joint):
        notes["limit_rad"] = "none in the URDF"
        return _MOST_LIMIT_RAD
    low, high = joint.range_rad
    if not low < 0.0 < high:
        what = f'{robot.file}: joint "{shown(joint.name)}": {low:g} to {high:g} rad'
        raise ConfigError(f"{what}, allowed: below 0 to above 0", file=robot.file)
    if abs(low + high) > 1e-6:
        notes["limit_rad"] = f"the nearer of {low:g} and {high:g}"
    return min(-low, high, _MOST_LIMIT_RAD)


def _couplings(robot: Robot, hinges: list[Joint], names: dict[str, str]) -> list[Table]:
    found = []
    for hinge in hinges:
        if hinge.mimic is None or hinge.mimic[0] not in names:
            continue
        other, factor, offset = hinge.mimic
        notes = {"ratio": f"its offset of {offset:g} rad is left out"} if offset else {}
        found.append((f"{names[hinge.name]}_{names[other]}", hinge.name, other, -factor, notes))
    titles = _names(robot, [title for title, *_ in found])
    return [
        Table("[coupling]", {"name": titles[title], "hinge_a": names[a], "hinge_b": names[b], "ratio": ratio}, notes)
        for title, a, b, ratio, notes in found
    ]


def _roller_angles(robot: Robot, wheels: list[Wheel], kind: str | None) -> tuple[list[float], dict[str, str]]:
    """Return the angle of each wheel's rollers, and the guess behind it; rollers of mecanum wheels form an O."""
    first = wheels[0].axis
    parallel = all(abs(float(np.cross(first, wheel.axis)[2])) < 0.02 for wheel in wheels)
    chosen = kind or ("mecanum" if parallel else "omni")
    if (chosen == "mecanum") != parallel:
        other, axles = ("omni", "not all parallel") if chosen == "mecanum" else ("mecanum", "all parallel")
        raise ConfigError(f"{robot.file}: --wheels {chosen}: the axles are {axles}, allowed: {other}", file=robot.file)
    if chosen == "omni":
        return [0.0] * len(wheels), {} if kind else {"roller_angle_rad": "omni, as not all axles are parallel"}
    middle_m = np.mean([wheel.middle_m for wheel in wheels], axis=0)
    forward = np.array([first[1], -first[0]])
    angles = []
    for wheel in wheels:
        x, y = (wheel.middle_m - middle_m)[:2] @ np.array([forward, [-forward[1], forward[0]]]).T
        if min(abs(x), abs(y)) < 0.1 * wheel.radius_m:
            what = f'{robot.file}: mecanum wheel "{shown(wheel.name)}" is in the middle'
            allowed = f"a left and a right one in front and rear{leave_out(wheel.name)}"
            raise ConfigError(f"{what}, allowed: {allowed}", file=robot.file)
        angles.append(math.copysign(math.pi / 4, -x * y))
    note = "an O seen from below, an X from above"
    if kind is None:
        note = f"mecanum, as all axles are parallel; {note}"
    return angles, {"roller_angle_rad": note}


def _motor(wheels: list[Wheel], bodies_kg: float) -> Table:
    """Return the motor: the limits of the wheels' joints if all are alike and plausible, otherwise mecanum4's motor."""
    weight_n = 9.81 * (bodies_kg + sum(wheel.mass.mass_kg for wheel in wheels))
    radius_m = wheels[0].radius_m
    limits = {(wheel.joint.effort_n_m, wheel.joint.velocity_rad_s) for wheel in wheels}
    effort, velocity = limits.pop()
    if not limits and effort is not None and velocity is not None:
        thrust = effort * len(wheels) / radius_m / weight_n
        if _THRUSTS[0] <= thrust <= _THRUSTS[1] and _TOPS_M_S[0] <= velocity * radius_m <= _TOPS_M_S[1]:
            note = "the limit of the wheels' joints; take the datasheet's"
            keys = {"stall_torque_n_m": effort, "no_load_rad_s": velocity}
            return Table("motor", keys, dict.fromkeys(keys, note))
    keys = {
        "stall_torque_n_m": _digits(_THRUST * weight_n * radius_m / len(wheels)),
        "no_load_rad_s": _digits(_TOP_M_S / radius_m),
    }
    notes = {
        "stall_torque_n_m": "a thrust of two thirds of the weight; take the datasheet's",
        "no_load_rad_s": f"{_TOP_M_S} m/s; take the datasheet's",
    }
    return Table("motor", keys, notes)


def _rollers(wheels: list[Wheel], angles: Iterable[float]) -> Table:
    """Return the rollers, equal in number and thickness to the built-in vehicles' rollers."""
    keys: dict[str, Any] = {"count": 9} if any(angles) else {"count": 6, "rows": 2}
    keys["radius_m"] = _digits(min(wheel.radius_m for wheel in wheels) / 5.0)
    return Table("rollers", keys, dict.fromkeys(keys, "look at yours") | {"radius_m": "a fifth of the wheel's"})


def _wheel(wheel: Wheel, name: str, body: str, angle: float, notes: dict[str, str]) -> Table:
    axis = wheel.axis
    notes = wheel.notes | notes
    inertia = wheel.mass.about(wheel.middle_m, axis)
    disc = wheel.mass.mass_kg * wheel.radius_m**2 / 2.0
    if inertia < _LEAST_INERTIA_KG_M2:
        inertia, notes["inertia_kg_m2"] = disc, "of a disc; none in the URDF"
    keys: dict[str, Any] = {
        "name": name,
        "body": body,
        "position_m": wheel.middle_m[:2],
        "rolling_direction": [axis[1], -axis[0]],
    }
    keys |= {"roller_angle_rad": angle} if notes.get("roller_angle_rad") else {}
    keys |= {"radius_m": wheel.radius_m, "mass_kg": wheel.mass.mass_kg, "inertia_kg_m2": inertia}
    return Table("[wheel]", keys, notes)


def _digits(value: float) -> float:
    """Two digits of a number that is not known better."""
    return float(f"{value:.2g}")
