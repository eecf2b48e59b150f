"""The map of a foreign log: columns or topics of the signals, and their units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NoReturn

from omnistep._omnistep import Scenario, shortened
from omnistep._output_files import named_files, scenario_files
from omnistep._toml_files import read_toml, unknown_key
from omnistep.errors import ConfigError

#: Numbers beyond are none of a robot.
_LARGEST = 1e15
_TURN = 2.0 * math.pi
_DEGREE = math.pi / 180.0
_ANGLES = {"rad": 1.0, "deg": _DEGREE}
_RATES = {"rad/s": 1.0, "deg/s": _DEGREE}
_POSITIONS = {**_ANGLES, "turn": _TURN, "count": math.nan}  # a count follows from counts_per_turn
_SPEEDS = {**_RATES, "rpm": _TURN / 60.0, "turn/s": _TURN}
_TORQUES = {"N.m": 1.0, "A": math.nan, "mA": math.nan}  # a current follows from n_m_per_a
_DUTIES = {"1": 1.0, "percent": 0.01}
_FORCES = {"m/s2": 1.0, "g": 9.80665}
#: Units of time [s].
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


@dataclass(frozen=True)
class Kind:
    """Allowed contents of a table of the map.

    Attributes:
        units: factors to our units, by name; the first is the default.
        count: number of names; ``wheels`` or ``hinges`` for one for each wheel or hinge.
        held: each sample holds until the next; else values are linear between samples.
        keys: keys of this table only.
    """

    units: Mapping[str, float]
    count: tuple[int, ...] | Literal["wheels", "hinges"]
    held: bool = False
    keys: tuple[str, ...] = ()


#: The tables of a map that name signals.
KINDS = {
    "wheels": Kind({**_SPEEDS, **_POSITIONS}, "wheels", keys=("counts_per_turn", "wrap_bits", "at")),
    "references": Kind(_SPEEDS, "wheels", held=True, keys=("at",)),
    "torques": Kind(_TORQUES, "wheels", keys=("n_m_per_a", "at")),
    "commanded_torques": Kind(_TORQUES, "wheels", held=True, keys=("n_m_per_a", "at")),
    "duty": Kind(_DUTIES, "wheels", held=True, keys=("zero",)),
    "command": Kind(_ANGLES, (3,), held=True),
    "gyro": Kind(_RATES, (1, 3)),
    "accelerometer": Kind(_FORCES, (3,)),
    "attitude": Kind(_ANGLES, (2,)),
    "hinges": Kind(_ANGLES, "hinges"),
    "hinge_rates": Kind(_RATES, "hinges"),
    "pose": Kind(_ANGLES, (3,)),
    "odometry": Kind(_ANGLES, (3,)),
}
_OF_ALL = ("topic", "names", "unit", "scale", "offset", "max_gap_s")
_TOP = ("schema_version", "scenario", "vehicle", "period_s", "max_gap_s", "time", *KINDS)
_OF_TIME = ("column", "unit", "clock", "from_s", "until_s")


@dataclass(frozen=True)
class Signal:
    """A table of the map: the source of a signal and its conversion.

    A number becomes (number - offset) * factor, with one factor and offset for each name.
    """

    table: str
    kind: Kind
    topic: str | None
    names: tuple[str, ...]
    factors: tuple[float, ...]
    offsets: tuple[float, ...]
    unit: str
    positions: bool
    wrap: float | None
    at_wheel: bool
    max_gap_s: float | None
    #: State of the bridges at a duty cycle of zero, if the map states it.
    zero: str | None = None


@dataclass(frozen=True)
class LogMap:
    """A map, checked."""

    file: str
    text: str
    scenario: Scenario
    time_column: str | None
    time_unit_s: float
    clock: str
    from_s: float | None
    until_s: float | None
    #: The files of its vehicle and scenario, and files that the scenario names, unless they are built in.
    files: tuple[Path, ...] = ()
    names_vehicle: bool = True
    signals: dict[str, Signal] = field(default_factory=dict)

    @property
    def hinge_names(self) -> tuple[str, ...]:
        """Names of the hinges, in the vehicle's order."""
        return tuple(hinge["name"] for hinge in self.scenario.vehicle.to_dict().get("hinge", []))

    def refuse(self, key: str, reason: str) -> NoReturn:
        """Raise an error about a key, in one line."""
        _refuse(self.file, key, reason)


def _refuse(file: str, key: str, reason: str) -> NoReturn:
    raise ConfigError(f"{file}: {key}: {shortened(reason)}", key=key, file=file)


def read_map(path: str | PathLike[str]) -> LogMap:
    """Read a map and check it, its vehicle and scenario included."""
    path = Path(path)
    file = str(path)
    text, keys = read_toml(path)
    _known(file, "", keys, _TOP)
    version = keys.get("schema_version")
    if version != 1 or isinstance(version, bool):
        _refuse(file, "schema_version", f"{'missing' if version is None else repr(version)}, allowed: 1")
    scenario = _scenario(file, path.parent, keys)
    time = _table(file, keys, "time", {})
    _known(file, "time", time, _OF_TIME)
    limits = {
        name: _number(file, f"time.{name}", time[name], -math.inf) for name in ("from_s", "until_s") if name in time
    }
    if len(limits) == 2 and limits["until_s"] <= limits["from_s"]:
        _refuse(file, "time.until_s", f"{limits['until_s']}, allowed: more than time.from_s = {limits['from_s']}")
    gap = _gap(file, "max_gap_s", keys["max_gap_s"]) if "max_gap_s" in keys else None
    column = time.get("column")
    if column is not None and not isinstance(column, str):
        _refuse(file, "time.column", f"{column!r}, allowed: the name of a column")
    made = LogMap(
        file=file,
        text=text,
        scenario=scenario,
        time_column=column,
        time_unit_s=TIMES[_choice(file, "time.unit", time.get("unit", "s"), TIMES)],
        clock=_choice(file, "time.clock", time.get("clock", "header"), ("header", "received")),
        from_s=limits.get("from_s"),
        until_s=limits.get("until_s"),
        files=(
            *named_files({"vehicle": keys.get("vehicle")}, path.parent),
            *(scenario_files(path.parent / base) if (base := keys.get("scenario", "")).endswith(".toml") else ()),
        ),
        names_vehicle="vehicle" in keys or "scenario" in keys,
    )
    for table, kind in KINDS.items():
        if table in keys:
            made.signals[table] = _signal(made, table, kind, _table(file, keys, table, None), gap)
    if "wheels" not in made.signals:
        _refuse(file, "wheels", "missing, allowed: a table [wheels] with the encoders")
    return made


def _scenario(file: str, folder: Path, keys: Mapping[str, Any]) -> Scenario:
    period_us = round(_number(file, "period_s", keys.get("period_s"), 1e-6, 0.1) * 1e6)
    # The longest physics step that divides the control period; physics.md states the default.
    step_us = max(step for step in range(1, min(period_us, 500) + 1) if period_us % step == 0)
    base = _reference(file, folder, keys, "scenario", "flat") or "flat"
    vehicle = _reference(file, folder, keys, "vehicle", None)
    overrides = {"control.period_s": period_us / 1e6, "physics.timestep_s": step_us / 1e6}
    try:
        return Scenario(base, vehicle=vehicle, overrides=overrides)
    except ConfigError as error:
        raise ConfigError(f"{file}: {error}", key=error.key, file=file) from error


def _reference(file: str, folder: Path, keys: Mapping[str, Any], key: str, default: str | None) -> str | None:
    """The name of a built-in file, or a path relative to the map."""
    given = keys.get(key, default)
    if given is not None and (not isinstance(given, str) or not given):
        _refuse(file, key, f"{given!r}, allowed: a built-in {key} or the path of a .toml file")
    return str(folder / given) if given is not None and given.endswith(".toml") else given


def _signal(made: LogMap, table: str, kind: Kind, keys: dict[str, Any], gap: float | None) -> Signal:
    file = made.file
    _known(file, table, keys, (*_OF_ALL, *kind.keys))
    topic = keys.get("topic")
    if topic is not None and (not isinstance(topic, str) or not topic):
        _refuse(file, f"{table}.topic", f"{topic!r}, allowed: the name of a topic")
    vehicle = made.scenario.vehicle
    of_vehicle = {"wheels": tuple(vehicle.wheel_names), "hinges": made.hinge_names}
    allowed = (len(of_vehicle[kind.count]),) if isinstance(kind.count, str) else kind.count
    what = "one each of " + ", ".join(of_vehicle[kind.count]) if isinstance(kind.count, str) else ""
    if what and not made.names_vehicle:
        what += f" of {vehicle.name}, because the map names no vehicle"
    names = _names(file, f"{table}.names", keys.get("names", []), allowed, what)
    # Messages of commands, IMUs and poses have fixed fields for their numbers.
    count = len(names) or allowed[-1]
    unit = _choice(file, f"{table}.unit", keys.get("unit", next(iter(kind.units))), kind.units)
    factor = kind.units[unit]
    if (unit == "count") != ("counts_per_turn" in keys):
        how = (
            "missing"
            if unit == "count"
            else f"of unit {unit!r}"
            if "unit" in keys
            else f"unit missing, {unit!r} assumed"
        )
        _refuse(
            file, f"{table}.counts_per_turn", f'{how}, allowed: a number with unit = "count", and with no other unit'
        )
    if unit == "count":
        factor = _TURN / _number(file, f"{table}.counts_per_turn", keys["counts_per_turn"], 1.0, 1e9)
    current = unit in ("A", "mA")
    if current != ("n_m_per_a" in keys):
        how = "missing" if current else f"of unit {unit!r}"
        _refuse(file, f"{table}.n_m_per_a", f'{how}, allowed: a number with unit = "A" or "mA", and with no other unit')
    if current:
        constant = _number(file, f"{table}.n_m_per_a", keys["n_m_per_a"], 1e-9, 1e6)
        factor = constant * (1e-3 if unit == "mA" else 1.0)
    wrap = None
    if "wrap_bits" in keys:
        bits = keys["wrap_bits"]
        if unit != "count" or isinstance(bits, bool) or not isinstance(bits, int) or not 2 <= bits <= 53:
            _refuse(file, f"{table}.wrap_bits", f'{bits!r}, allowed: a whole number, 2 to 53, with unit = "count"')
        wrap = 2.0**bits
    at = _choice(file, f"{table}.at", keys.get("at", "actuator"), ("actuator", "wheel"))
    # Linear parts of a command, and places, are in m: only the last of three is an angle.
    angles = [k == count - 1 or table not in ("command", "pose", "odometry") for k in range(count)]
    scales = _numbers(file, f"{table}.scale", keys.get("scale", 1.0), count)
    if 0.0 in scales:
        _refuse(file, f"{table}.scale", "0, allowed: other numbers")
    return Signal(
        table=table,
        kind=kind,
        topic=topic,
        names=names,
        factors=tuple(scale * (factor if angle else 1.0) for scale, angle in zip(scales, angles, strict=True)),
        offsets=_numbers(file, f"{table}.offset", keys.get("offset", 0.0), count),
        unit=unit,
        positions=table == "wheels" and unit in _POSITIONS,
        wrap=wrap,
        at_wheel=at == "wheel",
        max_gap_s=_gap(file, f"{table}.max_gap_s", keys["max_gap_s"]) if "max_gap_s" in keys else gap,
        zero=_zero(file, keys["zero"]) if "zero" in keys else None,
    )


def _zero(file: str, given: Any) -> str:
    if given not in ("brake", "coast"):
        _refuse(file, "duty.zero", f'{given!r}, allowed: "brake" or "coast"')
    return str(given)


def _known(file: str, table: str, keys: Mapping[str, Any], known: Sequence[str]) -> None:
    for key in keys:
        if key not in known:
            _refuse(file, f"{table}.{key}" if table else shortened(key), unknown_key(key, known))


def _table(file: str, keys: Mapping[str, Any], table: str, default: dict[str, Any] | None) -> dict[str, Any]:
    found = keys.get(table, default)
    if not isinstance(found, dict):
        _refuse(file, table, f"{found!r}, allowed: a table [{table}]")
    return found


def _choice(file: str, key: str, given: Any, allowed: Sequence[str] | Mapping[str, Any]) -> str:
    if not isinstance(given, str) or given not in allowed:
        _refuse(file, key, f"{given!r}, allowed: {', '.join(allowed)}")
    return given


def _number(file: str, key: str, given: Any, least: float, most: float = math.inf) -> float:
    number = isinstance(given, int | float) and not isinstance(given, bool)
    # A whole number may be larger than any double.
    if not number or not max(least, -_LARGEST) <= given <= min(most, _LARGEST):
        limits = "a number" if least == -math.inf else f"{least:g} to {most:g}"
        _refuse(file, key, f"{'missing' if given is None else repr(given)}, allowed: {limits}")
    return float(given)


def _gap(file: str, key: str, given: Any) -> float:
    """The longest gap that is bridged: infinite if a signal is known between any two samples."""
    if given == math.inf:
        return math.inf
    return _number(file, key, given, 1e-6, 1e7)


def _numbers(file: str, key: str, given: Any, count: int) -> tuple[float, ...]:
    if not isinstance(given, list):
        return (_number(file, key, given, -math.inf),) * count
    if len(given) != count:
        _refuse(file, key, f"{len(given)} numbers, allowed: one, or {count}")
    return tuple(_number(file, key, each, -math.inf) for each in given)


def _names(file: str, key: str, given: Any, counts: Sequence[int], what: str) -> tuple[str, ...]:
    if not isinstance(given, list) or not all(isinstance(name, str) and name for name in given):
        _refuse(file, key, f"{given!r}, allowed: a list of names")
    if twice := next((name for number, name in enumerate(given) if name in given[:number]), None):
        _refuse(file, key, f"{twice!r} twice, allowed: each name once")
    if given and len(given) not in counts:
        allowed = " or ".join(str(count) for count in counts)
        _refuse(file, key, f"{len(given)} names, allowed: {allowed}{', ' if what else ''}{what}")
    return tuple(given)
