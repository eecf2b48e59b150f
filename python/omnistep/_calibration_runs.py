"""Runs for calibration: the drive, and the pose that was measured at its end."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from omnistep._omnistep import shortened
from omnistep._toml_files import read_toml, unknown_key
from omnistep._wheel_logs import LogLike
from omnistep.errors import ConfigError

#: Measurements at the end of a run.
ENDS = ("end_x_m", "end_y_m", "end_yaw_rad", "distance_m")
#: Which part of the log it is.
PART = ("from_s", "until_s")
RANGES = {
    **dict.fromkeys(PART, (0.0, 1e6)),
    **dict.fromkeys(ENDS, (-1e3, 1e3)),
    "distance_m": (0.0, 1e3),
    "position_sd_m": (1e-6, 10.0),
    "yaw_sd_rad": (1e-6, 3.0),
}
KEYS = ("schema_version", "position_sd_m", "yaw_sd_rad", "run")


@dataclass(frozen=True, kw_only=True)
class CalibrationRun:
    """One drive and the pose measured at its end, or poses recorded all the way; the start is the origin, facing +x.

    Attributes:
        log: readings of the encoders: columns ``time_s`` and, for the actuator of every wheel,
            ``wheel_NAME_position_rad`` or ``wheel_NAME_measured_rad_s``.
        end_x_m: forward position from the start [m]; None if it was not measured.
        end_y_m: position to the left of the start [m].
        end_yaw_rad: heading, counter-clockwise from the start [rad]; whole turns do not matter.
        distance_m: distance of the end from the start [m], if only the distance was measured.
        gyro: use the heading from the log's ``gyro_rad_s``; its bias is its mean while the vehicle is at rest at the
            start, 0.5 s or more.
        pose: use the poses of the log, for example from motion capture: columns ``pose_x_m``, ``pose_y_m``,
            ``pose_yaw_rad``. The drive is cut into pieces, and the position of the marker plate on the vehicle is
            estimated.
        plate: runs with the same name share the position of the marker plate; otherwise each log has its own.
        from_s: start of the run, after the first row of the log [s].
        until_s: end of the run, likewise.

    >>> import omnistep
    >>> omnistep.CalibrationRun(log="ahead.csv", distance_m=2.013).end_x_m is None
    True
    """

    log: LogLike
    end_x_m: float | None = None
    end_y_m: float | None = None
    end_yaw_rad: float | None = None
    distance_m: float | None = None
    gyro: bool = False
    pose: bool = False
    plate: str | None = None
    from_s: float | None = None
    until_s: float | None = None


def read_runs(path: str | PathLike[str]) -> tuple[list[CalibrationRun], dict[str, float]]:
    r"""Read a TOML file with logs and measured poses, for :func:`calibrate`.

    Args:
        path: a file with ``[[run]]`` tables of the keys of :class:`CalibrationRun`; ``log`` is relative to the file.
            ``position_sd_m`` and ``yaw_sd_rad`` may precede them.

    Returns:
        The runs, and the numbers that precede them.

    Raises:
        ConfigError: the file cannot be read, or a key or value is wrong.

    >>> import tempfile, pathlib
    >>> from omnistep._calibration_runs import read_runs
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "runs.toml"
    >>> _ = file.write_text('[[run]]\nlog = "ahead.csv"\ndistance_m = 2.013\n')
    >>> runs, _ = read_runs(file)
    >>> runs[0].distance_m
    2.013
    """
    name = fspath(path)
    if Path(path).suffix in (".mcap", ".csv", ".parquet"):
        raise ConfigError(
            f'{name}: a log, allowed: a TOML file with [[run]] and log = "{Path(path).name}" in it', file=name
        )
    _, keys = read_toml(Path(path))
    if unknown := sorted(set(keys) - set(KEYS)):
        key = shortened(unknown[0])
        raise ConfigError(f"{name}: {key}: {unknown_key(unknown[0], KEYS)}", key=key, file=name)
    if keys.get("schema_version", 1) != 1:
        raise ConfigError(
            f"{name}: schema_version = {shortened(repr(keys['schema_version']))}, allowed: 1",
            key="schema_version",
            file=name,
        )
    tables = keys.get("run", [])
    if not (isinstance(tables, list) and tables and all(isinstance(each, dict) for each in tables)):
        raise ConfigError(f"{name}: no [[run]], allowed: at least one", key="run", file=name)
    runs = []
    for index, each in enumerate(tables):
        allowed = ("log", *ENDS, "gyro", "pose", "plate", *PART)
        if unknown := sorted(set(each) - set(allowed)):
            key = f"run[{index}].{shortened(unknown[0])}"
            raise ConfigError(f"{name}: {key}: {unknown_key(unknown[0], allowed)}", key=key, file=name)
        log = each.get("log")
        if not isinstance(log, str):
            raise ConfigError(
                f"{name}: run[{index}].log = {shortened(repr(log))}, allowed: the path of an MCAP or CSV file",
                key=f"run[{index}].log",
                file=name,
            )
        for key in ("gyro", "pose"):
            if not isinstance(each.get(key, False), bool):
                raise ConfigError(
                    f"{name}: run[{index}].{key} = {shortened(repr(each[key]))}, allowed: true, false",
                    key=f"run[{index}].{key}",
                    file=name,
                )
        if not isinstance(each.get("plate", ""), str):
            raise ConfigError(
                f"{name}: run[{index}].plate = {shortened(repr(each['plate']))}, allowed: a name",
                key=f"run[{index}].plate",
                file=name,
            )
        runs.append(CalibrationRun(**{**each, "log": Path(path).parent / log}))
        check(runs[-1], f"{name}: run[{index}]")
    noise: dict[str, float] = {key: keys[key] for key in ("position_sd_m", "yaw_sd_rad") if key in keys}
    for key, value in noise.items():
        number(key, value, f"{name}: ")
    return runs, noise


def check(run: CalibrationRun, where: str) -> None:
    """Refuse a run without a measurement, with two that exclude each other, or with numbers out of range."""
    stated = [key for key in ENDS if getattr(run, key) is not None]
    for key in (*stated, *(key for key in PART if getattr(run, key) is not None)):
        number(key, getattr(run, key), f"{where}.")
    if run.from_s is not None and run.until_s is not None and run.from_s >= run.until_s:
        raise ConfigError(
            f"{where}.from_s = {run.from_s:g}, allowed: less than until_s = {run.until_s:g}", key="from_s"
        )
    if run.pose and (stated or run.gyro):
        raise ConfigError(f"{where}: pose and {(*stated, 'gyro')[0]}, allowed: one of the two", key="pose")
    if run.plate is not None and not run.pose:
        raise ConfigError(f"{where}: plate without pose, allowed: with pose = true", key="plate")
    if run.gyro and run.end_yaw_rad is not None:
        raise ConfigError(f"{where}: gyro and end_yaw_rad, allowed: one of the two", key="gyro")
    if not (stated or run.gyro or run.pose):
        raise ConfigError(
            f"{where}: no measurement, allowed: at least one of {', '.join(ENDS)}, gyro, pose", key="end_x_m"
        )


def number(key: str, value: Any, where: str) -> None:
    """Refuse a value that is not a number within a key's range."""
    low, high = RANGES[key]
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not low <= value <= high:
        raise ConfigError(f"{where}{key} = {shortened(repr(value))}, allowed: {low:g} to {high:g}", key=key)
