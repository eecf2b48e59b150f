"""Plausibility checks of a log of wheels: signs, order, units. A finding is one line, and no log is refused for it."""

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
#: And surely here.
SURELY = 0.9
#: A rate this many times another one is in other units: degrees are 57.3 times radians.
OTHER_UNIT = 5.0
#: What turns less than this on the average says nothing [rad/s, m/s].
STILL = 0.02
#: Wheels are compared by what they turn in this time [s]: a count more or less is then none to speak of.
OVER_S = 0.2
#: Signals of motors, and the part of their rows that may be beyond what motors can do.
MOTOR, BEYOND = ("wheels", "references", "torques", "commanded_torques", "duty"), 0.05
#: A step of a counter this many times the usual ones is a jump; up to so many, or one in a thousand, are single ones.
JUMP, MOST_JUMPS = 20.0, 10
#: Wheels and a measured pose are compared by what they move in this time [s]; a reading fits that leaves so much of it.
POSE_OVER_S, FITS = 0.5, 0.4
#: A wheel that turns, or is told to, by less than this part of the fastest one says nothing of the others.
SLOW = 0.1


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


def of_command(vehicle: Vehicle, measured_rad_s: Floats, asked: Floats) -> list[str]:
    """Report wheels, (T, N), whose velocities contradict the commanded twists, (T, 3)."""
    known = np.isfinite(measured_rad_s).all(axis=1) & np.isfinite(asked).all(axis=1)
    if known.sum() < 10:
        return []
    told = np.asarray(Kinematics(layout=vehicle.layout).inverse(asked[known]))
    turned = measured_rad_s[known]
    with np.errstate(invalid="ignore", divide="ignore"):
        alike = np.nan_to_num(np.corrcoef(turned.T, told.T)[: turned.shape[1], turned.shape[1] :])
    names = vehicle.wheel_names
    sizes = [np.sqrt(np.mean(each**2, axis=0)) for each in (turned, told)]
    heard = np.logical_and(*(size > max(SLOW * float(size.max()), STILL) for size in sizes))
    alike[~heard] = 0.0
    alike[:, sizes[1] <= SLOW * float(sizes[1].max())] = 0.0
    own, best = np.diag(alike), np.abs(alike).argmax(axis=1)
    other = [name for name, part in zip(names, own, strict=True) if part < -ALIKE]
    if len(other) == int(heard.sum()) > 1:
        return ["all wheels turn opposite to the command: x must be forward, y left, and a turn to the left positive"]
    doubts = [f"wheel {name} turns opposite to the command" for name in other]
    return doubts + [
        f"wheel {name} follows the command for wheel {names[of]}: check that the order is that of the file"
        for name, of, part, most in zip(names, best, own, np.abs(alike).max(axis=1), strict=True)
        if abs(part) < ALIKE and most > SURELY
    ]


def of_pose(vehicle: Vehicle, measured_rad_s: Floats, period_s: float, pose: Floats) -> list[str]:
    """Report wheels, (T, N), that move the vehicle otherwise than a measured pose, (T, 3), and which reading would fit.

    Both are compared as twists over parts of a second. Readings that are tried: another order of the wheels, one wheel
    the other way, axes of the pose exchanged or the other way, a heading in degrees, another scale, a frame that is
    turned.
    """
    rows, pose = max(1, round(POSE_OVER_S / period_s)), pose.copy()
    there = np.isfinite(pose[:, 2])
    pose[there, 2] = np.unwrap(pose[there, 2])
    ends = np.arange(0, len(pose) - rows, rows)
    over_s = rows * period_s
    # A row's pose is at the end of its period: what the wheels turn from the next row on leads to the next pose.
    turned = (
        np.stack([measured_rad_s[at + 1 : at + 1 + rows].mean(axis=0) for at in ends])
        if len(ends)
        else np.zeros((0, 0))
    )
    known = np.isfinite(turned).all(axis=1) & np.isfinite(pose[ends]).all(axis=1)
    known &= np.isfinite(pose[ends + rows]).all(axis=1)
    if known.sum() < 10:
        return []
    turned, first, last = turned[known], pose[ends][known], pose[ends + rows][known]
    back = np.asarray(Kinematics(layout=vehicle.layout).forward_matrix)
    lever = float(np.mean([np.hypot(*wheel.position_m) for wheel in vehicle.layout.wheels]))

    def twists(axes: Floats) -> Floats:
        """Of poses whose x, y, yaw are these parts of those that were read, with turns as metres at the wheels."""
        begin, end = first @ axes.T, last @ axes.T
        turn = end[:, 2] - begin[:, 2]
        way = (end[:, 0] - begin[:, 0]) + 1j * (end[:, 1] - begin[:, 1])
        way = way * np.exp(-1j * (begin[:, 2] + 0.5 * turn)) / np.sinc(0.5 * turn / np.pi)
        return np.column_stack([way.real, way.imag, lever * turn]) / over_s

    def apart(of: Floats, what: Floats) -> float:
        return float(np.sqrt(np.mean((of - what) ** 2) / max(float(np.mean(what**2)), 1e-300)))

    seen = twists(np.eye(3))
    if np.sqrt(np.mean(seen**2)) < STILL:
        return []
    scaled = np.array([1.0, 1.0, lever])
    rolled = turned @ back.T * scaled
    before = apart(rolled, seen)
    if before < DISAGREE:
        return []
    names, found = list(vehicle.wheel_names), []
    for order in _orders(len(names)):
        moved = [names[k] for k in order]
        found.append((apart(turned[:, order] @ back.T * scaled, seen), f"the wheels look read as {', '.join(moved)}"))
    for k, name in enumerate(names):
        signs = np.where(np.arange(len(names)) == k, -1.0, 1.0)
        found.append((apart(turned * signs @ back.T * scaled, seen), f"wheel {name} looks reversed"))
    found.append((apart(-rolled, seen), "all wheels look reversed"))
    for axes, reading in (
        (np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]]), "x and y of the pose look exchanged"),
        (np.diag([-1.0, 1, 1]), "x of the pose looks reversed"),
        (np.diag([1.0, -1, 1]), "y of the pose looks reversed"),
        (np.diag([1.0, 1, -1]), "the heading of the pose looks reversed: a turn to the left is positive"),
        (np.diag([1.0, 1, np.pi / 180]), "the heading of the pose looks like degrees"),
        (np.diag([1.0, 1, 180 / np.pi]), "the heading of the pose looks converted from degrees twice"),
    ):
        there = twists(axes)
        found.append((apart(rolled, there), reading))
    scale = float((rolled * seen).sum() / (rolled**2).sum())
    found.append(
        (
            apart(scale * rolled, seen),
            f"the vehicle moves {scale:.3g} times what the wheels say: counts a turn, gear, radius",
        )
    )
    turn = float(np.angle(((rolled[:, 0] - 1j * rolled[:, 1]) * (seen[:, 0] + 1j * seen[:, 1])).sum()))
    ahead = (rolled[:, 0] + 1j * rolled[:, 1]) * np.exp(1j * turn)
    turned_frame = np.column_stack([ahead.real, ahead.imag, rolled[:, 2]])
    found.append(
        (apart(turned_frame, seen), f"the pose's heading looks {np.degrees(turn):.0f} degrees off the vehicle's")
    )
    best, reading = min(found, key=lambda each: each[0])
    said = f"the wheels move the vehicle otherwise than the pose: {100 * before:.0f} % apart"
    if best < FITS * before:
        return [f"{said}; {reading}, then {100 * best:.0f} %"]
    return [f"{said}; check the order and signs of the wheels, units, and the axes of the pose"]


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


def of_counter(name: str, time_s: Floats, counts: Floats) -> list[str]:
    """Report single steps of a counter that no wheel makes: it began again, or went round."""
    steps = np.diff(counts)
    usual = float(np.quantile(np.abs(steps), 0.9)) if len(steps) >= MOST_JUMPS * 10 else np.inf
    jumps = np.flatnonzero(np.abs(steps) > JUMP * max(usual, 1.0))
    if not 0 < len(jumps) <= max(MOST_JUMPS, len(steps) // 1000):
        return []
    first = jumps[0]
    size = float(steps[first])
    times = "once" if len(jumps) == 1 else f"and {len(jumps) - 1} times more"
    said = f"{name} jumps by {size:.0f} counts at {time_s[first + 1]:.3f} s, {times}"
    bits = round(float(np.log2(abs(size) + usual)))
    if abs(abs(size) - 2.0**bits) <= 3 * usual + 1 and bits >= 8:
        return [f"{said}: a counter of {bits} bits goes round, wrap_bits = {bits}"]
    return [f"{said}: the counter began again; import the log in pieces"]


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
