"""Plausibility checks of a measured pose against what wheels turn: axes, units, order and signs, clocks, jumps."""

from __future__ import annotations

from itertools import combinations
from math import hypot

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Kinematics, Vehicle
from omnistep._plausibility import AXES_READ, DISAGREE, FITS, MOST_JUMPS, more_times, orders
from omnistep._wheel_logs import spans
from omnistep.errors import ConfigError

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

#: Wheels and a measured pose are compared over parts of a drive of this time [s] and way [m] or more, if there are so
#: many of them. Wheel rotations are summed over this time [s].
OVER_S, MOVES_M, FEWEST, STEP_S = 0.5, 0.05, 10, 0.02
#: Noise dominates poses that are closer in time [s], or in rolled distance [m], than this; a part is at least this
#: multiple of the noise.
CLOSE_S, IDLE_M, NOISY = 0.05, 0.002, 10.0
#: Beyond this turn from one pose to the next, the turn of the vehicle is ambiguous [rad].
BLIND = 2.0
#: Readings within so much of the best one are as likely. A difference below `DISAGREE` but above the second limit is
#: reported only if a reading fits.
ALSO, SLIGHT = 0.01, 0.07
#: A pose stands in a part of which it moves less than this; it is said of so many parts in sequence, or more.
STANDS, STANDING = 0.1, 10
#: A pose jumps that moves from one sample to the next by more than this [m, rad] and so many times what wheels roll and
#: what 95 % of its steps are at most.
JUMPS, JUMPS_TIMES = (0.1, 0.5), 3.0
#: A vehicle moves all about that moves by so much each way [m, m, rad].
ABOUT = (0.3, 0.3, 1.0)
#: A pose is repeated that is the same while wheels roll more than so many of its smallest steps.
COARSE = 3.0
#: Message for wheels and poses that do not agree.
APART = "the wheels move the vehicle otherwise than the pose"
AXES = ("x", "y", "the heading")
#: Clocks are tried so much late, and early [s]; of a pose that agrees so much is none to speak of.
AGREE_S = (0.0, 0.05, -0.05, 0.1, -0.1)
LATE_S = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0)


def of_pose(vehicle: Vehicle, measured_rad_s: Floats, period_s: float, pose: Floats, sampled: Integers) -> list[str]:
    """Report wheels, (T, N), that move the vehicle otherwise than a measured pose, and which reading would fit.

    The pose, (T, 3), is that at the ends of the rows; ``sampled`` are the rows nearest to its samples. Ways over parts
    of the drive are compared, less what the noise of the pose makes.
    """
    seen = _Seen(vehicle, measured_rad_s, period_s, pose, sampled)
    doubts = [*seen.jumps(), *seen.stands(), *seen.repeats()]
    if len(seen.ends) < FEWEST:
        return doubts + seen.blind()
    way = seen.way(np.eye(3))
    before, seen.late_s = min((seen.apart(seen.rolled(late_s=late), way), late) for late in AGREE_S)
    if before > DISAGREE:
        seen.late_s = 0.0
        before = seen.apart(seen.rolled(), way)
    rolled = seen.rolled()
    likely, exact = seen.adjusted(rolled, way), seen.exchanged(rolled, way)
    if before < DISAGREE:
        # Small differences are reported only if one reading explains them all.
        likely, exact = likely if before > SLIGHT else [], []
        if not likely or min(likely)[0] > FITS * before:
            return doubts
    said = f"{APART}: {100 * before:.0f} % apart"
    every = sorted([*likely, *exact])
    best = every[0][0]
    if best > FITS * before:
        if stuck := seen.stuck():
            return [*doubts, f"{said}; {stuck} of the pose does not change"]
        return [*doubts, f"{said}; check the order and signs of the wheels, units, and the axes of the pose"]
    readings = [reading for apart, reading in every if apart < best + ALSO][:3]
    return [*doubts, f"{said}; {', or '.join(readings)}, then {100 * best:.0f} %"]


class _Seen:
    """Parts of a drive by wheels and by pose, and the readings of them that are tried."""

    def __init__(
        self, vehicle: Vehicle, measured_rad_s: Floats, period_s: float, pose: Floats, sampled: Integers
    ) -> None:
        self.vehicle, self.names, layout = vehicle, list(vehicle.wheel_names), vehicle.layout
        self.period_s, self.late_s = period_s, 0.0
        self.lever = float(np.mean([np.hypot(*wheel.position_m) for wheel in layout.wheels]))
        self.scaled = np.array([1.0, 1.0, self.lever])
        self.back = np.asarray(Kinematics(layout=layout).forward_matrix)
        pose, known = pose.copy(), np.asarray(np.isfinite(pose).all(axis=1))
        there = np.asarray(np.isfinite(measured_rad_s))
        pose[known, 2] = np.unwrap(pose[known, 2])
        # A row's pose is at the end of its period: wheel rotations from the next row on lead to the next pose.
        last, step = len(pose) - 2, max(1, round(STEP_S / period_s))
        rows = sampled[(sampled <= last) & known[np.minimum(sampled, last)]]
        self.rows = rows[np.unique(rows // step, return_index=True)[1]]
        self.nodes = np.unique(np.concatenate([np.arange(0, last + 1, step), self.rows]))
        turned = np.cumsum(np.where(there, measured_rad_s, 0.0), axis=0)[self.nodes + 1] * period_s
        self.turned = np.diff(turned, axis=0, prepend=turned[:1])
        self.poses, self.path = pose[self.rows], self._path(np.eye(len(self.names)))
        unknown = np.cumsum(~there.all(axis=1))[self.rows + 1]
        self.odometry = self.path[np.searchsorted(self.nodes, self.rows)]
        self.sigma = self._sigma()
        #: Samples at which parts begin and end, (P, 2).
        self.ends = self._parts()
        begin, end = self.ends.T
        self.ends = self.ends[unknown[begin] == unknown[end]]
        # Slow poses do not say by how much it turned from one to the next.
        self.far = np.abs(np.diff(self.odometry[:, 2], prepend=self.odometry[:1, 2]))
        blind = np.cumsum(self.far > BLIND)
        begin, end = self.ends.T
        self.unseen = self.ends[blind[begin] != blind[end]]
        self.ends = self.ends[blind[begin] == blind[end]]

    def _path(self, read: Floats) -> Floats:
        """Odometry at the nodes, for wheels whose readings are these combinations of the read columns."""
        twist = self.turned @ read.T @ self.back.T
        heading = np.cumsum(twist[:, 2])
        steps = (twist[:, 0] + 1j * twist[:, 1]) * np.exp(1j * (heading - 0.5 * twist[:, 2]))
        at = np.cumsum(steps)
        return np.column_stack([at.real, at.imag, heading])

    def _sigma(self) -> Floats:
        """Noise of the pose from its curvature between samples."""
        bends = np.diff(self.poses, n=2, axis=0)
        rolls = np.abs(np.diff(self.odometry * self.scaled, axis=0)).max(axis=1, initial=0.0)
        idle = np.maximum(rolls[1:], rolls[:-1]) < IDLE_M
        if idle.sum() >= FEWEST:
            return _noise(bends[idle])
        close = len(bends) > 0 and np.median(np.diff(self.rows)) * self.period_s < CLOSE_S
        return _noise(bends) if close else np.zeros(3)

    def _parts(self) -> Integers:
        """Cut between samples when either has moved far enough."""
        least = max(MOVES_M, NOISY * float(np.linalg.norm(self.sigma * self.scaled)))
        tracks = np.column_stack([self.odometry * self.scaled, self.poses * self.scaled]).tolist()
        rows, ends = self.rows.tolist(), [0]
        over = round(OVER_S / self.period_s)
        for at, (x, y, turn, u, v, heading) in enumerate(tracks):
            a, b, c, d, e, f = tracks[ends[-1]]
            moved = max(hypot(x - a, y - b, turn - c), hypot(u - d, v - e, heading - f))
            if rows[at] - rows[ends[-1]] >= over and moved > least:
                ends.append(at)
        return np.column_stack([ends[:-1], ends[1:]]).astype(np.int64).reshape(-1, 2)

    def _ways(self, begin: Floats, end: Floats) -> Floats:
        """Displacements between poses, forward and left at the mean of their headings; turns at the wheels [m]."""
        turn = end[:, 2] - begin[:, 2]
        way = (end[:, 0] - begin[:, 0] + 1j * (end[:, 1] - begin[:, 1])) * np.exp(-1j * (begin[:, 2] + 0.5 * turn))
        return np.column_stack([way.real, way.imag, self.lever * turn])

    def rolled(self, read: Floats | None = None, late_s: float | None = None) -> Floats:
        """Ways of the parts by the wheels, so read, so much before the pose's."""
        path = self.path if read is None else self._path(read)
        at = self.rows[self.ends.T] - (self.late_s if late_s is None else late_s) / self.period_s
        begin, end = (
            np.stack([np.interp(each, self.nodes, column, np.nan, np.nan) for column in path.T], axis=1) for each in at
        )
        return self._ways(begin, end)

    def way(self, axes: Floats, heading: float = 0.0) -> Floats:
        """Displacements of the parts by the pose, for these combinations of the read columns and a heading error."""
        poses = self.poses @ axes.T + [0.0, 0.0, heading]
        if abs(axes[2, 2]) > 1.0:
            # What was unwrapped in larger units was not.
            poses[:, 2] = np.unwrap(poses[:, 2])
        begin, end = (poses[each] for each in self.ends.T)
        return self._ways(begin, end)

    def apart(self, of: Floats, what: Floats, axes: Floats | None = None) -> float:
        """How far two kinds of ways are apart, as a part of the second, beyond noise of a pose with these axes."""
        there = np.isfinite(of).all(axis=1)
        if there.sum() < FEWEST:
            return np.inf
        sigma = self.sigma if axes is None else np.abs(axes) @ self.sigma
        noise = float(np.mean(2.0 * (sigma * self.scaled) ** 2))
        square, whole = max(float(np.mean((of - what)[there] ** 2)) - noise, 0.0), float(np.mean(what[there] ** 2))
        # Noise that is made so large fits everything.
        return float(np.sqrt(square / max(whole, 1e-300))) if axes is None or noise < 0.5 * whole else np.inf

    def blind(self) -> list[str]:
        """Report that poses are too far apart in heading to compare wheels with them."""
        if len(self.unseen) < FEWEST // 2:
            return []
        most = np.degrees(np.median(self.far[self.far > BLIND]))
        return [
            f"the wheels turn the vehicle by {most:.0f} degrees from one pose to the next, too far to compare them:"
            " check the wheels' unit, counts_per_turn and gear"
        ]

    def jumps(self) -> list[str]:
        """Report a pose that jumps now and then; the parts over jumps are left out."""
        if not len(self.ends):
            return []
        steps, rolled = (np.abs(np.diff(each, axis=0)) for each in (self.poses, self.odometry))
        moved, rolls = np.hypot(*steps[:, :2].T), np.hypot(*rolled[:, :2].T)
        noise = NOISY * self.sigma
        usual, usually = np.percentile(moved, 95), np.percentile(steps[:, 2], 95)
        jumps = moved > JUMPS[0] + noise[:2].max() + JUMPS_TIMES * np.maximum(rolls, usual)
        jumps |= steps[:, 2] > JUMPS[1] + noise[2] + JUMPS_TIMES * np.maximum(rolled[:, 2], usually)
        # Where a pose was repeated it goes on somewhere else, see `repeats`; there may be a row between.
        repeated = (np.diff(self.poses, axis=0) == 0.0).all(axis=1) & (rolls > 0.0)
        jumps &= ~(np.append([False], repeated[:-1]) | np.append([False, False], repeated[:-2])[: len(jumps)])
        count = int(jumps.sum())
        most = min(max(MOST_JUMPS, len(jumps) // 1000), int(np.count_nonzero(moved > 0.0)) // 10)
        if not 0 < count <= most:
            return []
        before = np.concatenate([[0], np.cumsum(jumps)])
        begin, end = self.ends.T
        self.ends = self.ends[before[begin] == before[end]]
        first = (self.rows[int(np.argmax(jumps)) + 1] + 1) * self.period_s
        by = f"{moved[jumps][0]:.2f} m and {np.degrees(steps[jumps][0, 2]):.0f} degrees"
        return [f"the pose jumps by {by} at {first:.2f} s{more_times(count)}: none is compared over it"]

    def stands(self) -> list[str]:
        """Report a pose that stands while wheels roll; those parts are left out."""
        if not len(self.ends):
            return []
        rolled, way = (np.linalg.norm(each, axis=1) for each in (self.rolled(), self.way(np.eye(3))))
        doubts, stood = [], np.zeros(len(way), dtype=bool)
        for first, after in spans(way < STANDS * rolled):
            # It may begin to stand within the first part, and end in the last one.
            begin, end = int(self.ends[first, 1]), int(self.ends[after - 1, 0])
            if after - first < STANDING or not _constant(self.poses[begin : end + 1]).all():
                continue
            stood[max(first - 1, 0) : after + 1] = True
            since, until = ((self.rows[each] + 1) * self.period_s for each in (begin, end))
            when = "" if stood.all() else f" from {since:.1f} to {until:.1f} s"
            doubts.append(f"the pose does not move{when} while the wheels do")
        self.ends = self.ends[~stood]
        return doubts[:1]

    def repeats(self) -> list[str]:
        """Report poses that are the last one again; these parts, and those next to them, are left out."""
        # A pose in coarse steps is also constant for a while.
        steps = np.abs(np.diff(self.poses * self.scaled, axis=0))
        coarse = float(
            np.min(steps, axis=0, initial=np.inf, where=steps > 0.0).max(initial=0.0, where=steps.any(axis=0))
        )
        lost = (self.way(np.eye(3)) == 0.0).all(axis=1)
        lost &= np.linalg.norm(self.rolled(), axis=1) > COARSE * coarse
        if not lost.any() or lost.all():
            return []
        times, same = spans(lost), (steps == 0.0).all(axis=1)
        begin, end = int(self.ends[times[0][0], 0]), int(self.ends[times[0][1] - 1, 1])
        while begin > 0 and same[begin - 1]:
            begin -= 1
        while end < len(same) and same[end]:
            end += 1
        since, until = ((self.rows[each] + 1) * self.period_s for each in (begin, end))
        for first, after in times:
            # It goes on somewhere else.
            lost[max(first - 1, 0) : after + 1] = True
        self.ends = self.ends[~lost]
        return [
            f"the pose is the same to the last digit from {since:.1f} to {until:.1f} s while the wheels"
            f" move{more_times(len(times))}: repeated there, or wheels slipped"
        ]

    def mounted_otherwise(self) -> Floats | None:
        """What readings of these wheels would be of wheels whose rollers are all turned to the other side."""
        angles = [wheel.roller_angle_rad for wheel in self.vehicle.layout.wheels]
        if not any(angles):
            return None
        turned = {f"wheel.{k}.roller_angle_rad": -angle for k, angle in enumerate(angles)}
        try:
            otherwise = Kinematics(layout=self.vehicle.replace(turned).layout)
        except ConfigError:
            return None  # such a vehicle cannot turn
        return np.asarray(Kinematics(layout=self.vehicle.layout).inverse_matrix @ otherwise.forward_matrix)

    def stuck(self) -> str:
        """Name the columns of the pose that do not change while the vehicle moves all about by its wheels."""
        constant = _constant(self.poses) & (np.ptp(self.odometry, axis=0) > ABOUT).all()
        return " and ".join(np.array(AXES)[constant])

    def adjusted(self, rolled: Floats, way: Floats) -> list[tuple[float, str]]:
        """What readings leave that may be wrong by a little: scale, heading, place of the marker, clock."""
        found: list[tuple[float, str]] = []
        for columns in (slice(0, 3), slice(2, 3)):
            square = float((rolled[:, columns] ** 2).sum())
            scale = float((rolled * way)[:, columns].sum()) / max(square, 1e-300)
            said = f"the vehicle moves {scale:.3g} times what the wheels say: counts a turn, gear, radius, units"
            found.append((self.apart(self.rolled(scale * np.eye(len(self.names))), way), said))
        found = [min(found)]
        turn = float(np.angle(((rolled[:, 0] - 1j * rolled[:, 1]) * (way[:, 0] + 1j * way[:, 1])).sum()))
        ahead = (rolled[:, 0] + 1j * rolled[:, 1]) * np.exp(1j * turn)
        # Displacements in the axes of a marker that is rotated to the left are rotated to the right.
        said = f"the pose's heading looks {np.degrees(-turn):.1f} degrees to the left of the vehicle's"
        found.append((self.apart(np.column_stack([ahead.real, ahead.imag, rolled[:, 2]]), way), said))
        # A marker off the vehicle's centre moves laterally as the vehicle turns.
        turns = 2.0 * np.sin(0.5 * way[:, 2] / self.lever)
        place = [float((off * turns).sum() / max((turns**2).sum(), 1e-300))
                 for off in (way[:, 1] - rolled[:, 1], rolled[:, 0] - way[:, 0])]  # fmt: skip
        moved = rolled + np.column_stack([-place[1] * turns, place[0] * turns, 0.0 * turns])
        said = f"the pose looks taken {place[0]:.2f} m ahead and {place[1]:.2f} m left of the vehicle's middle"
        found.append((self.apart(moved, way), said))
        for part in LATE_S:
            for late_s, said in ((part, "late"), (-part, "early")):
                found.append((self.apart(self.rolled(late_s=late_s), way), f"the pose looks {part:g} s {said}"))
        return found

    def exchanged(self, rolled: Floats, way: Floats) -> list[tuple[float, str]]:
        """What readings leave that are right or wrong: order and signs of the wheels, axes and units of the pose."""
        found: list[tuple[float, str]] = []
        wheels = np.eye(len(self.names))
        for order in orders(len(self.names)):
            said = f"the wheels look read as {', '.join(self.names[k] for k in order)}"
            found.append((self.apart(self.rolled(wheels[list(order)]), way), said))
        for count in (1, 2):
            for some in combinations(range(len(self.names)), count):
                signs = np.where(np.isin(np.arange(len(self.names)), some), -1.0, 1.0)
                said = f"wheel {' and '.join(self.names[k] for k in some)} look{'s' * (count == 1)} reversed"
                found.append((self.apart(self.rolled(np.diag(signs)), way), said))
        found.append((self.apart(self.rolled(-wheels), way), "all wheels look reversed"))
        if (mounted := self.mounted_otherwise()) is not None:
            said = 'the wheels\' rollers look mounted the other way round ("O" and "X" exchanged)'
            found.append((self.apart(self.rolled(mounted), way), said))
        for axes, heading, said in AXES_READ:
            words = said.format(of="of the pose", turn="the heading of the pose")
            found.append((self.apart(rolled, self.way(axes, heading), axes), words))
        return found


def _noise(bends: Floats) -> Floats:
    """Noise of readings of which these are second differences."""
    return np.asarray(np.median(np.abs(bends), axis=0) / 0.6745 / 6**0.5) if len(bends) else np.zeros(bends.shape[1])


def _constant(poses: Floats) -> Flags:
    """Columns that vary only as noise does, whose change from sample to sample is as large as its spread."""
    return np.asarray(np.ptp(poses, axis=0) < NOISY * _noise(np.diff(poses, n=2, axis=0)) + 1e-3)
