"""Decimated signals of a run in progress, and running errors.

Bins are fixed to sample numbers, so that a trace does not flicker while it scrolls. Each bin keeps
its minimum and maximum, so that no spike is lost.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

__all__ = ["ErrorsSoFar", "Pyramid", "RunningErrors"]


class _Level:
    """The newest ``capacity`` complete bins of ``size`` samples each."""

    def __init__(self, size: int, capacity: int) -> None:
        self.size = size
        self.capacity = capacity
        self.count = 0  # bins ever filled
        self.low = np.full(capacity, np.nan)
        self.high = np.full(capacity, np.nan)

    @property
    def oldest(self) -> int:
        """Number of the first bin that is still kept."""
        return max(0, self.count - self.capacity)

    def push(self, low: np.ndarray, high: np.ndarray) -> None:
        self.count += low.size
        low, high = low[-self.capacity :], high[-self.capacity :]
        places = np.arange(self.count - low.size, self.count) % self.capacity
        self.low[places] = low
        self.high[places] = high

    def bins(self, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
        places = np.arange(first, last) % self.capacity
        return self.low[places], self.high[places]


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
        # samples that do not fill a bin of the next level yet, for each level
        self._rest = [(np.empty(0), np.empty(0)) for _ in self._levels]

    @property
    def samples(self) -> int:
        """Samples pushed so far."""
        return self._samples

    def push(self, values: np.ndarray) -> None:
        """Add ``values`` (n,), the next samples; NaN is not drawn."""
        low = high = np.asarray(values, dtype=np.float64)
        self._samples += low.size
        self._levels[0].push(low, high)
        for k in range(1, len(self._levels)):
            low = np.concatenate((self._rest[k][0], low))
            high = np.concatenate((self._rest[k][1], high))
            whole = low.size // 2 * 2
            self._rest[k] = (low[whole:], high[whole:])
            # fmin and fmax ignore NaN: a bin with a gap shows its other sample
            low = np.fmin(low[0:whole:2], low[1:whole:2])
            high = np.fmax(high[0:whole:2], high[1:whole:2])
            self._levels[k].push(low, high)

    def view(self, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
        """Return sample numbers and values (m,) of a polyline for samples ``first`` to ``last``.

        It uses the finest bins that reach back to ``first``. Each bin gives its minimum and its
        maximum; the samples that have filled no bin yet follow one by one.
        """
        first, last = max(first, 0), min(last, self._samples)
        if last <= first:
            return np.empty(0), np.empty(0)
        level = next(
            (v for v in self._levels if v.oldest * v.size <= first), self._levels[-1]
        )  # fmt: skip
        begin = max(first // level.size, level.oldest)
        end = min(-(-last // level.size), level.count)
        low, high = level.bins(begin, max(end, begin))
        if level.size == 1:
            return np.arange(begin, max(end, begin), dtype=np.float64), low
        middle = (np.arange(begin, max(end, begin)) + 0.5) * level.size - 0.5
        x = np.repeat(middle, 2)
        x[0::2] -= 0.25 * level.size
        x[1::2] += 0.25 * level.size
        y = np.empty(2 * low.size)
        y[0::2], y[1::2] = low, high
        finest = self._levels[0]
        newest = max(level.count * level.size, finest.oldest)
        if newest < last:
            values, _ = finest.bins(newest, last)
            x = np.concatenate((x, np.arange(newest, last, dtype=np.float64)))
            y = np.concatenate((y, values))
        return x, y


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
