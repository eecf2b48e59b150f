"""Radii, positions and directions of wheels from measured ends or recorded poses: UMBmark for any number of wheels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import isfinite
from os import PathLike

import numpy as np

from omnistep import _plausibility
from omnistep._blas_threads import one_thread
from omnistep._calibration_drives import Drive, name_of, part_of
from omnistep._calibration_fit import ENOUGH, NEEDED_BY, Found, Problem, recordings_of
from omnistep._calibration_poses import Piece, Recording
from omnistep._calibration_runs import CalibrationRun, check, number
from omnistep._estimates import CHECK, Estimate, Floats, refutes, scipy_part, table, withheld
from omnistep._omnistep import Kinematics, Vehicle
from omnistep._pose_doubts import APART
from omnistep._progress import bar
from omnistep._wheel_logs import read
from omnistep.errors import ConfigError

#: Ratio of distances if one quantity is mistaken for another.
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
#: It is named only if the other runs fit this many times better without it, and longer runs need a larger factor,
#: because slip differs between runs.
TWICE = 2.0
#: Part of the pieces of recorded poses that may be left out because they do not fit the others.
LEFT_OUT = 0.1
#: Radii in a file are not wrong by more than this part: something else is. A smaller lateral slip is not reported.
RADIUS_OFF, SLIPS_ASIDE = 0.08, 0.01
#: Paths that differ by less are as far off [m].
LEAST_PATH_M = 1e-6
#: Evaluations of all runs after which most searches have ended.
USUAL = 500
#: Largest final error of odometry that fits [m, rad]: a larger error is a mistake of measurement or notation.
OFF_M, OFF_RAD = 0.1, 0.2


@dataclass(frozen=True, kw_only=True)
class PathError:
    """How far odometry is off a recorded path.

    Attributes:
        run: the run, as messages name it.
        pieces: number of pieces into which it was cut.
        piece_m: rolled distance of the wheels in each piece [m].
        before_m: with the file's values, root mean square over the path [m]; the plate's position is the estimated one.
        after_m: with the estimates as in the written file [m].
        sideways_m: also with ``all.sideways``, which a file cannot hold [m]; equal to ``after_m`` if it is 1.
    """

    run: str
    pieces: int
    piece_m: float
    before_m: float
    after_m: float
    sideways_m: float

    def __str__(self) -> str:
        slip = "" if self.sideways_m == self.after_m else f", {self.sideways_m:.3f} m with all.sideways"
        return (
            f"{self.run}: path {self.after_m:.3f} m off{slip}, {self.before_m:.3f} m with the file (root mean square);"
            f" {self.pieces} pieces of {self.piece_m:.2g} m"
        )


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Result of :func:`calibrate`.

    Attributes:
        common: common parameters: ``all.radius`` and ``all.lever``, factors on the radii and lever arms of the file,
            and ``all.turn_rad``, the rotation of the whole vehicle, counter-clockwise. With oblique rollers also
            ``all.sideways``, the ratio of lateral motion to the wheels' readings: rollers tilt, slip and bind. That is
            no size of a wheel, and not in ``vehicle``.
        estimates: for every wheel ``NAME.radius_m``, ``NAME.shift_m`` (shift of its position across its push direction,
            to the right of it) and ``NAME.turn_rad`` (rotation of its rolling direction, counter-clockwise).
        undetermined: parameters that the runs do not determine, and runs that would; one line each. Logs that were
            cut off come first.
        vehicle: the vehicle with the estimates.
        plates: for recorded poses, the position of the marker plate on the vehicle, ``NAME.plate_x_m``,
            ``NAME.plate_y_m`` and ``NAME.plate_yaw_rad``, and the poses' delay, ``NAME.delay_s``. NAME is the log's, or
            ``plate`` of the run.
        paths: of recorded poses how far odometry is off the path.
        doubted: reason why the numbers should not be used: the residuals refute the stated errors, or a number ended at
            the limit of the search. Otherwise empty.
        position_rms_m: residual of the measured positions, root mean square [m]; NaN if none was measured.
        yaw_rms_rad: residual of the measured headings [rad]; NaN if none was measured.
    """

    common: tuple[Estimate, ...]
    estimates: tuple[Estimate, ...]
    undetermined: tuple[str, ...]
    vehicle: Vehicle = field(repr=False)
    position_rms_m: float
    yaw_rms_rad: float
    plates: tuple[Estimate, ...] = ()
    paths: tuple[PathError, ...] = ()
    doubted: str = ""

    def __getitem__(self, name: str) -> Estimate:
        every = (*self.common, *self.estimates, *self.plates)
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
        found = table((*self.common, *self.estimates, *self.plates))
        return "\n".join([found, *left, *(str(path) for path in self.paths), *self.undetermined])


def calibrate(
    runs: Sequence[CalibrationRun],
    *,
    vehicle: str | PathLike[str] | Vehicle,
    position_sd_m: float | None = None,
    yaw_sd_rad: float | None = None,
    progress: bool = True,
) -> Calibration:
    """Find wheel radii, positions and directions from runs with measured ends or recorded poses.

    Odometry of every run is compared with the measurement at its end, by least squares over all runs. More than three
    wheels are also compared with each other. The common parameters come first; single wheels deviate from them only if
    this makes the measurements more probable. Parameters that the runs do not determine are named and keep the file's
    value, without an interval; no parameter has an interval if the final errors are much larger than stated. A wheel
    determines only its rolling distance, its push direction, and the lever arm of its push: its position along the
    push, and a roller angle separate from the radius, keep their values.

    A run with recorded poses is cut into pieces of some three seconds of motion, each as long as the others. The place
    and the yaw of the marker plate on the vehicle, and a delay of the poses, are also estimated. Pieces that do not fit
    the others are left out, up to a tenth of them.

    Args:
        runs: squares in both directions, straight lines forward and lateral, turns on the spot; with recorded poses any
            drive that contains all of these.
        vehicle: the vehicle as designed: a built-in name, the path of a .toml file or a :class:`Vehicle`.
        position_sd_m: standard deviation of measured positions and distances [m], slip on the way included: their
            weight against headings. 2 mm by default, and 1 % of the mean way of the runs, or of a piece of recorded
            poses. With enough runs, intervals follow from the residuals instead; residuals that are three times as
            large refute the number.
        yaw_sd_rad: standard deviation of measured headings [rad]; 0.005 by default, and 1 % of the distance over the
            wheels' distance from the middle.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.

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
        if value is not None:
            number(name, value, "")
    prepared, cut_off = _prepared(runs, drawn)
    done = 0
    with one_thread(NEEDED_BY), bar("calibrate", shown=progress) as show:

        def watch() -> None:
            nonlocal done
            done += 1
            show(done / (done + USUAL))

        problem, found, single, left_out = _solved(drawn, prepared, position_sd_m, yaw_sd_rad, watch)
        places, turns, parts_places, parts_turns, _ = problem.groups(found.reported)
        show(1.0)
    drives = problem.drives
    wrong = _wrong(problem, found)
    refuted = wrong or _refuted(np.maximum(found.sd, found.rms), problem.stated)
    common, parts, plates = problem.common_estimates(found), problem.estimates(found, single), problem.plates(found)
    if refuted:
        common, parts, plates = withheld(common), withheld(parts), withheld(plates)
    recordings = recordings_of(drives)
    far, doubts = [] if refuted else problem.far(found), _doubtful(drawn, problem, found, bool(refuted))
    # A possible cause of errors is more informative than their size.
    why = next((doubt for doubt in doubts if refuted and APART in doubt), refuted)
    return Calibration(
        common=common,
        estimates=parts,
        undetermined=(
            *cut_off,
            *left_out,
            *(f"{each.where}: {said}" for each in recordings for said in each.without()),
            *_remarkable(common, drawn),
            *(doubt for doubt in doubts if doubt != why),
            *([f"no interval is given: {why}"] if refuted else _undetermined(common, parts, bool(recordings))),
            *(f"{each}; {CHECK}" for each in far),
        ),
        vehicle=problem.vehicle(found.reported),
        position_rms_m=_rms([*places, *parts_places]),
        yaw_rms_rad=_rms([*turns, *parts_turns]),
        plates=plates,
        paths=tuple(_path(problem, found, recording) for recording in recordings),
        doubted=next((reason.split(";")[0] for reason in (why, *far) if reason), ""),
    )


def _prepared(runs: Sequence[CalibrationRun], drawn: Vehicle) -> tuple[list[Drive | Piece], list[str]]:
    """Runs with a measured end, and the pieces of runs with recorded poses; and messages about truncated logs."""
    drives: list[Drive | Piece] = []
    cut_off: dict[str, None] = {}
    for index, run in enumerate(runs):
        check(run, f"run[{index}]")
        log = read(run.log, drawn, pose=run.pose)
        cut_off |= {log.cut_off: None} if log.cut_off else {}
        where = name_of(run, index, log)
        log, first = part_of(log, run, where)
        drives += Recording(run, log, first, drawn, where).pieces if run.pose else [Drive(run, log, where)]
    if not drives:
        raise ConfigError("runs: empty, allowed: at least one run", key="runs")
    return drives, list(cut_off)


def _solved(
    drawn: Vehicle,
    drives: list[Drive | Piece],
    position_sd: float | None,
    yaw_sd: float | None,
    watch: Callable[[], None],
) -> tuple[Problem, Found, Found, list[str]]:
    """The fit without the pieces that do not fit, and messages about these pieces."""
    said: list[str] = []
    left = LEFT_OUT * sum(isinstance(drive, Piece) for drive in drives)
    while True:
        problem = Problem(drawn, drives, position_sd, yaw_sd, watch)
        found, single = problem.solve()
        misfit = _misfit(found)
        drive = drives[misfit[0]] if misfit else None
        if misfit is None or not isinstance(drive, Piece) or len(said) + 1 > left:
            return problem, found, single, said
        said.append(f"{drive.where}: left out, it does not fit the others (slip, or a pose that is none)")
        drives = [each for each in drives if each is not drive]


def _misfit(found: Found) -> tuple[int, float] | None:
    """The run whose misfit is improbable by chance, and the factor by which the other runs fit better."""
    beyond, chances = scipy_part("special", NEEDED_BY).fdtrc, []
    for less, numbers, _ in found.left_out:
        rest, left = max(found.ends_left - less, 1e-3 * found.ends_left), found.ends_freedom - numbers
        tells = bool(numbers) and left >= ENOUGH
        # The upper tail of the distribution F.
        chances.append(beyond(numbers, left, max(0.0, less / numbers) / (rest / left)) if tells else 1.0)
    worst = int(np.argmin(chances))
    return (worst, found.left_out[worst][2]) if chances[worst] * len(chances) <= BY_CHANCE else None


def _path(problem: Problem, found: Found, recording: Recording) -> PathError:
    plate = problem.plate(recording, found.reported)
    vehicle = problem.vehicle(found.reported)
    before, after, sideways = (
        recording.path_error_m(Kinematics(layout=layout), plate)
        for layout in (problem.drawn.layout, vehicle.layout, problem.layout(found.reported))
    )
    # But for rounding on the way into a file.
    sideways = after if abs(sideways - after) < LEAST_PATH_M else sideways
    return PathError(
        run=recording.where,
        pieces=len(recording.pieces),
        piece_m=recording.piece_m,
        before_m=before,
        after_m=after,
        sideways_m=sideways,
    )


def _refuted(sd: Floats, stated: Floats) -> str:
    """Why intervals would be wrong: ends that are much farther off than was stated."""
    for k, (off, most) in enumerate(zip(sd[:4], stated, strict=True)):
        if refutes(off, most):
            key, unit = (("position_sd_m", "m"), ("yaw_sd_rad", "rad"))[k % 2]
            return (
                f"the {'ends' if k < 2 else 'pieces'} are {off:.2g} {unit} off where {key} = {most:.2g}; state how well"
                " they were measured and how far wheels slip, or find the run that is wrong"
            )
    return ""


def _wrong(problem: Problem, found: Found) -> str:
    """Name the run without which the others fit much better: one end that was measured or written down wrong."""
    misfit = _misfit(found)
    if misfit is None:
        return ""
    worst, times = misfit
    drive = problem.drives[worst]
    # An end also counts as wrong if slip might explain it but no other run slipped as far.
    allowed = problem.stated if isinstance(drive, Piece) else np.r_[problem.tape, problem.stated[2:]]
    ends = [each.way_rad for each in problem.drives if isinstance(each, Drive)]
    # A longer run slips more.
    longer = max(1.0, drive.way_rad / float(np.mean(ends))) if isinstance(drive, Drive) else 1.0
    if times < TWICE * longer or (found.sd[:4] <= allowed).all():
        return ""
    remedy = "measure its end again, or leave it out"
    if isinstance(drive, Piece):
        remedy = f"nor do {100 * LEFT_OUT:.0f} % of the pieces, which are left out; look at the log there"
    return f"{drive.where} does not fit the others, which fit {times:.1f} times as well without it; {remedy}"


def _doubtful(vehicle: Vehicle, problem: Problem, found: Found, refuted: bool) -> list[str]:
    """Report runs that fit no vehicle near the designed one: signs, units, the order of wheels or of positions."""
    ends = [drive for drive in problem.drives if isinstance(drive, Drive)]
    doubts: list[str] = []
    for drive in ends:
        doubts += [f"{drive.where}: {doubt}" for doubt in _plausibility.of_parts(vehicle, drive.parts)]
    for recording in recordings_of(problem.drives):
        doubts += [f"{recording.where}: {doubt}" for doubt in recording.doubts(vehicle, refuted)]
    if not any(APART in doubt for doubt in doubts):
        doubts = [*_times(vehicle, problem.drives), *doubts]
    if not ends:
        return doubts
    # By the best fit: a parameter that keeps the file's value is not a mistake of a measurement.
    kinematics = Kinematics(layout=problem.layout(found.u))
    errors = [drive.errors(kinematics) for drive in ends]
    for kind, unit, most, why in (
        (0, "m", OFF_M, "check that it is in m, that x has the right sign, and that x and y are not swapped"),
        (1, "rad", OFF_RAD, "check that it is in rad and that a turn to the left is positive"),
    ):
        off = [max((abs(each) for each in error[kind]), default=0.0) for error in errors]
        worst = int(np.argmax(off))
        if off[worst] > most:
            doubts.append(
                f"{ends[worst].where}: its end is {off[worst]:.3g} {unit} off, the largest of all runs: {why}"
            )
    return doubts


def _times(vehicle: Vehicle, drives: Sequence[Drive | Piece]) -> list[str]:
    """Report wheels that go another multiple of their way than one that a drawing may be wrong by."""
    kinematics, times = Kinematics(layout=vehicle.layout), []
    for drive in drives:
        x, y, _ = drive.end(kinematics)
        way, seen = float(np.hypot(x, y)), drive.distance_m
        if seen > OFF_M and way > OFF_M * seen / 100.0:
            times.append(seen / way)
    factor = float(np.median(times)) if times else 1.0
    for of, why in MISTAKEN.items():
        if abs(factor / of - 1.0) < 0.15:
            return [f"the ends are {factor:.3g} times as far as the wheels say: check for {why}, and the gear"]
    return []


def _remarkable(common: Sequence[Estimate], vehicle: Vehicle) -> list[str]:
    """What a file cannot hold, and a radius that no drawing is wrong by."""
    every = {each.name: each for each in common if each.determined}
    said, radius, sideways = [], every.get("all.radius"), every.get("all.sideways")
    if radius is not None and abs(radius.value - 1.0) > RADIUS_OFF:
        said.append(
            f"all wheels are {radius.value:.3g} times as large as in the file: measure one, or was counts_per_turn or"
            f" the gear {radius.value:.3g} times too large?"
        )
    if sideways is None or sideways.low is None or sideways.high is None:
        return said
    if abs(sideways.value - 1.0) <= max(SLIPS_ASIDE, 0.5 * (sideways.high - sideways.low)):
        return said
    angle = abs(
        float(np.mean([abs(wheel.roller_angle_rad) for wheel in vehicle.layout.wheels if wheel.roller_angle_rad]))
    )
    turned = np.arctan2(np.tan(angle), sideways.value)
    same = (
        f"; wheels that are all turned by {abs(turned - angle):.3g} rad, of {np.cos(turned) / np.cos(angle):.4g} times"
        " the radius, would be the same to odometry"
    )
    if sideways.value > 1.0:
        cause = (
            f"more than slip does; rollers at {np.degrees(turned):.1f} degrees instead of {np.degrees(angle):.1f} do so"
        )
    else:
        cause = "rollers tilt, slip and bind"
    said.append(
        f"it goes {sideways.value:.3g} times as far sideways as its wheels say ({cause}): not in the file; multiply"
        f" odometry's steps to the side by it, and give it to resimulate, --sideways {sideways.value:.3g}{same}"
    )
    return said


def _undetermined(common: Sequence[Estimate], single: Sequence[Estimate], poses: bool) -> tuple[str, ...]:
    """What was determined, what was not, and the drives that would, in words of the robot."""
    drives = {
        "radius": ("radius", "straight lines with a measured distance_m, forward and sideways"),
        "lever": ("shift_m", "turns on the spot and squares both ways with end_yaw_rad or a gyro"),
        "turn": ("turn_rad", "straight lines forward and sideways with end_x_m and end_y_m"),
    }
    if poses:
        # A rotated plate and a vehicle that is rotated below the plate have the same poses.
        drives = {
            "radius": ("radius", "longer"),
            "lever": ("shift_m", "turns on the spot and arcs"),
            "turn": ("turn_rad", "lines with end_x_m and end_y_m measured by hand; to poses it is the plate's yaw"),
        }
    words = {
        "all.radius": "one radius for all wheels",
        "all.lever": "the lever",
        "all.turn_rad": "the turn of the whole",
        "all.sideways": "how far it goes sideways",
    }
    known = [words[each.name] for each in common if each.determined]
    said = [f"these runs tell {', '.join(known) or 'nothing that all wheels have in common'}"]
    for kind, (ending, drive) in drives.items():
        lacks = [each for each in single if f".{ending}" in each.name and not each.determined]
        whole = next(each for each in common if kind in each.name)
        if not whole.determined:
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
