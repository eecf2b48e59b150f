"""Plausibility checks of a log of wheels: signs, order, units; a finding is one line, and no log is rejected for it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Kinematics, Vehicle
from omnistep._wheel_logs import CLOSEST_S, FARTHEST_S

Floats = NDArray[np.float64]

#: Rolling wheels agree within this fraction of their rotation; a wheel with the wrong sign is far beyond it.
DISAGREE = 0.2
#: Two rates measure the same motion if they correlate this well.
ALIKE = 0.7
#: Signals with a smaller average are not evaluated [rad/s, m/s].
STILL = 0.02
#: Wheels are compared by their rotation in this time [s], so that single counts are negligible.
OVER_S = 0.2
#: Signals of motors, and the fraction of their rows that may exceed the motors' limits.
MOTOR, BEYOND = ("wheels", "references", "torques", "commanded_torques"), 0.05
#: A step of a counter this many times the usual ones is a jump; up to so many, or one in a thousand, are single ones.
JUMP, MOST_JUMPS = 20.0, 10
#: A counter that goes round goes on within so many usual steps of those beside.
ROUND = 4.0
#: A reading fits if it leaves this fraction of the difference.
FITS = 0.4
#: Axes of a pose or a command as combinations of the read columns, and the error of its heading [rad].
AXES_READ = (
    (np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]]), 0.0, "x and y {of} look exchanged"),
    (np.diag([-1.0, 1, 1]), 0.0, "x {of} looks reversed"),
    (np.diag([1.0, -1, 1]), 0.0, "y {of} looks reversed"),
    (np.diag([1.0, 1, -1]), 0.0, "{turn} looks reversed: a turn to the left is positive"),
    (np.diag([1.0, 1, -1]), 0.5 * np.pi, "{turn} looks like a compass's: clockwise, and 0 along y"),
    (np.diag([1.0, -1, -1]), 0.0, "y {of} and {turn} look reversed: to the right, and clockwise"),
    (np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]), 0.0, "x and y {of} look exchanged and {turn} reversed"),
    (np.diag([1.0, 1, np.pi / 180]), 0.0, "{turn} looks like degrees"),
    (np.diag([1.0, 1, 180 / np.pi]), 0.0, "{turn} looks like radians that are read as degrees"),
    (np.diag([1e-3, 1e-3, 1]), 0.0, "x and y {of} look like millimetres"),
    (np.diag([1e-3, 1e-3, np.pi / 180]), 0.0, "x and y {of} look like millimetres, {turn} like degrees"),
    (np.diag([1e-2, 1e-2, 1]), 0.0, "x and y {of} look like centimetres"),
    (np.diag([0.0254, 0.0254, 1]), 0.0, "x and y {of} look like inches"),
    (np.diag([0.3048, 0.3048, 1]), 0.0, "x and y {of} look like feet"),
)


def more_times(count: int) -> str:
    """What is said of all but the first of something that happens so many times."""
    return f", and {count - 1} times more" if count > 1 else ""


def of_wheels(vehicle: Vehicle, measured_rad_s: Floats, period_s: float) -> list[str]:
    """Report wheels, (T, N) every period, whose velocities fit no motion of this vehicle."""
    return of_parts(vehicle, means(measured_rad_s, period_s, OVER_S))


def of_parts(vehicle: Vehicle, turned: Floats) -> list[str]:
    """Report the same for rotations of wheels, (P, N), in parts that far exceed one count; rates or angles."""
    known = turned[np.isfinite(turned).all(axis=1)]
    if not known.size or np.sqrt(np.mean(known**2)) < STILL:
        return []
    part = unexplained(Kinematics(layout=vehicle.layout), known)
    if part < DISAGREE:
        return []
    return [
        f"{100 * part:.0f} % of the wheels' rotation fits no motion of this vehicle: a counter is reversed, the order"
        " of the wheels is wrong, or the vehicle file is wrong"
    ]


def means(columns: Floats, period_s: float, over_s: float) -> Floats:
    """Means of columns over parts of the time, NaN if one is unknown."""
    rows = max(1, round(over_s / period_s))
    whole = len(columns) // rows
    return np.asarray(columns[: whole * rows].reshape(whole, rows, columns.shape[1]).mean(axis=1))


def unexplained(kinematics: Kinematics, turned: Floats) -> float:
    """Fraction of wheel rotations, (P, N), that no motion of the vehicle explains; 0 for three wheels."""
    if turned.shape[1] <= 3:
        return 0.0
    left = np.asarray(kinematics.residual(turned))
    return float(np.sqrt(np.mean(left**2) / max(float(np.mean(turned**2)), 1e-300)))


def orders(wheels: int) -> list[tuple[int, ...]]:
    """Other orders of wheels, the simplest first: of up to four every order, of more two exchanged."""
    same = tuple(range(wheels))
    found = [tuple(b if k == a else a if k == b else k for k in same) for a, b in combinations(same, 2)]
    if wheels <= 4:
        every = sorted(permutations(same), key=lambda order: sum(order[order[k]] != k for k in same))
        found += [order for order in every[1:] if order not in found]
    return found


def of_motors(signals: Iterable[tuple[str, str, int, int]], no_load_rad_s: float) -> list[str]:
    """Report signals, by table and name, in which too many of the known rows exceed the motors' limits."""
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

    ``most_per_s`` is the motor's highest speed in counts per second; infinite if unknown.
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
    # A counter that goes round goes on as fast as before, and never is as far as 2^bits from where it was.
    beside = np.array([np.median(steps[max(k - 3, 0) : k + 4]) for k in jumps])
    round_ = np.abs(np.abs(steps[jumps] - beside) - 2.0**bits) <= ROUND * usual + 2.0
    again = "once" if len(jumps) == 1 else f"and {len(jumps) - 1} times more"
    said = f"{name} jumps by {steps[first]:.0f} counts at {time_s[first + 1]:.3f} s, {again}"
    if bits >= 7 and round_.mean() > 0.9 and np.ptp(counts) < 2.0**bits:
        return [f"{said}: a counter of {bits} bits goes round, wrap_bits = {bits}"]
    if len(jumps) <= max(MOST_JUMPS, len(steps) // 1000):
        return [f"{said}: the counter began again; import the log in pieces"]
    return []


def of_steps(median_s: float) -> list[str]:
    """Report rows whose spacing is implausible for a robot."""
    if CLOSEST_S <= median_s <= FARTHEST_S:
        return []
    return [f"samples are {median_s:.3g} s apart: check the unit of time"]
