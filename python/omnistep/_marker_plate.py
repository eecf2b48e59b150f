"""The marker plate and the clock of a recorded pose: their position and delay, from wheels and poses."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Vehicle
from omnistep.errors import ConfigError
from omnistep.recordings import estimated

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Wheels and poses are compared over pieces of this time [s], of which there must be so many. One that is so many times
#: as far off as half of them is left out: a pose that jumps.
PIECE_S, FEWEST, OUTLIER = 1.0, 8, 5.0
#: A piece in which the plate moves less than this [m] and the wheels turn the vehicle less than this [rad] is at rest.
MOVED_M, MOVED_RAD = 0.01, 0.01
#: A place is known to this [m], a yaw to this [rad] (standard deviations), and wheels go as far as the plate but for
#: this part; else the plate is taken for the vehicle's own axes.
KNOWN_M, KNOWN_RAD, SCALE = 0.02, 0.02, 0.2
#: Poses are up to this much late [s]. A delay is known to so much (standard deviation), by sums so far apart [s].
LATE_S, KNOWN_S, APART_S = 0.5, 0.01, 0.05
#: A plate is no farther away [m], and its yaw no larger [rad].
FARTHEST_M, TURNED_RAD = 10.0, 7.0


class MarkerPlate(NamedTuple):
    """Pose of the plate in the vehicle's axes.

    Attributes:
        x_m: forward from the vehicle's origin [m].
        y_m: to the left of it [m].
        yaw_rad: its heading, counter-clockwise from the vehicle's [rad].
        source: how that is known, in words.
    """

    x_m: float
    y_m: float
    yaw_rad: float
    source: str

    def __str__(self) -> str:
        return (
            f"marker plate on the vehicle: x {self.x_m:.4f} m, y {self.y_m:.4f} m, yaw {self.yaw_rad:.4f} rad,"
            f" {self.source}"
        )

    def of(self, pose: Floats) -> Floats:
        """The plate's poses for given poses of the vehicle, (T, 3)."""
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        x = pose[:, 0] + c * self.x_m - s * self.y_m
        y = pose[:, 1] + s * self.x_m + c * self.y_m
        return np.column_stack([x, y, pose[:, 2] + self.yaw_rad])


def given(plate: Sequence[float]) -> MarkerPlate:
    """The plate as it was stated, or as another resimulation found it.

    Raises:
        ConfigError: it is not three numbers, or one is out of range.
    """
    if isinstance(plate, MarkerPlate):
        return plate
    there = len(plate) == 3 and all(isfinite(each) for each in plate)
    if not there or max(map(abs, plate[:2])) > FARTHEST_M or abs(plate[2]) > TURNED_RAD:
        raise ConfigError(
            f"plate = {', '.join(f'{each:g}' for each in plate)}, allowed: x and y of -{FARTHEST_M:g} to"
            f" {FARTHEST_M:g} m, and a yaw of -{TURNED_RAD:g} to {TURNED_RAD:g} rad",
            key="plate",
        )
    return MarkerPlate(float(plate[0]), float(plate[1]), float(plate[2]), "as given")


def slipping(pose: Floats, sideways: float) -> Floats:
    """The poses of a vehicle that goes only so far of its steps to the side, (T, 3); unknown from the first gap on."""
    yaw = np.unwrap(pose[:, 2])
    place, heading = pose[:, 0] + 1j * pose[:, 1], np.exp(0.5j * (yaw[1:] + yaw[:-1]))
    steps = np.diff(place) / heading
    place = place[0] + np.r_[0.0, np.cumsum((steps.real + 1j * sideways * steps.imag) * heading)]
    return np.column_stack([place.real, place.imag, pose[:, 2]])


def found(
    vehicle: Vehicle, measured_rad_s: Floats, pose: Floats, period_s: float, sideways: float = 1.0
) -> MarkerPlate:
    """The plate with which short motions by the wheels, (T, N), are those of the pose, (T, 3), by least squares.

    The motion of the plate is turned by its yaw, and has a part of the vehicle's turn times its place (of a camera on
    an arm: Tsai and Lenz, 1989). Pieces are short, so that errors of the whole path stay in the path. Values that a
    drive without turns, or without translation, does not determine are 0.
    """
    ways, turns, seen = _moving(_odometry(vehicle, measured_rad_s, period_s, sideways), pose, period_s)
    lever = 1.0 - np.exp(1j * turns)
    if len(ways) >= FEWEST:
        for rows in (np.column_stack([seen, lever]), seen[:, None]):
            solved, sd = _solved(rows, ways)
            turned = complex(solved[0])
            place, place_sd = (complex(solved[1]), sd[1]) if rows.shape[1] == 2 else (0j, 0.0)
            if abs(abs(turned) - 1.0) < SCALE and sd[0] < KNOWN_RAD and place_sd < KNOWN_M:
                how = "found from wheels and poses" if rows.shape[1] == 2 else "its yaw found from wheels and poses"
                return MarkerPlate(place.real, place.imag, float(np.angle(turned)), how)
    return MarkerPlate(0.0, 0.0, 0.0, "assumed: wheels and poses do not tell it; --plate X Y YAW gives it")


def late_s(vehicle: Vehicle, measured_rad_s: Floats, pose: Floats, period_s: float, sideways: float = 1.0) -> float:
    """How late poses are [s], in whole control periods: motions agree best then, wherever the plate is.

    Only changes of the speed tell it. It is 0 if there are too few, or if poses are early.
    """
    most, apart = round(LATE_S / period_s), max(1, round(APART_S / period_s))
    odometry = _odometry(vehicle, measured_rad_s, period_s, sideways)

    @cache
    def left(shift: int) -> tuple[float, int]:
        """Mean square that is left with poses so many periods earlier, and its degrees of freedom."""
        ways, turns, seen = _moving(odometry, earlier(pose, shift), period_s)
        if len(ways) < FEWEST:
            return np.inf, 0
        rows = np.column_stack([seen, 1.0 - np.exp(1j * turns)])
        solved, _ = _solved(rows, ways)
        return float(np.mean(np.abs(ways - rows @ solved) ** 2)), 2 * len(ways) - 2 * len(solved)

    # In steps of a fifth of what tells the curvature, then period by period about the best of these.
    step = max(1, apart // 5)
    near = min(range(0, most + 1, step), key=left)
    best = min(range(max(0, near - step), min(most, near + step) + 1), key=left)
    (least, free), before, after = left(best), left(best - apart)[0], left(best + apart)[0]
    if not isfinite(before + least + after):
        return 0.0
    # The curvature of the sum, over some periods: noise of single sums does not matter there.
    bend = (before + after - 2.0 * least) / (apart * period_s) ** 2
    known = bend > 0.0 and np.sqrt(2.0 * least / (free * bend)) < KNOWN_S
    return best * period_s if known else 0.0


def earlier(pose: Floats, rows: int) -> Floats:
    """Poses this many rows earlier, (T, 3); NaN if there is none."""
    moved, count = np.full_like(pose, np.nan), max(0, len(pose) - abs(rows))
    moved[max(0, -rows) :][:count] = pose[max(0, rows) :][:count]
    return moved


class Odometry(NamedTuple):
    """Pose by odometry at the start of each period.

    Attributes:
        at_m: x + i y [m].
        heading_rad: heading [rad].
        unknown: periods without a motion so far.
    """

    at_m: Complex
    heading_rad: Floats
    unknown: NDArray[np.int64]


def _odometry(vehicle: Vehicle, measured_rad_s: Floats, period_s: float, sideways: float) -> Odometry:
    twist = estimated(vehicle, measured_rad_s) * period_s * [1.0, sideways, 1.0]
    there = np.isfinite(twist).all(axis=1)
    twist[~there] = 0.0
    heading = np.cumsum(twist[:, 2])
    at = np.cumsum((twist[:, 0] + 1j * twist[:, 1]) * np.exp(1j * (heading - 0.5 * twist[:, 2])))
    return Odometry(at, heading, np.cumsum(~there))


def _moving(odometry: Odometry, pose: Floats, period_s: float) -> tuple[Complex, Floats, Complex]:
    """The pieces that are not at rest: these agree whatever the plate is, and would make every other one an outlier."""
    ways, turns, seen = _pieces(odometry, pose, period_s)
    moving = (np.abs(seen) > MOVED_M) | (np.abs(ways) > MOVED_M) | (np.abs(turns) > MOVED_RAD)
    return ways[moving], turns[moving], seen[moving]


def _pieces(odometry: Odometry, pose: Floats, period_s: float) -> tuple[Complex, Floats, Complex]:
    """Ways of the vehicle by its wheels, its turns, and ways of the plate, each in the axes of the piece's start."""
    step, last = max(1, round(PIECE_S / period_s)), len(pose) - 2
    at, heading, unknown = odometry
    place, ends = pose[:, 0] + 1j * pose[:, 1], []
    begin = -1
    for row in np.flatnonzero(np.isfinite(pose).all(axis=1)).tolist():
        if row > last:
            break
        if begin < 0 or row - begin > 2 * step:
            begin = row
        elif row - begin >= step:
            # Readings are of the start of a period, poses of its end.
            if unknown[row + 1] == unknown[begin + 1]:
                ends.append((begin, row))
            begin = row
    a, b = np.array(ends, dtype=np.int64).reshape(-1, 2).T
    ways = (at[b + 1] - at[a + 1]) * np.exp(-1j * heading[a + 1])
    return ways, heading[b + 1] - heading[a + 1], (place[b] - place[a]) * np.exp(-1j * pose[a, 2])


def _solved(rows: Complex, ways: Complex) -> tuple[Complex, Floats]:
    """Least squares without the pieces that are far off, and standard deviations."""
    kept = np.ones(len(ways), dtype=bool)
    for _ in range(3):
        solved, _, rank, _ = np.linalg.lstsq(rows[kept], ways[kept], rcond=1e-9)
        off = np.abs(ways - rows @ solved)
        if rank < rows.shape[1]:
            return np.asarray(solved), np.full(len(solved), np.inf)
        kept = off <= OUTLIER * np.median(off) + 1e-9
    free = max(1, int(kept.sum()) - rows.shape[1])
    variance = float((off[kept] ** 2).sum()) / free
    inverse = np.linalg.inv(rows[kept].conj().T @ rows[kept])
    return np.asarray(solved), np.asarray(np.sqrt(0.5 * variance * np.real(np.diag(inverse))))
