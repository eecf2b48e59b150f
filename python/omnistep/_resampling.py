"""Resampling of samples at any times to one number for each control period: gaps stay gaps, and nothing is smoothed."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from omnistep._log_map import Signal
from omnistep._log_sources import Nanoseconds, Samples
from omnistep._plausibility import more_times
from omnistep._tables import Floats
from omnistep.errors import LogError

#: A signal is known between samples that are no further apart than this many times their median distance.
GAP_IN_PERIODS = 3.0
#: If at least this many samples stay behind the preceding time, the clock was set back; fewer arrived late.
LATE = 5
#: Times that go back by more than this are another recording [ns].
_BACK_NS = 1_000_000_000


@dataclass(frozen=True)
class Channel:
    """One column of a signal, cleaned: ascending times, finite numbers in our units.

    Attributes:
        name: the table of the map and the column's number in it.
        time_ns: times [ns].
        value: the numbers.
        max_gap_ns: samples farther apart than this leave a gap [ns]; infinite for no gaps.
        held: a sample holds until the next one.
        missing: cells that were empty or not finite, left out.
        unordered: samples that were left out so that times ascend, as few as possible.
        set_back: samples of those that are left at which the clock had gone back, see :func:`set_back`.
    """

    name: str
    time_ns: Nanoseconds
    value: Floats
    max_gap_ns: float
    held: bool
    missing: int
    unordered: int
    set_back: tuple[int, ...] = ()

    def over(self, starts_ns: Nanoseconds, period_ns: int) -> Floats:
        """The signal in the periods that start at these times, in sequence; NaN while it is unknown.

        For a held signal this is the mean over the period, if it is known in half of the period or more: a sample that
        comes a little after the start, because clocks jitter, belongs to the period. For other signals it is the value
        at the start.
        """
        if not self.held:
            return self.at(starts_ns)
        edges = np.concatenate([starts_ns, starts_ns[-1:] + period_ns])
        inside = self.time_ns[(self.time_ns > edges[0]) & (self.time_ns < edges[-1])]
        if np.isfinite(self.max_gap_ns):
            ends = self.time_ns + np.int64(self.max_gap_ns) + 1
            inside = np.concatenate([inside, ends[(ends > edges[0]) & (ends < edges[-1])]])
        begins = np.unique(np.concatenate([starts_ns, inside]))
        held = self.at(begins)
        row = np.searchsorted(starts_ns, begins, side="right") - 1
        lasts = np.diff(np.append(begins, edges[-1])).astype(np.float64)
        known_ns = np.bincount(row, weights=np.where(np.isfinite(held), lasts, 0.0))
        total = np.bincount(row, weights=np.nan_to_num(held) * lasts)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.where(known_ns >= 0.5 * period_ns, total / known_ns, np.nan)
        # If nothing changes, the value itself, bit-identical.
        alone = np.bincount(row) == 1
        mean[alone] = held[np.searchsorted(begins, starts_ns[alone])]
        return mean

    def at(self, grid_ns: Nanoseconds) -> Floats:
        """The signal at these times, NaN while it is unknown."""
        found = np.full(grid_ns.shape, np.nan)
        if self.time_ns.size == 0:
            return found
        before = np.searchsorted(self.time_ns, grid_ns, side="right") - 1
        last = self.time_ns.size - 1
        here = np.clip(before, 0, last)
        since = grid_ns - self.time_ns[here]
        if self.held:
            known = (before >= 0) & (since <= self.max_gap_ns)
            return np.where(known, self.value[here], found)
        after = np.minimum(here + 1, last)
        apart = self.time_ns[after] - self.time_ns[here]
        exact = (before >= 0) & (since == 0)
        between = (before >= 0) & (before < last) & (apart <= self.max_gap_ns)
        part = since / np.maximum(apart, 1)
        linear = self.value[here] + part * (self.value[after] - self.value[here])
        return np.where(exact, self.value[here], np.where(between, linear, found))

    def gaps_s(self) -> Floats:
        """Length of each gap [s]."""
        apart = np.diff(self.time_ns)
        return np.asarray(apart[apart > self.max_gap_ns] * 1e-9, dtype=np.float64)

    def rate_hz(self) -> float:
        """Samples a second, by the median distance; NaN for fewer than two."""
        return 1e9 / float(np.median(np.diff(self.time_ns))) if self.time_ns.size > 1 else float("nan")


def set_back(time_ns: Nanoseconds) -> list[int]:
    """Samples at which a clock goes back and on from there; a few samples that come late are none.

    >>> import numpy as np
    >>> from omnistep._resampling import set_back
    >>> late = [0, 10, 20, 50, 60, 30, 40, 70, 80, 90, 100]
    >>> set_back(np.array([0, 10, 20, 30, 40, 50, 0, 10, 20, 30, 40])), set_back(np.array(late))
    ([6], [])
    """
    steps = np.diff(time_ns)
    if not steps.size or steps.min() >= 0:
        return []
    least = -GAP_IN_PERIODS * float(np.median(np.abs(steps)))
    back = np.flatnonzero(steps < least) + 1
    return [int(k) for k in back if k + LATE <= time_ns.size and time_ns[k : k + LATE].max() <= time_ns[k - 1]]


def clock_doubts(clock: str, time_ns: Nanoseconds) -> list[str]:
    """Report times at which a clock goes back; ``clock`` names its column or topic."""
    back = set_back(time_ns)
    if not back:
        return []
    again = more_times(len(back))
    return [f"{clock}: {_went_back(time_ns, back[0])}{again}: the clock was set there; import the log in pieces"]


def _went_back(time_ns: Nanoseconds, at: int) -> str:
    before_s, after_s = time_ns[:at].max() * 1e-9, time_ns[at] * 1e-9
    return f"time goes back by {before_s - after_s:.6g} s in row {at + 1}, from {before_s:.6g} to {after_s:.6g} s"


def channels(path: Path, signal: Signal, samples: Samples, *, clock: str, turning: Sequence[int] = ()) -> list[Channel]:
    """Clean a signal's columns; those in ``turning`` are angles that jump by a turn; ``clock`` names that of times."""
    # The time of a row without a number counts for nothing.
    empty = ~np.isfinite(samples.values).any(axis=1)
    back = np.maximum.accumulate(np.where(empty, samples.time_ns.min(initial=0), samples.time_ns)) - samples.time_ns
    back[empty] = 0
    if back.size and back.max() > _BACK_NS:
        what = _went_back(samples.time_ns, int(np.argmax(back > _BACK_NS)))
        raise LogError(
            f"{path}: {clock}: {what}, allowed: {_BACK_NS * 1e-9:g} s at most; cut the log there", file=str(path)
        )
    made = []
    for number, (factor, offset) in enumerate(zip(signal.factors, signal.offsets, strict=True)):
        raw = samples.values[:, number]
        finite = np.isfinite(raw)
        time_ns, raw = samples.time_ns[finite], raw[finite]
        name = f"{signal.table}.{number}" if not signal.names else signal.names[number]
        ordered = _ascending(time_ns)
        begins = np.searchsorted(np.flatnonzero(ordered), set_back(time_ns))
        time_ns, raw = time_ns[ordered], raw[ordered]
        if signal.wrap is not None:
            if raw.size and np.ptp(raw) >= signal.wrap:
                what = f"counts from {raw.min():g} to {raw.max():g}, allowed: fewer than 2^wrap_bits = {signal.wrap:g}"
                raise LogError(f"{path}: {name}: {what}", file=str(path))
            raw = np.unwrap(raw, period=signal.wrap)
        value = (raw - offset) * factor
        if not np.isfinite(value).all():
            raise LogError(f"{path}: {name}: numbers too large for their unit", file=str(path))
        if number in turning:
            value = np.unwrap(value)
        gap_ns = (signal.max_gap_s or 0.0) * 1e9
        if signal.max_gap_s is None and time_ns.size > 1:
            gap_ns = GAP_IN_PERIODS * float(np.median(np.diff(time_ns)))
        made.append(
            Channel(
                name=name,
                time_ns=time_ns,
                value=value,
                max_gap_ns=gap_ns,
                held=signal.kind.held,
                missing=int(np.count_nonzero(~finite)),
                unordered=int(np.count_nonzero(~ordered)),
                set_back=tuple(int(begin) for begin in begins if 0 < begin < time_ns.size),
            )
        )
    return made


def _ascending(time_ns: Nanoseconds) -> NDArray[np.bool_]:
    """Samples to keep so that times ascend: as many as possible, of two that exclude each other the first one."""
    kept = np.ones(time_ns.shape, dtype=bool)
    if time_ns.size < 2:
        return kept
    # After all before it and before all after it: of such a sample there is nothing to choose.
    kept[1:] = time_ns[1:] > np.maximum.accumulate(time_ns)[:-1]
    kept[:-1] &= time_ns[:-1] < np.minimum.accumulate(time_ns[::-1])[::-1][1:]
    doubtful = np.flatnonzero(~kept)
    # The longest ascending subsequence, by patience sorting from the end: `chain[k]` is the sample with the latest time
    # after which k more ascend, `chain_ns[k]` that time, negated so that the list ascends.
    chain_ns: list[int] = []
    chain: list[int] = []
    after = np.full(doubtful.size, -1)
    for here in range(doubtful.size - 1, -1, -1):
        time = -int(time_ns[doubtful[here]])
        length = bisect_left(chain_ns, time)
        if length:
            after[here] = chain[length - 1]
        chain_ns[length : length + 1] = [time]
        chain[length : length + 1] = [here]
    at = chain[-1] if chain else -1
    while at >= 0:
        kept[doubtful[at]] = True
        at = int(after[at])
    return kept
