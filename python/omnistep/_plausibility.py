"""Plausibility checks of a log of wheels: signs, order, units; a finding is one line, and no log is refused for it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Kinematics, Vehicle
from omnistep._wheel_logs import CLOSEST_S, FARTHEST_S

Floats = NDArray[np.float64]

#: Wheels that roll agree but for this part of what they turn; one that turns the other way is far beyond it.
DISAGREE = 0.2
#: Two rates are of the same thing where they correlate so.
ALIKE = 0.7
#: A rate this many times another one is in other units: degrees are 57.3 times radians.
OTHER_UNIT = 5.0
#: What turns less than this on the average says nothing [rad/s, m/s].
STILL = 0.02
#: Wheels are compared by what they turn in this time [s]: a count more or less is then none to speak of.
OVER_S = 0.2
#: Signals of motors, and the part of their rows that may be beyond what motors can do.
MOTOR, BEYOND = ("wheels", "references", "torques", "commanded_torques"), 0.05
#: A step of a counter this many times the usual ones is a jump; up to so many, or one in a thousand, are single ones.
JUMP, MOST_JUMPS = 20.0, 10
#: Wheels and a measured pose are compared by what they move in this time [s], where it is as much as this [m].
POSE_OVER_S, MOVES_M = 0.5, 0.05
#: A reading fits that leaves so much of what is apart; others within so much of it are as likely. What is apart by less
#: than `DISAGREE` but more than this is said only where a reading fits.
FITS, ALSO, SLIGHT = 0.4, 0.01, 0.04
#: A pose that moves by less than this part of what the wheels move the vehicle is none of it.
STAYS = 1e-4


def of_wheels(vehicle: Vehicle, measured_rad_s: Floats, period_s: float) -> list[str]:
    """Report wheels, (T, N) every period, whose velocities fit no motion of this vehicle."""
    rows = max(1, round(OVER_S / period_s))
    whole = len(measured_rad_s) // rows
    parts = measured_rad_s[: whole * rows].reshape(whole, rows, measured_rad_s.shape[1]).mean(axis=1)
    return of_parts(vehicle, parts)


def of_parts(vehicle: Vehicle, turned: Floats) -> list[str]:
    """Report the same for rotations of wheels, (P, N), in parts of a drive long against one count; rates or angles."""
    known = turned[np.isfinite(turned).all(axis=1)]
    size = float(np.sqrt(np.mean(known**2))) if known.size else 0.0
    if known.shape[1] <= 3 or size < STILL:
        return []
    left = np.asarray(Kinematics(layout=vehicle.layout).residual(known))
    part = float(np.sqrt(np.mean(left**2))) / size
    if part < DISAGREE:
        return []
    return [
        f"{100 * part:.0f} % of the wheels' rotation fits no motion of this vehicle: a counter is reversed, the order"
        " of the wheels is wrong, or the vehicle file is wrong"
    ]


def of_yaw(turning_rad_s: Floats, gyro_rad_s: Floats) -> list[str]:
    """Report a gyro that contradicts the wheels' yaw rate, both (T,)."""
    slope = _slope(turning_rad_s, gyro_rad_s)
    if slope is None or 1.0 / OTHER_UNIT < slope < OTHER_UNIT:
        return []
    if slope < 0.0:
        return ["the gyro has the opposite sign of the wheels: counter-clockwise must be positive"]
    return [
        f"the gyro reads {slope:.3g} times the yaw rate from the wheels: rad/s and deg/s differ by a factor of 57.3"
    ]


def of_pose(vehicle: Vehicle, measured_rad_s: Floats, period_s: float, pose: Floats, pose_hz: float) -> list[str]:
    """Report wheels, (T, N), that move the vehicle otherwise than a measured pose, (T, 3), and which reading would fit.

    Both are compared as ways over parts of a second in which something moves, less what the noise of the pose makes.
    """
    pose = pose.copy()
    there = np.isfinite(pose[:, 2])
    pose[there, 2] = np.unwrap(pose[there, 2])
    rows = max(1, round(max(POSE_OVER_S, 2.0 / pose_hz if pose_hz > 0.0 else 0.0) / period_s))
    seen = _Seen(vehicle, measured_rad_s, rows, period_s, pose)
    rolled, way = seen.rolled(np.eye(len(vehicle.wheel_names))), seen.way(np.eye(3))
    if len(way) < 10:
        return []
    if np.mean(way**2) < STAYS**2 * np.mean(rolled**2):
        return ["the pose stays where it is while the wheels move the vehicle"]
    before = seen.apart(rolled, way)
    likely, exact = seen.readings()
    if before < DISAGREE:
        # Little ones are said only where one reading explains them all.
        likely, exact = likely if before > SLIGHT else [], []
        if not likely or min(likely)[0] > FITS * before:
            return []
    said = f"the wheels move the vehicle otherwise than the pose: {100 * before:.0f} % apart"
    every = sorted([*likely, *exact])
    best = every[0][0]
    if best > FITS * before:
        return [f"{said}; check the order and signs of the wheels, units, and the axes of the pose"]
    readings = [reading for apart, reading in every if apart < best + ALSO][:3]
    return [f"{said}; {', or '.join(readings)}, then {100 * best:.0f} %"]


class _Seen:
    """Parts of a drive by wheels and by pose, and the readings of them that are tried."""

    def __init__(self, vehicle: Vehicle, measured_rad_s: Floats, rows: int, period_s: float, pose: Floats) -> None:
        self.names, self.rows, self.period_s, self.pose = list(vehicle.wheel_names), rows, period_s, pose
        layout = vehicle.layout
        lever = float(np.mean([np.hypot(*wheel.position_m) for wheel in layout.wheels]))
        self.lever, self.scaled = lever, np.array([1.0, 1.0, lever])
        self.back = np.asarray(Kinematics(layout=layout).forward_matrix)
        # A row's pose is at the end of its period: what wheels turn from the next row on leads to the next pose.
        starts = np.arange(0, len(pose) - rows, rows)
        turned = [measured_rad_s[at + 1 : at + 1 + rows].sum(axis=0) * period_s for at in starts]
        self.starts, self.turned = starts, np.array(turned).reshape(len(starts), len(self.names))
        with np.errstate(invalid="ignore"):
            twist, way = self.turned @ self.back.T * self.scaled, self.way(np.eye(3))
            moves = np.maximum(np.linalg.norm(twist, axis=1), np.linalg.norm(way, axis=1)) > MOVES_M
            kept = np.isfinite(twist).all(axis=1) & np.isfinite(way).all(axis=1) & moves
            # Where it turns far in a part, slow poses do not say by how much.
            kept &= np.abs(twist[:, 2]) < 0.5 * np.pi * lever
        self.starts, self.turned = starts[kept], self.turned[kept]
        # Noise of a pose by how much it bends from row to row: of both ends of a part.
        bends = np.diff(pose, n=2, axis=0)
        sigma = [np.median(np.abs(each[np.isfinite(each)])) / 0.6745 / 6**0.5 if np.isfinite(each).any() else 0.0
                 for each in bends.T]  # fmt: skip
        self.sigma = np.array(sigma)

    def rolled(self, read: Floats) -> Floats:
        """Ways by the wheels, whose readings are these combinations of what was read; turns at the wheels [m]."""
        return np.asarray(self.turned @ read.T @ self.back.T * self.scaled)

    def way(self, axes: Floats, later: int = 0) -> Floats:
        """Ways by the pose, whose axes are these combinations of what was read, so many rows later."""
        last = len(self.pose) - 1
        begin, end = (self.pose[np.clip(self.starts + k + later, 0, last)] @ axes.T for k in (0, self.rows))
        turn = end[:, 2] - begin[:, 2]
        way = (end[:, 0] - begin[:, 0]) + 1j * (end[:, 1] - begin[:, 1])
        way = way * np.exp(-1j * (begin[:, 2] + 0.5 * turn)) / np.sinc(0.5 * np.clip(turn, -np.pi, np.pi) / np.pi)
        return np.column_stack([way.real, way.imag, self.lever * turn])

    def apart(self, of: Floats, what: Floats, axes: Floats | None = None) -> float:
        """How far ways are apart from those by the pose, whose axes may be read otherwise: as a part, beyond noise."""
        there = np.isfinite(what).all(axis=1)
        if there.sum() < 10:
            return np.inf
        sigma = self.sigma if axes is None else np.abs(axes) @ self.sigma
        noise = float(np.mean(2.0 * (sigma * self.scaled) ** 2))
        square = max(float(np.mean((of - what)[there] ** 2)) - noise, 0.0)
        return float(np.sqrt(square / max(float(np.mean(what[there] ** 2)), 1e-300)))

    def readings(self) -> tuple[list[tuple[float, str]], list[tuple[float, str]]]:
        """What other readings leave: those that may be wrong by a little, and those that are or are not."""
        rolled, way, wheels = self.rolled(np.eye(len(self.names))), self.way(np.eye(3)), np.eye(len(self.names))
        found: list[tuple[float, str]] = []
        scale = float((rolled * way).sum() / max((rolled**2).sum(), 1e-300))
        said = f"the vehicle moves {scale:.3g} times what the wheels say: counts a turn, gear, radius, units"
        found.append((self.apart(scale * rolled, way), said))
        turn = float(np.angle(((rolled[:, 0] - 1j * rolled[:, 1]) * (way[:, 0] + 1j * way[:, 1])).sum()))
        ahead = (rolled[:, 0] + 1j * rolled[:, 1]) * np.exp(1j * turn)
        said = f"the pose's heading looks {np.degrees(turn):.1f} degrees off the vehicle's"
        found.append((self.apart(np.column_stack([ahead.real, ahead.imag, rolled[:, 2]]), way), said))
        # A marker beside the vehicle's middle moves aside as it turns.
        turns = way[:, 2] / self.lever
        place = [float((off * turns).sum() / max((turns**2).sum(), 1e-300))
                 for off in (way[:, 1] - rolled[:, 1], rolled[:, 0] - way[:, 0])]  # fmt: skip
        moved = rolled + np.column_stack([-place[1] * turns, place[0] * turns, 0.0 * turns])
        said = f"the pose looks taken {place[0]:.2f} m ahead and {place[1]:.2f} m left of the vehicle's middle"
        found.append((self.apart(moved, way), said))
        for part in (0.1, 0.2, 0.3, 0.5, 1.0):
            for later in {round(sign * part / self.period_s) for sign in (1, -1)} - {0}:
                said = f"the pose looks {abs(part):g} s {'late' if later > 0 else 'early'}"
                found.append((self.apart(rolled, self.way(np.eye(3), later)), said))
        exact: list[tuple[float, str]] = []
        for order in _orders(len(self.names)):
            said = f"the wheels look read as {', '.join(self.names[k] for k in order)}"
            exact.append((self.apart(self.rolled(wheels[order]), way), said))
        for count in (1, 2):
            for some in combinations(range(len(self.names)), count):
                signs = np.where(np.isin(np.arange(len(self.names)), some), -1.0, 1.0)
                said = f"wheel {' and '.join(self.names[k] for k in some)} look{'s' * (count == 1)} reversed"
                exact.append((self.apart(self.rolled(np.diag(signs)), way), said))
        exact.append((self.apart(-rolled, way), "all wheels look reversed"))
        for axes, said in AXES_READ:
            exact.append((self.apart(rolled, self.way(axes), axes), said))
        return found, exact


#: Axes of a pose as combinations of what was read.
AXES_READ = (
    (np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]]), "x and y of the pose look exchanged"),
    (np.diag([-1.0, 1, 1]), "x of the pose looks reversed"),
    (np.diag([1.0, -1, 1]), "y of the pose looks reversed"),
    (np.diag([1.0, 1, -1]), "the heading of the pose looks reversed: a turn to the left is positive"),
    (np.diag([1.0, 1, np.pi / 180]), "the heading of the pose looks like degrees"),
    (np.diag([1.0, 1, 180 / np.pi]), "the heading of the pose looks converted from degrees twice"),
    (np.diag([1e-3, 1e-3, 1]), "x and y of the pose look like millimetres"),
    (np.diag([1e-3, 1e-3, np.pi / 180]), "x and y of the pose look like millimetres and its heading like degrees"),
)


def _orders(wheels: int) -> list[list[int]]:
    """Other orders of wheels: of up to four all, of more those of two exchanged."""
    if wheels <= 4:
        return [list(order) for order in permutations(range(wheels))][1:]
    pairs = combinations(range(wheels), 2)
    return [[b if k == a else a if k == b else k for k in range(wheels)] for a, b in pairs]


def of_motors(signals: Iterable[tuple[str, str, int, int]], no_load_rad_s: float) -> list[str]:
    """Report signals, by table and name, of which too many of the known rows are beyond what motors can do."""
    beyond: dict[str, list[str]] = {}
    for table, name, rows, known in signals:
        if table in MOTOR and rows > BEYOND * known:
            beyond.setdefault(table, []).append(f"{name} ({100 * rows / known:.0f} % of its rows)")
    rates = (
        f"faster than the motors without load, {no_load_rad_s:.3g} rad/s: check the unit (read as rad/s, rad/min is 60"
        " times too much and rpm 9.55 times), counts_per_turn, and at which side of the gear it is read"
    )
    torques = "more than the motors can give: check the unit, and the motor of the vehicle file"
    return [
        f"{table}: {', '.join(names)}: {rates if table in ('wheels', 'references') else torques}"
        for table, names in beyond.items()
    ]


def of_counter(name: str, time_s: Floats, counts: Floats, most_per_s: float) -> list[str]:
    """Report steps of a counter that no motor makes: it began again, went round, or was not read.

    ``most_per_s`` is what the motor can turn in counts a second; infinite where that is unknown.
    """
    steps, times = np.diff(counts), np.diff(time_s)
    turns = np.abs(steps[steps != 0.0])
    usual = float(np.median(turns)) if len(turns) else 0.0
    most = np.where(np.isfinite(most_per_s), 1.5 * most_per_s * times, JUMP * usual) + 2.0
    jumps = np.flatnonzero(np.abs(steps) > most)
    if not len(jumps):
        return []
    # There and back in the next row: one reading that is none.
    there = jumps[:-1][(np.diff(jumps) == 1) & (np.abs(steps[jumps[:-1]] + steps[jumps[1:]]) <= 2.0 * most[jumps[:-1]])]
    if 2 * len(there) >= 0.8 * len(jumps):
        read = counts[there[0] + 1]
        return [
            f"{name} reads {read:.0f} in {len(there)} rows, the first at {time_s[there[0] + 1]:.3f} s: leave them out"
        ]
    size, first = float(np.median(np.abs(steps[jumps]))), int(jumps[0])
    bits = round(float(np.log2(size + usual)))
    round_ = np.abs(np.abs(steps[jumps]) - 2.0**bits) <= most[jumps] + usual
    again = "once" if len(jumps) == 1 else f"and {len(jumps) - 1} times more"
    said = f"{name} jumps by {steps[first]:.0f} counts at {time_s[first + 1]:.3f} s, {again}"
    if bits >= 7 and round_.mean() > 0.9:
        return [f"{said}: a counter of {bits} bits goes round, wrap_bits = {bits}"]
    if len(jumps) <= max(MOST_JUMPS, len(steps) // 1000):
        return [f"{said}: the counter began again; import the log in pieces"]
    return []


def of_steps(median_s: float) -> list[str]:
    """Report rows that are closer or farther apart than those of a robot."""
    if CLOSEST_S <= median_s <= FARTHEST_S:
        return []
    return [f"samples are {median_s:.3g} s apart: check the unit of time"]


def _slope(of: Floats, what: Floats) -> float | None:
    """Ratio of the second to the first, where they are correlated."""
    known = np.isfinite(of) & np.isfinite(what)
    if known.sum() < 10:
        return None
    x, y = of[known] - np.mean(of[known]), what[known] - np.mean(what[known])
    sizes = np.sqrt(np.mean(x**2)), np.sqrt(np.mean(y**2))
    if sizes[0] < STILL or sizes[1] == 0.0 or abs(np.mean(x * y)) < ALIKE * sizes[0] * sizes[1]:
        return None
    return float(np.mean(x * y) / np.mean(x**2))
