"""Recorded poses for calibration: a drive in pieces, each of which begins and ends at a measured pose."""

from __future__ import annotations

from cmath import rect
from collections.abc import Sequence
from itertools import pairwise
from math import cos, nan, remainder, sin, tau
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from omnistep import _plausibility, _pose_doubts
from omnistep._calibration_drives import GAP_S, STANDS, STANDS_OVER_S, end_of, thinned
from omnistep._calibration_drives import whole_positions as whole
from omnistep._calibration_runs import CalibrationRun
from omnistep._estimates import Floats
from omnistep._omnistep import Kinematics, Odometry, Vehicle
from omnistep._plausibility import more_times
from omnistep._wheel_logs import POSE, WheelLog, spans
from omnistep.errors import ConfigError

#: A piece is as long as the vehicle moves in this time on the average.
PIECE_S = 3.0
#: A piece is left out that is longer than so many others, because poses are missing, or shorter than this part of one.
LONGEST, SHORTEST = 2.0, 0.5
#: Fewest pieces: each yields three numbers, and a plate and a clock have four unknowns.
FEWEST = 4
#: Wheels that turn less than this in all do not move the vehicle [m at the wheel].
MOVES_M = 0.1
#: A pose jumps that moves so much farther than wheels may [m, rad]; these may be so many times as fast as in the file,
#: and a plate so far from the middle [m].
JUMP_M, JUMP_RAD, FASTER, REACH_M = 0.03, 0.1, 2.0, 0.5
#: Poses that are back after this time were somewhere else in single rows.
AWAY_S = 0.5
#: Poses this close to a gap are no ends: the clocks may differ so much.
MARGIN_S = 0.1
#: Parts of a piece, of equal ways, in which wheels are compared with each other.
PARTS = 3
#: Poses are smoothed over this time: less noise, and a smooth course for the delay. By parabolas: means would cut
#: corners, by 0.03 % of an arc at 0.8 rad/s and by 0.4 mm where a drive begins at 1 m/s^2.
SMOOTH_S = 0.1


class Plate(NamedTuple):
    """Position of the marker plate on the vehicle, and the delay of its poses."""

    x_m: float
    y_m: float
    yaw_rad: float
    delay_s: float

    def moved(self, x: Any, y: Any, yaw: Any) -> tuple[Any, Any, Any]:
        """Motion of the plate for a motion of the vehicle, each from its own start and in its own axes."""
        c, s = np.cos(yaw), np.sin(yaw)
        x = x + c * self.x_m - s * self.y_m - self.x_m
        y = y + s * self.x_m + c * self.y_m - self.y_m
        c, s = cos(self.yaw_rad), sin(self.yaw_rad)
        return c * x + s * y, c * y - s * x, yaw


class Stretch(NamedTuple):
    """Rows of a log with every wheel, in which the pose does not jump."""

    first: int
    #: Angles of the actuators [rad], (T, N).
    positions: Floats
    #: At which rows a piece may begin or end, (T,).
    good: Any


class Recording:
    """Wheels and poses of a run, in pieces."""

    def __init__(self, run: CalibrationRun, log: WheelLog, first: int, vehicle: Vehicle, where: str) -> None:
        self.run, self.where, self.first, self.period_s, self.log = run, where, first, log.period_s, log
        name = where.split(" (")[0] if log.name == "data" else Path(log.name).stem
        self.clock, self.plate = name, run.plate or name
        poses = _poses(log, where)
        self.stretches, self.jumps_s, self.repeated_s = self._stretches(vehicle, poses)
        self.known = np.flatnonzero(np.isfinite(poses).all(axis=1))
        seen = poses[self.known]
        seen[:, 2] = np.unwrap(seen[:, 2])
        self.poses = _smooth(seen, 2 * round(0.5 * SMOOTH_S / self.period_s) + 1)
        radius = float(np.mean([abs(wheel.radius_m * wheel.gear) for wheel in vehicle.layout.wheels]))
        ways = [self._way(stretch.positions) * radius for stretch in self.stretches]
        total = sum(float(way[-1]) for way in ways)
        if total < MOVES_M:
            raise ConfigError(
                f"{where}: nothing moves {self.span()}, allowed: a part in which the vehicle drives", key="log"
            )
        moving = sum(np.count_nonzero(np.diff(way)) for way in ways) * self._raster() * self.period_s
        #: Rotation of wheels in a piece [m], at the rim.
        self.piece_m = float(total / moving * PIECE_S)
        cuts = [
            (stretch, begin, end)
            for stretch, way in zip(self.stretches, ways, strict=True)
            for begin, end in self._cuts(stretch, way)
        ]
        self.pieces = [Piece(self, index, *cut) for index, cut in enumerate(cuts)]
        self._measured: tuple[float, list[list[float]]] = (nan, [])
        if len(self.pieces) < FEWEST:
            why = self._why_few(vehicle)
            raise ConfigError(
                f"{where}: {len(self.pieces)} pieces of {PIECE_S:g} s with poses {self.span()}, allowed: {FEWEST} or"
                f" more{''.join(f'; {each}' for each in why)}",
                key="pose",
            )

    def span(self) -> str:
        """Which part of the log it is, in words."""
        first = self.first * self.period_s
        return f"from {first:.4g} to {first + (len(self.log.measured) - 1) * self.period_s:.4g} s"

    def at(self, row: Any, delay_s: float) -> Floats:
        """Measured pose of the plate at rows, (T, 3) or (2, T, 3), with a delayed clock."""
        late = np.asarray(row) + delay_s / self.period_s
        return np.stack([np.interp(late, self.known, column) for column in self.poses.T], axis=-1)

    def measured(self, delay_s: float) -> list[list[float]]:
        """Measured motion of the plate in every piece, from its start and in the axes there: x, y [m], yaw [rad].

        Kept for a fit, which asks for one delay many times.
        """
        if self._measured[0] != delay_s:
            begin, end = self.at(np.array([piece.rows for piece in self.pieces]).T, delay_s)
            dx, dy, dyaw = (end - begin).T
            c, s = np.cos(begin[:, 2]), np.sin(begin[:, 2])
            self._measured = delay_s, np.stack([c * dx + s * dy, c * dy - s * dx, dyaw], axis=-1).tolist()
        return self._measured[1]

    def yaw_of_plate(self, kinematics: Kinematics) -> float:
        """Approximate yaw of the plate: the rotation from odometry of the pieces to the measured displacements."""
        total = 0j
        for piece in self.pieces:
            (x, y, _), (u, v, _) = piece.end(kinematics), piece.measured(0.0)
            total += complex(x, y) * complex(u, -v)
        return float(np.angle(total))

    def doubts(self, vehicle: Vehicle, refuted: bool) -> list[str]:
        """Doubts about it; a disagreement of wheels and poses only if it remains after the fit."""
        doubts = _plausibility.of_parts(vehicle, np.concatenate([piece.parts for piece in self.pieces]))
        if refuted:
            poses = self.at(np.arange(len(self.log.measured)), 0.0)
            doubts += _pose_doubts.of_pose(vehicle, self.log.measured, self.period_s, poses, self.known)
        return doubts

    def without(self) -> list[str]:
        """What is said of poses that are not compared."""
        said = []
        if self.jumps_s:
            more = more_times(len(self.jumps_s))
            said.append(f"the pose jumps at {self.jumps_s[0]:.2f} s{more}: pieces begin anew there")
        return said + repeated(self.repeated_s)

    def _why_few(self, vehicle: Vehicle) -> list[str]:
        """Reasons why poses yield no pieces, as far as they are known."""
        assert self.log.pose is not None
        raw = self.log.pose
        known = np.flatnonzero(np.isfinite(raw).all(axis=1))
        seen = raw[known]
        # A pose that is identical to the last digit repeats the previous pose.
        new = known[np.r_[True, (np.diff(seen, axis=0) != 0.0).any(axis=1)]]
        if len(new) < 2:
            return ["the pose never changes"]
        apart = float(np.median(np.diff(new)))
        if apart * self.period_s > GAP_S + 0.5 * self.period_s:
            return [f"poses are {apart * self.period_s:.2g} s apart, allowed: {GAP_S:g} s"]
        seen[:, 2] = np.unwrap(seen[:, 2])
        rows = np.arange(len(raw))
        poses = np.stack([np.interp(rows, known, column, np.nan, np.nan) for column in seen.T], axis=1)
        for begin, end in pairwise(known):
            if end - begin > 2.0 * apart:
                poses[begin + 1 : end] = np.nan
        why = _pose_doubts.of_pose(vehicle, self.log.measured, self.period_s, poses, new)
        if len(self.jumps_s) > 1:
            why.append(f"the pose jumps {len(self.jumps_s)} times")
        part = float(np.mean(np.isfinite(poses[:, 2])))
        if part < 0.5:
            why.append(f"poses are known in {100 * part:.0f} % of the log")
        return why

    def path_error_m(self, kinematics: Kinematics, plate: Plate) -> float:
        """Distance of odometry from the recorded path, root mean square [m]; restarts at each jump of the pose.

        Laid over it by rotation and shift, as an absolute trajectory error is (Sturm and others, "A benchmark for the
        evaluation of RGB-D SLAM systems", 2012): the first pose alone may be off.
        """
        squares = []
        for stretch in self.stretches:
            rows = np.flatnonzero(stretch.good)
            if not len(rows):
                continue
            odometry = Odometry(kinematics=kinematics, period_s=self.period_s)
            path = odometry.step_positions(stretch.positions[rows[0] :])[rows - rows[0]]
            seen = self.at(stretch.first + rows, plate.delay_s)
            x, y, _ = plate.moved(*path.T)
            own, there = (place - place.mean() for place in (x + 1j * y, seen[:, 0] + 1j * seen[:, 1]))
            turn = np.angle((own.conj() * there).sum())
            squares.append(np.abs(own * np.exp(1j * turn) - there) ** 2)
        return float(np.sqrt(np.concatenate(squares).mean()))

    def _raster(self) -> int:
        return max(1, round(STANDS_OVER_S / self.period_s))

    def _stretches(
        self, vehicle: Vehicle, poses: Floats
    ) -> tuple[list[Stretch], list[float], list[tuple[float, float]]]:
        """Rows with every wheel and consistent poses, times of pose jumps, and intervals of repeated poses.

        Poses that are none become NaN.
        """
        rows = self.log.measured if self.log.positions is None else self.log.positions
        back = np.asarray(Kinematics(layout=vehicle.layout).forward_matrix)
        found, jumps, frozen = [], [], []
        for first, last in _runs(~np.isnan(rows).any(axis=1), int(GAP_S / self.period_s + 1e-6)):
            part = self.log.rows(first, last)
            positions = whole(part, self.where)
            own = poses[first:last]
            twist = np.abs(np.diff(positions, axis=0, prepend=positions[:1]) @ back.T)
            for begin, end in without_repeated(own, twist, self.period_s):
                frozen.append(
                    ((self.first + first + begin) * self.period_s, (self.first + first + end) * self.period_s)
                )
            ends = _jumps(own, twist, round(AWAY_S / self.period_s))
            jumps += [(self.first + first + at) * self.period_s for at in ends]
            for begin, end in zip([0, *ends], [*ends, len(own)], strict=True):
                if end - begin > 1:
                    good = _good(own[begin:end], self.period_s)
                    found.append(Stretch(first + begin, positions[begin:end], good))
        return found, jumps, frozen

    def _way(self, positions: Floats) -> Floats:
        """Rotation of the fastest wheel at every row of a raster [rad], without the noise of single counts."""
        turned = np.abs(np.diff(positions[:: self._raster()], axis=0)).max(axis=1, initial=0.0)
        turned[turned < STANDS * np.max(turned, initial=0.0)] = 0.0
        return np.asarray(np.r_[0.0, np.cumsum(turned)])

    def _cuts(self, stretch: Stretch, way: Floats) -> list[tuple[int, int]]:
        """First and last row of every piece, of equal ways as far as poses are known."""
        cuts, begin, raster = [], -1, self._raster()
        for row, here in zip(range(0, len(stretch.positions), raster), way, strict=True):
            last = row + raster >= len(stretch.positions)
            if not stretch.good[row]:
                continue
            gone = here - way[begin // raster] if begin >= 0 else 0.0
            enough = gone >= (SHORTEST if last else 1.0) * self.piece_m
            if enough and gone <= LONGEST * self.piece_m:
                cuts.append((begin, row))
            if begin < 0 or enough or gone == 0.0:
                begin = row
        return cuts


class Piece:
    """A part of a recording: odometry from its start, and the pose at its end in the axes of that at its start."""

    def __init__(self, recording: Recording, index: int, stretch: Stretch, begin: int, end: int) -> None:
        self.recording, self.index, self.rows = recording, index, (stretch.first + begin, stretch.first + end)
        times = [(recording.first + row) * recording.period_s for row in self.rows]
        self.where = f"{recording.where} from {times[0]:.1f} to {times[1]:.1f} s"
        positions = stretch.positions[begin : end + 1]
        self.positions = thinned(positions, recording.period_s)
        way = np.cumsum(np.abs(np.diff(self.positions, axis=0, prepend=self.positions[:1])).max(axis=1))
        ends = np.searchsorted(way, np.linspace(0.0, way[-1], PARTS + 1))
        self.parts = np.diff(self.positions[ends], axis=0)

    @property
    def distance_m(self) -> float:
        """How far from its start it was measured to end [m]."""
        return float(np.hypot(*self.measured(0.0)[:2]))

    def end(self, kinematics: Kinematics) -> tuple[float, float, float]:
        """Final pose by odometry: x, y [m], yaw [rad]."""
        return end_of(self.positions, kinematics)

    def measured(self, delay_s: float) -> tuple[float, float, float]:
        """Measured final pose of the plate, relative to its start: x, y [m], yaw [rad]."""
        x, y, yaw = self.recording.measured(delay_s)[self.index]
        return x, y, yaw

    def errors(self, kinematics: Kinematics, plate: Plate) -> tuple[list[float], list[float]]:
        """Odometry less the measurement: positions [m], headings [rad]."""
        x, y, yaw = plate.moved(*self.end(kinematics))
        u, v, turned = self.measured(plate.delay_s)
        off = remainder(yaw - turned, tau)
        # Displacements in the axes halfway through, so that an error of the turn does not affect the displacement.
        way = complex(x, y) * rect(1.0, -0.5 * (turned + off)) - complex(u, v) * rect(1.0, -0.5 * turned)
        return [way.real, way.imag], [off]


def repeated(spans_s: Sequence[tuple[float, float]]) -> list[str]:
    """What is said of poses that were repeated from one time to another [s]."""
    if not spans_s:
        return []
    (begin, end), more = spans_s[0], more_times(len(spans_s))
    return [f"the pose is repeated from {begin:.1f} to {end:.1f} s{more} while the wheels move: left out"]


def _poses(log: WheelLog, where: str) -> Floats:
    if log.pose is None or not np.isfinite(log.pose).all(axis=1).any():
        raise ConfigError(
            f"{where}: no poses, allowed: a log imported with [pose] in its map, or columns {', '.join(POSE)}",
            key="pose",
        )
    return log.pose.copy()


def _smooth(poses: Floats, rows: int) -> Floats:
    """A parabola through as many rows at each one (Savitzky and Golay, 1964)."""
    if rows < 5 or len(poses) < rows:
        return poses
    powers = np.vander(np.linspace(-1.0, 1.0, rows), 3)
    # The parabola through each window, at all of its rows; at its middle it is a running mean with weights.
    parabola, middle = powers @ np.linalg.pinv(powers), rows // 2
    windows = np.lib.stride_tricks.sliding_window_view(poses, rows, axis=0) @ parabola[middle]
    begin, end = (parabola @ poses[part] for part in (slice(rows), slice(-rows, None)))
    return np.concatenate([begin[:middle], windows, end[middle + 1 :]])


def _runs(there: Any, bridged: int) -> list[tuple[int, int]]:
    """First and last row of each known stretch, with gaps of up to this many rows."""
    rows = np.flatnonzero(there)
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(rows) > bridged + 1)
    begins, ends = np.r_[rows[0], rows[breaks + 1]], np.r_[rows[breaks], rows[-1]] + 1
    return [(int(begin), int(end)) for begin, end in zip(begins, ends, strict=True) if end - begin > 1]


def without_repeated(poses: Floats, twist: Floats, period_s: float) -> list[tuple[int, int]]:
    """Poses that stay the same to the last digit while the wheels turn were repeated, not measured: NaN; and where.

    The twist is the largest possible motion by the wheels in each row. The first that is another lies between the last
    one repeated and the next one measured.
    """
    rows = max(1, round(GAP_S / period_s))
    same, frozen = np.r_[False, (poses[1:] == poses[:-1]).all(axis=1)], []
    for begin, end in spans(same):
        x, y, turn = twist[begin:end].sum(axis=0)
        if end - begin > rows and (np.hypot(x, y) > JUMP_M or turn > JUMP_RAD):
            frozen.append((begin, end))
            poses[begin : end + rows] = np.nan
    return frozen


def _jumps(poses: Floats, twist: Floats, away: int) -> list[int]:
    """Rows at which poses jump by more than wheels may have moved them; short excursions become NaN."""
    at = _steps(poses, twist)
    for begin, end in pairwise(at):
        if end - begin <= away:
            poses[begin:end] = np.nan
    return _steps(poses, twist)


def _steps(poses: Floats, twist: Floats) -> list[int]:
    rows = np.flatnonzero(np.isfinite(poses).all(axis=1))
    if len(rows) < 2:
        return []
    ways = np.diff(np.cumsum(twist, axis=0)[rows], axis=0)
    steps = np.diff(poses[rows], axis=0)
    turned = np.abs(np.arctan2(np.sin(steps[:, 2]), np.cos(steps[:, 2])))
    far = np.hypot(*steps[:, :2].T) > JUMP_M + FASTER * np.hypot(*ways[:, :2].T) + REACH_M * turned
    return [int(row) for row in rows[1:][far | (turned > JUMP_RAD + FASTER * ways[:, 2])]]


def _good(poses: Floats, period_s: float) -> Any:
    """Rows with poses on both sides, for clocks that differ."""
    known = np.asarray(np.isfinite(poses).all(axis=1))
    bridged = np.ones(len(known))
    for begin, end in spans(~known):
        if (end - begin) * period_s > GAP_S or begin == 0 or end == len(known):
            bridged[begin:end] = 0.0
    margin = round(MARGIN_S / period_s)
    near = np.convolve(np.pad(1.0 - bridged, margin, constant_values=1.0), np.ones(2 * margin + 1), mode="valid")
    return near < 0.5
