"""Triangles of the shapes in a URDF, for players that know nothing else."""

import math
import re
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

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


def of_urdf(text: str) -> Mesh:
    """Turn the visuals of a URDF into triangles.

    Args:
        text: the URDF, as ``/robot_description`` has it.

    Returns:
        The triangles, link by link.

    Raises:
        ValueError: the text is no URDF.
    """
    # Logs are files from elsewhere: nothing in them may name other files or grow when it is read.
    if re.search(r"<!(DOCTYPE|ENTITY)", text):
        raise ValueError("the URDF declares entities, allowed: plain elements")
    try:
        robot = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"not a URDF: {error}") from error
    links: list[str] = []
    parts: list[tuple[int, _Floats, _Integers, _Integers]] = []
    for number, link in enumerate(robot.iter("link")):
        links.append(link.get("name", ""))
        for visual in link.iter("visual"):
            try:
                parts.extend((number, *part) for part in _shape(visual))
            except (AttributeError, TypeError, ValueError) as error:
                raise ValueError(f"not a URDF: link {links[-1]!r} has a shape without its numbers") from error
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


def _shape(visual: Any) -> list[tuple[_Floats, _Integers, _Integers]]:
    origin = visual.find("origin")
    place = _numbers(origin, "xyz", "0 0 0")
    turn = _turned(_numbers(origin, "rpy", "0 0 0"))
    rgba = visual.find("material/color")
    colour = np.round(255 * _numbers(rgba, "rgba", "0.6 0.6 0.6 1")[:3]).astype(np.int64)
    geometry = visual.find("geometry")
    if (box := geometry.find("box")) is not None:
        vertices, triangles = _box(_numbers(box, "size", "1 1 1"))
        colours = np.tile(colour, (len(triangles), 1))
    elif (cylinder := geometry.find("cylinder")) is not None:
        vertices, triangles = _cylinder(float(cylinder.get("radius")), float(cylinder.get("length")))
        sector = (np.arange(len(triangles)) % _SEGMENTS) * 6 // _SEGMENTS
        shade = np.where(sector % 2 == 0, 1.0, _SPOKE)
        colours = np.round(shade[:, None] * colour).astype(np.int64)
    else:
        return []  # this program writes no other shape
    return [(vertices @ turn.T + place, triangles, colours)]


def _numbers(element: Any, name: str, default: str) -> _Floats:
    text = default if element is None else element.get(name, default)
    return np.array([float(word) for word in text.split()])


def _turned(rpy: _Floats) -> _Floats:
    """Return the rotation about x, then y, then z, all fixed, as URDF has it."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


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
