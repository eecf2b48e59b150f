"""Propagation of measurement errors along a stretch: quantisation is independent, velocity noise is a random walk."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from omnistep._estimates import Floats, scipy_part

#: Speed is nearly constant over this time [s] of at least so many rows; a wheel turns by this part of the fastest.
STEADY_S, FEWEST_ROWS, TURNS = 0.1, 6, 0.1
#: Steps of a walk are looked for between these parts of the errors of single readings, as variances.
LEAST, MOST = 1e-6, 1e4


class Noise:
    """Independent errors of angles, and a random walk whose steps have ``ratio`` times their variance.

    Each stretch has its own straight line, and the residual of a reading is relative to it.
    """

    def __init__(self, ratio: float, rows: int) -> None:
        self.ratio, self.rows = ratio, rows
        self._of_size: dict[int, Floats] = {}

    def whitened(self, left: Floats, stretch: NDArray[np.int64]) -> Floats:
        """The residuals, (B, N), transformed such that their errors are independent."""
        done = np.empty_like(left)
        for rows in _runs(stretch):
            size = rows.stop - rows.start
            if size not in self._of_size:
                steps, ways = _walk_of(size, self.rows)
                self._of_size[size] = (ways / np.sqrt(1.0 + self.ratio * steps)) @ ways.T
            done[rows] = self._of_size[size] @ left[rows]
        return done


def likely(parts: Iterable[tuple[Floats, NDArray[np.int64]]], rows: int, needed_by: str) -> Noise:
    """The most likely noise of the residuals, (B, N), in stretches; restricted likelihood, which includes the lines.

    A reading is the mean over that many rows; the random walk has a step in each.
    """
    spread, squares = [], []
    for left, stretch in parts:
        for run in _runs(stretch):
            steps, ways = _walk_of(run.stop - run.start, rows)
            seen = left[run][:, (left[run] != 0.0).any(axis=0)]
            spread.append(steps)
            squares.append(np.mean((ways.T @ seen) ** 2, axis=1) if seen.size else np.zeros(len(steps)))
    steps, square = np.concatenate(spread), np.concatenate(squares)

    def unlikely(log_ratio: float) -> float:
        variance = 1.0 + np.exp(log_ratio) * steps
        return float(np.log(np.mean(square / variance)) + np.mean(np.log(variance)))

    search = scipy_part("optimize", needed_by).minimize_scalar
    found = search(unlikely, bounds=(np.log(LEAST), np.log(MOST)), method="bounded")
    return Noise(float(np.exp(found.x)), rows)


def implied_rad_s(sd: float, ratio: float, rows: int, period_s: float) -> float:
    """Noise of the velocity of a single row that such errors of bins make, standard deviation [rad/s]."""
    # A bin is the mean of that many independent readings; a step of the walk is the sum of as many.
    return float(sd * np.sqrt(2.0 * rows + ratio / rows) / period_s)


def shown_rad_s(speeds_rad_s: Floats, period_s: float) -> float:
    """The same noise from velocities, (T, N), about a straight line at nearly constant speed [rad/s]."""
    rows = max(FEWEST_ROWS, round(STEADY_S / period_s))
    parts = speeds_rad_s[: len(speeds_rad_s) // rows * rows].reshape(-1, rows, speeds_rad_s.shape[1])
    size = np.nan_to_num(np.abs(parts.mean(axis=1)).max(axis=1))
    parts = parts[size > TURNS * size.max(initial=0.0)]
    if not len(parts):
        return 0.0
    time = np.arange(rows) - 0.5 * (rows - 1)
    slope = np.einsum("t,ptn->pn", time, parts) / (time @ time)
    left = parts - parts.mean(axis=1, keepdims=True) - time[:, None] * slope[:, None, :]
    steep = np.abs(slope).max(axis=1)
    steady = left[steep <= np.median(steep)]
    return float(np.sqrt((steady**2).sum() / (steady.size * (rows - 2) / rows)))


def _runs(stretch: NDArray[np.int64]) -> list[slice]:
    edges = np.flatnonzero(np.diff(stretch)) + 1
    return [slice(int(a), int(b)) for a, b in zip(np.r_[0, edges], np.r_[edges, len(stretch)], strict=True)]


def _walk(size: int, rows: int) -> tuple[Floats, Floats]:
    """Variances of a unit-step random walk about its line, (size - 2,), and their directions, (size, size - 2)."""
    number = np.arange(1.0, size + 1.0)
    lines = np.linalg.qr(np.stack([np.ones(size), number], axis=1), mode="complete")[0][:, 2:]
    # The mean of a walk over some rows varies less about its course than the walk.
    course = np.minimum.outer(number, number) - (rows**2 - 1) / (6 * rows**2) * np.eye(size)
    variances, ways = np.linalg.eigh(lines.T @ course @ lines)
    return variances, lines @ ways


_walk_of = lru_cache(maxsize=256)(_walk)
