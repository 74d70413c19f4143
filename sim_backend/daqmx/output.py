"""The card's analog outputs over time: generations of samples, and single values."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

__all__ = ["TICK_TOLERANCE", "Generation", "Track", "Waveform"]

#: A tick that the clock has reached but for this part of a tick has been reached.
TICK_TOLERANCE = 1e-3


class Waveform:
    """The samples (channels, n) int16 of an output task by tick, as far as they were written.

    Where ``loops``, what was written is repeated for ever, as the card does with regeneration.
    """

    def __init__(self, channels: int, loops: bool) -> None:
        self.loops = loops
        self.written = 0  # samples a channel that the program has written
        self._row = np.empty((channels, 0), dtype=np.int16)  # ticks from _first on
        self._first = 0
        self._used = 0
        self._loop = np.empty((channels, 0), dtype=np.int16)

    @property
    def size(self) -> int:
        """Samples a channel in the buffer that is repeated; 0 where nothing is."""
        return self._loop.shape[1]

    def append(self, counts: np.ndarray) -> None:
        """Write ``counts`` (channels, n) after what was written."""
        self.written += counts.shape[1]
        if self.loops:
            self._loop = np.concatenate((self._loop, counts), axis=1)
        else:
            self._store(counts)

    def replace(self, counts: np.ndarray, tick: int) -> None:
        """Write into the repeated buffer, whose sample ``tick`` is being put out now."""
        end = self._first + self._used
        if tick + 1 > end:
            self._store(self.at(np.arange(end, tick + 1)))
        places = (self.written + np.arange(counts.shape[1])) % self.size
        self._loop = self._loop.copy()
        self._loop[:, places] = counts
        self.written += counts.shape[1]

    def at(self, ticks: np.ndarray) -> np.ndarray:
        """Samples (channels, k) at ``ticks`` (k,); beyond what was written the last one stands."""
        end = self._first + self._used
        if not self.loops:
            return self._row[:, np.clip(ticks - self._first, 0, self._used - 1)]
        counts = self._loop[:, ticks % self.size]
        past = ticks < end
        if past.any():
            counts[:, past] = self._row[:, np.maximum(ticks[past] - self._first, 0)]
        return counts

    def drop_before(self, tick: int) -> None:
        """Forget the samples before ``tick``, but for the last one."""
        drop = min(tick - self._first, self._used - 1)
        if drop > max(self._used // 2, 100_000):  # seldom, and then much
            self._row = self._row[:, drop : self._used].copy()
            self._first += drop
            self._used -= drop

    def _store(self, counts: np.ndarray) -> None:
        need = self._used + counts.shape[1]
        if need > self._row.shape[1]:
            grown = np.empty((counts.shape[0], max(need, 2 * self._row.shape[1])), dtype=np.int16)
            grown[:, : self._used] = self._row[:, : self._used]
            self._row = grown
        self._row[:, self._used : need] = counts
        self._used = need


@dataclass(eq=False)
class Generation:
    """An output task at work: ``waveform`` at ``rate`` Hz from ``start`` s, ``total`` samples.

    ``total`` is None for one that goes on until it is stopped. ``ended`` is the number of samples
    that were put out when it was stopped, or ran out of samples (``starved``). ``breaks`` is a
    tick at which it fails whatever was written.
    """

    waveform: Waveform
    rate: float
    start: float
    total: int | None
    breaks: float = math.inf
    ended: int | None = None
    starved: bool = False

    def ticks(self, now: float) -> int:
        """Whole sample periods that have passed, and at its end the samples that were put out."""
        if self.ended is not None:
            return self.ended
        passed = max(0, math.floor((now - self.start) * self.rate + TICK_TOLERANCE))
        return passed if self.total is None else min(passed, self.total)

    def finished(self, now: float) -> bool:
        """True once all samples were put out, or it has failed."""
        return self.ended is not None or (self.total is not None and self.ticks(now) >= self.total)

    def settle(self, now: float) -> float | None:
        """Find out whether it ran out of samples up to ``now``; when it did, in s."""
        if self.ended is not None:
            return None
        # a generation that has its last sample needs no more of them
        limit = self.breaks
        written = math.inf if self.waveform.loops else self.waveform.written
        if self.total is None or written < self.total:
            limit = min(limit, written)
        if self.ticks(now) < limit or (self.total is not None and self.total <= limit):
            return None
        self.ended, self.starved = int(limit), True
        return self.start + self.ended / self.rate

    def stop(self, now: float) -> None:
        """End it: the sample that stands now was the last one."""
        if self.ended is None:
            self.ended = self._standing(now) + 1

    def due(self, samples: int) -> float:
        """When ``samples`` sample periods will have passed, in s."""
        return self.start + samples / self.rate

    def at_times(self, times: np.ndarray) -> np.ndarray:
        """Counts (channels, n) that stand at ``times`` (n,) s after the start."""
        return self.at_ticks(
            np.floor((times - self.start) * self.rate + TICK_TOLERANCE).astype(np.int64)
        )

    def at_ticks(self, ticks: np.ndarray) -> np.ndarray:
        """Counts (channels, n) that stand from ``ticks`` (n,) on; after its end the last stands."""
        return self.waveform.at(np.clip(ticks, 0, self._last()))

    def _last(self) -> int:
        if self.ended is not None:
            return max(0, self.ended - 1)
        return np.iinfo(np.int64).max if self.total is None else self.total - 1

    def _standing(self, now: float) -> int:
        last = self._last()
        if not self.waveform.loops:
            last = min(last, self.waveform.written - 1)
        return min(self.ticks(now), last)


@dataclass
class _Stretch:
    """From ``start`` s on the output follows a row of ``generation``, or stands at ``counts``."""

    start: float
    counts: int
    generation: Generation | None = None
    row: int = 0


@dataclass
class Track:
    """One output over time; it stands at 0 counts from the beginning."""

    _stretches: list[_Stretch] = field(default_factory=lambda: [_Stretch(-math.inf, 0)])

    def set(self, now: float, counts: int) -> None:
        """Let the output stand at ``counts`` from ``now`` on."""
        self._stretches.append(_Stretch(now, counts))

    def follow(self, generation: Generation, row: int) -> None:
        """Let the output follow ``row`` of ``generation`` from its start on."""
        self._stretches.append(_Stretch(generation.start, 0, generation, row))

    def standing(self, now: float) -> int:
        """Counts that stand at ``now``."""
        return int(self.at(np.array([now]))[0])

    def at(self, times: np.ndarray) -> np.ndarray:
        """Counts (n,) int16 that stand at ``times`` (n,) s, in order."""
        counts = np.empty(times.size, dtype=np.int16)
        end = times.size
        for stretch in reversed(self._stretches):
            first = 0
            if stretch.start > -math.inf:
                slack = TICK_TOLERANCE / stretch.generation.rate if stretch.generation else 0.0
                first = min(end, int(np.searchsorted(times, stretch.start - slack)))
            if first < end:
                if stretch.generation is None:
                    counts[first:end] = stretch.counts
                else:
                    held = stretch.generation.at_times(times[first:end])
                    counts[first:end] = held[stretch.row]
                end = first
            if end == 0:
                break
        return counts

    def forget_before(self, time: float) -> None:
        """Drop what is over at ``time`` s."""
        while len(self._stretches) > 1 and self._stretches[1].start <= time:
            del self._stretches[0]
