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
from omnistep._estimates import CONFIDENCE, Estimate, Floats, scipy_part, table
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
#: What all wheels have in common may be off by so many times that.
COMMON = 4.0
#: A number is told where its standard deviation is below this part of what the drawing may be wrong by.
TOLD = 0.3
#: Residuals tell their own size from so many degrees of freedom on, and are no smaller than this [m, rad].
ENOUGH, LEAST_M = 3.0, 1e-6
#: The search: differences, the largest and the smallest step, how far it goes, in units of ``SCALE``.
DIFFERENCE, LARGEST, SMALLEST, FARTHEST, ITERATIONS = 1e-3, 2.0, 1e-6, 9.0, 30
#: How much farther a vehicle goes where something is taken for something else.
MISTAKEN = {
    2.0: "diameters for radii",
    0.5: "radii for diameters",
    57.3: "radians for degrees",
    1 / 57.3: "degrees for radians",
    2 * np.pi: "radians for turns",
    0.5 / np.pi: "turns for radians",
}
#: A run is wrong that fits so badly by chance in fewer than so many calibrations.
BY_CHANCE = 0.02
#: Ends that are off by so many times what was stated refute the statement, and every interval with it.
REFUTED = 3.0
#: Odometry that fits ends no farther off than this [m, rad]: what is, was measured or written down wrong.
OFF_M, OFF_RAD = 0.1, 0.2


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Result of :func:`calibrate`.

    Attributes:
        common: what all wheels have in common: ``all.radius`` and ``all.lever``, factors on the radii and lever arms of
            the file, and ``all.turn_rad``, the rotation of the whole vehicle, counter-clockwise.
        estimates: for every wheel ``NAME.radius_m``, ``NAME.shift_m`` (shift of its position across its push direction,
            to the right of it) and ``NAME.turn_rad`` (rotation of its rolling direction, counter-clockwise).
        cannot_tell: parameters that the runs do not determine, and runs that would; a line each.
        vehicle: the vehicle with the estimates.
        position_rms_m: residual of the measured positions, root mean square [m]; NaN where none was measured.
        yaw_rms_rad: residual of the measured headings [rad]; NaN where none was measured.
    """

    common: tuple[Estimate, ...]
    estimates: tuple[Estimate, ...]
    cannot_tell: tuple[str, ...]
    vehicle: Vehicle = field(repr=False)
    position_rms_m: float
    yaw_rms_rad: float

    def __getitem__(self, name: str) -> Estimate:
        every = (*self.common, *self.estimates)
        for each in every:
            if each.name == name:
                return each
        raise KeyError(f"{name}, allowed: {', '.join(each.name for each in every)}")

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
        return "\n".join([table((*self.common, *self.estimates)), *left, *self.cannot_tell])


def calibrate(
    runs: Sequence[CalibrationRun],
    *,
    vehicle: str | PathLike[str] | Vehicle,
    position_sd_m: float = 0.002,
    yaw_sd_rad: float = 0.005,
) -> Calibration:
    """Find wheel radii, positions and directions from runs with measured ends.

    Odometry of every run is compared with the measurement at its end, by least squares over all runs. With more than
    three wheels the wheels are compared with each other too. First comes what all wheels have in common; single wheels
    differ from that only where the measurements are more probable then. What the runs do not determine is named and
    has no interval; nothing has one where the ends are much farther off than was stated. A wheel determines only
    its rolling distance, its push direction, and the lever arm of its push: its position along the push, and a roller
    angle separate from the radius, keep their values.

    Args:
        runs: squares both ways, straight lines forward and sideways, turns on the spot.
        vehicle: the vehicle as designed: a built-in name, the path of a .toml file or a :class:`Vehicle`.
        position_sd_m: standard deviation of measured positions and distances [m], slip on the way included: their
            weight against headings. With enough runs, intervals follow from the residuals instead; residuals that are
            three times as large refute the number.
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
    found, single = problem.solve()
    wrong = _wrong(drives, found, problem.stated)
    ends = [drive.errors(Kinematics(layout=problem.layout(found.u))) for drive in drives]
    places, turns = (_rms([e for end in ends for e in end[kind]]) for kind in (0, 1))
    refuted = wrong or _refuted(found.sd[0], position_sd_m, "m") or _refuted(found.sd[1], yaw_sd_rad, "rad")
    common, parts = problem.common_estimates(found, refuted), problem.estimates(found, single, refuted)
    return Calibration(
        common=common,
        estimates=parts,
        cannot_tell=(
            *_doubtful(drawn, drives, ends),
            *([f"no interval is given: {refuted}"] if refuted else _cannot_tell(common, parts)),
            *_far((*common, *parts)),
        ),
        vehicle=problem.vehicle(found.u),
        position_rms_m=places,
        yaw_rms_rad=turns,
    )


def _refuted(sd: float, stated: float, unit: str) -> str:
    """Why intervals would be wrong: ends that are much farther off than was stated."""
    if not sd > REFUTED * stated:
        return ""
    key = "position_sd_m" if unit == "m" else "yaw_sd_rad"
    return (
        f"the ends are {sd:.2g} {unit} off where {key} = {stated:g}; state how well they were measured and how far"
        " wheels slip, or find the run that is wrong"
    )


def _wrong(drives: Sequence[_Drive], found: _Found, stated: Floats) -> str:
    """Name the run without which the others fit much better: one end that was measured or written down wrong."""
    if (found.sd[:2] <= stated).all():
        return ""
    worst = max(range(len(drives)), key=lambda run: found.left_out[run][0] / max(1, found.left_out[run][1]))
    less, numbers = found.left_out[worst]
    rest, left = max(found.ends_left - less, 1e-3 * found.ends_left), found.ends_freedom - numbers
    if numbers == 0 or left < ENOUGH:
        return ""
    by_chance = scipy_part("stats", NEEDED_BY).f.sf((less / numbers) / (rest / left), numbers, left)
    if by_chance * len(drives) > BY_CHANCE:
        return ""
    times = np.sqrt(found.ends_left / found.ends_freedom / (rest / left))
    return (
        f"{drives[worst].where} does not fit the others, which fit {times:.1f} times as well without it; measure its"
        " end again, or leave it out"
    )


def _far(parts: Sequence[Estimate]) -> tuple[str, ...]:
    """Say what ends where the search does."""
    most = 0.99 * FARTHEST * SCALE
    far = [each for each in parts if abs(each.value - each.before) > most * (each.before or 1.0)]
    return tuple(
        f"{each.name} is {each.value:.4g} {each.unit}".rstrip()
        + f" after {each.before:.4g} in the file, as far as is searched: check units, signs and names in the log, and"
        " the vehicle file"
        for each in far
    )


def _doubtful(vehicle: Vehicle, drives: Sequence[_Drive], ends: Sequence[tuple[list[float], list[float]]]) -> list[str]:
    """Report runs that fit no vehicle near the designed one: signs, units, the order of wheels or of positions."""
    doubts = _times(vehicle, drives)
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


def _times(vehicle: Vehicle, drives: Sequence[_Drive]) -> list[str]:
    """Report wheels that go another multiple of their way than one that a drawing may be wrong by."""
    kinematics, times = Kinematics(layout=vehicle.layout), []
    for drive in drives:
        odometry = Odometry(kinematics=kinematics, period_s=STEP_S)
        odometry.step_positions(drive.positions)
        way, run = float(np.hypot(*odometry.pose[:2])), drive.run
        seen = run.distance_m if run.distance_m is not None else np.hypot(run.end_x_m or 0.0, run.end_y_m or 0.0)
        if seen > OFF_M and way > OFF_M * seen / 100.0:
            times.append(float(seen) / way)
    factor = float(np.median(times)) if times else 1.0
    for of, why in MISTAKEN.items():
        if abs(factor / of - 1.0) < 0.15:
            return [f"the ends are {factor:.3g} times as far as the wheels say: check for {why}, and the gear"]
    return []


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

    def numbers(self) -> tuple[int, int]:
        """How many numbers were measured at its end: of places and of turns."""
        run = self.run
        return sum(each is not None for each in (run.end_x_m, run.end_y_m, run.distance_m)), int(self.yaw is not None)

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


@dataclass
class _Found:
    """The parameters that fit best, in units of what a drawing may be wrong by, and what is known of them."""

    u: Floats
    covariance: Floats
    #: Degrees of freedom of what the variances rest on.
    freedom: float
    #: Standard deviations of places [m], of turns [rad] and of wheels against each other, by what is left.
    sd: Floats
    #: What is left of the ends, in squares of these, and its degrees of freedom.
    ends_left: float
    ends_freedom: float
    #: Of each run by how much less is left without it, and how many numbers it has.
    left_out: list[tuple[float, int]]
    #: Logarithm of how probable the measurements are under this model; larger is better.
    evidence: float


class _Problem:
    """Parameters, and the residuals of all runs for them."""

    def __init__(self, vehicle: Vehicle, drives: list[_Drive], position_sd: float, yaw_sd: float) -> None:
        self.drawn, self.drives = vehicle, drives
        self.wheels = vehicle.layout.wheels
        lever = float(np.mean([np.hypot(*wheel.position_m) for wheel in self.wheels]))
        start, scale, common = [], [], []
        for wheel in self.wheels:
            push = atan2(*wheel.rolling_direction[::-1]) + wheel.roller_angle_rad
            x, y = wheel.position_m
            start += [wheel.radius_m, 0.0, 0.0]
            scale += [SCALE * wheel.radius_m, SCALE * lever, SCALE]
            # Columns: all radii, all levers larger by the same part; the whole vehicle turned, with levers that stay.
            common += [
                [1.0, 0.0, 0.0],
                [0.0, (x * sin(push) - y * cos(push)) / lever, -(x * cos(push) + y * sin(push)) / lever],
                [0.0, 0.0, 1.0],
            ]
        self.start, self.scale, self.common = np.array(start), np.array(scale), np.array(common)
        self.stated = np.array([position_sd, yaw_sd])
        if all(not drive.parts.any() for drive in drives):
            raise ConfigError("runs: no wheel turns in any run, allowed: runs that drive", key="runs")

    def layout(self, u: Floats) -> Layout:
        wheels = []
        for wheel, (radius, shift, turn) in zip(self.wheels, self.numbers(u).reshape(-1, 3), strict=True):
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

    def numbers(self, u: Floats) -> Floats:
        """Radius [m], shift [m], turn [rad] of every wheel."""
        return np.asarray(self.start + self.scale * u)

    def groups(self, u: Floats) -> list[Floats]:
        """Errors of positions, of headings, and of wheels against each other."""
        kinematics = Kinematics(layout=self.layout(u))
        ends = [drive.errors(kinematics) for drive in self.drives]
        places, turns = ([e for end in ends for e in end[kind]] for kind in (0, 1))
        spread = np.zeros(0)
        if len(self.wheels) > 3:
            spread = kinematics.residual(np.concatenate([drive.parts for drive in self.drives])).ravel()
        return [np.array(places), np.array(turns), spread]

    def solve(self) -> tuple[_Found, _Found]:
        """The better of two models, and the second: what wheels have in common is all, or every wheel differs.

        Better is what makes the measurements more probable (MacKay, "Bayesian interpolation", 1992): each further
        number must pay for itself.
        """
        common, single = self._fit(single=False), self._fit(single=True)
        return (single if single.evidence > common.evidence else common), single

    def _fit(self, *, single: bool) -> _Found:
        """Least squares about the drawing, each group weighted by its residuals.

        A wheel is believed to be as drawn but for what all wheels have in common: within ``SCALE``, if it may differ at
        all. What runs do not tell stays so, with the uncertainty that it has; no number is held at the file's value
        while others move.
        """
        wide = np.full(self.common.shape[1], COMMON)
        moves = np.hstack([self.common, np.eye(len(self.start))]) if single else self.common
        prior = np.diag(1.0 / np.r_[wide, np.ones(len(self.start)) if single else []] ** 2)
        z = np.zeros(moves.shape[1])
        parts = len(self.drives) * PARTS if len(self.wheels) > 3 else 0
        # What the drawing leaves of the comparison of wheels, of counts and slip, is how well it is believed at first.
        groups = self.groups(moves @ z)
        spread = np.sqrt((groups[2] ** 2).sum() / max(1, len(groups[2]) - 3 * parts))
        sd = np.r_[self.stated, max(spread, LEAST_M)]
        for _ in range(ITERATIONS):
            groups = self.groups(moves @ z)
            sizes = [len(group) for group in groups]
            independent = np.array(sizes) - np.array([0, 0, 3 * parts])
            residual, jacobian = np.concatenate(groups), self._jacobian(moves @ z) @ moves
            weights = 1.0 / np.repeat(sd, sizes)
            weighted, slopes = weights * residual, weights[:, None] * jacobian
            covariance = np.linalg.inv(slopes.T @ slopes + prior)
            step = -covariance @ (slopes.T @ weighted + prior @ z)
            # What each group has told of the parameters is gone from its residuals.
            left = residual + jacobian @ step
            hat = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
            before, free, at = sd.copy(), np.zeros(3), 0
            for k, size in enumerate(sizes):
                rows = slice(at, at + size)
                free[k] = independent[k] - hat[rows].sum()
                if free[k] >= ENOUGH:
                    sd[k] = max(LEAST_M, np.sqrt((left[rows] ** 2).sum() / free[k]))
                at += size
            z = z + np.clip(step, -LARGEST, LARGEST)
            z = self._within(moves, z)
            if np.abs(step).max() < SMALLEST and np.allclose(sd, before, rtol=0.01):
                break
        said = independent > 0
        evidence = -0.5 * (weighted @ weighted + z @ prior @ z) - float(independent[said] @ np.log(sd[said]))
        evidence -= 0.5 * float(np.linalg.slogdet(np.eye(len(z)) + np.linalg.solve(prior, slopes.T @ slopes))[1])
        # The ends tell lengths; few of them, and intervals are wide.
        known = free[:2].sum() if (free[:2] >= ENOUGH).any() else np.inf
        return _Found(
            u=moves @ z,
            covariance=moves @ covariance @ moves.T,
            freedom=float(max(1.0, known)),
            sd=sd,
            ends_left=float((weighted[: sizes[0] + sizes[1]] ** 2).sum()),
            ends_freedom=float(free[:2].sum()),
            left_out=[self._without(run, weighted, slopes, covariance) for run in range(len(self.drives))],
            evidence=float(evidence),
        )

    def _without(self, run: int, weighted: Floats, slopes: Floats, covariance: Floats) -> tuple[float, int]:
        """By how much less squares are left without a run, and how many numbers its end has."""
        counts = np.array([drive.numbers() for drive in self.drives])
        rows: list[int] = []
        at = 0
        for kind in (0, 1):
            begin = at + int(counts[:run, kind].sum())
            rows += range(begin, begin + int(counts[run, kind]))
            at += int(counts[:, kind].sum())
        if not rows:
            return 0.0, 0
        own, left = slopes[rows], weighted[rows]
        alone: Floats = np.eye(len(rows)) - own @ covariance @ own.T
        return float(left @ np.linalg.solve(alone, left)), len(rows)

    def _jacobian(self, u: Floats) -> Floats:
        """How residuals move with every number of every wheel."""
        columns = []
        for k in range(len(u)):
            ends = [np.concatenate(self.groups(u + side * np.eye(len(u))[k])) for side in (-DIFFERENCE, DIFFERENCE)]
            columns.append((ends[1] - ends[0]) / (2 * DIFFERENCE))
        return np.stack(columns, axis=1)

    def _within(self, moves: Floats, z: Floats) -> Floats:
        """No wheel is half or twice as large as drawn, nor turned by half a radian."""
        most = np.abs(moves @ z).max(initial=0.0)
        return z * min(1.0, FARTHEST / most) if most > 0.0 else z

    def vehicle(self, u: Floats) -> Vehicle:
        keys: dict[str, Any] = {}
        for k, (wheel, numbers) in enumerate(zip(self.wheels, self.numbers(u).reshape(-1, 3), strict=True)):
            radius, shift, turn = numbers
            place, direction = _moved(wheel, shift, turn)
            keys[f"wheel.{k}.radius_m"] = float(radius)
            keys[f"wheel.{k}.position_m"] = list(place)
            keys[f"wheel.{k}.rolling_direction"] = list(direction)
        return self.drawn.replace(keys)

    def common_estimates(self, found: _Found, refuted: str) -> tuple[Estimate, ...]:
        """What all wheels have in common; an interval where the runs tell, and do not refute it."""
        # A mean over the wheels for a radius and a turn, by their levers for a lever.
        common = np.linalg.pinv(self.common)
        rows = [
            ("all.radius", "", 1.0, SCALE, common[0]),
            ("all.lever", "", 1.0, SCALE, common[1]),
            ("all.turn_rad", "rad", 0.0, SCALE, common[2]),
        ]
        return tuple(self._estimate(*row, found, found, refuted) for row in rows)

    def estimates(self, found: _Found, single: _Found, refuted: str) -> tuple[Estimate, ...]:
        """Every wheel, likewise: what is known of it where it may differ from the others."""
        given = []
        names = [f"{wheel}.{kind}" for wheel in self.drawn.wheel_names for kind in ("radius_m", "shift_m", "turn_rad")]
        for k, (name, row) in enumerate(zip(names, np.eye(len(names)), strict=True)):
            unit = "rad" if name.endswith("rad") else "m"
            given.append(self._estimate(name, unit, self.start[k], self.scale[k], row, found, single, refuted))
        return tuple(given)

    @staticmethod
    def _estimate(
        name: str, unit: str, start: float, scale: float, row: Floats, found: _Found, known: _Found, refuted: str
    ) -> Estimate:
        value, middle = (start + scale * float(row @ each.u) for each in (found, known))
        deviation = float(np.sqrt(row @ known.covariance @ row))
        told = not refuted and deviation < TOLD
        half = scale * deviation * float(scipy_part("stats", NEEDED_BY).t.ppf(0.5 + CONFIDENCE / 2, known.freedom))
        return Estimate(
            name=name,
            unit=unit,
            value=value,
            low=min(value, middle - half) if told else None,
            high=max(value, middle + half) if told else None,
            before=float(start),
            note="" if told else refuted or "these runs do not tell it",
        )


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
    # Before the first and after the last row that all have, wheels that are known must stand.
    whole = np.flatnonzero(~np.isnan(rows).any(axis=1))
    if not len(whole):
        raise ConfigError(f"{where}: no row has every encoder, allowed: at least two", key="log")
    for ends, edge in ((rows[: whole[0]], "starts"), (rows[whole[-1] + 1 :], "ends")):
        moved = (
            np.ptp(ends, axis=0) if log.positions is not None and len(ends) else np.abs(ends).max(axis=0, initial=0.0)
        )
        if np.nanmax(moved, initial=0.0) > 0.0:
            raise ConfigError(
                f"{where}: it {edge} without an encoder while it moves, allowed: logs that have every wheel then",
                key="log",
            )
    rows = rows[whole[0] : whole[-1] + 1].copy()
    at = np.arange(len(rows))
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


def _cannot_tell(common: Sequence[Estimate], single: Sequence[Estimate]) -> tuple[str, ...]:
    """What was determined, what was not, and the drives that would, in words of the robot."""
    drives = {
        "radius": ("radius", "straight lines with a measured distance_m, forward and sideways"),
        "lever": ("shift_m", "turns on the spot and squares both ways with end_yaw_rad or a gyro"),
        "turn": ("turn_rad", "straight lines forward and sideways with end_x_m and end_y_m"),
    }
    words = {
        "all.radius": "one radius for all wheels",
        "all.lever": "the lever",
        "all.turn_rad": "the turn of the whole",
    }
    told = [words[each.name] for each in common if each.told]
    said = [f"these runs tell {', '.join(told) or 'nothing that all wheels have in common'}"]
    for kind, (ending, drive) in drives.items():
        lacks = [each for each in single if f".{ending}" in each.name and not each.told]
        whole = next(each for each in common if kind in each.name)
        if not whole.told:
            names = ", ".join(each.name for each in lacks) or whole.name
            said.append(f"these runs cannot tell {words[whole.name]} ({names}); drive {drive}")
        elif lacks:
            names = ", ".join(each.name for each in lacks)
            said.append(f"not single wheels: {names} are as all wheels are")
    said.append(
        "no run can tell the position of a wheel along its force, or separate a roller's angle from its wheel's radius"
    )
    return tuple(said)


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")
