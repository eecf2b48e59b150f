"""Plausibility checks of wheel rotations against commands: sign, order, axes, size, clocks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Kinematics, Vehicle
from omnistep._plausibility import ALIKE, AXES_READ, DISAGREE, FITS, STILL, means, orders, unexplained
from omnistep._wheel_logs import spans

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

#: Signals are compared by their means over parts of this time [s].
OVER_S = 0.1
#: Wheels follow what is commanded later: a first-order lag of one of these [s], and so many parts.
LAGS_S, LATE = (0.0, 0.1, 0.2, 0.4, 0.8), range(-1, 4)
#: Clocks are tried up to so many parts late and early, with so many parts and this part of all variation left; they
#: differ if what is unlike becomes this part of it.
CLOCKS, LEFT, VARIES, UNLIKE = 20, 30, 0.5, 0.5
#: A wheel is driven by this part of what drives the others, of duty cycles by so much; it stands if it turns less than
#: the third, in so many parts in sequence.
DRIVEN, DRIVEN_DUTY, STANDS, STANDING = 0.3, 0.2, 0.05, 30
#: One wheel turns this many times as far as the other wheels.
ONE_OTHER = 1.6
#: A reading must correlate by this much more to be reported.
GAIN = 0.3
#: Of a wheel that is read as another one, which also moves with the first one.
SURELY = 0.8
#: Readings whose correlation is within this distance of the best are equally likely; at most this many are reported.
ALSO, MOST = 0.02, 3
#: Wheels slower than this fraction of the fastest are not evaluated.
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
    return (*found, Reading(same, (-1,) * wheels), *(Reading(order, forward) for order in orders(wheels)))


def of_command(vehicle: Vehicle, measured_rad_s: Floats, asked: Floats, period_s: float) -> list[str]:
    """Report wheels, (T, N) every period, that contradict the commanded twists, (T, 3)."""
    commanded = asked @ np.asarray(Kinematics(layout=vehicle.layout).inverse_matrix).T
    names, follows = vehicle.wheel_names, _follows(measured_rad_s, commanded, period_s)
    if follows is None:
        return []
    if not follows.moving.any():
        return follows.stands(names, 0.0)
    if one_way := _one_way(follows, "the command"):
        return [one_way]
    doubts, likely = follows.clocks("the command"), _axes(vehicle, follows)
    wheels = [] if likely else [each.said(names) for each in follows.otherwise()]
    if wheels == ["all wheels look reversed"]:
        opposite = "all wheels turn opposite to the command: x must be forward, y left, and a turn to the left positive"
        return [*doubts, opposite]
    if likely or wheels:
        return [*doubts, f"the wheels do not follow the command: {', or '.join([*likely, *wheels])}"]
    doubts += follows.stands(names, 0.0) or follows.one_other(names)
    return doubts + follows.sizes("what is commanded", 1.0 / OTHER_UNIT)


def of_duty(vehicle: Vehicle, measured_rad_s: Floats, duty: Floats, period_s: float) -> list[str]:
    """Report wheels, (T, N) every period, that contradict the duty cycles of their motors, (T, N)."""
    doubts: list[str] = []
    size = np.abs(duty[np.isfinite(duty)])
    if size.size and np.mean(size > 1.001) > BEYOND:
        most = float(size.max())
        full = next((each for each in FULL if 2.0 < most <= 1.001 * each), None)
        hint = "check scale" if full is None else f"of a PWM of {full:g} scale is {1.0 / full:.3g}"
        doubts.append(f"duty cycles reach {most:.4g}, allowed: -1 to 1: {hint}")
    names, follows = vehicle.wheel_names, _follows(measured_rad_s, duty, period_s)
    if follows is None:
        return doubts
    if one_way := _one_way(follows, "the duty cycles"):
        return [*doubts, one_way]
    doubts += [*follows.undriven(names), *follows.clocks("the duty cycles")]
    if wheels := follows.otherwise() if follows.moving.any() else []:
        likely = ", or ".join(each.said(names) for each in wheels)
        return [*doubts, f"the wheels do not follow the duty cycles: {likely}"]
    doubts += follows.stands(names, DRIVEN_DUTY) or follows.one_other(names)
    no_load = vehicle.no_load_rad_s
    if not doubts and no_load and follows.moving.any():
        doubts = follows.sizes("what these duty cycles give without load", LITTLE, no_load)
    return doubts


def _axes(vehicle: Vehicle, follows: _Follows) -> list[str]:
    """The readings of the command's axes, and then of the wheels, with which consistent wheels follow the command."""
    kinematics = Kinematics(layout=vehicle.layout)
    back = np.asarray(kinematics.forward_matrix)
    lever = float(np.mean([np.hypot(*wheel.position_m) for wheel in vehicle.layout.wheels]))

    def apart(turned: Floats, axes: Floats) -> float:
        if unexplained(kinematics, turned) > DISAGREE:
            return np.inf
        of, what = (each * [1.0, 1.0, lever] for each in (turned @ back.T, follows.lagged @ back.T @ axes.T))
        gain = np.clip((of * what).sum() / max(float((what**2).sum()), 1e-300), 1.0 / OTHER_UNIT, OTHER_UNIT)
        return float(np.sqrt(np.mean((of - gain * what) ** 2) / np.mean(of**2)))

    before = apart(follows.turned, np.eye(3))
    if not DISAGREE < before < np.inf:
        return []
    scores = [
        (apart(follows.turned, axes), said.format(of="of the command", turn="wz of the command"))
        for axes, heading, said in AXES_READ
        if not heading
    ]
    best = min(scores)[0]
    if best > FITS * before:
        return []
    for each in readings(len(vehicle.wheel_names)):
        scores.append((apart(follows.turned[:, each.order] * each.signs, np.eye(3)), each.said(vehicle.wheel_names)))
    return [said for score, said in scores if score < best + ALSO][:MOST]


def _one_way(follows: _Follows, what: str) -> str:
    """Report commands without direction while wheels have one, or the reverse."""
    ways = [
        [float(np.mean(each < -SLOW * most)), float(np.mean(each > SLOW * most))]
        for each in (follows.lagged, follows.turned)
        for most in [max(float(np.abs(each).max()), STILL)]
    ]
    (given_back, given_on), (back, on) = ways
    if given_back == 0.0 < given_on and min(back, on) > BEYOND:
        turn = "turns" if what == "the command" else "turn"
        return f"{what} {turn} no wheel backwards, but wheels turn both ways: a direction, or offset, is lacking"
    if back == 0.0 < on and min(given_back, given_on) > BEYOND:
        return f"no wheel turns backwards, but {what} would turn some: the wheels lack their direction"
    return ""


@dataclass
class _Follows:
    """How wheels follow what is commanded, in parts of the time.

    Attributes:
        turned, lagged: wheel rotations, and commands with the best-fitting lag, (P, N).
        alike: correlations of the first, a row, with the second, a column.
        moving: the wheels that turn and are commanded.
        late: lag of the wheels beyond the motors' lag, in parts; negative if they precede the command.
        times: when the parts begin [s].
    """

    turned: Floats
    lagged: Floats
    alike: Floats
    moving: Flags
    late: int
    times: Floats

    @property
    def gains(self) -> Floats:
        """How many times what is commanded of it each wheel turns."""
        squares = (self.lagged**2).sum(axis=0)
        return np.asarray((self.turned * self.lagged).sum(axis=0) / np.maximum(squares, 1e-300))

    def otherwise(self) -> list[Reading]:
        """The readings with which wheels that do not follow what is commanded would."""
        rows, own = np.arange(len(self.alike)), np.diag(self.alike)
        products = self.turned.T @ self.lagged
        found: list[tuple[float, Reading]] = []
        for each in readings(len(rows)):
            # With this reading, wheel k of the file is wheel order[k] of the map.
            as_read = self.alike[list(each.order), rows] * each.signs
            changed = each.changed & self.moving[list(each.order)]
            least = ALIKE if min(each.signs) < 0 else SURELY
            better = as_read[changed] > own[list(each.order)][changed] + GAIN
            # On the whole, too: at a constant speed what is left without the means is noise.
            whole = (products[list(each.order), rows] * each.signs)[changed]
            if changed.any() and (as_read[changed] > least).all() and better.all() and (whole >= 0.0).all():
                found.append((float(as_read[self.moving].mean()), each))
        best = max((score for score, _ in found), default=0.0)
        if best < own[self.moving].mean() + GAIN / 4:
            return []
        return [each for score, each in found if score > best - ALSO][:MOST]

    def clocks(self, what: str) -> list[str]:
        """Report wheels that move long after they are commanded, or before."""
        if not self.late:
            return []
        by = f"{abs(self.late) * OVER_S:g} s"
        if self.late > 0:
            return [f"the wheels follow {what} {by} late: their clocks may differ"]
        return [f"the wheels move {by} before {what}: their clocks differ"]

    def stands(self, names: list[str], least: float) -> list[str]:
        """Report wheels that stand while they are driven, by more than the least."""
        driving, turning = np.abs(self.lagged), np.abs(self.turned)
        driven = driving > max(least, DRIVEN * float(np.percentile(driving, 95)), 1e-300)
        sums = driving.sum(axis=0)
        usual = turning.sum(axis=0)[sums > DRIVEN * sums.max()] / max(float(sums.max()), 1e-300)
        dead: dict[str, list[str]] = {}
        all_driven = int((driven.sum(axis=0) >= STANDING).sum())
        for k, name in enumerate(names):
            parts = np.flatnonzero(driven[:, k])
            still = turning[parts, k] <= STANDS * float(usual.max()) * driving[parts, k]
            first, after = max(spans(still), key=lambda each: each[1] - each[0], default=(0, 0))
            if after - first < STANDING:
                continue
            since, until = self.times[parts[first]], self.times[parts[after - 1]] + OVER_S
            dead.setdefault("" if still.all() else f" from {since:.1f} to {until:.1f} s", []).append(name)
        return [
            f"all wheels stand{when} while they are driven"
            if len(each) == all_driven > 1
            else f"wheel {' and '.join(each)} stand{'s' * (len(each) == 1)}{when} while driven"
            for when, each in dead.items()
        ]

    def undriven(self, names: list[str]) -> list[str]:
        """Report wheels that turn while nothing is commanded of them, ever."""
        driving, turning = (np.sqrt(np.mean(each**2, axis=0)) for each in (self.lagged, self.turned))
        never = (driving < 1e-3 * driving.max()) & (turning > DRIVEN * turning.max())
        return [f"the duty cycle of wheel {names[k]} is always 0 while it turns" for k in np.flatnonzero(never)]

    def one_other(self, names: list[str]) -> list[str]:
        """Report a wheel that turns more, or less, than the other wheels for its command."""
        sizes = np.sqrt(np.mean(self.lagged**2, axis=0))
        sure = np.flatnonzero(self.moving & (np.diag(self.alike) > ALIKE) & (sizes > DRIVEN * sizes.max()))
        if len(sure) < 3:
            return []
        gains = self.gains[sure]
        times = [float(gain / np.median(np.delete(gains, k))) for k, gain in enumerate(gains)]
        k = int(np.argmax(np.abs(np.log(times))))
        if 1.0 / ONE_OTHER < times[k] < ONE_OTHER:
            return []
        return [
            f"wheel {names[sure[k]]} turns {times[k]:.2g} times as far as the others for what drives it: check its"
            " counts_per_turn, gear and scale"
        ]

    def sizes(self, what: str, least: float, full: float = 1.0) -> list[str]:
        """Report wheels that turn far more, or less, than is commanded, of which 1 is so much."""
        of, to = self.turned[:, self.moving], full * self.lagged[:, self.moving]
        gain = float((of * to).sum() / max(float((to**2).sum()), 1e-300))
        if np.diag(self.alike)[self.moving].mean() < ALIKE or least < gain < OTHER_UNIT:
            return []
        return [
            f"the wheels turn {gain:.3g} times {what}: check the unit (read as rad/s, rad/min is 60 times too much,"
            " rpm 9.55 times, turns a second are 6.28 times too little), counts_per_turn, and scale"
        ]


def _follows(measured_rad_s: Floats, commanded: Floats, period_s: float) -> _Follows | None:
    """How wheels follow what is commanded, with the lag and the clocks with which they do best."""
    turned, commanded = parts(measured_rad_s, period_s), parts(commanded, period_s)
    unknown = np.isnan(commanded)
    known = np.isfinite(turned).all(axis=1) & ~unknown.any(axis=1)
    if known.sum() < 10:
        return None
    sizes = [np.sqrt(np.mean(each[known] ** 2, axis=0)) for each in (turned, commanded)]
    moving = (sizes[0] > max(SLOW * float(sizes[0].max()), STILL)) & (sizes[1] > SLOW * float(sizes[1].max()))
    found: list[Tried] = []
    for lag in LAGS_S:
        # A bridge at zero brakes its motor, or leaves it open, so that the wheel goes on.
        for coasts in (False, True):
            lagged = _lagged(np.nan_to_num(commanded), np.exp(-OVER_S / lag) if lag else 0.0, coasts)
            lagged[unknown] = np.nan
            for late, of, what in with_clocks(turned, lagged, moving):
                score = float(np.abs(_alike(of, what, moving)).max(axis=1)[moving].mean()) if moving.any() else 0.0
                found.append(Tried(score, late, (lagged,)))
    best, differ = most_alike(found, LATE)
    of, what, at = together(turned, best.signals[0], best.late)
    return _Follows(of, what, _alike(of, what, moving), moving, best.late if differ else 0, np.asarray(OVER_S * at))


class Tried(NamedTuple):
    """Correlation of two signals, -1 to 1, with the first delayed by this many parts; and the rows that this uses."""

    alike: float
    late: int
    signals: tuple[Floats, ...]


def most_alike(tried: list[Tried], usual: range) -> tuple[Tried, bool]:
    """The clock offset with the highest correlation of two signals, and whether it is unusual: only if far better."""
    best, own = (
        max(some, key=lambda each: abs(each.alike)) for some in (tried, [each for each in tried if each.late in usual])
    )
    differ = best.late not in usual and abs(best.alike) > SURELY
    differ = differ and 1.0 - best.alike**2 < UNLIKE * (1.0 - own.alike**2)
    return (best if differ else own), differ


def _variation(of: Floats) -> float:
    """Sum of squares around the means of columns."""
    return float(((of - of.mean(axis=0)) ** 2).sum()) if len(of) else 0.0


def _alike(of: Floats, what: Floats, moving: Flags) -> Floats:
    """Correlations of columns with columns, 0 if one does not move."""
    of, what = of - of.mean(axis=0), what - what.mean(axis=0)
    sizes = np.sqrt(np.outer((of**2).sum(axis=0), (what**2).sum(axis=0)))
    return np.asarray(np.where(np.outer(moving, moving) & (sizes > 0.0), of.T @ what / np.maximum(sizes, 1e-300), 0.0))


def parts(columns: Floats, period_s: float) -> Floats:
    """Means of columns over the compared parts of the time, NaN if one is unknown."""
    return means(columns, period_s, OVER_S)


def with_clocks(of: Floats, what: Floats, moving: Flags) -> Iterator[tuple[int, Floats, Floats]]:
    """Parts of two signals with every clock that is tried, by how late the first is; the smallest difference first.

    Without its start, a drive at a constant speed is noise, which is like anything: a clock is tried only if enough
    parts, and of the moving columns enough variation, are left.
    """
    own, _, _ = together(of, what, 0)
    enough, varies = max(LEFT, len(own) // 2), VARIES * _variation(own[:, moving])
    for late in sorted(range(-CLOCKS, CLOCKS + 1), key=abs):
        first, second, _ = together(of, what, late)
        if not late or (len(first) >= enough and _variation(first[:, moving]) >= varies):
            yield late, first, second


def together(of: Floats, what: Floats, late: int) -> tuple[Floats, Floats, Integers]:
    """Parts of two signals, of which the first is so much late, where both are known; and which these are of it."""
    count = max(len(of) - abs(late), 0)
    first, second = of[max(late, 0) :][:count], what[max(-late, 0) :][:count]
    known = np.flatnonzero(np.isfinite(first).all(axis=1) & np.isfinite(second).all(axis=1))
    return first[known], second[known], known + max(late, 0)


def _lagged(commanded: Floats, keep: float, coasts: bool) -> Floats:
    """What follows with a first-order lag; a wheel that coasts keeps its speed while 0 is commanded."""
    found, now = np.empty_like(commanded), np.zeros(commanded.shape[1])
    zero = np.abs(commanded) < 1e-3 * float(np.abs(commanded).max())
    for row, each in enumerate(commanded):
        now = np.where(zero[row] & coasts, now, keep * now + (1.0 - keep) * each)
        found[row] = now
    return found
