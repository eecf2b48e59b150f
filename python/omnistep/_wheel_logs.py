"""Wheel signals of a log of any kind: a trace, an MCAP log, a CSV file, arrays by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Log, Trace, Vehicle, read_mcap
from omnistep._tables import SUFFIXES, columns_of, floats, module, names_of, needs, reading
from omnistep._toml_files import no_file
from omnistep.errors import ConfigError, LogError

Floats = NDArray[np.float64]
#: A trace, a log, the path of an MCAP, CSV or Parquet file, or columns by name.
LogLike: TypeAlias = Trace | Log | str | PathLike[str] | Mapping[str, Any]

#: State of a bridge at a duty cycle of zero: motor shorted, or left open.
ZERO_DUTIES = ("brake", "coast")
#: Fact of a recording that states it.
ZERO_DUTY_FACT = "duty_zero"

#: Rows may come this much too early or too late, in periods; others are left out, up to a part of them.
JITTER, MOST_OFF = 0.35, 0.1
#: Part of the steps in which one period may be missing.
MOST_LOST = 0.2
#: Rate at which the phase of the periods follows each row.
FOLLOWS = 0.05
#: A step of more periods than this is a gap; the clock may go on at another phase after it.
GAP = 2.5
#: Duty cycles are at most 1, but for rounding.
MOST_DUTY = 1.001
MOST_ROWS = 5_000_000
#: Rows are no closer and no farther apart than this [s].
CLOSEST_S, FARTHEST_S = 5e-5, 0.5
#: Numbers beyond are none of a robot.
LARGEST = 1e12
#: Columns of each wheel, and others, that are looked for.
WHEELS = (
    "wheel_{}_position_rad",
    "wheel_{}_measured_rad_s",
    "sensed_wheel_rad_{}",
    "wheel_{}_applied_n_m",
    "wheel_{}_duty",
    "commanded_duty_{}",
)
OTHERS = ("time_s", "gyro_rad_s", "sensed_yaw_rate_rad_s")
POSE = ("pose_x_m", "pose_y_m", "pose_yaw_rad")


@dataclass(frozen=True)
class WheelLog:
    """Rows at equal distances. The command of a row is held until the next one; missing values are NaN."""

    name: str
    period_s: float
    #: Actuator velocities as measured [rad/s], (T, N).
    measured: Floats
    #: Actuator angles [rad], (T, N), if the log contains them.
    positions: Floats | None
    #: Commanded torques [N.m], (T, N), if the log contains them.
    torques: Floats | None
    #: Duty cycles, -1 to 1, (T, N), if the log contains them.
    duty: Floats | None
    #: Yaw rate by a gyro [rad/s], (T,), if the log contains it.
    yaw_rate: Floats | None
    #: State of the bridges at a duty cycle of zero, if the log states it.
    zero_duty: str | None = None
    #: Measured poses at the times of the angles: x [m], y [m], yaw [rad], (T, 3), if they were requested.
    pose: Floats | None = None
    #: Message about a truncated file, otherwise empty.
    cut_off: str = ""

    def rows(self, first: int, last: int) -> WheelLog:
        """The part from the row ``first`` to the one before ``last``."""

        def part(column: Any) -> Any:
            return None if column is None else column[first:last]

        columns = ("measured", "positions", "torques", "duty", "yaw_rate", "pose")
        return replace(self, **{key: part(getattr(self, key)) for key in columns})


def spans(there: Any) -> list[tuple[int, int]]:
    """First row of each unbroken run of rows that are there, and the one after its last.

    >>> import numpy as np
    >>> from omnistep._wheel_logs import spans
    >>> spans(np.array([True, True, False, True]))
    [(0, 2), (3, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def read(data: LogLike, vehicle: Vehicle, *, pose: bool = False) -> WheelLog:
    """Read the wheel signals of a log for a vehicle, and measured poses if these are asked for.

    Raises:
        ConfigError: a column is missing, of another length, or not numbers; the message names log and column.
        LogError: the file cannot be read.
    """
    name, columns, zero, complete = _columns(data, vehicle, POSE if pose else ())
    time = _column(name, columns, "time_s", None)
    if len(time) < 10:
        raise ConfigError(f"{name}: time_s has {len(time)} rows, allowed: 10 or more", key="time_s", file=name)
    with np.errstate(over="ignore"):
        steps = np.diff(time)
    if (wrong := np.flatnonzero(~(np.isfinite(steps) & (steps > 0.0)))).size:
        row = int(wrong[0]) + 1
        raise ConfigError(
            f"{name}: time_s does not increase in row {row + 1}, from {time[row - 1]:.6g} to {time[row]:.6g} s,"
            " allowed: finite, increasing times; cut the log there",
            key="time_s",
            file=name,
        )
    period, kept, slots = _grid(name, time)

    def wheels(pattern: str) -> Floats | None:
        keys = [pattern.format(wheel) for wheel in vehicle.wheel_names]
        if not any(key in columns for key in keys):
            return None
        read = np.stack([_column(name, columns, key, len(time)) for key in keys], axis=1)
        # Every trace has torque columns, which are empty for a recording without torques.
        return read if np.isfinite(read).any() else None

    positions, measured = wheels("wheel_{}_position_rad"), wheels("wheel_{}_measured_rad_s")
    # In a trace, readings are of the start of a period, and poses of its end.
    trace = positions is None and not isinstance(data, Mapping) and not _is_table(data)
    if positions is None:
        positions = wheels("sensed_wheel_rad_{}")  # of a recording
        trace |= positions is not None
    if positions is not None:
        # The velocity over the periods that end with the row. Logged velocities may be filtered or noisy.
        measured = np.full_like(positions, np.nan)
        turned = np.diff(positions[kept], axis=0, prepend=positions[kept[:1]])
        measured[kept] = turned / (period * np.diff(slots, prepend=-1)[:, None])
    if measured is None:
        key = f"wheel_{vehicle.wheel_names[0]}_measured_rad_s"
        raise ConfigError(
            f"{name}: no column {key}, allowed: wheel_NAME_measured_rad_s or wheel_NAME_position_rad of every wheel"
            f" ({', '.join(vehicle.wheel_names)})",
            key=key,
            file=name,
        )
    torques = wheels("wheel_{}_applied_n_m")
    duty = wheels("wheel_{}_duty")
    if duty is None:
        duty = wheels("commanded_duty_{}")  # of a recording
    if duty is not None and (most := float(np.nanmax(np.abs(duty), initial=0.0))) > MOST_DUTY:
        wheel = vehicle.wheel_names[int(np.argmax(np.nanmax(np.abs(duty), axis=0, initial=0.0)))]
        raise ConfigError(
            f"{name}: wheel_{wheel}_duty reaches {most:.4g}, allowed: -1 to 1", key=f"wheel_{wheel}_duty", file=name
        )
    gyro = next((key for key in ("gyro_rad_s", "sensed_yaw_rate_rad_s") if key in columns), None)
    yaw_rate = None if gyro is None else _column(name, columns, gyro, len(time))

    poses = None
    if pose and all(key in columns for key in POSE):
        poses = np.stack([_column(name, columns, key, len(time)) for key in POSE], axis=1)
        if trace:
            poses = np.vstack([np.full((1, 3), np.nan), poses[:-1]])

    def at(rows: Floats) -> Floats:
        taken = np.full((slots[-1] + 1, rows.shape[1]), np.nan)
        taken[slots] = rows[kept]
        return taken

    return WheelLog(
        name=name,
        period_s=period,
        measured=at(measured),
        positions=None if positions is None else at(positions),
        torques=None if torques is None else at(torques),
        duty=None if duty is None else at(duty),
        yaw_rate=None if yaw_rate is None else at(yaw_rate[:, None])[:, 0],
        zero_duty=zero,
        pose=None if poses is None else at(poses),
        cut_off=""
        if complete
        else f"{name}: its end is missing, as of a recording that was cut off: {time[-1]:.6g} s read",
    )


def _grid(name: str, time: Floats) -> tuple[float, NDArray[np.int64], NDArray[np.int64]]:
    """The period, the rows that are kept, and the number of the period of each, from 0.

    Times may be rounded to a fraction of the period, so it is estimated from all of them and not from single steps.
    """
    steps = np.diff(time)
    median, span = float(np.median(steps)), float(time[-1]) - float(time[0])
    if not span <= MOST_ROWS * median:
        raise ConfigError(
            f"{name}: time_s spans {span / median:.3g} periods, allowed: up to {MOST_ROWS}",
            key="time_s",
            file=name,
        )
    if (most := float(np.abs(time).max())) > LARGEST:
        raise ConfigError(f"{name}: time_s reaches {most:.3g}, allowed: up to {LARGEST:g}", key="time_s", file=name)
    if not CLOSEST_S <= median <= FARTHEST_S:
        raise ConfigError(
            f"{name}: rows of time_s are {median:.4g} s apart, allowed: {CLOSEST_S:g} to {FARTHEST_S:g} s; log it in s",
            key="time_s",
            file=name,
        )
    # Late rows are followed by short steps: as many of both are left out. Then a line through all times.
    period = float(np.mean(steps[np.abs(steps / median - 1.0) <= 0.5 + 1e-6]))
    since, part = time - time[0], np.cumsum(np.r_[0, steps > GAP * median])

    def centred(column: Any) -> Floats:
        mean = np.bincount(part, weights=column) / np.bincount(part)
        return np.asarray(column - mean[part], dtype=np.float64)

    for _ in range(2):
        slots, off = _followed(since / period, part)
        late, number = centred(since), centred(slots)
        period = float(late @ number / (number @ number)) if number.any() else period
    slots, off = _followed(since / period, part)
    near = np.abs(off) <= JITTER
    if (~near).mean() > MOST_OFF:
        raise ConfigError(
            f"{name}: {(~near).sum()} of {len(time)} times of time_s are more than {JITTER} periods of {period:.4g} s"
            f" early or late, allowed: up to {100 * MOST_OFF:.0f} %; log at equal intervals",
            key="time_s",
            file=name,
        )
    kept, slots = np.flatnonzero(near), slots[near]
    if (twice := np.flatnonzero(np.diff(slots) < 1)).size:
        at = time[kept[twice[0] + 1]]
        raise ConfigError(
            f"{name}: time_s has two rows in one period of {period:.4g} s, at {at:.6g} s, allowed: one in each period",
            key="time_s",
            file=name,
        )
    if (lost := (np.diff(slots) == 2).mean()) > MOST_LOST:
        raise ConfigError(
            f"{name}: {100 * lost:.0f} % of the steps of time_s are two periods of {period:.4g} s, allowed: up to"
            f" {100 * MOST_LOST:.0f} %; log every period, with times to half a period or finer",
            key="time_s",
            file=name,
        )
    return period, kept, slots - slots[0]


def _followed(times: Floats, part: NDArray[np.int64]) -> tuple[NDArray[np.int64], Floats]:
    """The nearest period of each time, in periods, and its distance; the phase is tracked, and restarts after gaps."""
    slots, off = np.empty(len(times), dtype=np.int64), np.empty(len(times))
    slot, phase, before = 0, 0.0, 0
    for row, (time, number) in enumerate(zip(times.tolist(), part.tolist(), strict=True)):
        if number == before:
            slot = round(time - phase)
        else:
            slot, before = slot + round(time - times[row - 1]), number
            phase = time - slot
        slots[row], off[row] = slot, time - phase - slot
        phase += FOLLOWS * off[row]
    return slots, off


def _is_table(data: LogLike) -> bool:
    return isinstance(data, str | PathLike) and Path(data).suffix.lower() in SUFFIXES


def _columns(data: LogLike, vehicle: Vehicle, more: tuple[str, ...]) -> tuple[str, Mapping[str, Any], str | None, bool]:
    """Name, columns, state of the bridges at zero duty if known, and whether the file is complete."""
    if isinstance(data, Trace):
        return data.scenario, data.columns(), None, True
    if isinstance(data, Mapping):
        return "data", data, None, True
    if not isinstance(data, Log | str | PathLike):
        raise TypeError(f"data: {type(data).__name__}, allowed: a trace, a log, a path, or arrays by name")
    if not isinstance(data, Log):
        path = Path(data)
        if _is_table(path):
            return fspath(path), _table(path, vehicle, more), None, True
        data = read_mcap(path)
    zero = data.run.get(ZERO_DUTY_FACT)
    return fspath(data.path), data.trace.columns(), zero if zero in ZERO_DUTIES else None, data.complete


def _table(path: Path, vehicle: Vehicle, more: tuple[str, ...]) -> dict[str, Floats]:
    """The columns of a table that are needed; others may have any content."""
    if not path.is_file():
        raise LogError(no_file(path), file=fspath(path))
    try:
        module("pyarrow")
    except ImportError as error:
        raise needs("pyarrow", f"a {path.suffix.lower()} log", "identify") from error
    useful = [*OTHERS, *more, *(pattern.format(wheel) for pattern in WHEELS for wheel in vehicle.wheel_names)]
    with reading(path):
        names = names_of(path)
        wanted = [name for name in useful if name in names]
        for name in wanted:
            if names.count(name) > 1:
                raise LogError(f"{path}: {names.count(name)} columns {name}, allowed: one", file=fspath(path))
        columns = columns_of(path, wanted) if wanted else {}
        return {name: floats(path, name, column) for name, column in columns.items()}


def _column(name: str, columns: Mapping[str, Any], key: str, length: int | None) -> Floats:
    if key not in columns:
        raise ConfigError(
            f"{name}: no column {key}, allowed: a column of numbers; other names: omnistep import", key=key, file=name
        )
    try:
        column = np.array(columns[key], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{name}: {key} is not numbers, allowed: a column of numbers", key=key, file=name) from error
    if column.ndim != 1 or (length is not None and len(column) != length):
        raise ConfigError(
            f"{name}: {key} has shape {column.shape}, allowed: ({'T' if length is None else length},)",
            key=key,
            file=name,
        )
    column[~np.isfinite(column)] = np.nan
    if key != "time_s" and (most := float(np.nanmax(np.abs(column), initial=0.0))) > LARGEST:
        raise ConfigError(f"{name}: {key} reaches {most:.3g}, allowed: up to {LARGEST:g}", key=key, file=name)
    return column
