"""Decimated signals of a run in progress, and running errors.

Bins are fixed to sample numbers, so that a trace does not flicker while it scrolls. Each bin keeps
its lowest and its highest sample, so that no spike is lost.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

__all__ = ["ErrorsSoFar", "Newest", "Pyramid", "RunningErrors"]


# Bins are (4, n) arrays: the lowest value of each bin, the highest, and the numbers of their
# samples, which float64 holds exactly below 2**53
_LOW, _HIGH, _LOW_AT, _HIGH_AT = range(4)


def _of_samples(values: np.ndarray, first: int) -> np.ndarray:
    """Return bins of one sample each; ``first`` is the number of the first of ``values`` (n,)."""
    bins = np.empty((4, values.size))
    bins[_LOW] = bins[_HIGH] = values
    bins[_LOW_AT] = bins[_HIGH_AT] = np.arange(first, first + values.size)
    return bins


def _paired_samples(values: np.ndarray, first: int) -> np.ndarray:
    """Return bins of two samples each; as ``_paired`` of bins of one sample, and faster."""
    a, b = values[0::2], values[1::2]
    pairs = np.empty((4, a.size))
    np.fmin(a, b, out=pairs[_LOW])
    np.fmax(a, b, out=pairs[_HIGH])
    at = np.arange(first, first + values.size, 2)
    np.add(at, pairs[_LOW] != a, out=pairs[_LOW_AT])
    np.add(at, pairs[_HIGH] == b, out=pairs[_HIGH_AT])
    return pairs


def _paired(bins: np.ndarray) -> np.ndarray:
    """Return the bins (4, n/2) that consist of two of ``bins`` (4, n) each; n is even.

    Of equal samples the first is the lowest and the last is the highest. NaN is left out where the
    other bin has a value.
    """
    a, b = bins[:, 0::2], bins[:, 1::2]
    pairs = np.empty((4, a.shape[1]))
    np.fmin(a[_LOW], b[_LOW], out=pairs[_LOW])
    np.fmax(a[_HIGH], b[_HIGH], out=pairs[_HIGH])
    # a comparison with NaN is false: the place is then that of the other bin
    pairs[_LOW_AT] = np.where(pairs[_LOW] == a[_LOW], a[_LOW_AT], b[_LOW_AT])
    pairs[_HIGH_AT] = np.where(pairs[_HIGH] == b[_HIGH], b[_HIGH_AT], a[_HIGH_AT])
    return pairs


def _points(bins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return sample numbers and values (m,) of both extremes of each bin, in the order of time."""
    low_first = bins[_LOW_AT] <= bins[_HIGH_AT]
    x, y = np.empty((2, 2 * bins.shape[1]))
    x[0::2] = np.where(low_first, bins[_LOW_AT], bins[_HIGH_AT])
    x[1::2] = np.where(low_first, bins[_HIGH_AT], bins[_LOW_AT])
    y[0::2] = np.where(low_first, bins[_LOW], bins[_HIGH])
    y[1::2] = np.where(low_first, bins[_HIGH], bins[_LOW])
    once = bins[_LOW_AT] == bins[_HIGH_AT]
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
        self.kept = np.full((4, capacity), np.nan)

    @property
    def oldest(self) -> int:
        """Number of the first bin that is still kept."""
        return max(0, self.count - self.capacity)

    def push(self, bins: np.ndarray, count: int) -> None:
        """Add ``count`` bins, of which the last ones are ``bins``."""
        self.count += count
        bins = bins[:, -self.capacity :]
        start = (self.count - bins.shape[1]) % self.capacity
        before_end = min(bins.shape[1], self.capacity - start)
        self.kept[:, start : start + before_end] = bins[:, :before_end]
        self.kept[:, : bins.shape[1] - before_end] = bins[:, before_end:]

    def bins(self, first: int, last: int) -> np.ndarray:
        return self.kept[:, np.arange(first, max(first, last)) % self.capacity]


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
        self._odd = np.empty(0)  # a sample that does not fill a bin of two yet
        # bins of each level, but the finest, that do not fill one of the next level yet
        self._rest = [np.empty((4, 0)) for _ in self._levels[1:]]

    @property
    def samples(self) -> int:
        """Samples pushed so far."""
        return self._samples

    def push(self, values: np.ndarray) -> None:
        """Add ``values`` (n,), the next samples; NaN is not drawn."""
        values = np.asarray(values, dtype=np.float64)
        first, finest = self._samples, self._levels[0]
        self._samples += values.size
        newest = values[-finest.capacity :]
        finest.push(_of_samples(newest, self._samples - newest.size), values.size)
        first -= self._odd.size
        values = np.concatenate((self._odd, values))
        whole = values.size // 2 * 2
        self._odd = values[whole:]
        bins = _paired_samples(values[:whole], first)
        for k, level in enumerate(self._levels[1:]):
            level.push(bins, bins.shape[1])
            bins = np.concatenate((self._rest[k], bins), axis=1)
            whole = bins.shape[1] // 2 * 2
            self._rest[k] = bins[:, whole:].copy()
            bins = _paired(bins[:, :whole])

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
        x, y = _points(level.bins(begin, end))
        finest = self._levels[0]
        newest = max(level.count * level.size, finest.oldest)
        if level.size > 1 and newest < last:
            x = np.concatenate((x, np.arange(newest, last, dtype=np.float64)))
            y = np.concatenate((y, finest.bins(newest, last)[_LOW]))
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
