"""Import of real logs: converts measurements on a vehicle into a log like a run's log."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from omnistep import _followed, _gyro_doubts, _plausibility, _pose_doubts
from omnistep._log_map import LogMap, read_map
from omnistep._log_sources import Nanoseconds, read_samples, span
from omnistep._omnistep import Kinematics, Scenario, Vehicle, write_recording
from omnistep._output_files import check_output
from omnistep._progress import bar
from omnistep._recorded_command import AXES, MOST_COMMANDS, recorded_scenario
from omnistep._resampling import Channel, channels, clock_doubts
from omnistep._tables import Floats, Skipped
from omnistep._wheel_logs import ZERO_DUTY_FACT
from omnistep._wheel_odometry import reckoned
from omnistep.errors import LogError

_PLACE = ("x_m", "y_m", "yaw_rad")
#: Columns of each wheel, by the table of the map.
_OF_WHEELS = {
    "wheels": "measured_rad_s",
    "references": "reference_rad_s",
    "torques": "torque_n_m",
    "commanded_torques": "applied_n_m",
}


@dataclass(frozen=True)
class ImportedSignal:
    """Import result of one column of a foreign log.

    Attributes:
        signal: the table of the map.
        name: column, joint or field.
        samples: number of samples that were used, over the whole log.
        rate_hz: samples per second, by the median distance.
        missing: cells that were empty, not a number or infinite; left out.
        unordered: samples left out so that times ascend, as few as possible; of two at one time the second.
        gaps: number of times that two samples are too far apart for interpolation.
        longest_gap_s: the longest of these [s].
        gaps_s: all of them [s].
        beyond: control periods in which a velocity is beyond the motors' no-load speed, a torque beyond their
            torque-speed line at the measured velocity, or a duty cycle beyond 1; they are kept.
        known: control periods in which the new log has the signal.
    """

    signal: str
    name: str
    samples: int
    rate_hz: float
    missing: int
    unordered: int
    gaps: int
    longest_gap_s: float
    gaps_s: float
    beyond: int
    known: int


@dataclass(frozen=True)
class ImportSummary:
    """Import result of a foreign log: ``print`` it.

    Attributes:
        source: the foreign log.
        path: the log that was written.
        rows: control periods.
        period_s: the control period [s].
        start_s: start of the first control period, after the first sample of the foreign log [s].
        signals: its columns, one by one.
        commands_left_out: changes of the command that are missing in the embedded scenario, because its table is
            limited to 100000; the log's columns contain them.
        doubts: implausible findings, one line each: signs, the order of wheels, units; first whether the log was cut
            off.
        skipped: the lines of a CSV file that were left out (``count``, ``first``), if requested.
    """

    source: Path
    path: Path
    rows: int
    period_s: float
    start_s: float
    signals: tuple[ImportedSignal, ...]
    commands_left_out: int
    doubts: tuple[str, ...] = ()
    skipped: Skipped | None = None

    def __str__(self) -> str:
        headings = (
            "signal",
            "name",
            "samples",
            "Hz",
            "gaps",
            "longest [s]",
            "in gaps [s]",
            "left out",
            "beyond motor",
            "known in",
        )
        rows = [
            (
                each.signal,
                each.name,
                str(each.samples),
                f"{each.rate_hz:.1f}",
                str(each.gaps),
                f"{each.longest_gap_s:.3f}",
                f"{each.gaps_s:.3f}",
                str(each.missing + each.unordered),
                str(each.beyond),
                str(each.known),
            )
            for each in self.signals
        ]
        widths = [max(len(row[k]) for row in [headings, *rows]) for k in range(len(headings))]
        lines = []
        for row in [headings, *rows]:
            cells = [
                cell.ljust(width) if k < 2 else cell.rjust(width)
                for k, (cell, width) in enumerate(zip(row, widths, strict=True))
            ]
            lines.append("  ".join(cells).rstrip())
        span = f"{self.rows * self.period_s:.3f} s from {self.start_s:.3f} s on"
        title = f"{self.source}: {self.rows} control periods of {self.period_s:g} s, {span}"
        if self.commands_left_out:
            lacks = f"the scenario in the log lacks {self.commands_left_out} changes of the command"
            lines.append(f"{lacks}: it can hold {MOST_COMMANDS}")
        if self.skipped is not None:
            lines.append(f"{self.skipped} (--skip-bad-lines)")
        lines += [f"doubtful: {doubt}" for doubt in self.doubts]
        return "\n".join([title, *lines])


def import_log(
    log: str | PathLike[str],
    *,
    map: str | PathLike[str],
    out: str | PathLike[str],
    progress: bool = True,
    skip_bad_lines: bool = False,
) -> ImportSummary:
    r"""Make a log of measurements on a vehicle, for :func:`omnistep.read_mcap`, replay and resimulate.

    Velocities, currents and other measurements are linear between two samples; commands hold until the next one.
    Between samples that are too far apart the columns are NaN. Nothing is smoothed.

    Args:
        log: a CSV or Parquet file, a rosbag2 (its folder, .mcap or .db3).
        map: the map in TOML: columns or topics of the signals, and their units.
        out: the log to write.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.
        skip_bad_lines: leave out lines of a CSV file that cannot be read, and those before the columns' names.

    Returns:
        The import result of each column.

    Raises:
        ConfigError: a key of the map is wrong, or names something that is missing; the message names it and the allowed
            values. Or ``out`` is the log, the map or a file that it names, or no regular file.
        LogError: the log cannot be read or written.
        ImportError: pyarrow or rosbags is not installed: install the extra ``import``.

    Example:
        >>> import omnistep, pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     here = pathlib.Path(folder)
        ...     _ = (here / "robot.csv").write_text("t,a,b,c\n0,1,1,1\n0.01,2,2,2\n0.02,3,3,3\n")
        ...     names = '[time]\ncolumn = "t"\n[wheels]\nnames = ["a", "b", "c"]\n'
        ...     head = 'schema_version = 1\nvehicle = "omni3"\nperiod_s = 0.005\n'
        ...     _ = (here / "my.toml").write_text(head + names)
        ...     summary = omnistep.import_log(here / "robot.csv", map=here / "my.toml", out=here / "robot.mcap")
        ...     log = omnistep.read_mcap(here / "robot.mcap")
        >>> summary.rows, log.trace.wheels("measured_rad_s")[:, 0].tolist()
        (5, [1.0, 1.5, 2.0, 2.5, 3.0])
        >>> summary.signals[2].name, summary.signals[2].samples, summary.signals[2].gaps
        ('c', 3, 0)
    """
    source, path = Path(log), Path(out)
    log_map = read_map(map)
    check_output(path, [source, Path(map), *log_map.files])
    with bar("import", shown=progress) as advance:
        skipped = Skipped() if skip_bad_lines else None
        samples, missing = read_samples(source, log_map, advance, skipped)
    # Numbers of absurd size become infinite or NaN, which a log never marks as known.
    with np.errstate(over="ignore", invalid="ignore"):
        read = {
            table: channels(source, signal, samples[table], clock=_clock(log_map, table), turning=_turning(table))
            for table, signal in log_map.signals.items()
        }
        starts_ns, rows = _span(source, log_map, read["wheels"])
        columns = _columns(log_map, read, starts_ns, rows)
        scenario, commands_left_out = recorded_scenario(log_map, source, columns, rows)
        signals = _signals(log_map, read, columns)
        period_s = log_map.scenario.period_s
        clocks = {_clock(log_map, table): samples[table].time_ns for table in read}
        doubts: tuple[str, ...] = (missing,) if missing else ()
        doubts += tuple(doubt for clock, time_ns in clocks.items() for doubt in clock_doubts(clock, time_ns))
        doubts += _doubtful(log_map, read, columns, signals, starts_ns)
    summary = ImportSummary(source, path, rows, period_s, starts_ns * 1e-9, signals, commands_left_out, doubts, skipped)
    facts = {"source": source.name, "map": Path(map).name, "import": str(summary)}
    if "duty" in log_map.signals and (zero := log_map.signals["duty"].zero):
        facts[ZERO_DUTY_FACT] = zero
    write_recording(path, scenario, columns, facts, log_map.text)
    return summary


def _clock(log_map: LogMap, table: str) -> str:
    """Description of the source of a signal's times."""
    topic = log_map.signals[table].topic
    return f"column {log_map.time_column}" if topic is None else f"topic {topic}"


def _turning(table: str) -> tuple[int, ...]:
    return (2,) if table in ("pose", "odometry") else ()


def _span(source: Path, log_map: LogMap, wheels: list[Channel]) -> tuple[int, int]:
    """Start of the first control period [ns], and the number of periods."""
    there = [wheel for wheel in wheels if wheel.time_ns.size]
    if not there:
        raise LogError(f"{source}: no velocity of any wheel, allowed: at least two samples", file=str(source))
    first = int(min(wheel.time_ns[0] for wheel in there))
    last = int(max(wheel.time_ns[-1] for wheel in there))
    return span(source, log_map, first, last, max(wheel.time_ns.size for wheel in there))


def _period_ns(scenario: Scenario) -> int:
    return round(scenario.period_s * 1e6) * 1000


def _columns(log_map: LogMap, read: Mapping[str, list[Channel]], starts_ns: int, rows: int) -> dict[str, Floats]:
    """Columns of the log. Measurements belong to the start of a control period, poses to its end."""
    scenario = log_map.scenario
    period_ns, vehicle = _period_ns(scenario), scenario.vehicle
    starts: Nanoseconds = starts_ns + period_ns * np.arange(rows, dtype=np.int64)
    columns: dict[str, Floats] = {}
    gears = [wheel.gear for wheel in vehicle.layout.wheels]

    def turned(channel: Channel) -> Floats:
        before = np.concatenate([starts[:1] - period_ns, starts])
        return np.asarray(np.diff(channel.at(before)) / (period_ns * 1e-9), dtype=np.float64)

    def there(channel: Channel) -> Floats:
        return channel.over(starts, period_ns)

    positions = log_map.signals["wheels"].positions
    for table, of_table in read.items():
        for number, (name, channel) in enumerate(zip(_names(log_map, table), of_table, strict=True)):
            if table in ("pose", "odometry"):
                at = channel.at(starts + period_ns)
                columns[name] = np.arctan2(np.sin(at), np.cos(at)) if name.endswith("yaw_rad") else at
                continue
            columns[name] = turned(channel) if table == "wheels" and positions else there(channel)
            if table in _OF_WHEELS and log_map.signals[table].at_wheel:
                # With a gear the wheel turns as many times as fast, and pushes that much less hard.
                columns[name] *= gears[number] ** (1 if table in ("torques", "commanded_torques") else -1)
    if positions:
        # Their differences are coarse; a model is fitted to the angles themselves.
        for name, gear, channel in zip(vehicle.wheel_names, gears, read["wheels"], strict=True):
            columns[f"sensed_wheel_rad_{name}"] = there(channel) / (gear if log_map.signals["wheels"].at_wheel else 1.0)
    if "gyro" in read:
        columns["gyro_rad_s"] = columns["sensed_yaw_rate_rad_s"]
    measured = np.column_stack([columns[f"wheel_{name}_measured_rad_s"] for name in vehicle.wheel_names])
    if "odometry" not in read:
        poses = reckoned(log_map, read["wheels"], read.get("pose", []), measured, starts, period_ns)
        for name, column in zip(_PLACE, poses.T, strict=True):
            columns[f"odom_{name}"] = np.ascontiguousarray(column)
    for axis, column in zip(AXES, estimated(vehicle, measured).T, strict=True):
        columns[f"estimated_{axis}"] = np.ascontiguousarray(column)
    return columns


def _names(log_map: LogMap, table: str) -> list[str]:
    """The columns that a table of the map becomes, in its order."""
    wheels, hinges = log_map.scenario.vehicle.wheel_names, log_map.hinge_names
    if table in _OF_WHEELS:
        return [f"wheel_{name}_{_OF_WHEELS[table]}" for name in wheels]
    if table == "gyro":
        axes = ("roll", "pitch", "yaw")[-len(log_map.signals["gyro"].factors) :]
        return [f"sensed_{axis}_rate_rad_s" for axis in axes]
    return {
        "duty": [f"commanded_duty_{name}" for name in wheels],
        "command": [f"asked_{axis}" for axis in AXES],
        "accelerometer": [f"sensed_specific_force_{axis}_m_s2" for axis in "xyz"],
        "attitude": ["sensed_roll_rad", "sensed_pitch_rad"],
        "hinges": [f"sensed_angle_rad_{hinge}" for hinge in hinges],
        "hinge_rates": [f"sensed_rate_rad_s_{hinge}" for hinge in hinges],
        "pose": [f"pose_{name}" for name in _PLACE],
        "odometry": [f"odom_{name}" for name in _PLACE],
    }[table]


def _doubtful(
    log_map: LogMap,
    read: Mapping[str, list[Channel]],
    columns: Mapping[str, Floats],
    signals: Sequence[ImportedSignal],
    starts_ns: int,
) -> tuple[str, ...]:
    vehicle = log_map.scenario.vehicle
    measured = np.column_stack([columns[f"wheel_{name}_measured_rad_s"] for name in vehicle.wheel_names])
    rates = [each.rate_hz for each in signals if each.signal == "wheels" and each.rate_hz > 0.0]
    doubts = _plausibility.of_steps(1.0 / max(rates)) if rates else []
    wheels = log_map.signals["wheels"]
    if wheels.unit == "count":
        gears = [wheel.gear if wheels.at_wheel else 1.0 for wheel in vehicle.layout.wheels]
        no_load = vehicle.no_load_rad_s or math.inf
        for channel, factor, gear in zip(read["wheels"], wheels.factors, gears, strict=True):
            # If a clock goes back, rows are left out; the counter continues after them.
            pieces = (np.split(column, channel.set_back) for column in (channel.time_ns * 1e-9, channel.value / factor))
            for time_s, counts in zip(*pieces, strict=True):
                doubts += _plausibility.of_counter(channel.name, time_s, counts, no_load * gear / abs(factor))
    doubts += [f"{each.name} of [{each.signal}] has no number" for each in signals if each.known == 0]
    beyond = [(each.signal, each.name, each.beyond, each.known) for each in signals]
    doubts += _plausibility.of_motors(beyond, vehicle.no_load_rad_s or math.inf)
    doubts += _plausibility.of_wheels(vehicle, measured, log_map.scenario.period_s)
    if "gyro_rad_s" in columns:
        doubts += _gyro_doubts.of_gyro(vehicle, measured, columns["gyro_rad_s"], log_map.scenario.period_s)
    if "pose" in log_map.signals:
        period_ns = _period_ns(log_map.scenario)
        rows = np.round((read["pose"][2].time_ns - starts_ns) / period_ns).astype(np.int64) - 1
        sampled = np.unique(rows[(rows >= 0) & (rows < len(measured))])
        # Headings in degrees read as rad would lose whole turns in the log's column.
        ends = starts_ns + period_ns * np.arange(1, len(measured) + 1, dtype=np.int64)
        pose = np.column_stack([channel.at(ends) for channel in read["pose"]])
        doubts += _pose_doubts.of_pose(vehicle, measured, log_map.scenario.period_s, pose, sampled)
    if "command" in log_map.signals:
        asked = np.column_stack([columns[f"asked_{axis}"] for axis in AXES])
        doubts += _followed.of_command(vehicle, measured, asked, log_map.scenario.period_s)
    if "duty" in log_map.signals:
        duty = np.column_stack([columns[f"commanded_duty_{name}"] for name in vehicle.wheel_names])
        doubts += _followed.of_duty(vehicle, measured, duty, log_map.scenario.period_s)
    # Command and duty cycles may indicate the same finding for a wheel.
    return tuple(dict.fromkeys(doubts))


def estimated(vehicle: Vehicle, measured_rad_s: Floats) -> Floats:
    """The twists from velocities of all wheels, (T, 3); NaN if one of them is unknown."""
    twists = np.full((len(measured_rad_s), 3), np.nan)
    known = np.isfinite(measured_rad_s).all(axis=1)
    if known.any():
        twists[known] = Kinematics(layout=vehicle.layout).forward(measured_rad_s[known])
    return twists


def _signals(
    log_map: LogMap, read: Mapping[str, list[Channel]], columns: Mapping[str, Floats]
) -> tuple[ImportedSignal, ...]:
    vehicle = log_map.scenario.vehicle
    stall_n_m = float(vehicle["motor.stall_torque_n_m"])
    no_load_rad_s = vehicle.no_load_rad_s or math.inf
    limits = {
        "wheels": no_load_rad_s,
        "references": no_load_rad_s,
        "torques": stall_n_m,
        "commanded_torques": stall_n_m,
        "duty": 1.0,
    }
    signals = []
    for table, of_table in read.items():
        limit = limits.get(table, math.inf)
        for number, (name, channel) in enumerate(zip(_names(log_map, table), of_table, strict=True)):
            column = columns[name]
            most = np.full(len(column), limit)
            if table in ("torques", "commanded_torques"):
                # The driving torque of a motor falls with its speed; its braking torque does not.
                wheel = np.nan_to_num(columns[_names(log_map, "wheels")[number]])
                most = limit * (1.0 - np.maximum(wheel * np.sign(np.nan_to_num(column)), 0.0) / no_load_rad_s)
            beyond = int(np.count_nonzero(np.abs(column) > np.maximum(most, 0.0) + 1e-6 * limit))
            gaps_s = channel.gaps_s()
            signals.append(
                ImportedSignal(
                    signal=table,
                    name=channel.name,
                    samples=int(channel.time_ns.size),
                    rate_hz=channel.rate_hz(),
                    missing=channel.missing,
                    unordered=channel.unordered,
                    gaps=int(gaps_s.size),
                    longest_gap_s=float(gaps_s.max(initial=0.0)),
                    gaps_s=float(gaps_s.sum()),
                    beyond=beyond,
                    known=int(np.count_nonzero(np.isfinite(column))),
                )
            )
    return tuple(signals)
