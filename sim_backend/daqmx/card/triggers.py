"""When a task takes samples: start, retriggerable and pause triggers, and external clocks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.sim_backend.daqmx.card.output import TICK_TOLERANCE, Track
from dearig.sim_backend.daqmx.card.signals import Signal

__all__ = [
    "AwaitedEdge",
    "Edge",
    "EdgeTicks",
    "Pause",
    "Reference",
    "SampleTicks",
    "TriggeredTicks",
]


@dataclass(frozen=True)
class Edge:
    """Edge of a signal that a task waits for; without ``rising`` a falling one."""

    signal: Signal
    rising: bool = True

    def after(self, time: float) -> float | None:
        """Return the time of the first one after ``time``, or None where it is unknown."""
        return self.signal.nth(time, 1, self.rising)

    def until(self, first: float, last: float) -> float | None:
        """Return the time of the first one after ``first`` and until ``last``, or None."""
        edges = self.signal.edges(first, last, self.rising)
        return float(edges[0]) if edges.size else None


class AwaitedEdge:
    """The edge that a task waits for, if any; the signal is looked at once, up to each ``now``."""

    def __init__(self) -> None:
        self.edge: Edge | None = None
        self._since = 0.0  # s; edges until then do not count

    def begin(self, edge: Edge | None, since: float) -> None:
        """Wait for ``edge`` after ``since``; None: wait for nothing."""
        self.edge, self._since = edge, since

    def passed(self, now: float) -> float | None:
        """Return the time of the edge if it came until ``now``, and wait no longer; or None."""
        if self.edge is None:
            return None
        at = self.edge.until(self._since, now)
        if at is None:
            self._since = now
        else:
            self.edge = None
        return at

    def due(self, now: float = -math.inf) -> float | None:
        """Return when the edge comes, not before ``now``, or None where it is unknown."""
        return None if self.edge is None else self.edge.after(max(now, self._since))


@dataclass(frozen=True)
class Pause:
    """Level of a signal at which a task's clock stands still."""

    signal: Signal
    when_high: bool

    def holds(self, time: float) -> bool:
        """Return True if the clock stands still at ``time``."""
        return self.signal.high(time) is self.when_high

    def changes(self, first: float, last: float, *, to_pause: bool) -> np.ndarray:
        """Return when it begins (``to_pause``) or ends after ``first`` and until ``last``."""
        return self.signal.edges(first, last, self.when_high is to_pause)

    def ends_after(self, time: float) -> float | None:
        """Return when it ends after ``time``, or None where that is unknown."""
        return self.signal.nth(time, 1, not self.when_high)


@dataclass
class Reference:
    """Reference trigger of an analog input with ``before`` samples before it.

    ``terminal`` has the edge, or with ``level`` in V it is an analog input of the task. An analog
    start trigger is one without samples before it. ``at`` s and ``sample``, the first one after
    it, are known once it has come.
    """

    terminal: str
    rising: bool
    before: int
    level: float | None = None
    hysteresis: float = 0.0  # V; it must have been so far on the other side
    at: float | None = None
    sample: int = 0
    seen: float = 0.0  # s; edges after this may be it
    checked: int = 0  # samples that were compared with the level
    ready: bool = False  # True once the signal was on the other side
    starts: bool = False  # True for a start trigger

    def found(self, at: float, sample: int) -> None:
        """Note that it has come."""
        self.at, self.sample = at, sample

    def rearm(self) -> None:
        """Forget what came, for a new start."""
        self.at, self.sample, self.seen, self.checked, self.ready = None, 0, 0.0, 0, False

    def crossing(self, volts: np.ndarray, first: int) -> int | None:
        """Return the place in ``volts`` (n,) from ``first`` on where the level is passed, or None.

        The signal must have been beyond the hysteresis on the other side before.
        """
        level = self.level or 0.0
        sign = 1.0 if self.rising else -1.0
        above = sign * (volts - level) > 0.0
        below = sign * (volts - level) <= -self.hysteresis
        place = 0
        while place < volts.size:
            if not self.ready:
                armed = np.flatnonzero(below[place:])
                if not armed.size:
                    return None
                place, self.ready = place + int(armed[0]), True
            passed = np.flatnonzero(above[place:])
            if not passed.size:
                return None
            place += int(passed[0])
            if place >= first:
                return place
            self.ready = False
        return None

    @property
    def offset(self) -> int:
        """Return the number of samples before the first one that is read."""
        return self.sample - self.before


@dataclass
class _Piece:
    """Samples from number ``first`` on at ``start`` and then regularly; ``taken`` at its end."""

    first: int
    start: float
    taken: int | None = None


class SampleTicks:
    """Times of a task's samples, found with the time that passes."""

    rate: float

    @property
    def start(self) -> float | None:
        """Return the time in s of the start, or None before it."""
        raise NotImplementedError

    def advance(self, now: float) -> None:
        """Find the samples up to ``now``."""
        raise NotImplementedError

    def passed(self, now: float) -> int:
        """Return the number of samples that are complete at ``now``."""
        raise NotImplementedError

    def due(self, samples: int, now: float) -> float | None:
        """Return the time in s at which ``samples`` are complete, or None where it is unknown."""
        raise NotImplementedError

    def times(self, first: int, last: int) -> np.ndarray:
        """Return the times (n,) s of the samples from ``first`` to before ``last``."""
        raise NotImplementedError

    def commands(
        self,
        first: int,
        last: int,
        track: Track,
        *,
        wired: bool = True,  # noqa: ARG002
    ) -> np.ndarray:
        """Return the counts (n,) on the output of ``track`` at these samples."""
        return track.at(self.times(first, last))


class TriggeredTicks(SampleTicks):
    """Samples on their own clock of ``rate`` Hz, from a trigger on.

    The task is armed at ``armed`` s. Without ``trigger`` the clock starts then. With ``again`` it
    stops after so many samples, and the next edge starts it again. While ``pause`` holds it stands
    still; the part of a period that is over then counts when it goes on.
    """

    def __init__(
        self,
        rate: float,
        armed: float,
        trigger: Edge | None,
        *,
        again: int | None = None,
        pause: Pause | None = None,
    ) -> None:
        self.rate = rate
        self._trigger = trigger
        self._again = again
        self._pause = pause
        self._seen = armed
        self._left = 0.0  # s to the next sample when a pause ends
        self._paused = False
        self._pieces: list[_Piece] = []
        self._open = False
        if trigger is None:
            self._begin(armed)

    @property
    def start(self) -> float | None:
        return self._pieces[0].start if self._pieces else None

    def advance(self, now: float) -> None:
        while self._step(now):
            pass

    def _step(self, now: float) -> bool:
        """Find the next change up to ``now``; returns False if there is none."""
        if self._paused and self._pause is not None:
            ends = self._pause.changes(self._seen, now, to_pause=False)
            if not ends.size:
                self._seen = max(self._seen, now)
                return False
            self._resume(float(ends[0]))
            return True
        if not self._open:
            at = None if self._trigger is None else self._trigger.until(self._seen, now)
            if at is None:
                self._seen = max(self._seen, now)
                return False
            self._begin(at)
            return True
        piece = self._pieces[-1]
        over = math.inf
        if self._again is not None:
            done = sum(p.taken or 0 for p in self._pieces[:-1]) % self._again
            over = piece.start + (self._again - done) / self.rate
        if self._pause is not None:
            pauses = self._pause.changes(self._seen, min(now, over), to_pause=True)
            if pauses.size:
                self._hold(piece, float(pauses[0]))
                return True
            self._seen = max(self._seen, min(now, over))
        if over <= now and self._again is not None:
            piece.taken = round((over - piece.start) * self.rate)
            self._open, self._seen = False, over
            return True
        return False

    def _begin(self, at: float) -> None:
        self._open, self._seen = True, at
        if self._pause is not None and self._pause.holds(at):
            self._paused, self._left = True, 0.0
        else:
            self._pieces.append(_Piece(self._total(), at))

    def _hold(self, piece: _Piece, at: float) -> None:
        piece.taken = max(0, math.ceil((at - piece.start) * self.rate - TICK_TOLERANCE))
        self._left = max(0.0, piece.start + piece.taken / self.rate - at)
        self._paused, self._seen = True, at

    def _resume(self, at: float) -> None:
        self._paused, self._seen = False, at
        self._pieces.append(_Piece(self._total(), at + self._left))

    def _total(self) -> int:
        if not self._pieces:
            return 0
        return self._pieces[-1].first + (self._pieces[-1].taken or 0)

    def passed(self, now: float) -> int:
        self.advance(now)
        if not self._pieces:
            return 0
        piece = self._pieces[-1]
        if piece.taken is not None:
            return piece.first + piece.taken
        return piece.first + max(0, math.floor((now - piece.start) * self.rate + TICK_TOLERANCE))

    def due(self, samples: int, now: float) -> float | None:
        self.advance(now)
        if self._open and not self._paused:
            piece = self._pieces[-1]
            due = piece.start + (samples - piece.first) / self.rate
            if self._again is None and self._pause is None:
                return due
            # a pause or the end of this record may come first: look again at the next one
            ahead = [due]
            if self._pause is not None:
                ahead.append(self._pause.signal.nth(now, 1, self._pause.when_high) or math.inf)
            if self._again is not None:
                done = sum(p.taken or 0 for p in self._pieces[:-1]) % self._again
                ahead.append(piece.start + (self._again - done) / self.rate)
            return min(ahead)
        if self._paused and self._pause is not None:
            return self._pause.ends_after(self._seen)
        return None if self._trigger is None else self._trigger.after(self._seen)

    def times(self, first: int, last: int) -> np.ndarray:
        parts = []
        for i, piece in enumerate(self._pieces):
            end = self._pieces[i + 1].first if i + 1 < len(self._pieces) else last
            numbers = np.arange(max(first, piece.first), min(last, end))
            if numbers.size:
                parts.append(piece.start + (numbers - piece.first) / self.rate)
        if last > first and not parts:  # expected ones of a run that has not begun
            return self._seen + np.arange(first, last) / self.rate
        return np.concatenate(parts) if parts else np.empty(0)


class EdgeTicks(SampleTicks):
    """One sample at each edge of ``clock``, from ``trigger`` on if there is one.

    ``rate`` is what the program said about the clock; while ``pause`` holds edges do not count.
    """

    def __init__(
        self,
        rate: float,
        armed: float,
        clock: Edge,
        trigger: Edge | None = None,
        pause: Pause | None = None,
    ) -> None:
        self.rate = rate
        self._clock = clock
        self._trigger = trigger
        self._pause = pause
        self._seen = armed
        self._start = None if trigger is not None else armed
        self._dropped = 0
        self._times = np.empty(0)

    @property
    def start(self) -> float | None:
        return self._start

    def advance(self, now: float) -> None:
        if self._start is None and self._trigger is not None:
            self._start = self._trigger.until(self._seen, now)
            self._seen = now if self._start is None else self._start
        if self.start is None or now <= self._seen:
            return
        edges = self._clock.signal.edges(self._seen, now, self._clock.rising)
        if self._pause is not None and edges.size:
            edges = edges[self._pause.signal.level(edges) != self._pause.when_high]
        self._times = np.concatenate((self._times, edges))
        self._seen = now

    def passed(self, now: float) -> int:
        self.advance(now)
        return self._dropped + self._times.size

    def due(self, samples: int, now: float) -> float | None:
        missing = samples - self.passed(now)
        if missing <= 0:
            return now
        if self.start is None:
            return None if self._trigger is None else self._trigger.after(self._seen)
        if self._pause is not None:
            missing = 1
        return self._clock.signal.nth(self._seen, missing, self._clock.rising)

    def times(self, first: int, last: int) -> np.ndarray:
        known = self._times[max(0, first - self._dropped) : max(0, last - self._dropped)]
        short = last - first - known.size
        if short <= 0:
            return known
        end = float(known[-1]) if known.size else self._seen
        return np.concatenate((known, end + np.arange(1, short + 1) / self.rate))

    def drop_before(self, sample: int) -> None:
        """Discard the times of the samples before ``sample``."""
        drop = min(sample - self._dropped, self._times.size)
        if drop > 100_000:  # rarely, and many at a time
            self._times = self._times[drop:].copy()
            self._dropped += drop
