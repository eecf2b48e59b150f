"""Plausibility checks of what wheels turn against what is commanded and what a gyro reads: sign, order, size."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Kinematics, Vehicle
from omnistep._plausibility import ALIKE, STILL, of_yaw

Floats = NDArray[np.float64]

#: Signals are compared by their means over this time [s].
OVER_S = 0.1
#: Wheels follow what is commanded later: a first-order lag of one of these [s].
LAGS_S = (0.0, 0.1, 0.2, 0.4, 0.8)
#: A reading has to correlate by so much more for it to be said.
GAIN = 0.3
#: Of a wheel that is read as another one, which also moves with the first one.
SURELY = 0.8
#: Readings whose correlation is within this of the best are as likely; so many are said at most.
ALSO, MOST = 0.02, 3
#: What turns less than this part of the fastest says nothing.
SLOW = 0.1
#: Wheels that turn so many times what is commanded are read in another unit; of duty cycles, which friction eats, only
#: a tenth is too little.
OTHER_UNIT, LITTLE = 3.0, 0.1
#: Duty cycles beyond 1 in more than this part of the rows are not scaled; the largest values of usual counters.
BEYOND, FULL = 0.05, (100.0, 255.0, 1000.0, 1023.0, 4095.0, 32767.0, 65535.0)


@dataclass(frozen=True)
class Reading:
    """Another reading of the wheels: which wheel each of the file is, with which sign."""

    order: tuple[int, ...]
    signs: tuple[int, ...]

    @property
    def changed(self) -> NDArray[np.bool_]:
        """The wheels that it reads otherwise than the map."""
        pairs = zip(self.order, self.signs, strict=True)
        return np.array([wheel != k or sign < 0 for k, (wheel, sign) in enumerate(pairs)])

    def said(self, names: list[str]) -> str:
        """The reading in words."""
        turned = [names[k] for k, sign in enumerate(self.signs) if sign < 0]
        if turned:
            return f"wheel {turned[0]} looks reversed" if len(turned) == 1 else "all wheels look reversed"
        pairs = [(k, other) for k, other in enumerate(self.order) if k < other and self.order[other] == k]
        if 2 * len(pairs) == int(self.changed.sum()):
            return f"wheels {', '.join(f'{names[a]} and {names[b]}' for a, b in pairs)} look exchanged"
        return f"the wheels look read as {', '.join(names[k] for k in self.order)}"


def readings(wheels: int) -> tuple[Reading, ...]:
    """Other readings, the simplest first: of up to four wheels every order, of more two exchanged."""
    same, forward = tuple(range(wheels)), (1,) * wheels
    found = [Reading(same, tuple(-1 if k == other else 1 for k in same)) for other in same]
    found.append(Reading(same, (-1,) * wheels))
    orders = [tuple(b if k == a else a if k == b else k for k in same) for a, b in combinations(same, 2)]
    if wheels <= 4:
        every = sorted(permutations(same), key=lambda order: sum(order[order[k]] != k for k in same))
        orders += [order for order in every[1:] if order not in orders and order != same]
    return (*found, *(Reading(order, forward) for order in orders if order != same))


def of_command(vehicle: Vehicle, measured_rad_s: Floats, asked: Floats, period_s: float) -> list[str]:
    """Report wheels, (T, N) every period, that contradict the commanded twists, (T, 3)."""
    commanded = np.full_like(measured_rad_s, np.nan)
    known = np.isfinite(asked).all(axis=1)
    commanded[known] = np.asarray(Kinematics(layout=vehicle.layout).inverse(asked[known])).reshape(
        -1, commanded.shape[1]
    )
    follows = _follows(measured_rad_s, commanded, period_s)
    if follows is None:
        return []
    doubts = follows.otherwise(vehicle.wheel_names, "the command")
    if doubts == ["the wheels do not follow the command: all wheels look reversed"]:
        return ["all wheels turn opposite to the command: x must be forward, y left, and a turn to the left positive"]
    return doubts or _sizes(follows, "what is commanded", 1.0 / OTHER_UNIT)


def of_duty(vehicle: Vehicle, measured_rad_s: Floats, duty: Floats, period_s: float) -> list[str]:
    """Report wheels, (T, N) every period, that contradict the duty cycles of their motors, (T, N)."""
    doubts: list[str] = []
    size = np.abs(duty[np.isfinite(duty)])
    if size.size and np.mean(size > 1.001) > BEYOND:
        most = float(size.max())
        full = next((each for each in FULL if 2.0 < most <= 1.001 * each), None)
        hint = "check scale" if full is None else f"of a PWM of {full:g} scale is {1.0 / full:.3g}"
        doubts.append(f"duty cycles reach {most:.4g}, allowed: -1 to 1: {hint}")
    follows = _follows(measured_rad_s, duty, period_s)
    if follows is None:
        return doubts
    otherwise = follows.otherwise(vehicle.wheel_names, "the duty cycles")
    no_load = vehicle.no_load_rad_s
    if not doubts and not otherwise and no_load:
        follows.gain /= no_load
        otherwise = _sizes(follows, "what these duty cycles give without load", LITTLE)
    return doubts + otherwise


def of_gyro(vehicle: Vehicle, measured_rad_s: Floats, gyro_rad_s: Floats, period_s: float) -> list[str]:
    """Report wheels, (T, N) every period, that turn the vehicle otherwise than a gyro reads, (T,)."""
    turning = np.full(len(measured_rad_s), np.nan)
    known = np.isfinite(measured_rad_s).all(axis=1)
    if known.any():
        turning[known] = np.asarray(Kinematics(layout=vehicle.layout).forward(measured_rad_s[known]))[:, 2]
    doubts = of_yaw(turning, gyro_rad_s)
    likely = _turning(vehicle, measured_rad_s, gyro_rad_s, period_s)
    if not likely:
        return doubts
    said = doubts[0] if doubts else "the wheels do not turn the vehicle as the gyro reads: "
    return [f"{said}{', or ' if doubts else ''}{', or '.join(likely)}"]


def _turning(vehicle: Vehicle, measured_rad_s: Floats, gyro_rad_s: Floats, period_s: float) -> list[str]:
    """The readings of the wheels with which they turn the vehicle as a gyro reads."""
    wheels = vehicle.wheel_names
    both = _parts(np.column_stack([measured_rad_s, gyro_rad_s]), period_s)
    turned, seen = both[:, :-1], both[:, -1]
    if len(both) < 10 or np.std(seen) < STILL:
        return []
    kinematics = Kinematics(layout=vehicle.layout)
    back = np.asarray(kinematics.forward_matrix)[2]

    def alike(read: Floats) -> float:
        left = np.asarray(kinematics.residual(read)) if len(wheels) > 3 else np.zeros(1)
        fits = float(np.sqrt(np.mean(left**2))) < 0.2 * float(np.sqrt(np.mean(read**2)))
        yaw = read @ back
        if not fits or np.std(yaw) == 0.0 or not 0.5 < np.std(seen) / np.std(yaw) < 2.0:
            return 0.0
        return float(np.corrcoef(yaw, seen)[0, 1])

    own = float(np.corrcoef(turned @ back, seen)[0, 1]) if np.std(turned @ back) > 0.0 else 0.0
    if own > ALIKE:
        return []
    scores = [(alike(turned[:, each.order] * each.signs), each) for each in readings(len(wheels))]
    best = max(score for score, _ in scores)
    if best < max(SURELY, own + GAIN):
        return []
    return [each.said(wheels) for score, each in scores if score > best - ALSO][:MOST]


@dataclass
class _Follows:
    """Correlations of what each wheel turns, a row, with what is commanded of each, a column; the size of the first."""

    alike: Floats
    moving: NDArray[np.bool_]
    gain: float

    def otherwise(self, names: list[str], what: str) -> list[str]:
        """The readings with which wheels that do not follow what is commanded would."""
        rows, own = np.arange(len(self.alike)), np.diag(self.alike)
        found: list[tuple[float, Reading]] = []
        for each in readings(len(rows)):
            # What the file calls wheel k is, so read, what the map calls wheel order[k].
            as_read = self.alike[list(each.order), rows] * each.signs
            changed = each.changed & self.moving[list(each.order)]
            least = ALIKE if min(each.signs) < 0 else SURELY
            better = as_read[changed] > own[list(each.order)][changed] + GAIN
            if changed.any() and (as_read[changed] > least).all() and better.all():
                found.append((float(as_read[self.moving].mean()), each))
        best = max((score for score, _ in found), default=0.0)
        if best < own[self.moving].mean() + GAIN / 4:
            return []
        likely = [each.said(names) for score, each in found if score > best - ALSO][:MOST]
        return [f"the wheels do not follow {what}: {', or '.join(likely)}"]


def _follows(measured_rad_s: Floats, commanded: Floats, period_s: float) -> _Follows | None:
    """How wheels follow what is commanded, with the lag with which they do best."""
    wheels = measured_rad_s.shape[1]
    both = _parts(np.column_stack([measured_rad_s, commanded]), period_s)
    turned, commanded = both[:, :wheels], both[:, wheels:]
    if len(both) < 10:
        return None
    sizes = [np.sqrt(np.mean(each**2, axis=0)) for each in (turned, commanded)]
    moving = (sizes[0] > max(SLOW * float(sizes[0].max()), STILL)) & (sizes[1] > SLOW * float(sizes[1].max()))
    if not moving.any():
        return None
    found: list[tuple[float, Floats, Floats]] = []
    for lag in LAGS_S:
        # A bridge at zero brakes its motor, or leaves it open, so that the wheel goes on.
        for coasts in (False, True):
            lagged = _lagged(commanded, np.exp(-OVER_S / lag) if lag else 0.0, coasts)
            with np.errstate(invalid="ignore", divide="ignore"):
                alike = np.nan_to_num(np.corrcoef(turned.T, lagged.T)[:wheels, wheels:])
            alike[~moving], alike[:, ~moving] = 0.0, 0.0
            found.append((float(np.abs(alike).max(axis=1)[moving].mean()), alike, lagged))
    _, alike, lagged = max(found, key=lambda each: each[0])
    of, what = turned[:, moving], lagged[:, moving]
    gain = float((of * what).sum() / max(float((what**2).sum()), 1e-300))
    return _Follows(alike, moving, gain if np.diag(alike)[moving].mean() > ALIKE else 1.0)


def _sizes(follows: _Follows, what: str, least: float) -> list[str]:
    """Report wheels that turn far more, or less, than is commanded."""
    if np.diag(follows.alike)[follows.moving].mean() < ALIKE or least < follows.gain < OTHER_UNIT:
        return []
    return [
        f"the wheels turn {follows.gain:.3g} times {what}: check the unit (read as rad/s, rad/min is 60 times too much,"
        " rpm 9.55 times, turns a second are 6.28 times too little), counts_per_turn, and scale"
    ]


def _parts(columns: Floats, period_s: float) -> Floats:
    """Means of columns over parts of the time, where all are known."""
    rows = max(1, round(OVER_S / period_s))
    whole = len(columns) // rows
    parts = columns[: whole * rows].reshape(whole, rows, columns.shape[1]).mean(axis=1)
    return np.asarray(parts[np.isfinite(parts).all(axis=1)])


def _lagged(commanded: Floats, keep: float, coasts: bool) -> Floats:
    """What follows with a first-order lag; a wheel that coasts keeps its speed while 0 is commanded."""
    found, now = np.empty_like(commanded), np.zeros(commanded.shape[1])
    zero = np.abs(commanded) < 1e-3 * float(np.abs(commanded).max())
    for row, each in enumerate(commanded):
        now = np.where(zero[row] & coasts, now, keep * now + (1.0 - keep) * each)
        found[row] = now
    return found
