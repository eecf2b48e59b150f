"""Plausibility checks of a log of wheels: signs, order, units. A finding is one line, and no log is refused for it."""

from __future__ import annotations

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
