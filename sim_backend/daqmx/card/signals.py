"""Digital signals as functions of time, and what a signal generator puts on a terminal."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dearig.sim_backend.daqmx.card.output import Generation, Track

__all__ = [
    "LOW",
    "ClockSignal",
    "Events",
    "LineSignal",
    "Series",
    "Signal",
    "SquareWave",
    "parse_square_wave",
]

#: Two times in s are one within this; a tenth of the card's fastest timebase period.
SAME_S = 1e-9
_FASTEST_WAVE = 10e6  # Hz
_MOST = 1 << 22  # edges that are searched for a prediction


class Signal:
    """Level of a terminal over time in s on the card's clock; a low one without edges.

    A signal knows its past; of its future it may know some, or nothing.
    """

    def level(self, times: np.ndarray) -> np.ndarray:
        """Return the levels (n,) bool at ``times`` (n,), those after an edge at that time."""
        return np.zeros(np.shape(times), dtype=bool)

    def edges(self, first: float, last: float, rising: bool) -> np.ndarray:  # noqa: ARG002
        """Return the times of the edges after ``first`` and until ``last``."""
        return np.empty(0)

    def count(self, first: float, last: float, rising: bool) -> int:
        """Return the number of edges after ``first`` and until ``last``."""
        return int(self.edges(first, last, rising).size)

    def nth(self, after: float, n: int, rising: bool) -> float | None:  # noqa: ARG002
        """Return the time of the ``n``-th edge after ``after``, or None where it is unknown."""
        return None

    def high(self, time: float) -> bool:
        """Return the level at ``time``."""
        return bool(self.level(np.array([time]))[0])


LOW = Signal()  #: a terminal that nothing drives: the card pulls it down


@dataclass(frozen=True)
class Series:
    """Times that repeat: ``start + offsets`` and then every ``cycle`` s.

    There are ``total`` of them from ``start`` on; None: without end, and before ``start`` too if
    ``always``.
    """

    start: float
    offsets: np.ndarray
    cycle: float
    total: int | None = None
    always: bool = False

    def until(self, time: float) -> int:
        """Return how many are not later than ``time``, counted from ``start``."""
        size = self.offsets.size
        passed = (time + SAME_S - self.start) / self.cycle
        if not np.isfinite(passed):
            return 0 if passed < 0 or self.total is None else self.total
        cycles = int(np.floor(passed))
        within = time + SAME_S - self.start - cycles * self.cycle
        found = cycles * size + int(np.searchsorted(self.offsets, within, side="right"))
        if not self.always:
            found = max(0, found)
        return found if self.total is None else min(found, self.total)

    def time(self, index: np.ndarray | int) -> np.ndarray:
        """Return the times of the numbers ``index``, the first being 0."""
        cycles, place = np.divmod(index, self.offsets.size)
        return np.asarray(self.start + cycles * self.cycle + self.offsets[place])

    def between(self, first: float, last: float) -> np.ndarray:
        """Return those after ``first`` and until ``last``."""
        return self.time(np.arange(self.until(first), self.until(last)))

    def nth(self, after: float, n: int) -> float | None:
        """Return the ``n``-th one after ``after``, or None where there are not so many."""
        index = self.until(after) + n - 1
        if self.total is not None and index >= self.total:
            return None
        return float(self.time(index))


@dataclass(frozen=True)
class SquareWave(Signal):
    """Wave of ``frequency`` Hz that is high for ``duty`` of the period, ``delay`` periods late.

    It has run since before the card was switched on.
    """

    frequency: float
    duty: float = 0.5
    delay: float = 0.0

    def _series(self, rising: bool) -> Series:
        period = 1.0 / self.frequency
        offset = (self.delay if rising else self.delay + self.duty) % 1.0 * period
        return Series(0.0, np.array([offset]), period, always=True)

    def level(self, times: np.ndarray) -> np.ndarray:
        phase = ((np.asarray(times) + SAME_S) * self.frequency - self.delay) % 1.0
        return np.asarray(phase < self.duty)

    def edges(self, first: float, last: float, rising: bool) -> np.ndarray:
        return self._series(rising).between(first, last)

    def count(self, first: float, last: float, rising: bool) -> int:
        series = self._series(rising)
        return series.until(last) - series.until(first)

    def nth(self, after: float, n: int, rising: bool) -> float | None:
        return self._series(rising).nth(after, n)


_SQUARE_WAVE = re.compile(
    r"\s*(?P<frequency>\d+(?:\.\d+)?)\s*(?P<unit>[kM]?)Hz"
    r"(?:[\s,]+(?P<duty>\d+(?:\.\d+)?)\s*%)?"
    r"(?:[\s,]+(?P<delay>\d+(?:\.\d+)?)\s*deg)?\s*"
)


def parse_square_wave(text: str) -> SquareWave:
    """Return the wave of a text such as ``1 kHz``, ``1 kHz, 25 %`` or ``100 Hz, 50 %, 90 deg``.

    The last number is by how much the wave is late. Raises ``ValueError`` with a sentence.
    """
    found = _SQUARE_WAVE.fullmatch(text)
    if found is not None:
        frequency = float(found["frequency"]) * {"": 1.0, "k": 1e3, "M": 1e6}[found["unit"]]
        duty, delay = float(found["duty"] or 50.0) / 100.0, float(found["delay"] or 0.0) / 360.0
        if 0.0 < frequency <= _FASTEST_WAVE and 0.0 < duty < 1.0:
            return SquareWave(frequency, duty, delay)
    raise ValueError(
        f"{text.strip()!r} is not a square wave; write it as '1 kHz', '1 kHz, 25 %' or "
        "'100 Hz, 50 %, 90 deg', with up to 10 MHz and a duty cycle between 0 and 100 %"
    )


class Events(Signal):
    """Short pulses at single times, such as those of a start trigger."""

    def __init__(self, times: Callable[[], Sequence[float]]) -> None:
        self._times = times

    def edges(self, first: float, last: float, rising: bool) -> np.ndarray:  # noqa: ARG002
        return np.array([t for t in self._times() if first < t <= last])

    def nth(self, after: float, n: int, rising: bool) -> float | None:  # noqa: ARG002
        later = [t for t in self._times() if t > after]
        return later[n - 1] if len(later) >= n else None


class ClockSignal(Signal):
    """Pulses of a sample clock: ``series()`` are its present times, or None while it stands."""

    def __init__(self, series: Callable[[], Series | None]) -> None:
        self._series = series

    def edges(self, first: float, last: float, rising: bool) -> np.ndarray:  # noqa: ARG002
        series = self._series()
        return np.empty(0) if series is None else series.between(first, last)

    def count(self, first: float, last: float, rising: bool) -> int:  # noqa: ARG002
        series = self._series()
        return 0 if series is None else series.until(last) - series.until(first)

    def nth(self, after: float, n: int, rising: bool) -> float | None:  # noqa: ARG002
        series = self._series()
        return None if series is None else series.nth(after, n)


class LineSignal(Signal):
    """Digital line that the card drives: single levels, and generations of samples."""

    def __init__(self) -> None:
        self._track = Track()
        self._changes: list[float] = []  # starts of the parts of the track
        self._following: tuple[float, Generation] | None = None

    def set(self, now: float, level: bool) -> None:
        """Hold ``level`` from ``now`` on."""
        self._track.set(now, int(level))
        self._changes.append(now)
        self._following = None

    def follow(self, generation: Generation, row: int) -> None:
        """Follow ``row`` of ``generation`` from its start on."""
        self._track.follow(generation, row)
        self._changes.append(generation.start)
        self._following = (generation.start, generation)

    def level(self, times: np.ndarray) -> np.ndarray:
        times = np.asarray(times, dtype=float)
        order = np.argsort(times, kind="stable")
        levels = np.empty(times.shape, dtype=bool)
        levels[order] = self._track.at(times[order]) != 0
        return levels

    def edges(self, first: float, last: float, rising: bool) -> np.ndarray:
        times = [np.array([t for t in self._changes if first < t <= last])]
        if self._following is not None:
            start, generation = self._following
            ticks = np.arange(
                max(0, int((max(first, start) - start) * generation.rate)),
                min(generation.ticks(last), _MOST) + 1,
            )
            at = generation.start + ticks / generation.rate
            times.append(at[(at > first + SAME_S) & (at <= last + SAME_S)])
        candidates = np.unique(np.concatenate(times))
        if not candidates.size:
            return candidates
        levels = self.level(np.concatenate(([first], candidates)))
        changed = levels[1:] & ~levels[:-1] if rising else levels[:-1] & ~levels[1:]
        return np.asarray(candidates[changed])

    def nth(self, after: float, n: int, rising: bool) -> float | None:
        if self._following is None or self._following[1].ended is not None:
            return None
        generation = self._following[1]
        ahead = max(generation.waveform.size, 1) * (n + 1)
        if generation.total is not None and not generation.waveform.loops:
            ahead = generation.total
        edges = self.edges(after, after + min(ahead, _MOST) / generation.rate, rising)
        return float(edges[n - 1]) if edges.size >= n else None

    def forget_before(self, time: float) -> None:
        """Discard what ended before ``time`` s."""
        self._track.forget_before(time)
        self._changes = [t for t in self._changes if t > time]
