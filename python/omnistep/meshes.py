"""Triangles of the shapes in a URDF, for simple players."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnistep._urdf_elements import numbers, parsed, sizes, turned

_Floats = NDArray[np.float64]
_Integers = NDArray[np.int64]

#: Corners of a wheel's rim.
_SEGMENTS = 24
#: A wheel's spokes are this much darker: one sees it turn.
_SPOKE = 0.55


class Mesh(NamedTuple):
    """Triangles of one URDF.

    Attributes:
        links: names of the links, in the file's order.
        link: of each vertex, the index of its link, (V,).
        vertices_m: in the link's frame, (V, 3).
        triangles: three vertices each, (F, 3).
        colours: of each triangle, red, green, blue from 0 to 255, (F, 3).
    """

    links: list[str]
    link: _Integers
    vertices_m: _Floats
    triangles: _Integers
    colours: _Integers


class Shape(NamedTuple):
    """A visual of one URDF.

    Attributes:
        link: its link.
        kind: ``box`` or ``cylinder``; this program writes no other.
        size_m: three edges, or radius and length.
        place_m: its middle in the link's frame, (3,).
        turn: turns its own vectors into the link's, (3, 3); a cylinder's axis is its own z.
        colour: red, green, blue from 0 to 255, (3,).
    """

    link: str
    kind: str
    size_m: tuple[float, ...]
    place_m: _Floats
    turn: _Floats
    colour: _Integers


def of_urdf(text: str) -> Mesh:
    """Turn the visuals of a URDF into triangles.

    Args:
        text: the URDF, as in ``/robot_description``.

    Returns:
        The triangles, link by link.

    Raises:
        ValueError: the text is no URDF.
    """
    links = [link.get("name", "") for link in parsed(text).iter("link")]
    found = shapes(text)
    parts = [(links.index(shape.link), *_triangles(shape)) for shape in found]
    offsets = np.cumsum([0, *(len(vertices) for _, vertices, _, _ in parts)])
    return Mesh(
        links=links,
        link=np.concatenate([np.full(len(v), number) for number, v, _, _ in parts] or [np.zeros(0, np.int64)]),
        vertices_m=np.concatenate([v for _, v, _, _ in parts] or [np.zeros((0, 3))]),
        triangles=np.concatenate(
            [t + offset for (_, _, t, _), offset in zip(parts, offsets, strict=False)] or [np.zeros((0, 3), np.int64)]
        ),
        colours=np.concatenate([c for _, _, _, c in parts] or [np.zeros((0, 3), np.int64)]),
    )


def shapes(text: str) -> list[Shape]:
    """Return the visuals of a URDF, link by link.

    Args:
        text: the URDF.

    Returns:
        Boxes and cylinders.

    Raises:
        ValueError: the text is no URDF.
    """
    found: list[Shape] = []
    for link in parsed(text).iter("link"):
        name = link.get("name", "")
        for visual in link.iter("visual"):
            try:
                found.extend(_shape(name, visual))
            except (AttributeError, TypeError, ValueError) as error:
                wanted = "finite numbers, sizes above 0"
                found_instead = error if isinstance(error, ValueError) else "no geometry"
                raise ValueError(
                    f"not a URDF: link {name!r} has a shape of {found_instead}, allowed: {wanted}"
                ) from error
    return found


def axles(text: str) -> dict[str, _Floats]:
    """Return the axle of each wheel of a URDF.

    Args:
        text: the URDF.

    Returns:
        By the wheel's link, the direction about which it turns forwards, in the link's frame, (3,): the axis of its
        continuous joint.

    Raises:
        ValueError: the text is no URDF.
    """
    found: dict[str, _Floats] = {}
    for joint in parsed(text).iter("joint"):
        if joint.get("type") != "continuous":
            continue
        child = joint.find("child")
        name = "" if child is None else child.get("link", "")
        try:
            axis = numbers(joint.find("axis"), "xyz", "1 0 0")
        except ValueError as error:
            raise ValueError(f"not a URDF: the axis of {name!r} is not three numbers") from error
        if not np.any(axis):
            raise ValueError(f"not a URDF: the axis of {name!r} is not three numbers")
        found[name] = axis / np.linalg.norm(axis)
    return found


def _shape(link: str, visual: Any) -> list[Shape]:
    origin = visual.find("origin")
    place = numbers(origin, "xyz", "0 0 0")
    turn = turned(numbers(origin, "rpy", "0 0 0"))
    rgba = visual.find("material/color")
    colour = np.round(255 * numbers(rgba, "rgba", "0.6 0.6 0.6 1")[:3]).astype(np.int64)
    geometry = visual.find("geometry")
    if (box := geometry.find("box")) is not None:
        return [Shape(link, "box", tuple(sizes(box, "size", "1 1 1").tolist()), place, turn, colour)]
    if (cylinder := geometry.find("cylinder")) is not None:
        size = (float(sizes(cylinder, "radius", "1")[0]), float(sizes(cylinder, "length", "1")[0]))
        return [Shape(link, "cylinder", size, place, turn, colour)]
    return []  # this program writes no other shape


def _triangles(shape: Shape) -> tuple[_Floats, _Integers, _Integers]:
    if shape.kind == "box":
        vertices, triangles = _box(np.array(shape.size_m))
        colours = np.tile(shape.colour, (len(triangles), 1))
    else:
        vertices, triangles = _cylinder(*shape.size_m)
        sector = (np.arange(len(triangles)) % _SEGMENTS) * 6 // _SEGMENTS
        shade = np.where(sector % 2 == 0, 1.0, _SPOKE)
        colours = np.round(shade[:, None] * shape.colour).astype(np.int64)
    return vertices @ shape.turn.T + shape.place_m, triangles, colours


def _box(size: _Floats) -> tuple[_Floats, _Integers]:
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def _cylinder(radius: float, length: float) -> tuple[_Floats, _Integers]:
    angle = 2 * math.pi * np.arange(_SEGMENTS) / _SEGMENTS
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    ends = [np.column_stack([rim, np.full(_SEGMENTS, z)]) for z in (-length / 2, length / 2)]
    middles = np.array([[0, 0, -length / 2], [0, 0, length / 2]])
    here = np.arange(_SEGMENTS)
    after = (here + 1) % _SEGMENTS
    low, high = 2 * _SEGMENTS, 2 * _SEGMENTS + 1
    side = [np.stack([here, after, after + _SEGMENTS], 1), np.stack([here, after + _SEGMENTS, here + _SEGMENTS], 1)]
    caps = [
        np.stack([np.full(_SEGMENTS, low), after, here], 1),
        np.stack([np.full(_SEGMENTS, high), here + _SEGMENTS, after + _SEGMENTS], 1),
    ]
    return np.concatenate([*ends, middles]), np.concatenate([*side, *caps])
