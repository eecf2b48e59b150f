"""A URDF file as a tree of links and joints; every number in it is checked."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from omnistep._rigid_masses import Mass, Place
from omnistep._toml_files import no_file
from omnistep._urdf_elements import numbers, parsed, turned
from omnistep.errors import ConfigError

_Floats = NDArray[np.float64]

#: The largest that is read: a robot of a thousand links is less.
MOST_BYTES = 4 * 2**20
#: The largest number of a place, mass or inertia, in whatever unit: none overflows when it is multiplied.
LARGEST = 1e9
KINDS = ("fixed", "continuous", "revolute", "prismatic", "planar", "floating")


class Round(NamedTuple):
    """A cylinder or a sphere of a link.

    Attributes:
        radius_m: its radius.
        middle_m: its middle in the link's frame, (3,).
        axis: of a cylinder, in the link's frame, (3,); None of a sphere.
    """

    radius_m: float
    middle_m: _Floats
    axis: _Floats | None


class Link(NamedTuple):
    """A link: its mass, and its round shapes, those that collide before those that are only seen."""

    name: str
    mass: Mass
    touched: list[Round]
    seen: list[Round]


class Joint(NamedTuple):
    """A joint; missing values are None.

    Attributes:
        axis: unit vector in the child's frame, (3,).
        range_rad: lowest and highest position.
        effort_n_m, velocity_rad_s: the limits of its motor.
        mimic: the joint that it follows, the factor and the offset.
    """

    name: str
    kind: str
    parent: str
    child: str
    place: Place
    axis: _Floats
    range_rad: tuple[float, float] | None
    effort_n_m: float | None
    velocity_rad_s: float | None
    damping_n_m_s_rad: float | None
    mimic: tuple[str, float, float] | None


class Robot(NamedTuple):
    """A robot with all joints at 0.

    Attributes:
        links: by name.
        joints: in the file's order.
        places: of each link in the frame of the root.
        below: the joints that each link carries.
        carrier: the joint that carries each link but the root.
    """

    file: str
    name: str
    root: str
    links: dict[str, Link]
    joints: list[Joint]
    places: dict[str, Place]
    below: dict[str, list[Joint]]
    carrier: dict[str, Joint]

    def axis(self, joint: Joint) -> _Floats:
        """Return a joint's axis in the frame of the root, (3,)."""
        return self.places[joint.child].turn @ joint.axis

    def carried(self, link: str, past: Collection[str] = ()) -> Iterator[str]:
        """Yield a link and all that it carries, but not beyond the joints that are named."""
        left = [link]
        while left:
            each = left.pop()
            yield each
            left += [joint.child for joint in self.below[each] if joint.name not in past]

    def above(self, link: str) -> Iterator[Joint]:
        """Yield the joints between a link and the root, from the link on."""
        while joint := self.carrier.get(link):
            yield joint
            link = joint.parent

    def rigid(self, link: str) -> Iterator[str]:
        """Yield a link and all that is fixed to it."""
        left = [link]
        while left:
            each = left.pop()
            yield each
            left += [joint.child for joint in self.below[each] if joint.kind == "fixed"]


def shown(name: str) -> str:
    """A name for messages and comments: in one line, and not too long."""
    text = "".join(letter if letter.isprintable() else "?" for letter in name)
    return text if len(text) <= 40 else f"{text[:37]}..."


def read_urdf(path: Path) -> Robot:
    """Read a URDF file.

    Raises:
        ConfigError: it is no URDF, its links are no tree, or a number in it is none.
    """
    file = shown(path.name)
    root = _root(path, file)
    links = _links(file, root)
    joints = _joints(file, root, links)
    below: dict[str, list[Joint]] = {name: [] for name in links}
    for joint in joints:
        below[joint.parent].append(joint)
    top = _top(file, links, joints)
    places = {top: Place.middle()}
    left = [top]
    while left:
        for joint in below[left.pop()]:
            places[joint.child] = places[joint.parent].then(joint.place)
            left.append(joint.child)
    if lost := [shown(name) for name in links if name not in places]:
        raise _refused(file, f'link "{lost[0]}" is in a loop of joints', "a tree of links")
    carrier = {joint.child: joint for joint in joints}
    return Robot(file, root.get("name", ""), top, links, joints, places, below, carrier)


def _refused(file: str, what: str, allowed: str) -> ConfigError:
    return ConfigError(f"{file}: {what}, allowed: {allowed}", file=file)


def _root(path: Path, file: str) -> Element:
    """Return the element of the robot."""
    if path.suffix.lower() == ".xacro":
        raise _xacro(file)
    if not path.is_file():
        raise ConfigError(f"{no_file(path)}, allowed: a URDF file", file=file)
    with path.open("rb") as source:
        content = source.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise _refused(file, f"{path.stat().st_size} bytes", f"{MOST_BYTES}")
    try:
        # Of text, the parser takes no encoding but this one.
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _refused(file, "not a URDF: not UTF-8", "a URDF file") from error
    try:
        root = parsed(text)
    except ValueError as error:
        if "entities" in str(error):
            raise ConfigError(f"{file}: {error}", file=file) from error
        if "unbound prefix" in str(error) and "<xacro:" in text:
            raise _xacro(file) from error
        robots = re.findall(r"<robot[\s>]", text)
        what = f"{len(robots)} robots in one file" if len(robots) > 1 else str(error)
        raise _refused(file, what, "one <robot>") from error
    if any("xacro}" in str(element.tag) for element in root.iter()):  # but what is commented out may stay
        raise _xacro(file)
    if root.tag != "robot":
        raise _refused(file, f"not a URDF: its root is <{shown(root.tag)}>", "<robot>")
    return root


def _xacro(file: str) -> ConfigError:
    stem = re.sub(r"(\.urdf)?(\.xacro)?$", "", file)
    return _refused(file, "xacro is not URDF", f"URDF; run xacro first: xacro {file} > {stem}_flat.urdf")


def _named(file: str, elements: list[Element], what: str) -> dict[str, Element]:
    """Return elements by their names."""
    found: dict[str, Element] = {}
    for number, element in enumerate(elements):
        name = element.get("name", "")
        if not name:
            raise _refused(file, f"{what} {number} has no name", "a name")
        if name in found:
            raise _refused(file, f'two {what}s are named "{shown(name)}"', "one")
        found[name] = element
    return found


def _links(file: str, root: Element) -> dict[str, Link]:
    found: dict[str, Link] = {}
    for name, element in _named(file, root.findall("link"), "link").items():
        where = f'{file}: link "{shown(name)}"'
        touched = _rounds(where, element.findall("collision"))
        found[name] = Link(name, _mass(where, element), touched, _rounds(where, element.findall("visual")))
    if not found:
        raise _refused(file, "no links", "a robot with links and joints")
    return found


def _mass(where: str, link: Element) -> Mass:
    inertial = link.find("inertial")
    if inertial is None:
        return Mass.nothing()
    mass = inertial.find("mass")
    if mass is None or mass.get("value") is None:
        raise ConfigError(f'{where}: an inertial without mass, allowed: <mass value="..."/>')
    (kilograms,) = _numbers(where, mass, "value", "0")
    if kilograms < 0.0:
        raise ConfigError(f"{where}: mass {kilograms:g} kg, allowed: 0 or more")
    element = inertial.find("inertia")
    xx, yy, zz, xy, xz, yz = (
        _numbers(where, element, name, "0")[0] for name in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    if min(xx, yy, zz) < 0.0:
        raise ConfigError(f"{where}: a moment of inertia below 0, allowed: 0 or more")
    own = Mass(float(kilograms), np.zeros(3), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    return own.moved(_place(where, inertial))


def _rounds(where: str, shapes: list[Element]) -> list[Round]:
    found = []
    for shape in shapes:
        place = _place(where, shape)
        for kind in ("cylinder", "sphere"):
            element = shape.find(f"geometry/{kind}")
            if element is None:
                continue
            radius = float(_numbers(where, element, "radius", "0")[0])
            if radius <= 0.0:
                raise ConfigError(f"{where}: {kind} of radius {radius:g} m, allowed: above 0")
            found.append(Round(radius, place.at_m, place.turn[:, 2] if kind == "cylinder" else None))
    return found


def _joints(file: str, root: Element, links: dict[str, Link]) -> list[Joint]:
    found, carrier = [], dict[str, str]()
    for name, element in _named(file, root.findall("joint"), "joint").items():
        joint = _joint(file, name, element)
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                what = f'joint "{shown(name)}": {role} "{shown(link)}" is missing'
                raise _refused(file, what, "a link of the file")
        if other := carrier.get(joint.child):
            what = f'link "{shown(joint.child)}" is carried by "{shown(other)}" and "{shown(name)}"'
            raise _refused(file, what, "a tree of links")
        carrier[joint.child] = name
        found.append(joint)
    return found


def _joint(file: str, name: str, element: Element) -> Joint:
    where = f'{file}: joint "{shown(name)}"'
    kind = element.get("type", "")
    if kind not in KINDS:
        raise ConfigError(f'{where}: type "{shown(kind)}", allowed: {", ".join(KINDS)}', file=file)
    axis = _numbers(where, element.find("axis"), "xyz", "1 0 0")
    length = float(np.linalg.norm(axis))
    if length < 1e-6 and kind != "fixed":
        raise ConfigError(f"{where}: axis of length 0, allowed: a direction", file=file)
    limit, mimic, dynamics = element.find("limit"), element.find("mimic"), element.find("dynamics")
    damping = None if dynamics is None or dynamics.get("damping") is None else _numbers(where, dynamics, "damping", "0")
    return Joint(
        name=name,
        kind=kind,
        parent=_end(where, element, "parent"),
        child=_end(where, element, "child"),
        place=_place(where, element),
        axis=axis / max(length, 1e-6),
        range_rad=None if limit is None else (_loose(where, limit, "lower"), _loose(where, limit, "upper")),
        effort_n_m=None if limit is None else _loose(where, limit, "effort"),
        velocity_rad_s=None if limit is None else _loose(where, limit, "velocity"),
        damping_n_m_s_rad=None if damping is None else float(damping[0]),
        mimic=None if mimic is None else _mimic(where, mimic),
    )


def _end(where: str, joint: Element, role: str) -> str:
    end = joint.find(role)
    if end is None or not end.get("link"):
        raise ConfigError(f'{where}: no {role}, allowed: <{role} link="..."/>')
    return end.get("link", "")


def _mimic(where: str, mimic: Element) -> tuple[str, float, float]:
    factor, offset = _numbers(where, mimic, "multiplier", "1"), _numbers(where, mimic, "offset", "0")
    return mimic.get("joint", ""), float(factor[0]), float(offset[0])


def _loose(where: str, limit: Element, name: str) -> float:
    """Return a limit, which may be infinite, as some files write it."""
    try:
        found = float(limit.get(name, "0"))
    except ValueError:
        found = math.nan
    if math.isnan(found):
        raise ConfigError(f'{where}: limit {name} "{shown(limit.get(name, ""))}", allowed: a number')
    return found


def _place(where: str, element: Element) -> Place:
    origin = element.find("origin")
    return Place(turned(_numbers(where, origin, "rpy", "0 0 0")), _numbers(where, origin, "xyz", "0 0 0"))


def _numbers(where: str, element: Any, name: str, default: str) -> _Floats:
    """Return an attribute's numbers, all of a size that can be reckoned with."""
    count = len(default.split())
    allowed = f"{'a number' if count == 1 else f'{count} numbers'} within 1e9"
    try:
        found = numbers(element, name, default)
    except ValueError as error:
        text = shown(element.get(name))
        raise ConfigError(f'{where}: {name} "{text}", allowed: {allowed}') from error
    if np.abs(found).max() > LARGEST:
        raise ConfigError(f'{where}: {name} "{shown(element.get(name))}", allowed: {allowed}')
    return found


def _top(file: str, links: dict[str, Link], joints: list[Joint]) -> str:
    """Return the link that no joint carries."""
    carried = {joint.child for joint in joints}
    tops = [name for name in links if name not in carried]
    if not tops:
        raise _refused(file, "every link is carried by another: a loop of joints", "a tree of links")
    if len(tops) > 1:
        what = f'no joint carries "{shown(tops[0])}", nor "{shown(tops[1])}"'
        raise _refused(file, what, "one root link")
    return tops[0]
