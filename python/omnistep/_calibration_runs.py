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

#: What is measured at the end of a run.
ENDS = ("end_x_m", "end_y_m", "end_yaw_rad", "distance_m")
RANGES = {
    **dict.fromkeys(ENDS, (-1e3, 1e3)),
    "distance_m": (0.0, 1e3),
    "position_sd_m": (1e-6, 10.0),
    "yaw_sd_rad": (1e-6, 3.0),
}
KEYS = ("schema_version", "position_sd_m", "yaw_sd_rad", "run")


@dataclass(frozen=True, kw_only=True)
class CalibrationRun:
    """One drive and the pose measured at its end; the start is the origin, facing +x.

    Attributes:
        log: readings of the encoders: columns ``time_s`` and, for the actuator of every wheel,
            ``wheel_NAME_position_rad`` or ``wheel_NAME_measured_rad_s``.
        end_x_m: position ahead of the start [m]; None where it was not measured.
        end_y_m: position to the left of the start [m].
        end_yaw_rad: heading, counter-clockwise from the start [rad]; whole turns do not matter.
        distance_m: distance of the end from the start [m], where only that was measured.
        gyro: take the heading from the log's ``gyro_rad_s``; its bias is its mean while the vehicle is at rest at the
            start, 0.5 s or more.

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
        allowed = ("log", *ENDS, "gyro")
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
        for key in ENDS:
            if key in each:
                number(key, each[key], f"{name}: run[{index}].")
        if not isinstance(each.get("gyro", False), bool):
            raise ConfigError(
                f"{name}: run[{index}].gyro = {shortened(repr(each['gyro']))}, allowed: true, false",
                key=f"run[{index}].gyro",
                file=name,
            )
        runs.append(CalibrationRun(**{**each, "log": Path(path).parent / log}))
    noise: dict[str, float] = {key: keys[key] for key in ("position_sd_m", "yaw_sd_rad") if key in keys}
    for key, value in noise.items():
        number(key, value, f"{name}: ")
    return runs, noise


def number(key: str, value: Any, where: str) -> None:
    """Refuse a value that is not a number within a key's range."""
    low, high = RANGES[key]
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not low <= value <= high:
        raise ConfigError(f"{where}{key} = {shortened(repr(value))}, allowed: {low:g} to {high:g}", key=key)
