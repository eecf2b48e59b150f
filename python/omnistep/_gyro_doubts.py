"""Plausibility checks of a gyro against the yaw rate from wheels: sign, factor, clock, agreement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from omnistep._followed import (
    ALSO,
    GAIN,
    MOST,
    OVER_S,
    SURELY,
    Reading,
    Tried,
    most_alike,
    parts,
    readings,
    together,
    with_clocks,
)
from omnistep._omnistep import Kinematics, Vehicle
from omnistep._plausibility import ALIKE, DISAGREE, STILL, unexplained

Floats = NDArray[np.float64]

#: A gyro is absolute: wheels that turn the vehicle by another factor than these are doubted.
LEAST, MOST_TIMES = 0.7, 1.4
#: A vehicle turns enough to say that a gyro does not follow: so fast [rad/s], and wheels so much for it.
TURNS, TURNS_PART = 0.04, 0.25
#: A gyro turns while wheels stand beyond this [rad/s].
TURNED = 0.1
#: Wheels and gyro share a clock if one lags by this many parts.
SAME = range(-2, 3)


def of_yaw(turning_rad_s: Floats, gyro_rad_s: Floats, period_s: float) -> list[str]:
    """Report a gyro that contradicts the wheels' yaw rate, both (T,): its clock, its sign, its factor."""
    return _Yaw(turning_rad_s, gyro_rad_s, period_s).doubts()


def of_gyro(vehicle: Vehicle, measured_rad_s: Floats, gyro_rad_s: Floats, period_s: float) -> list[str]:
    """Report wheels, (T, N) every period, that turn the vehicle otherwise than a gyro reads, (T,)."""
    kinematics = Kinematics(layout=vehicle.layout)
    back = np.asarray(kinematics.forward_matrix)
    yaw = _Yaw(measured_rad_s @ back[2], gyro_rad_s, period_s)
    turned, seen, _ = together(parts(measured_rad_s, period_s), yaw.gyro, -yaw.late)
    if len(seen) < 10:
        return []
    size = float(np.sqrt(np.mean(turned**2)))
    if size < STILL:
        return ["the wheels stand while the gyro turns"] if np.std(seen) > TURNED else []
    doubts = yaw.doubts()
    likely = [] if yaw.alike > ALIKE else _turning(vehicle, turned, seen[:, 0])
    if likely:
        said = doubts.pop() if yaw.alike < -ALIKE else "the wheels do not turn the vehicle as the gyro reads: "
        return [*doubts, f"{said}{', or ' if said[-1] != ' ' else ''}{', or '.join(likely)}"]
    by_turn = np.std(turned @ back[2]) * np.sqrt(np.mean(np.asarray(kinematics.inverse_matrix)[:, 2] ** 2))
    if abs(yaw.alike) > ALIKE or np.std(turned @ back[2]) < TURNS or by_turn < TURNS_PART * size:
        return doubts
    angle = float(np.corrcoef(turned @ back[2], np.gradient(seen[:, 0]))[0, 1]) if np.std(seen) > 0.0 else 0.0
    what = f"they correlate by {yaw.alike:.2f}: another axis, an angle, or wheels that do not turn what they read"
    if np.ptp(seen) == 0.0 or abs(angle) > SURELY:
        what = "it is constant" if np.ptp(seen) == 0.0 else "it looks like an angle"
    return [*doubts, f"the gyro does not follow the yaw rate from the wheels: {what}"]


class _Yaw:
    """A yaw rate from wheels beside a gyro's, with the clocks with which they are most alike."""

    def __init__(self, turning_rad_s: Floats, gyro_rad_s: Floats, period_s: float) -> None:
        wheels, self.gyro = (parts(each[:, None], period_s) for each in (turning_rad_s, gyro_rad_s))
        found: list[Tried] = []
        for late, of, what in with_clocks(self.gyro, wheels, np.array([True])):
            of, what = (each[:, 0] - (np.mean(each) if len(each) else 0.0) for each in (of, what))
            sizes = float(np.sqrt(np.sum(of**2) * np.sum(what**2)))
            alike = float((of * what).sum()) / sizes if len(of) >= 10 and sizes > 0.0 else 0.0
            found.append(Tried(alike, late, (of, what)))
        (self.alike, self.late, (self.of, self.what)), self.differ = most_alike(found, SAME)

    def doubts(self) -> list[str]:
        """Report clock, sign and factor, if both measure the same motion."""
        if abs(self.alike) < ALIKE or max(np.std(self.of), np.std(self.what)) < STILL:
            return []
        doubts = []
        if self.differ:
            late = f"{abs(self.late) * OVER_S:g} s {'late' if self.late > 0 else 'early'}"
            doubts.append(f"the gyro looks {late}: its clock differs from the wheels'")
        if self.alike < 0.0:
            return [*doubts, "the gyro has the opposite sign of the wheels: counter-clockwise must be positive"]
        # Noise of the wheels makes the first one less, noise of the gyro the second one more.
        both = float((self.of * self.what).sum())
        least, most = both / float((self.what**2).sum()), float((self.of**2).sum()) / both
        if most < LEAST or least > MOST_TIMES:
            doubts.append(
                f"the gyro reads {np.sqrt(least * most):.3g} times the yaw rate from the wheels: quadrature makes 2 or"
                " 4 counts of one, a gear its ratio, deg/s are 57.3 times rad/s: check counts_per_turn, gear, unit"
            )
        return doubts


def _turning(vehicle: Vehicle, turned: Floats, seen: Floats) -> list[str]:
    """The readings of the wheels, (P, N), with which they turn the vehicle as a gyro reads, (P,)."""
    wheels = vehicle.wheel_names
    if np.std(seen) < STILL:
        return []
    kinematics = Kinematics(layout=vehicle.layout)
    back = np.asarray(kinematics.forward_matrix)[2]

    def alike(read: Floats) -> float:
        yaw = read @ back
        if (
            unexplained(kinematics, read) >= DISAGREE
            or np.std(yaw) == 0.0
            or not 0.5 < np.std(seen) / np.std(yaw) < 2.0
        ):
            return 0.0
        return float(np.corrcoef(yaw, seen)[0, 1])

    own = float(np.corrcoef(turned @ back, seen)[0, 1]) if np.std(turned @ back) > 0.0 else 0.0
    scores: list[tuple[float, Reading]] = [
        (alike(turned[:, each.order] * each.signs), each) for each in readings(len(wheels))
    ]
    best = max(score for score, _ in scores)
    if best < max(SURELY, own + GAIN):
        return []
    return [each.said(wheels) for score, each in scores if score > best - ALSO][:MOST]
