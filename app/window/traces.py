"""Decimated signals of a run in progress, and running errors.

Bins are fixed to sample numbers, so that a trace does not flicker while it scrolls. Each bin keeps
its lowest and its highest sample, so that no spike is lost.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

__all__ = ["ErrorsSoFar", "Newest", "Pyramid", "RunningErrors"]


@dataclass(frozen=True)
class _Bins:
    """Extremes of consecutive bins: their values and the numbers of their samples, (n,) each."""

    low: np.ndarray
    high: np.ndarray
    low_at: np.ndarray
    high_at: np.ndarray

    @classmethod
    def of_samples(cls, values: np.ndarray, first: int) -> _Bins:
        """Return bins of one sample each; ``first`` is the number of the first sample."""
        at = np.arange(first, first + values.size, dtype=np.int64)
        return cls(values, values, at, at)

    @classmethod
    def none(cls) -> _Bins:
        return cls.of_samples(np.empty(0), 0)

    def __len__(self) -> int:
        return int(self.low.size)

    def __getitem__(self, part: slice) -> _Bins:
        return _Bins(self.low[part], self.high[part], self.low_at[part], self.high_at[part])

    def followed_by(self, other: _Bins) -> _Bins:
        """Return these bins and then those of ``other``."""
        if not len(self):
            return other
        return _Bins(
            np.concatenate((self.low, other.low)),
            np.concatenate((self.high, other.high)),
            np.concatenate((self.low_at, other.low_at)),
            np.concatenate((self.high_at, other.high_at)),
        )

    def paired(self) -> _Bins:
        """Return the bins that consist of two of these each; their number must be even.

        Of equal samples the first is the lowest and the last is the highest. NaN is left out where
        the other bin has a value.
        """
        a, b = self[0::2], self[1::2]
        second_low = (b.low < a.low) | np.isnan(a.low)
        second_high = ~(b.high < a.high) & ~np.isnan(b.high)
        return _Bins(
            np.where(second_low, b.low, a.low),
            np.where(second_high, b.high, a.high),
            np.where(second_low, b.low_at, a.low_at),
            np.where(second_high, b.high_at, a.high_at),
        )

    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """Return sample numbers and values of both extremes of each bin, in the order of time."""
        low_first = self.low_at <= self.high_at
        x = np.empty(2 * len(self))
        y = np.empty(2 * len(self))
        x[0::2] = np.where(low_first, self.low_at, self.high_at)
        x[1::2] = np.where(low_first, self.high_at, self.low_at)
        y[0::2] = np.where(low_first, self.low, self.high)
        y[1::2] = np.where(low_first, self.high, self.low)
        once = self.low_at == self.high_at
        if once.any():  # one sample is both
            kept = np.ones(x.size, dtype=bool)
            kept[1::2] = ~once
            x, y = x[kept], y[kept]
        return x, y


class _Level:
    """The newest ``capacity`` complete bins of ``size`` samples each."""

    def __init__(self, size: int, capacity: int) -> None:
        self.size = size
        self.capacity = capacity
        self.count = 0  # bins ever filled
        self.low = np.full(capacity, np.nan)
        self.high = np.full(capacity, np.nan)
        self.low_at = np.zeros(capacity, dtype=np.int64)
        self.high_at = np.zeros(capacity, dtype=np.int64)

    @property
    def oldest(self) -> int:
        """Number of the first bin that is still kept."""
        return max(0, self.count - self.capacity)

    def push(self, bins: _Bins) -> None:
        self.count += len(bins)
        bins = bins[-self.capacity :]
        places = np.arange(self.count - len(bins), self.count) % self.capacity
        self.low[places], self.high[places] = bins.low, bins.high
        self.low_at[places], self.high_at[places] = bins.low_at, bins.high_at

    def bins(self, first: int, last: int) -> _Bins:
        places = np.arange(first, max(first, last)) % self.capacity
        return _Bins(self.low[places], self.high[places], self.low_at[places], self.high_at[places])


class Pyramid:
    """Extremes of a signal over bins of 1, 2, 4, ... samples, ``capacity`` bins each.

    Memory does not grow with the length of the run: the finest bins hold its newest samples, the
    coarsest all of ``total`` samples.
    """

    def __init__(self, total: int, capacity: int = 2048) -> None:
        self._levels = [_Level(1, capacity)]
        while self._levels[-1].size * capacity < total:
            self._levels.append(_Level(self._levels[-1].size * 2, capacity))
        self._samples = 0
        # bins that do not fill a bin of the next level yet, for each level
        self._rest = [_Bins.none() for _ in self._levels]

    @property
    def samples(self) -> int:
        """Samples pushed so far."""
        return self._samples

    def push(self, values: np.ndarray) -> None:
        """Add ``values`` (n,), the next samples; NaN is not drawn."""
        bins = _Bins.of_samples(np.asarray(values, dtype=np.float64), self._samples)
        self._samples += len(bins)
        self._levels[0].push(bins)
        for k in range(1, len(self._levels)):
            bins = self._rest[k].followed_by(bins)
            whole = len(bins) // 2 * 2
            self._rest[k] = bins[whole:]
            bins = bins[:whole].paired()
            self._levels[k].push(bins)

    def view(self, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
        """Return sample numbers and values (m,) of a polyline for samples ``first`` to ``last``.

        It uses the finest bins that reach back to ``first``. Each bin gives its lowest and its
        highest sample, in the order of time, so that rising and falling slopes look alike; the
        samples that have filled no bin yet follow one by one. Each point is a sample.
        """
        first, last = max(first, 0), min(last, self._samples)
        if last <= first:
            return np.empty(0), np.empty(0)
        level = next(
            (v for v in self._levels if v.oldest * v.size <= first), self._levels[-1]
        )  # fmt: skip
        begin = max(first // level.size, level.oldest)
        end = min(-(-last // level.size), level.count)
        x, y = level.bins(begin, end).points()
        finest = self._levels[0]
        newest = max(level.count * level.size, finest.oldest)
        if level.size > 1 and newest < last:
            x = np.concatenate((x, np.arange(newest, last, dtype=np.float64)))
            y = np.concatenate((y, finest.bins(newest, last).low))
        return x, y


class Newest:
    """The newest ``capacity`` samples of a signal."""

    def __init__(self, capacity: int) -> None:
        self._ring = np.full(capacity, np.nan)
        self._count = 0

    def push(self, values: np.ndarray) -> None:
        """Add ``values`` (n,), the next samples."""
        self._count += values.size
        kept = values[-self._ring.size :]
        places = np.arange(self._count - kept.size, self._count) % self._ring.size
        self._ring[places] = kept

    def last(self, samples: int) -> np.ndarray:
        """Return the newest ``samples`` values in the order of time, or as many as are kept."""
        size = min(samples, self._count, self._ring.size)
        return self._ring[np.arange(self._count - size, self._count) % self._ring.size]


@dataclass(frozen=True)
class ErrorsSoFar:
    """Errors of a model so far: ``rms`` and ``recent`` (of the last second) in m, ``nrmse_pct``.

    They are NaN without data.
    """

    rms: float
    recent: float
    nrmse_pct: float


class RunningErrors:
    """RMS of a residual, over all samples so far and over the last ``window`` samples."""

    def __init__(self, window: int) -> None:
        self._window = max(1, window)
        self._squares = 0.0
        self._count = 0
        self._low, self._high = np.inf, -np.inf
        self._blocks: deque[np.ndarray] = deque()
        self._held = 0

    def push(self, measured: np.ndarray, model: np.ndarray) -> None:
        """Add the next ``measured`` and ``model`` (n,) in m; NaN is left out."""
        both = np.isfinite(measured) & np.isfinite(model)
        if not both.any():
            return
        seen = measured[both]
        squares = (seen - model[both]) ** 2
        self._squares += float(squares.sum())
        self._count += squares.size
        self._low = min(self._low, float(seen.min()))
        self._high = max(self._high, float(seen.max()))
        self._blocks.append(squares)
        self._held += squares.size
        while self._held - self._blocks[0].size >= self._window:
            self._held -= self._blocks.popleft().size

    def now(self) -> ErrorsSoFar:
        """Return the errors so far; NRMSE uses the range measured so far."""
        if not self._count:
            return ErrorsSoFar(np.nan, np.nan, np.nan)
        rms = float(np.sqrt(self._squares / self._count))
        last = np.concatenate(self._blocks)[-self._window :]
        span = self._high - self._low
        share = 100.0 * rms / span if span > 0.0 else np.nan
        return ErrorsSoFar(rms, float(np.sqrt(last.mean())), share)
