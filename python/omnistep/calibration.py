"""Radii, positions and directions of wheels from runs with measured ends: UMBmark for any number of wheels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import atan2, cos, isfinite, sin
from os import PathLike
from typing import Any

import numpy as np

from omnistep import _plausibility
from omnistep._calibration_runs import ENDS, CalibrationRun, number
from omnistep._estimates import Estimate, Fit, Floats, Parameter, at_bounds, estimates, fit, table
from omnistep._omnistep import Kinematics, Layout, Odometry, Vehicle, Wheel
from omnistep._wheel_logs import WheelLog, read
from omnistep.errors import ConfigError

NEEDED_BY = "omnistep.calibrate"
#: Parts of a run in which wheels are compared with each other.
PARTS = 20
#: Odometry is stepped at this rate; a twist may change less in that time than matters.
STEP_S = 0.02
#: Longest gap in a log that is bridged.
GAP_S = 0.1
#: A gyro's zero is its mean over this time of rest at least.
REST_S = 0.5
#: A vehicle stands while no wheel turns faster than a part of its fastest, each over this time: noise and counts do.
STANDS, STANDS_OVER_S = 0.04, 0.2
#: Errors that a drawing may have: of radii and levers as a part, of directions in radians.
SCALE = 0.05
#: Odometry that fits ends no farther off than this [m, rad]: what is, was measured or written down wrong.
OFF_M, OFF_RAD = 0.1, 0.2


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Result of :func:`calibrate`.

    Attributes:
        estimates: for every wheel ``NAME.radius_m``, ``NAME.shift_m`` (shift of its position across its push direction,
            to the right of it) and ``NAME.turn_rad`` (rotation of its rolling direction, counter-clockwise).
        cannot_tell: parameters that the runs do not determine, and runs that would; a line each.
        vehicle: the vehicle with the estimates.
        position_rms_m: residual of the measured positions, root mean square [m]; NaN where none was measured.
        yaw_rms_rad: residual of the measured headings [rad]; NaN where none was measured.
    """

    estimates: tuple[Estimate, ...]
    cannot_tell: tuple[str, ...]
    vehicle: Vehicle = field(repr=False)
    position_rms_m: float
    yaw_rms_rad: float

    def __getitem__(self, name: str) -> Estimate:
        for each in self.estimates:
            if each.name == name:
                return each
        raise KeyError(f"{name}, allowed: {', '.join(each.name for each in self.estimates)}")

    def table(self) -> str:
        """The estimates and the undetermined parameters, as text."""
        left = [
            f"{what} remaining: {rms:.3g} {unit} (root mean square)"
            for what, rms, unit in (
                ("places", self.position_rms_m, "m"),
                ("turns", self.yaw_rms_rad, "rad"),
            )
            if isfinite(rms)
        ]
        return "\n".join([table(self.estimates), *left, *self.cannot_tell])


def calibrate(
    runs: Sequence[CalibrationRun],
    *,
    vehicle: str | PathLike[str] | Vehicle,
    position_sd_m: float = 0.002,
    yaw_sd_rad: float = 0.005,
) -> Calibration:
    """Find wheel radii, positions and directions from runs with measured ends.

    Odometry of every run is compared with the measurement at its end, by least squares over all runs. With more than
    three wheels the wheels are compared with each other too. Parameters that the runs do not determine keep the values
    of the file and are named. A wheel determines only its rolling distance, its push direction, and the lever arm of
    its push: its position along the push, and a roller angle separate from the radius, keep their values.

    Args:
        runs: squares both ways, straight lines forward and sideways, turns on the spot.
        vehicle: the vehicle as designed: a built-in name, the path of a .toml file or a :class:`Vehicle`.
        position_sd_m: standard deviation of measured positions and distances [m]: their weight against headings. With
            enough runs, intervals follow from the residuals instead.
        yaw_sd_rad: the same for measured headings [rad].

    Raises:
        ConfigError: a run has no measurement, a column is missing, there are too few runs, or a number is out of range.
        LogError: a log cannot be read.
        ImportError: SciPy, or pyarrow for a CSV or Parquet file, is not installed; install the extra ``identify``.

    >>> import numpy as np, omnistep
    >>> drawn = omnistep.Vehicle("omni3")
    >>> built = drawn.replace({"wheel.0.radius_m": 0.051})
    >>> runs = []
    >>> for twist in [(0.3, 0, 0), (0, 0.3, 0), (0, 0, 1), (0.2, 0, 0.5), (0, -0.2, -0.5)]:
    ...     wheels = omnistep.Kinematics(layout=built.layout).inverse([twist] * 401)
    ...     x, y, yaw = omnistep.moved_by([0, 0, 0], 4.0 * np.array(twist))
    ...     log = {"time_s": 0.01 * np.arange(401)}
    ...     log |= {f"wheel_{name}_measured_rad_s": wheels[:, k] for k, name in enumerate(built.wheel_names)}
    ...     runs.append(omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, end_yaw_rad=yaw))
    >>> found = omnistep.calibrate(runs, vehicle=drawn)
    >>> round(found.vehicle["wheel.0.radius_m"], 5)
    0.051
    """
    drawn = Vehicle(vehicle)
    for name, value in (("position_sd_m", position_sd_m), ("yaw_sd_rad", yaw_sd_rad)):
        number(name, value, "")
    drives = [_Drive(run, index, drawn) for index, run in enumerate(runs)]
    if not drives:
        raise ConfigError("runs: empty, allowed: at least one run", key="runs")
    problem = _Problem(drawn, drives, position_sd_m, yaw_sd_rad)
    found = problem.solve()
    parts = estimates(problem.parameters, found, needed_by=NEEDED_BY)
    ends = [drive.errors(Kinematics(layout=problem.layout(found.x))) for drive in drives]
    return Calibration(
        estimates=parts,
        cannot_tell=(
            *_doubtful(drawn, drives, ends),
            *_cannot_tell(parts, drawn),
            *at_bounds(problem.parameters, found),
        ),
        vehicle=problem.vehicle(found.x),
        position_rms_m=_rms([e for places, _ in ends for e in places]),
        yaw_rms_rad=_rms([e for _, turns in ends for e in turns]),
    )


def _doubtful(vehicle: Vehicle, drives: Sequence[_Drive], ends: Sequence[tuple[list[float], list[float]]]) -> list[str]:
    """Report runs that fit no vehicle near the designed one: signs, units, the order of wheels or of positions."""
    doubts = []
    for drive in drives:
        doubts += [f"{drive.where}: {doubt}" for doubt in _plausibility.of_parts(vehicle, drive.parts)]
    for kind, unit, most, why in (
        (0, "m", OFF_M, "check that it is in m, that x has the right sign, and that x and y are not swapped"),
        (1, "rad", OFF_RAD, "check that it is in rad and that a turn to the left is positive"),
    ):
        off = [max((abs(each) for each in end[kind]), default=0.0) for end in ends]
        worst = int(np.argmax(off))
        if off[worst] > most:
            doubts.append(
                f"{drives[worst].where}: its end is {off[worst]:.3g} {unit} off, the largest of all runs: {why}"
            )
    return doubts


class _Drive:
    """One run, prepared for odometry."""

    def __init__(self, run: CalibrationRun, index: int, vehicle: Vehicle) -> None:
        self.run = run
        log = read(run.log, vehicle)
        where = self.where = f"run[{index}]" if log.name == "data" else f"run[{index}] ({log.name})"
        for key in ENDS:
            if (value := getattr(run, key)) is not None:
                number(key, value, f"{where}.")
        self.yaw = run.end_yaw_rad
        if run.gyro:
            if self.yaw is not None:
                raise ConfigError(f"{where}: gyro and end_yaw_rad, allowed: one of the two", key="gyro")
        elif self.yaw is None and all(getattr(run, key) is None for key in ENDS):
            raise ConfigError(
                f"{where}: no measurement, allowed: at least one of {', '.join(ENDS)}, gyro", key="end_x_m"
            )
        positions = _positions(log, where)
        if run.gyro:
            self.yaw = _turned(log, positions, where)
        every = max(1, round(STEP_S / log.period_s))
        rows = np.unique(np.r_[np.arange(0, len(positions), every), len(positions) - 1])
        self.positions = positions[rows]
        ends = np.linspace(0, len(self.positions) - 1, PARTS + 1).astype(int)
        self.parts = np.diff(self.positions[ends], axis=0)

    def errors(self, kinematics: Kinematics) -> tuple[list[float], list[float]]:
        """Odometry less the measurement: positions [m], headings [rad]."""
        odometry = Odometry(kinematics=kinematics, period_s=STEP_S)
        odometry.step_positions(self.positions)
        x, y, yaw = odometry.pose
        run, places, turns = self.run, [], []
        if run.end_x_m is not None:
            places.append(x - run.end_x_m)
        if run.end_y_m is not None:
            places.append(y - run.end_y_m)
        if run.distance_m is not None:
            places.append(np.hypot(x, y) - run.distance_m)
        if self.yaw is not None:
            turns.append(atan2(sin(yaw - self.yaw), cos(yaw - self.yaw)))
        return places, turns


class _Problem:
    """Parameters, and the residuals of all runs for them."""

    def __init__(self, vehicle: Vehicle, drives: list[_Drive], position_sd: float, yaw_sd: float) -> None:
        self.drawn, self.drives = vehicle, drives
        self.wheels = vehicle.layout.wheels
        lever = float(np.mean([np.hypot(*wheel.position_m) for wheel in self.wheels]))
        self.parameters = []
        for name, wheel in zip(vehicle.wheel_names, self.wheels, strict=True):
            radius = wheel.radius_m
            self.parameters += [
                Parameter(
                    name=f"{name}.radius_m",
                    unit="m",
                    start=radius,
                    scale=SCALE * radius,
                    lower=0.5 * radius,
                    upper=2.0 * radius,
                ),
                Parameter(
                    name=f"{name}.shift_m", unit="m", start=0.0, scale=SCALE * lever, lower=-lever, upper=lever, rank=1
                ),
                Parameter(name=f"{name}.turn_rad", unit="rad", start=0.0, scale=SCALE, lower=-0.5, upper=0.5, rank=2),
            ]
        # Standard deviations of places, turns, and of a part of a wheel's way that no motion explains.
        rolled = float(np.sqrt(np.mean([np.mean(drive.parts**2) for drive in drives])))
        if rolled == 0.0:
            raise ConfigError("runs: no wheel turns in any run, allowed: runs that drive", key="runs")
        self.deviation = np.array([position_sd, yaw_sd, 1e-3 * rolled])

    def layout(self, x: Floats) -> Layout:
        wheels = []
        for wheel, (radius, shift, turn) in zip(self.wheels, x.reshape(-1, 3), strict=True):
            place, direction = _moved(wheel, shift, turn)
            wheels.append(
                Wheel(
                    position_m=place,
                    rolling_direction=direction,
                    roller_angle_rad=wheel.roller_angle_rad,
                    radius_m=radius,
                    gear=wheel.gear,
                    reversed=wheel.reversed,
                )
            )
        return Layout(wheels=wheels)

    def groups(self, x: Floats) -> list[Floats]:
        """Errors of positions, of headings, and of wheels against each other."""
        kinematics = Kinematics(layout=self.layout(x))
        ends = [drive.errors(kinematics) for drive in self.drives]
        places, turns = ([e for end in ends for e in end[kind]] for kind in (0, 1))
        spread = np.zeros(0)
        if len(self.wheels) > 3:
            spread = kinematics.residual(np.concatenate([drive.parts for drive in self.drives])).ravel()
        return [np.array(places), np.array(turns), spread]

    def solve(self) -> Fit:
        """Least squares, each group weighted by its residuals; a few iterations converge."""
        parts = len(self.drives) * PARTS if len(self.wheels) > 3 else 0
        sizes = [len(group) for group in self.groups(np.array([p.start for p in self.parameters]))]
        independent = np.array(sizes) - np.array([0, 0, 3 * parts])
        begin = None
        for _ in range(4):
            weights = np.repeat(1.0 / self.deviation, sizes)

            def weighted(x: Floats, weights: Floats = weights) -> Floats:
                return np.asarray(weights * np.concatenate(self.groups(x)))

            found = fit(
                weighted,
                self.parameters,
                needed_by=NEEDED_BY,
                redundant=3 * parts,
                begin=begin,
            )
            begin = found.x
            # What each group has told of the parameters is gone from its residuals.
            hat = np.einsum(
                "ij,jk,ik->i", found.jacobian, np.linalg.pinv(found.jacobian.T @ found.jacobian), found.jacobian
            )
            before, at, free = self.deviation.copy(), 0, np.zeros(3)
            for k, size in enumerate(sizes):
                rows = slice(at, at + size)
                free[k] = independent[k] - hat[rows].sum()
                if free[k] >= 3.0:
                    self.deviation[k] *= max(1e-3, np.sqrt((found.residual[rows] ** 2).sum() / free[k]))
                at += size
            if np.allclose(self.deviation, before, rtol=0.02):
                break
        # The ends tell lengths; few of them, and intervals are wide.
        if parts:
            found.freedom = float(max(1.0, free[:2].sum()))
        return found

    def vehicle(self, x: Floats) -> Vehicle:
        keys: dict[str, Any] = {}
        for k, (wheel, (radius, shift, turn)) in enumerate(zip(self.wheels, x.reshape(-1, 3), strict=True)):
            place, direction = _moved(wheel, shift, turn)
            keys[f"wheel.{k}.radius_m"] = float(radius)
            keys[f"wheel.{k}.position_m"] = list(place)
            keys[f"wheel.{k}.rolling_direction"] = list(direction)
        return self.drawn.replace(keys)


def _moved(wheel: Wheel, shift: float, turn: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Position and rolling direction of a wheel that is shifted across its push and rotated."""
    dx, dy = wheel.rolling_direction
    angle = atan2(dy, dx)
    push = angle + wheel.roller_angle_rad
    x, y = wheel.position_m
    place = (x + shift * sin(push), y - shift * cos(push))
    return place, ((dx, dy) if turn == 0.0 else (cos(angle + turn), sin(angle + turn)))


def _positions(log: WheelLog, where: str) -> Floats:
    """Angles of the actuators from the first row on [rad], short gaps bridged."""
    rows = log.measured if log.positions is None else log.positions
    longest = _longest_gap(np.isnan(rows).any(axis=1)) * log.period_s
    if longest > GAP_S:
        raise ConfigError(f"{where}: {longest:.3g} s without encoders, allowed: gaps up to {GAP_S} s", key="log")
    at = np.arange(len(rows))
    rows = rows.copy()
    for wheel in rows.T:
        there = ~np.isnan(wheel)
        wheel[~there] = np.interp(at[~there], at[there], wheel[there])
    if log.positions is not None:
        return np.asarray(rows - rows[0], dtype=np.float64)
    # A reading is of the period that ends with its row, or of its end: the same sum where it stands at both ends.
    return np.asarray(np.cumsum(rows, axis=0) * log.period_s, dtype=np.float64)


def _longest_gap(missing: Any) -> int:
    edges = np.flatnonzero(np.diff(np.r_[False, missing, False]))
    return int(np.max(edges[1::2] - edges[::2], initial=0))


def _turned(log: WheelLog, positions: Floats, where: str) -> float:
    """Rotation by the gyro [rad]; its bias is its mean while the wheels are at rest at the start."""
    if log.yaw_rate is None:
        raise ConfigError(f"{where}: no column gyro_rad_s, allowed: a column of yaw rates [rad/s]", key="gyro")
    rate = log.yaw_rate
    missing = np.isnan(rate)
    if missing.all():
        raise ConfigError(f"{where}: gyro_rad_s has no number, allowed: yaw rates [rad/s]", key="gyro")
    if _longest_gap(missing) * log.period_s > GAP_S:
        raise ConfigError(f"{where}: gyro_rad_s has gaps, allowed: gaps up to {GAP_S} s", key="gyro")
    at = np.arange(len(rate))
    rate = np.interp(at, at[~missing], rate[~missing])
    rest = _rest(positions, max(1, round(STANDS_OVER_S / log.period_s)))
    if rest * log.period_s < REST_S:
        raise ConfigError(
            f"{where}: the wheels stand {rest * log.period_s:.2g} s at its start, allowed: at least {REST_S} s, for the"
            " zero of gyro_rad_s",
            key="gyro",
        )
    return float((rate - rate[:rest].mean()).sum() * log.period_s)


def _rest(positions: Floats, rows: int) -> int:
    """Number of rows before a wheel turns."""
    turned = np.abs(positions[rows:] - positions[:-rows]).max(axis=1, initial=0.0)
    moves = np.flatnonzero(turned > STANDS * np.max(turned, initial=0.0))
    return int(moves[0]) if len(moves) else len(positions)


def _cannot_tell(parts: Sequence[Estimate], vehicle: Vehicle) -> tuple[str, ...]:
    drives = {
        "radius_m": "straight lines with a measured distance_m, forward and sideways",
        "shift_m": "turns on the spot and squares both ways with end_yaw_rad or a gyro",
        "turn_rad": "straight lines forward and sideways with end_x_m and end_y_m",
    }
    said = []
    for kind, drive in drives.items():
        held = [each for each in parts if not each.told and each.name.endswith(f".{kind}")]
        if held:
            names = ", ".join(each.name for each in held)
            said.append(f"these runs cannot tell {names} ({held[0].note}); held at those of the file; drive {drive}")
    said.append(
        "no run can tell the position of a wheel along its force, or separate a roller's angle from its wheel's radius"
    )
    return tuple(said)


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")
