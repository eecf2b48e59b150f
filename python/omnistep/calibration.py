"""Radii, positions and directions of wheels from runs with measured ends: UMBmark for any number of wheels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from os import PathLike

import numpy as np

from omnistep import _plausibility
from omnistep._calibration_drives import Drive
from omnistep._calibration_fit import ENOUGH, FARTHEST, NEEDED_BY, SCALE, Found, Problem
from omnistep._calibration_runs import CalibrationRun, number
from omnistep._estimates import Estimate, Floats, refutes, scipy_part, table, withheld
from omnistep._omnistep import Kinematics, Vehicle
from omnistep.errors import ConfigError

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
    drives = [Drive(run, index, drawn) for index, run in enumerate(runs)]
    if not drives:
        raise ConfigError("runs: empty, allowed: at least one run", key="runs")
    problem = Problem(drawn, drives, position_sd_m, yaw_sd_rad)
    found, single = problem.solve()
    wrong = _wrong(drives, found, problem.stated)
    ends = [drive.errors(Kinematics(layout=problem.layout(found.u))) for drive in drives]
    places, turns = (_rms([e for end in ends for e in end[kind]]) for kind in (0, 1))
    refuted = wrong or _refuted(found.sd[0], position_sd_m, "m") or _refuted(found.sd[1], yaw_sd_rad, "rad")
    common, parts = problem.common_estimates(found), problem.estimates(found, single)
    if refuted:
        common, parts = withheld(common), withheld(parts)
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
    if not refutes(sd, stated):
        return ""
    key = "position_sd_m" if unit == "m" else "yaw_sd_rad"
    return (
        f"the ends are {sd:.2g} {unit} off where {key} = {stated:g}; state how well they were measured and how far"
        " wheels slip, or find the run that is wrong"
    )


def _wrong(drives: Sequence[Drive], found: Found, stated: Floats) -> str:
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


def _doubtful(vehicle: Vehicle, drives: Sequence[Drive], ends: Sequence[tuple[list[float], list[float]]]) -> list[str]:
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


def _times(vehicle: Vehicle, drives: Sequence[Drive]) -> list[str]:
    """Report wheels that go another multiple of their way than one that a drawing may be wrong by."""
    kinematics, times = Kinematics(layout=vehicle.layout), []
    for drive in drives:
        x, y, _ = drive.end(kinematics)
        way, run = float(np.hypot(x, y)), drive.run
        seen = run.distance_m if run.distance_m is not None else np.hypot(run.end_x_m or 0.0, run.end_y_m or 0.0)
        if seen > OFF_M and way > OFF_M * seen / 100.0:
            times.append(float(seen) / way)
    factor = float(np.median(times)) if times else 1.0
    for of, why in MISTAKEN.items():
        if abs(factor / of - 1.0) < 0.15:
            return [f"the ends are {factor:.3g} times as far as the wheels say: check for {why}, and the gear"]
    return []


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
    known = [words[each.name] for each in common if each.told]
    said = [f"these runs tell {', '.join(known) or 'nothing that all wheels have in common'}"]
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
