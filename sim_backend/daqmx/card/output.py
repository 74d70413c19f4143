"""Analog outputs of the card over time: generations of samples, and single values."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

__all__ = ["TICK_TOLERANCE", "Generation", "Track", "Waveform"]

#: Tolerance in ticks of the clock's rounding when ticks are counted.
TICK_TOLERANCE = 1e-3


class Waveform:
    """Samples (channels, n) int16 of an output task by tick, as far as they were written.

    With ``loops`` the written samples repeat without end, as with the card's regeneration.
    """

    def __init__(self, channels: int, loops: bool) -> None:
        self.loops = loops
        self.written = 0  # samples per channel that the program has written
        self._row = np.empty((channels, 0), dtype=np.int16)  # ticks from _first on
        self._first = 0
        self._used = 0
        self._loop = np.empty((channels, 0), dtype=np.int16)

    @property
    def size(self) -> int:
        """Return the samples per channel in the repeated buffer; 0 without repetition."""
        return self._loop.shape[1]

    def append(self, counts: np.ndarray) -> None:
        """Append ``counts`` (channels, n) to the written samples."""
        self.written += counts.shape[1]
        if self.loops:
            self._loop = np.concatenate((self._loop, counts), axis=1)
        else:
            self._store(counts)

    def replace(self, counts: np.ndarray, tick: int) -> None:
        """Write into the repeated buffer, whose sample ``tick`` is on the output now."""
        end = self._first + self._used
        if tick + 1 > end:
            self._store(self.at(np.arange(end, tick + 1)))
        places = (self.written + np.arange(counts.shape[1])) % self.size
        self._loop = self._loop.copy()
        self._loop[:, places] = counts
        self.written += counts.shape[1]

    def at(self, ticks: np.ndarray) -> np.ndarray:
        """Return samples (channels, k) at ``ticks`` (k,); the last written one is held."""
        end = self._first + self._used
        if not self.loops:
            return self._row[:, np.clip(ticks - self._first, 0, self._used - 1)]
        counts = self._loop[:, ticks % self.size]
        past = ticks < end
        if past.any():
            counts[:, past] = self._row[:, np.maximum(ticks[past] - self._first, 0)]
        return counts

    def drop_before(self, tick: int) -> None:
        """Discard the samples before ``tick`` except the last one."""
        drop = min(tick - self._first, self._used - 1)
        if drop > max(self._used // 2, 100_000):  # rarely, and many at a time
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
    """Generation of an output task: ``waveform`` at ``rate`` Hz from ``start`` s.

    It has ``total`` samples, or None for a continuous one. ``ended`` is the number of samples that
    were output when it was stopped or ran out of samples (``starved``). ``breaks`` is a tick at
    which it fails regardless of what was written.
    """

    waveform: Waveform
    rate: float
    start: float
    total: int | None
    breaks: float = math.inf
    ended: int | None = None
    starved: bool = False

    def ticks(self, now: float) -> int:
        """Return the number of whole sample periods so far, or of the output samples at its end."""
        if self.ended is not None:
            return self.ended
        passed = max(0, math.floor((now - self.start) * self.rate + TICK_TOLERANCE))
        return passed if self.total is None else min(passed, self.total)

    def finished(self, now: float) -> bool:
        """Return True once all samples were output, or it has failed."""
        return self.ended is not None or (self.total is not None and self.ticks(now) >= self.total)

    def settle(self, now: float) -> float | None:
        """End it where it ran out of samples by ``now``; returns the time of that in s, or None."""
        if self.ended is not None:
            return None
        # a generation with all its samples cannot run out
        limit = self.breaks
        written = math.inf if self.waveform.loops else self.waveform.written
        if self.total is None or written < self.total:
            limit = min(limit, written)
        if self.ticks(now) < limit or (self.total is not None and self.total <= limit):
            return None
        self.ended, self.starved = int(limit), True
        return self.start + self.ended / self.rate

    def stop(self, now: float) -> None:
        """End the generation: the present sample is its last one."""
        if self.ended is None:
            self.ended = self._standing(now) + 1

    def due(self, samples: int) -> float:
        """Return the time in s at which ``samples`` sample periods are over."""
        return self.start + samples / self.rate

    def at_times(self, times: np.ndarray) -> np.ndarray:
        """Return the output counts (channels, n) at ``times`` (n,) s after the start."""
        return self.at_ticks(
            np.floor((times - self.start) * self.rate + TICK_TOLERANCE).astype(np.int64)
        )

    def at_ticks(self, ticks: np.ndarray) -> np.ndarray:
        """Return the output counts (channels, n) from ``ticks`` (n,) on; the last one is held."""
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
    """Part of a track: from ``start`` s on a row of ``generation``, or constant ``counts``."""

    start: float
    counts: int
    generation: Generation | None = None
    row: int = 0


@dataclass
class Track:
    """One output over time; it starts at 0 counts."""

    _stretches: list[_Stretch] = field(default_factory=lambda: [_Stretch(-math.inf, 0)])

    def set(self, now: float, counts: int) -> None:
        """Hold the output at ``counts`` from ``now`` on."""
        self._stretches.append(_Stretch(now, counts))

    def follow(self, generation: Generation, row: int) -> None:
        """Make the output follow ``row`` of ``generation`` from its start on."""
        self._stretches.append(_Stretch(generation.start, 0, generation, row))

    def standing(self, now: float) -> int:
        """Return the output counts at ``now``."""
        return int(self.at(np.array([now]))[0])

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the output counts (n,) int16 at ``times`` (n,) s, in order."""
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
        """Discard parts that end before ``time`` s."""
        while len(self._stretches) > 1 and self._stretches[1].start <= time:
            del self._stretches[0]
