"""Wheels of a vehicle file in a short form: the form's keys if they can hold the result, otherwise ``[[wheel]]``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, cos, hypot, isclose, sin
from typing import Any

#: Forms that describe all wheels.
FORMS = ("mecanum4", "omni3")
#: Keys of a form, and the keys of a wheel that they represent.
ALIKE = {"radius_m": "radius_m", "inertia_kg_m2": "wheel_inertia_kg_m2"}
#: A turn of all wheels that a form may leave out: 5 mm on a metre.
TURN_RAD = 0.005

Wheels = Sequence[Mapping[str, Any]]
#: A number, and the half width of its interval; None if it has none.
Number = tuple[float, float | None]


def form_of(file: Mapping[str, Any]) -> str | None:
    """The short form of a file's wheels."""
    return next((form for form in FORMS if form in file), None)


def of_form(
    form: str, before: Wheels, after: Wheels, halves: Mapping[str, float | None], notes: list[str]
) -> dict[str, Number] | None:
    """The keys of a form that hold the wheels after a change; None if it cannot hold them.

    Args:
        form: its name.
        before: the wheels that it describes.
        after: the same wheels with other numbers.
        halves: the keys of wheels that changed, with half widths of their intervals.
        notes: here goes what is left out.
    """
    given: dict[str, Number] = {}
    for key, name in ALIKE.items():
        values = [wheel[key] for wheel in after]
        if not alike(values):
            return None
        if key in halves:
            given[name] = (values[0], halves[key])
    turn = _turn(before, after)
    if turn is None or abs(turn) > TURN_RAD:
        return None
    if turn:
        notes.append(f"[{form}] has no turn of all wheels: {turn:.2g} rad are left out")
    if not {"position_m", "rolling_direction"} & set(halves):
        return given
    places = [_turned_back(old, new, turn) for old, new in zip(before, after, strict=True)]
    if form == "omni3":
        lengths = {"lever_m": [hypot(x, y) for x, y in places]}
    else:
        lengths = {"wheelbase_m": [2.0 * abs(x) for x, _ in places], "track_m": [2.0 * abs(y) for _, y in places]}
    half = halves.get("position_m")
    if form != "omni3" and half is not None:
        half *= 2.0
    for name, values in lengths.items():
        if not alike(values):
            return None
        given[name] = (values[0], half)
    return given


def alike(values: Sequence[float]) -> bool:
    """Whether numbers are equal except for rounding."""
    return all(isclose(each, values[0], rel_tol=1e-6) for each in values)


def _turn(before: Wheels, after: Wheels) -> float | None:
    """Common rotation of all wheels; None if the rotations differ."""
    turns = []
    for old, new in zip(before, after, strict=True):
        (x, y), (u, v) = old["rolling_direction"], new["rolling_direction"]
        turns.append(atan2(x * v - y * u, x * u + y * v))
    return turns[0] if all(abs(turn - turns[0]) < 1e-7 for turn in turns) else None


def _turned_back(old: Mapping[str, Any], new: Mapping[str, Any], turn: float) -> tuple[float, float]:
    """The place of a wheel without a turn of the whole, which leaves the levers as they are."""
    push = atan2(*old["rolling_direction"][::-1]) + old["roller_angle_rad"]
    (x, y), (u, v) = old["position_m"], new["position_m"]
    shift = turn * (x * cos(push) + y * sin(push))
    return u + shift * sin(push), v - shift * cos(push)
