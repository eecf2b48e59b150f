"""Notes on wheels of a URDF that roll along another axis than x, or stand elsewhere than their names say."""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import NDArray

from omnistep._urdf_tree import Robot, shown
from omnistep._urdf_wheels import Wheel, noted

#: Axis and sign of the words that place a wheel.
_WORDS = {"front": (0, 1), "rear": (0, -1), "back": (0, -1), "left": (1, 1), "right": (1, -1)}
_WORD = re.compile(r"front|rear|back|left|(?<!up)(?<!b)right")
#: The same in two letters, in either order: fl and lf, rr and br.
_ENDS, _SIDES = {"f": "front", "r": "rear", "b": "back"}, {"l": "left", "r": "right"}
_LETTERS = {
    letters: {_ENDS[end], _SIDES[side]} for end in _ENDS for side in _SIDES for letters in (end + side, side + end)
}
#: A wheel rolls along x within this angle [rad].
_ALONG = math.radians(5.0)


def note_contradictions(robot: Robot, wheels: list[Wheel], *, parallel: bool) -> None:
    """Note on each wheel what its name, its place and its axle say against each other.

    Args:
        robot: the robot.
        wheels: its wheels, to which notes are added.
        parallel: all axles are, as of mecanum wheels; omni wheels roll in every direction.
    """
    middle_m = np.mean([wheel.middle_m for wheel in wheels], axis=0)
    for wheel in wheels:
        if parallel and (off := math.atan2(abs(wheel.axis[0]), abs(wheel.axis[1]))) > _ALONG:
            note = f"{math.degrees(off):.0f} degrees off x, which is forward: is {shown(robot.root)} turned?"
            noted(wheel.notes, "rolling_direction", note)
        place_m = wheel.middle_m - middle_m
        words = [word for word in _words(wheel) if _is_elsewhere(word, place_m, wheel.radius_m)]
        if words:
            found = " ".join(_opposite(word) for word in words)
            noted(wheel.notes, "position_m", f"at the {found}, but the name says {' '.join(words)}")


def _words(wheel: Wheel) -> list[str]:
    """Return the position that the name of a wheel, or of its joint, implies; front or rear first."""
    for name in (wheel.name, wheel.joint.name):
        found = set(_WORD.findall(name.lower()))
        if not found:
            tokens = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
            found = {word for token in tokens for word in _LETTERS.get(token.lower(), ())}
        # A name with both ends, or both sides, includes the parts that carry the wheel.
        sure = [word for word in _WORDS if word in found and not found & _against(word)]
        if sure:
            return sure
    return []


def _against(word: str) -> set[str]:
    """Return the words for the other end or side."""
    axis, sign = _WORDS[word]
    return {other for other, place in _WORDS.items() if place == (axis, -sign)}


def _opposite(word: str) -> str:
    return {"front": "rear", "rear": "front", "back": "front", "left": "right", "right": "left"}[word]


def _is_elsewhere(word: str, place_m: NDArray[np.float64], radius_m: float) -> bool:
    """Whether a wheel is clearly at the other end or side than a word says."""
    axis, sign = _WORDS[word]
    return sign * float(place_m[axis]) < -0.1 * radius_m
