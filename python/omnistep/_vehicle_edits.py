"""Numbers replaced in the text of a vehicle file, the rest unchanged; the only module that names tomlkit."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import degrees, floor, hypot, isclose, log10, pi
from typing import Any

from omnistep._estimates import Estimate
from omnistep._omnistep import Vehicle
from omnistep._wheel_forms import Number, form_of, of_form

#: Path of a number in the file: keys, and indices of lists.
Path = tuple[str | int, ...]

#: Digits of a half width that its number is written with, and the most and the fewest of the number itself.
DIGITS, MOST, FEWEST = 2, 6, 2
#: Numbers with a relative difference of at most this are the same.
SAME = 1e-9
#: The stall torque in other units [N.m].
TORQUES = {"stall_torque_kg_cm": 0.0980665, "stall_torque_oz_in": 0.0070615518}
#: The no-load speed in its units [rad/s].
SPEEDS = {"no_load_rpm": pi / 30.0, "no_load_rad_s": 1.0}
#: Of the keys of a wheel those that a form stands for.
WHEEL = ("name", "body", "position_m", "rolling_direction", "roller_angle_rad", "radius_m", "mass_kg")


@dataclass(frozen=True)
class Changes:
    """A vehicle after a change of its numbers.

    Attributes:
        vehicle: the vehicle, with the same parts.
        halves: half widths of intervals, by the path in :meth:`Vehicle.to_dict`; a list has one for all its numbers.
    """

    vehicle: Vehicle
    halves: Mapping[Path, float]


def written(value: float, half: float | None = None, size: float | None = None) -> float:
    """A number with the digits that its interval justifies.

    >>> from omnistep._vehicle_edits import written
    >>> written(0.0767312, half=0.00042), written(0.0767312), written(28.0123, half=0.9)
    (0.07673, 0.0767312, 28.01)
    """
    size = abs(value) if size is None else size
    if size == 0.0:
        return 0.0
    place = floor(log10(size)) - MOST + 1
    if half:
        place = max(place, min(floor(log10(half)) - DIGITS + 1, floor(log10(size)) - FEWEST + 1))
    return round(value, -place) + 0.0


def edited(text: str, drawn: Vehicle, found: Changes) -> tuple[str, list[str]]:
    """The text of a vehicle's file with its changes, and the keys that had to be written in another form.

    Raises:
        ImportError: tomlkit is not installed.
    """
    file = tomlkit().parse(text)
    before, after = drawn.to_dict(), found.vehicle.to_dict()
    notes: list[str] = []
    changes: dict[Path, Number | None] = {}
    for path, value in _differences(before, after, ()):
        half = found.halves.get(path, found.halves.get(path[:-1]))
        changes[path] = None if value is None else (value, half)
    _motor(file, changes, after["motor"])
    _total_mass(file, changes, found.vehicle.mass_kg, found.halves.get(("total_mass_kg",)))
    form = form_of(file)
    _rotor(file, changes, after["wheel"], form, notes)
    if form:
        _wheels(file, form, changes, (before["wheel"], after["wheel"]), notes)
    if "gains" not in file and any(path[0] == "gains" for path in changes):
        file["gains"] = tomlkit().table()
        notes.append("[gains] is new in the file: the computed ones, with the margins that are printed")
    for path, change in changes.items():
        _put(file, path, change, after)
    return file.as_string(), notes


def tomlkit() -> Any:
    """The library that edits TOML.

    Raises:
        ImportError: it is not installed.
    """
    try:
        return importlib.import_module("tomlkit")
    except ImportError as error:
        raise ImportError('a vehicle file as output needs tomlkit: pip install "omnistep[identify]"') from error


def _differences(before: Any, after: Any, path: Path) -> Iterator[tuple[Path, float | None]]:
    """The numbers that differ; None for a removed number."""
    if isinstance(after, dict):
        for key in after:
            yield from _differences((before or {}).get(key), after[key], (*path, key))
    elif isinstance(after, list):
        for index, each in enumerate(after):
            yield from _differences(before[index] if before else None, each, (*path, index))
    elif after is None and isinstance(before, float):
        yield path, None
    elif isinstance(after, float) and (before is None or not isclose(after, before, rel_tol=SAME, abs_tol=1e-15)):
        yield path, after


def _put(file: Any, path: Path, change: Number | None, after: dict[str, Any]) -> None:
    """Replace one number, or remove it."""
    *parents, last = path
    at = file
    for part in parents:
        at = at[part]
    if change is None:
        at.pop(last, None)
        return
    value, half = change
    size = None
    if isinstance(last, int):  # of a list all numbers have the same places behind the point
        whole: Any = after
        for part in parents:
            whole = whole[part]
        size = max(abs(each) for each in whole)
    at[last] = written(value, half, size)


def _motor(file: Any, changes: dict[Path, Number | None], motor: dict[str, Any]) -> None:
    """The torque-speed line in the file's own units."""
    stall, slope = ("motor", "stall_torque_n_m"), ("motor", "slope_n_m_s_rad")
    line = changes.get(stall), changes.get(slope)
    for key, unit in TORQUES.items():
        if key in file["motor"] and (change := changes.pop(stall, None)):
            changes["motor", key] = _times(change, 1.0 / unit)
    for key, unit in SPEEDS.items():
        change = changes.pop(("motor", key), None)
        if key not in file["motor"]:
            continue
        if motor.get("slope_n_m_s_rad") and slope in changes:
            del changes[slope]
            speed = motor["stall_torque_n_m"] / motor["slope_n_m_s_rad"]
            # As uncertain as the less certain of its two components.
            parts = [each[1] / each[0] for each in line if each and each[0] and each[1]]
            changes["motor", key] = _times((speed, speed * max(parts) if parts else None), 1.0 / unit)
        elif slope in changes:
            changes["motor", key] = change  # no line any more: no speed without load either


def _times(change: Number, factor: float) -> Number:
    value, half = change
    return value * factor, None if half is None else half * factor


def _total_mass(file: Any, changes: dict[Path, Number | None], mass_kg: float, half: float | None) -> None:
    """The total mass; the base has the remaining mass."""
    base: Path = ("body", 0, "mass_kg")
    if "total_mass_kg" in file and base in changes:
        del changes[base]
        changes["total_mass_kg",] = (mass_kg, half)


def _rotor(
    file: Any, changes: dict[Path, Number | None], wheels: list[dict[str, Any]], form: str | None, notes: list[str]
) -> None:
    """Inertias of wheels from a motor's rotor: the rotor's inertia determines their mean, the only identified value."""
    motor, inertias = file["motor"], [path for path in changes if path[0] == "wheel" and path[-1] == "inertia_kg_m2"]
    if "rotor_inertia_kg_m2" not in motor or not inertias:
        return
    tables = [] if form else file["wheel"]
    ratio2 = float(motor["gear_ratio"]) ** 2
    rotors = [(wheel["inertia_kg_m2"] - wheel["mass_kg"] * wheel["radius_m"] ** 2 / 2) / ratio2 for wheel in wheels]
    rotor, half = sum(rotors) / len(rotors), changes[inertias[0]]
    if rotor > 0.0 and not any("inertia_kg_m2" in table for table in tables):
        changes["motor", "rotor_inertia_kg_m2"] = (rotor, half[1] / ratio2 if half and half[1] else None)
        for path in inertias:
            del changes[path]
        return
    for key in ("rotor_inertia_kg_m2", "gear_ratio"):
        changes["motor", key] = None
    notes.append("rotor_inertia_kg_m2 and gear_ratio cannot give these inertias: each wheel has inertia_kg_m2 instead")


def _wheels(
    file: Any,
    form: str,
    changes: dict[Path, Number | None],
    wheels: tuple[list[dict[str, Any]], list[dict[str, Any]]],
    notes: list[str],
) -> None:
    """The numbers of wheels in a short form, or the wheels written out if the form cannot hold them."""
    moved = {path: changes.pop(path) for path in list(changes) if path[0] == "wheel"}
    if not moved:
        return
    halves = {str(path[2]): change[1] for path, change in moved.items() if change}
    keys = of_form(form, *wheels, halves, notes)
    if keys is not None:
        changes.update({(form, key): change for key, change in keys.items()})
        return
    notes.append(
        f"[{form}] cannot hold wheels that differ: they are written out as [[wheel]], at the end of the file, the"
        " form as a comment"
    )
    given = "wheel_inertia_kg_m2" in file[form] or "inertia_kg_m2" in halves
    lines = [f"[{form}]", *file[form].as_string().strip().splitlines()]
    file.remove(form)
    for line in lines:
        file.add(tomlkit().comment(line.removeprefix("# ")))
    tables = tomlkit().aot()
    for wheel in wheels[0]:
        table = tomlkit().table()
        for key in (*WHEEL, *(["inertia_kg_m2"] if given else [])):
            value = wheel[key]
            if isinstance(value, list):
                value = [written(each, size=max(map(abs, value))) for each in value]
            if key == "roller_angle_rad":
                key, value = "roller_angle_deg", degrees(value)
            table[key] = value if isinstance(value, str | list) else written(value)
        tables.append(table)
    file["wheel"] = tables
    changes.update(moved)


def calibrated_halves(vehicle: Vehicle, estimates: Sequence[Estimate]) -> dict[Path, float]:
    """Half widths of the numbers of wheels, from a calibration's estimates.

    Each kind has the digits of its narrowest interval, so that equal wheels have equal digits.
    """
    keys = vehicle.to_dict()["wheel"]
    radius = max(wheel["radius_m"] for wheel in keys)
    lever = max(hypot(*wheel["position_m"]) for wheel in keys)
    halves: dict[Path, float] = {}
    for ending, key, times in (
        (".radius", "radius_m", radius),
        (".lever", "position_m", lever),
        (".turn_rad", "rolling_direction", 1.0),
        (".radius_m", "radius_m", 1.0),
        (".shift_m", "position_m", 1.0),
    ):
        for each in estimates:
            half = _half(each)
            if each.name.endswith(ending) and half is not None:
                for k in range(len(keys)):
                    path = ("wheel", k, key)
                    halves[path] = min(halves.get(path, times * half), times * half)
    return halves


def identified_halves(found: Vehicle, estimates: Sequence[Estimate]) -> dict[Path, float]:
    """Half widths of the numbers of a vehicle file, from an identification's estimates; of gains a hundredth."""
    known = {each.name: half for each in estimates if (half := _half(each)) is not None}
    parts = {each.name: known[each.name] / each.value for each in estimates if each.name in known and each.value}
    keys = found.to_dict()
    halves: dict[Path, float] = {("gains", key): 0.01 * abs(value) for key, value in keys["gains"].items()}
    for key in ("gear_friction_n_m", "viscous_n_m_s_rad", "stall_torque_n_m", "slope_n_m_s_rad"):
        if key in known:
            halves["motor", key] = known[key]
    if "mass_kg" in known:
        halves["total_mass_kg",] = known["mass_kg"]
    for kind, key, name, power in (
        ("body", "mass_kg", "mass_kg", 1.0),
        ("body", "inertia_box_m", "yaw_inertia_kg_m2", 0.5),
        ("wheel", "inertia_kg_m2", "wheel_inertia_kg_m2", 1.0),
    ):
        if name in parts:
            for k, each in enumerate(keys[kind]):
                size = max(each[key]) if isinstance(each[key], list) else each[key]
                halves[kind, k, key] = power * parts[name] * size
    return halves


def _half(each: Estimate) -> float | None:
    return None if each.low is None or each.high is None else (each.high - each.low) / 2.0
