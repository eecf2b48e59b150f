"""The scenario inside a recording: its vehicle, with the commands that the robot received."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from omnistep._log_map import LogMap
from omnistep._omnistep import Scenario
from omnistep._tables import Floats
from omnistep.errors import ConfigError, LogError

#: Longest recording, as of scenarios [s].
MOST_S = 3600.0
#: Most rows of a scenario's table of commands.
MOST_COMMANDS = 100_000
AXES = ("vx_m_s", "vy_m_s", "wz_rad_s")


def recorded_scenario(log_map: LogMap, source: Path, columns: Mapping[str, Floats], rows: int) -> tuple[Scenario, int]:
    """The scenario with the recorded command, held while it is unknown, over the length of the log.

    Also returns how many of its changes exceed the table's limit.
    """
    keys = log_map.scenario.to_dict()
    duration_s = min(max(rows * log_map.scenario.period_s, 0.01), MOST_S)
    keys.update(
        name="recorded", duration_s=duration_s, command={"vx_m_s": 0.0, "vy_m_s": 0.0, "wz_rad_s": 0.0, "ramp_s": 0.0}
    )
    if "command" not in log_map.signals:
        return Scenario.from_dict(keys), 0
    asked = held(np.column_stack([columns[f"asked_{axis}"] for axis in AXES]))[0]
    keys["command"], left_out = _command(log_map, asked)
    try:
        return Scenario.from_dict(keys), left_out
    except ConfigError as error:
        raise LogError(f"{source}: {_beyond(log_map, asked, str(error))}", file=str(source)) from error


def held(asked: Floats) -> tuple[Floats, int]:
    """Rows with each unknown one replaced by the last known row, rest before the first; and the unknown rows' count."""
    known = np.isfinite(asked).all(axis=1)
    last = np.maximum.accumulate(np.where(known, np.arange(len(asked)), -1))
    filled = np.where((last >= 0)[:, None], asked[np.maximum(last, 0)], 0.0)
    return filled, int(np.count_nonzero(~known))


def _beyond(log_map: LogMap, asked: Floats, said: str) -> str:
    """Report an invalid command, with the log's own names and times."""
    names = log_map.signals["command"].names or AXES
    for axis, name, column in zip(AXES, names, asked.T, strict=True):
        if f" {axis}: " in said:
            row = int(np.argmax(np.abs(column)))
            at_s, allowed = row * log_map.scenario.period_s, said.rpartition("allowed: ")[2]
            unit = "rad/s" if axis == "wz_rad_s" else "m/s"
            return f"command, {name}: {column[row]:g} {unit} at {at_s:g} s of the new log, allowed: {allowed}"
    return f"command: {said}"


def _command(log_map: LogMap, asked: Floats) -> tuple[dict[str, object], int]:
    """The table of a command, and the number of its changes beyond the table's limit."""
    changed = np.ones(len(asked), dtype=bool)
    changed[1:] = (asked[1:] != asked[:-1]).any(axis=1)
    at = np.flatnonzero(changed)
    changes = at.size
    if at.size > MOST_COMMANDS:
        at = at[:: math.ceil(at.size / MOST_COMMANDS)]
    period_s = log_map.scenario.period_s
    lines = ["time_s," + ",".join(AXES)]
    lines += [",".join(repr(float(value)) for value in (row * period_s, *asked[row])) for row in at]
    text = base64.b64encode("\n".join(lines).encode() + b"\n").decode()
    return {"file": f"data:text/csv;base64,{text}"}, changes - at.size
