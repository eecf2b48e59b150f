"""Stretches of a log in which no wheel reverses, and their bins, which identification fits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnistep._estimates import Floats
from omnistep._vehicle_masses import Masses
from omnistep._wheel_logs import WheelLog, spans

Integers = NDArray[np.int64]

#: Readings are averaged over this time, which is shorter than a vehicle's time constants and leaves few numbers to fit.
BIN_S = 0.02
#: A longer drive is cut into stretches of about this time, none over 1.5 times as long: long stretches determine
#: friction, short stretches do not drift. Cut to no more than this, intervals of friction held the truth in 86 %
#: instead of 95 %.
LONG_S = 0.8
SHORTEST_S = 0.15
#: Fewest bins of a stretch: a line goes through two.
FEWEST = 3
#: A wheel stands below this part of the fastest.
STANDS = 0.04
#: A wheel that stands turns by no more than this in a stretch [rad], three counts of 360; else it creeps, and drags.
CREEPS_RAD = 0.05
#: Velocities are smoothed over this time to see which way a wheel turns.
SMOOTH_S = 0.03
#: Left out after a wheel began, stopped or turned round: the smoothed velocity does not know when exactly.
SETTLE_S = 0.03
#: Left out after torques that are not known: three times a long lag.
REMEMBERED_S = 0.15


@dataclass(frozen=True)
class Stretches:
    """A log, cut into stretches; the bins of all stretches in sequence."""

    log: WheelLog
    #: The wheels are in the air.
    lifted: bool
    #: First row of each bin in the log, (B,), and its number of rows.
    first: Integers
    rows: int
    #: Stretch of each bin, from 0, (B,).
    stretch: Integers
    #: Direction of rotation of each wheel in each stretch: -1, 0 at rest, 1, (S, N).
    signs: Integers
    #: Part of the log's rows that are in stretches.
    used: float

    def mean(self, series: Floats) -> Floats:
        """Mean of a series over rows in each bin."""
        sums = np.concatenate([np.zeros((1, series.shape[1])), np.cumsum(np.nan_to_num(series), axis=0)])
        return np.asarray((sums[self.first + self.rows] - sums[self.first]) / self.rows)

    def straightened(self, bins: Floats) -> Floats:
        """Less the straight line of each stretch: its start and its initial speed are not known."""
        count = np.bincount(self.stretch)

        def per_stretch(column: Floats) -> Floats:
            return np.asarray(np.bincount(self.stretch, weights=column)[self.stretch])

        late = self.first - per_stretch(self.first.astype(np.float64)) / count[self.stretch]
        spread = per_stretch(late**2)
        columns = [
            column - per_stretch(column) / count[self.stretch] - late * per_stretch(late * column) / spread
            for column in bins.T
        ]
        return np.stack(columns, axis=1)

    def binned(self, rows: Floats) -> Floats:
        """A series over rows, in bins, straightened."""
        return self.straightened(self.mean(rows))


def cut(log: WheelLog, masses: Masses, inputs: Floats, *, lifted: bool) -> Stretches | None:
    """Cut a log into stretches; None if there are none."""
    rows = max(1, round(BIN_S / log.period_s))
    there = np.isfinite(log.measured).all(axis=1) & np.isfinite(inputs).all(axis=1)
    velocity = log.measured
    if not lifted:
        # The motion of the whole vehicle: further readings of single wheels are noise or slip.
        velocity = velocity @ masses.back.T @ masses.map.T
    slow = smooth(np.nan_to_num(velocity), max(1, round(SMOOTH_S / log.period_s)))
    signs = np.sign(slow).astype(np.int64)
    fastest = float(np.quantile(np.abs(slow).max(axis=1), 0.99))
    if fastest == 0.0:
        return None
    signs[np.abs(slow) < STANDS * fastest] = 0
    turns = np.r_[True, (np.diff(signs, axis=0) != 0).any(axis=1)]
    settle = max(1, round(SETTLE_S / log.period_s))
    near: Any = np.convolve(turns | ~there, np.ones(2 * settle + 1), mode="same") > 0.5
    # After torques that are not known: they are in the state of a lag.
    unknown: Any = ~np.isfinite(inputs).all(axis=1)
    remembered = max(1, round(REMEMBERED_S / log.period_s))
    near |= np.convolve(unknown, np.ones(remembered + 1))[: len(unknown)] > 0.5
    usable = ~near & (signs != 0).any(axis=1)
    angle = np.cumsum(np.nan_to_num(log.measured), axis=0) * log.period_s
    first, stretch, kept, count = [], [], [], 0
    for begin, end in spans(usable):
        bins = (end - begin) // rows
        parts = max(1, round(bins * rows * log.period_s / LONG_S))
        for part in np.array_split(np.arange(bins), parts):
            if len(part) * rows * log.period_s < SHORTEST_S or len(part) < FEWEST:
                continue
            rows_of = slice(begin + rows * part[0], begin + rows * (part[-1] + 1))
            if (np.ptp(angle[rows_of], axis=0)[signs[begin] == 0] > CREEPS_RAD).any():
                continue
            first += list(begin + rows * part)
            stretch += [count] * len(part)
            kept.append(signs[begin])
            count += 1
    if not count:
        return None
    begins = np.array(first, dtype=np.int64)
    return Stretches(
        log=log,
        lifted=lifted,
        first=begins,
        rows=rows,
        stretch=np.array(stretch, dtype=np.int64),
        signs=np.array(kept),
        used=len(begins) * rows / len(log.measured),
    )


def integral(series: Floats, period: float) -> Floats:
    """Integral up to each row of a signal that is linear between rows."""
    return np.asarray((np.cumsum(series, axis=0) - 0.5 * series) * period)


def smooth(series: Floats, rows: int) -> Floats:
    """A running mean."""
    window = np.ones(rows) / rows
    return np.stack([np.convolve(column, window, mode="same") for column in series.T], axis=1)
