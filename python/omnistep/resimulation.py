"""The simulation driven with the commands of a log, and its difference to the log's measurements."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from omnistep._argument_types import trace_of
from omnistep._axes import figure, recorded_and_simulated
from omnistep._calibration_poses import repeated, without_repeated
from omnistep._marker_plate import MarkerPlate, earlier, found, given, late_s, slipping
from omnistep._omnistep import Kinematics, Log, Odometry, Scenario, Simulation, Trace
from omnistep._output_files import REFERENCES, check_picture, named_files, replaced, scenario_files
from omnistep._progress import bar
from omnistep._recorded_command import AXES
from omnistep._resimulation_inputs import BYS, inputs_of, torque_line, twists_of
from omnistep.errors import ConfigError
from omnistep.recordings import estimated
from omnistep.runs import read_mcap

Floats = NDArray[np.float64]
#: Control periods between two looks at the progress bar.
_PERIODS_PER_LOOK = 256
_POSE = ("pose_x_m", "pose_y_m", "pose_yaw_rad")
#: Actuator effects between a commanded and an applied torque; an applied torque already includes them.
_ON_THE_WAY = ("actuators.torque_lag_s", "actuators.voltage_sag")
#: Wheels that are driven along recorded ones follow them if they are off by less than this part of these.
_NOT_FOLLOWED = 0.12
#: Allowed ratio of lateral motion to the wheels' readings.
_SIDEWAYS = (0.5, 1.5)


@dataclass(frozen=True)
class Difference:
    """Difference between a column of the simulation and the same column of the log, at equal times.

    Attributes:
        name: the column; ``path`` is the distance of the two positions, in m.
        rms: root mean square of the difference, in the column's unit; NaN without comparable rows.
        largest: its largest size.
        largest_at_s: its time [s].
        recorded_rms: root mean square of the log's column in the same rows.
        compared: rows in which both are known.
        left_out: rows in which one is unknown.
    """

    name: str
    rms: float
    largest: float
    largest_at_s: float
    recorded_rms: float
    compared: int
    left_out: int

    @classmethod
    def of(cls, name: str, time_s: Floats, recorded: Floats, simulated: Floats) -> Difference:
        """The difference of two columns."""
        off = np.abs(simulated - recorded)
        known = np.isfinite(off)
        compared = int(np.count_nonzero(known))
        if compared == 0:
            return cls(name, math.nan, math.nan, math.nan, math.nan, 0, len(off))
        at = int(np.nanargmax(np.where(known, off, -1.0)))
        return cls(
            name=name,
            rms=float(np.sqrt(np.mean(off[known] ** 2))),
            largest=float(off[at]),
            largest_at_s=float(time_s[at]),
            recorded_rms=float(np.sqrt(np.mean(recorded[known] ** 2))),
            compared=compared,
            left_out=len(off) - compared,
        )


@dataclass(frozen=True)
class Resimulation:
    """A log and a simulation that was driven with its commands or torques: ``print`` it.

    Attributes:
        recorded: the log's columns.
        simulated: signals of the simulation, with equal rows and times.
        by: the input of the simulation: ``commands``, ``torques``, ``wheels`` or ``duty``.
        unknown: control periods in which the log lacks that input: the last one was held, rest before the first.
        zeroed: keys of the scenario that were set to 0, because measured torques include their effect.
        differences: by name: ``wheel_NAME_measured_rad_s`` of each wheel, ``wheels`` (all of them), the twist from the
            wheels ``estimated_*``, ``gyro_rad_s`` and ``path`` (in the plane, from the start of the log; by ``pose_*``
            if the log has it, otherwise by the wheels, until the first gap).
        plate: position of the marker plate of the log's pose on the vehicle, ``x_m``, ``y_m`` and ``yaw_rad``; the
            paths are the plate's paths. None if the pose is the vehicle's own, from a run, or if there is none.
        late_s: how late the log's poses are behind its wheels [s], found from both; the paths are compared without it.
        repeated_s: from when to when the log's pose is the last one again while the wheels move [s]; not compared.
        complete: False of a log that was cut off: its end is missing.
    """

    recorded: Trace
    simulated: Trace
    by: str
    unknown: int
    zeroed: tuple[str, ...]
    differences: Mapping[str, Difference]
    plate: MarkerPlate | None
    late_s: float
    repeated_s: tuple[tuple[float, float], ...]
    complete: bool
    _wheels: tuple[Floats, Floats]
    _twists: tuple[Floats, Floats]
    _paths: tuple[Floats, Floats]

    def __str__(self) -> str:
        headings = ("column", "rms", "of rms", "largest", "at [s]", "compared", "left out")
        rows = [
            (
                each.name,
                f"{each.rms:.4g}",
                f"{each.recorded_rms:.4g}",
                f"{each.largest:.4g}",
                f"{each.largest_at_s:.3f}",
                str(each.compared),
                str(each.left_out),
            )
            for each in self.differences.values()
        ]
        widths = [max(len(row[k]) for row in [headings, *rows]) for k in range(len(headings))]
        lines = [
            "  ".join(
                cell.rjust(width) if k else cell.ljust(width)
                for k, (cell, width) in enumerate(zip(row, widths, strict=True))
            )
            for row in [headings, *rows]
        ]
        title = f"{len(self.recorded)} control periods by {self.by}, {self.unknown} of them unknown (last value held); "
        if self.zeroed:
            title += f"{', '.join(self.zeroed)} = 0, because measured torques include it; "
        plate = () if self.plate is None else (str(self.plate),)
        poses = [f"poses are {self.late_s:.3g} s late; the paths are compared without that"] if self.late_s else []
        lag = self._not_followed()
        poses += repeated(self.repeated_s)
        cut_off = () if self.complete else ("the log's end is missing, as of a recording that was cut off",)
        return "\n".join([f"{title}simulated minus recorded:", *lines, *plate, *poses, *lag, *cut_off])

    def _not_followed(self) -> tuple[str, ...]:
        """Reason why the path does not test radii and lever arms, if simulated wheels are too slow."""
        wheels = self.differences["wheels"]
        if self.by != "wheels" or not wheels.rms > _NOT_FOLLOWED * wheels.recorded_rms:
            return ()
        off = f"{wheels.rms:.2g} of {wheels.recorded_rms:.2g} rad/s off (root mean square)"
        return (
            f"the simulated wheels do not follow the recorded ones, {off}: the path tests their loops, not radii and"
            " lever arms; give the vehicle faster [gains], or import the log with a shorter period_s",
        )

    def plot(self) -> Any:
        """Draw both over each other: wheels' velocities, twist and path.

        Returns:
            A matplotlib figure.

        Raises:
            ImportError: matplotlib is not installed: install the extra ``plot``.
        """
        names = self.recorded.wheel_names
        columns = 2
        made, grid = figure(math.ceil((len(names) + 4) / columns), columns)
        axes = grid.ravel()
        time_s = self.recorded["time_s"]

        def both(ax: Any, columns: tuple[Floats, Floats], number: int, label: str) -> None:
            recorded_and_simulated(ax, time_s, *(each[:, number] for each in columns))
            ax.set_ylabel(label)

        for number, name in enumerate(names):
            both(axes[number], self._wheels, number, f"wheel {name} [rad/s]")
        for number, label in enumerate(("vx [m/s]", "vy [m/s]", "wz [rad/s]")):
            both(axes[len(names) + number], self._twists, number, label)
        for ax in axes[: len(names) + 3]:
            ax.set_xlabel("time [s]")
        path = axes[len(names) + 3]
        for places, style in zip(
            self._paths, ({"color": "0.6", "lw": 2.0}, {"color": "tab:blue", "lw": 1.0}), strict=True
        ):
            path.plot(places[:, 0], places[:, 1], **style)
        path.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", adjustable="datalim")
        path.grid(visible=True, alpha=0.3)
        for ax in axes[len(names) + 4 :]:
            ax.remove()
        made.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False)
        return made


def resimulate(
    log: str | PathLike[str] | Log,
    scenario: str | PathLike[str] | Scenario | None = None,
    *,
    by: Literal["commands", "torques", "wheels", "duty"] = "commands",
    overrides: Mapping[str, Any] | None = None,
    plate: Sequence[float] | None = None,
    sideways: float = 1.0,
    progress: bool = True,
) -> Resimulation:
    """Drive a simulation with the commands, torques, wheels or duty cycles of a log; compare the measurements.

    The simulation begins at rest at the scenario's start, so begin the log before the vehicle moves.

    Args:
        log: a log, of a vehicle (:func:`omnistep.import_log`) or of a run.
        scenario: ground, vehicle and controller of the simulation; the log's own by default. Its control period and its
            wheels must match the log. Its own command is not used.
        by: ``commands``: the recorded commands go to the scenario's controller. ``torques``: the measured torques of
            the actuators (from their currents), or without these the commanded torques, go to the motors; in gaps the
            last one is held. With measured torques the scenario's ``actuators.torque_lag_s`` and
            ``actuators.voltage_sag`` are set to 0, because these torques include both effects. ``wheels``: the twist of
            the measured wheels, by the scenario's vehicle, goes to its controller as a command. ``duty``: the duty
            cycles go to the motors, whose torque follows from the vehicle's line (stall torque, slope) at the simulated
            velocity; at a duty cycle of zero they brake, or have no torque if the log states ``coast``.
        overrides: keys of the scenario to replace, as in :func:`omnistep.run`.
        plate: x [m], y [m] and yaw [rad] of the marker plate in the vehicle's axes, where the log's pose is that of a
            plate (:attr:`Calibration.plates`). Of a vehicle's log it is found from wheels and poses if left out.
        sideways: how far the vehicle goes sideways of what its wheels say, 0.5 to 1.5: ``all.sideways`` of
            :func:`omnistep.calibrate`. So far the simulated path goes sideways of what the simulation does, where a log
            of a vehicle has poses.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.

    Returns:
        The log, the simulation, and their differences.

    Raises:
        ConfigError: the scenario does not fit the log, or the log lacks that input.
        LogError: the log cannot be read.
        SimulationError: the physics diverged (a value is not finite).

    Example:
        >>> import omnistep, pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "flat.mcap"
        ...     _ = omnistep.run("flat", overrides={"duration_s": 0.5}, mcap=path)
        ...     again = omnistep.resimulate(path)
        ...     heavier = omnistep.resimulate(path, overrides={"vehicle.body.1.mass_kg": 9.0})
        >>> again.differences["wheels"].rms, heavier.differences["wheels"].rms > 0.01
        (0.0, True)
    """
    if by not in BYS:
        raise ConfigError(f"by = {by!r}, allowed: {', '.join(BYS)}", key="by")
    stated = None if plate is None else given(plate)
    if not _SIDEWAYS[0] <= sideways <= _SIDEWAYS[1]:
        raise ConfigError(
            f"sideways = {sideways:g}, allowed: {_SIDEWAYS[0]:g} to {_SIDEWAYS[1]:g}, 1 where nothing slips",
            key="sideways",
        )
    read = log if isinstance(log, Log) else read_mcap(log, progress=progress)
    recorded = trace_of(read)
    if stated is not None and not _has_pose(recorded):
        raise ConfigError("plate: the log has no pose, allowed: a log imported with [pose] in its map", key="plate")
    if scenario is None:
        scenario = Scenario.from_toml(read.scenario_toml)
    made = Scenario(scenario, overrides=overrides)
    _fits(made, recorded)
    inputs, unknown, acted = inputs_of(recorded, made.vehicle, by)
    zeroed = tuple(key for key in _ON_THE_WAY if acted and made[key] != 0.0)
    if zeroed:
        made = Scenario(made, overrides=dict.fromkeys(zeroed, 0.0))
    simulation = Simulation(made)
    step = simulation.step if by in ("commands", "wheels") else simulation.step_torques
    line = torque_line(made, read) if by == "duty" else None
    read_rad_s = np.empty((len(inputs), len(recorded.wheel_names)))
    with bar("resimulate", shown=progress) as advance:
        for row, each in enumerate(inputs):
            # As read by the controller at the start of a period; a simulation driven by torques has none.
            read_rad_s[row] = simulation.measured_rad_s
            step(each if line is None else line(each, read_rad_s[row]))
            if row % _PERIODS_PER_LOOK == 0:
                advance(row / len(inputs))
    simulated = simulation.trace
    wheels = (np.asarray(recorded.wheels("measured_rad_s")), read_rad_s)
    twists = (twists_of(recorded, "estimated"), estimated(made.vehicle, read_rad_s))
    # A gyro is read at the start of a period, as the encoders are.
    yaw_rates = (recorded["gyro_rad_s"], np.concatenate([[0.0], simulated["twist_wz_rad_s"][:-1]]))
    again, marker, late, paths = _paths(made, read, simulated, wheels, stated, sideways)
    return Resimulation(
        recorded=recorded,
        simulated=simulated,
        by=by,
        unknown=unknown,
        zeroed=zeroed,
        differences=_differences(read, wheels, twists, yaw_rates, paths),
        plate=marker,
        late_s=late,
        repeated_s=again,
        complete=read.complete,
        _wheels=wheels,
        _twists=twists,
        _paths=paths,
    )


def _fits(scenario: Scenario, recorded: Trace) -> None:
    """Refuse a scenario that cannot be compared with a log."""
    names = (scenario.vehicle.wheel_names, recorded.wheel_names)
    if names[0] != names[1]:
        found, allowed = (", ".join(each) for each in names)
        raise ConfigError(
            f"scenario {scenario.name}: wheels {found}, allowed: those of the log, {allowed}", key="scenario"
        )
    time_s = recorded["time_s"]
    expected = scenario.period_s * np.arange(1, len(time_s) + 1)
    # Times are whole microseconds; as seconds they are rounded.
    wrong = np.flatnonzero(np.abs(time_s - expected) > 1e-7)
    if wrong.size:
        what = (
            f"a control period of {scenario.period_s:g} s, and row {wrong[0]} of the log ends at {time_s[wrong[0]]:g} s"
        )
        allowed = "a log with a row every control period, from the first one on"
        raise ConfigError(f"scenario {scenario.name}: {what}, allowed: {allowed}", key="control.period_s")


def _has_pose(recorded: Trace) -> bool:
    """Is there a measured pose in any row?"""
    return all(name in recorded for name in _POSE) and bool(np.isfinite(sum(recorded[name] for name in _POSE)).any())


def _paths(
    scenario: Scenario,
    log: Log,
    simulated: Trace,
    wheels: tuple[Floats, Floats],
    plate: MarkerPlate | None,
    sideways: float,
) -> tuple[tuple[tuple[float, float], ...], MarkerPlate | None, float, tuple[Floats, Floats]]:
    """Repeated poses, the plate, how late poses are, and positions of log and simulation, (T, 2), from one start."""
    recorded = log.trace
    if _has_pose(recorded):
        seen, own = (np.column_stack([trace[name] for name in _POSE]) for trace in (recorded, simulated))
        late, spans = 0.0, []
        period_s = scenario.period_s
        if log.recorded:
            rolled = np.nan_to_num(np.abs(estimated(scenario.vehicle, wheels[0])) * period_s)
            spans = without_repeated(seen, rolled, period_s)
            late = late_s(scenario.vehicle, wheels[0], seen, period_s, sideways)
            seen = earlier(seen, round(late / period_s))
            plate = plate or found(scenario.vehicle, wheels[0], seen, period_s, sideways)
            own = slipping(own, sideways)
        own = own if plate is None else plate.of(own)
        # The simulation's frame is aligned with the log's frame at the start.
        at = np.flatnonzero(np.isfinite(seen).all(axis=1))[0]
        turn = seen[at, 2] - own[at, 2]
        rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        again = tuple((begin * period_s, end * period_s) for begin, end in spans)
        return again, plate, late, (seen[:, :2], (own[:, :2] - own[at, :2]) @ rotation + seen[at, :2])
    # From the wheels, for both: once they are unknown, so is the position.
    unknown = np.flatnonzero(~np.isfinite(wheels[0][1:]).all(axis=1))
    first = int(np.isnan(wheels[0][0]).any())  # velocities from counts begin with the second row
    end = int(unknown[0]) + 1 if unknown.size else len(recorded)
    places = []
    for each in wheels:
        place = np.full((len(recorded), 2), np.nan)
        if end > first:
            odometry = Odometry(kinematics=Kinematics(layout=scenario.vehicle.layout), period_s=scenario.period_s)
            place[first:end] = odometry.step_velocities(each[first:end])[:, :2]
        places.append(place)
    return (), None, 0.0, (places[0], places[1])


def _differences(
    log: Log,
    wheels: tuple[Floats, Floats],
    twists: tuple[Floats, Floats],
    yaw_rates: tuple[Floats, Floats],
    paths: tuple[Floats, Floats],
) -> dict[str, Difference]:
    recorded = log.trace
    time_s, names = recorded["time_s"], recorded.wheel_names
    pairs = {f"wheel_{name}_measured_rad_s": [each[:, k] for each in wheels] for k, name in enumerate(names)}
    made = {name: Difference.of(name, time_s, *pair) for name, pair in pairs.items()}
    made["wheels"] = Difference.of("wheels", np.repeat(time_s, len(names)), *(each.ravel() for each in wheels))
    for number, axis in enumerate(AXES):
        name = f"estimated_{axis}"
        made[name] = Difference.of(name, time_s, *(each[:, number] for each in twists))
    if log.recorded and np.isfinite(yaw_rates[0]).any():
        made["gyro_rad_s"] = Difference.of("gyro_rad_s", time_s, *yaw_rates)
    off = np.hypot(*(paths[1] - paths[0]).T)
    way = np.hypot(*(paths[0] - paths[0][np.isfinite(paths[0]).all(axis=1)][:1].sum(axis=0)).T)
    made["path"] = Difference.of("path", time_s, way, way + off)
    return made


def write(
    log: Path,
    out: Path,
    *,
    scenario: str | None = None,
    by: Literal["commands", "torques", "wheels", "duty"] = "commands",
    keys: Sequence[str] = (),
    plate: Sequence[float] | None = None,
    sideways: float = 1.0,
    progress: bool = True,
) -> None:
    """Resimulate a log, print the differences and draw both into a file, as ``omnistep resimulate``."""
    overrides = dict(_override(key) for key in keys)
    # A path in an override is relative to the working directory.
    named = {table: {key: overrides.get(f"{table}.{key}")} for table, key in REFERENCES}
    inputs = [log, *named_files({"vehicle": overrides.get("vehicle"), **named}, Path())]
    inputs += () if scenario is None else scenario_files(Path(scenario))
    check_picture(out, inputs)
    again = resimulate(log, scenario, by=by, overrides=overrides, plate=plate, sideways=sideways, progress=progress)
    print(again)
    with replaced(out, inputs) as aside:
        again.plot().savefig(aside, dpi=110)


def _override(text: str) -> tuple[str, Any]:
    """A key and its value, as with ``--set``: TOML, or else a text."""
    key, equals, value = text.partition("=")
    if not key or not equals:
        raise ConfigError(f"--set {text}: allowed: KEY=VALUE", key="set")
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value
