"""Counter inputs: what the four counters of the card measure on digital signals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dearig.sim_backend.daqmx.card.channels import CounterChannel
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import TIMEBASE
from dearig.sim_backend.daqmx.card.signals import Signal
from dearig.sim_backend.daqmx.card.tasks import Task
from dearig.sim_backend.daqmx.card.terminals import Terminals
from dearig.sim_backend.daqmx.card.triggers import AwaitedEdge, Edge, Pause, SampleTicks
from dearig.sim_backend.daqmx.card.work import CardSamples, SampledInput
from dearig.sim_backend.daqmx.digital.counting import Counting
from dearig.sim_backend.daqmx.digital.intervals import EdgeIntervals
from dearig.sim_backend.daqmx.digital.measures import (
    ENCODERS,
    PULSES,
    TICKS,
    TWO_PULSES,
    X1,
    X2,
    X4,
    Measure,
)

__all__ = ["CounterInput"]

_COUNTS = 1 << 32  # the counters have 32 bits


class CounterInput(SampledInput):
    """Measurement of the one channel of ``task`` on the signals at ``terminals``.

    ``timing(task, now)`` makes the sample clock, ``buffer_size(task)`` is in samples,
    ``pause(task)`` what stops the counting of edges, ``armed(task)`` the edge that arms it.
    """

    def __init__(
        self,
        task: Task,
        channel: CounterChannel,
        terminals: Terminals,
        timing: Callable[[Task, float], SampleTicks],
        buffer_size: Callable[[Task], int],
        pause: Callable[[Task], Pause | None],
        armed: Callable[[Task], Edge | None],
    ) -> None:
        super().__init__(task)
        self.channel = channel
        self._terminals = terminals
        self._timing = timing
        self._buffer_size = buffer_size
        self._pause = pause
        self._armed = armed
        self._counting = Counting(channel, self._signal)
        self._intervals = EdgeIntervals(channel, self._signal)
        self._ready: list[np.ndarray] = []  # values that the buffer has not
        self._ends = np.empty(0)
        self._last: np.ndarray | None = None  # the newest value of a task without timing
        self._waits = AwaitedEdge()
        self._running = False

    @property
    def counts(self) -> bool:
        """Return True for a value that exists at any time; others come with edges."""
        return self.channel.measure == Measure.COUNT_EDGES or self.channel.measure in ENCODERS

    @property
    def may_be_implicit(self) -> bool:  # type: ignore[override]
        """Return True for a value that comes with the edges of the signal."""
        return not self.counts

    def _signal(self, role: str) -> Signal:
        return self._terminals.signal(self.channel.terminals[role])

    def resources(self) -> list[str]:
        return [self.channel.terminal]

    def start(self, now: float) -> None:
        edge = self._armed(self.task)
        self._waits.begin(edge, now)
        self._last, self._ready, self._ends = None, [], np.empty(0)
        clock = self.task.clock
        if clock is not None:
            rows = 2 if self.channel.measure in PULSES else 1
            self.samples = CardSamples(rows, self._buffer_size(self.task), np.float64)
            if not clock.implicit:
                self.ticks = self._timing(self.task, now)
        if edge is None:
            self._begin(now)

    def _begin(self, at: float) -> None:
        self._running = True
        self._counting.start(at)
        self._intervals.start(at)

    def end(self, now: float) -> None:
        super().end(now)
        self._running = False
        self._waits.begin(None, now)

    def watch(self, now: float) -> None:
        at = self._waits.passed(now)
        if at is not None:
            self._begin(at)
        if self._running and not self.counts and self.task.failed is None:
            clock = self.task.clock
            if self.samples is not None and clock is not None and clock.implicit:
                more = self._intervals.most(now) - 1
                waiting = self.samples.total - self.task.delivered
                full = waiting + more > self.samples.room and not self.task.overwrites
                if self.task.wanted is None and full:
                    self.task.failed = Code.SAMPLES_OVERWRITTEN
                    return
            values, ends = self._intervals.complete(now)
            if ends.size:
                self._ready.append(values)
                self._ends = np.concatenate((self._ends, ends))
                self._last = values[:, -1:]
                if self.samples is None:
                    self._ready, self._ends = [], np.empty(0)
        super().watch(now)

    def _new(self, now: float) -> int:
        clock = self.task.clock
        if clock is None or self.samples is None:
            return 0
        if clock.implicit:
            return self.samples.total + sum(int(part.shape[1]) for part in self._ready)
        return 0 if self.ticks is None else self.ticks.passed(now)

    def _take(self, first: int, last: int) -> np.ndarray:
        clock = self.task.clock
        if clock is not None and clock.implicit:
            values = np.concatenate(self._ready, axis=1)
            taken, rest = values[:, : last - first], values[:, last - first :]
            self._ready = [rest]
            self._ends = self._ends[last - first :]
            return self._scaled(taken)
        if self.ticks is None:
            raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {self.task.name}", read=0)
        times = self.ticks.times(first, last)
        if self.counts:
            return self._values(times)
        # at each edge of the clock the newest complete measurement
        values = np.concatenate(self._ready, axis=1) if self._ready else np.zeros((2, 0))
        known = np.concatenate((np.zeros((2, 1)), values), axis=1)
        place = np.searchsorted(self._ends, times, side="right")
        taken = known[:, place]
        keep = max(0, int(place[-1]) - 1)
        self._ready, self._ends = [values[:, keep:]], self._ends[keep:]
        return self._scaled(taken)

    def _values(self, times: np.ndarray) -> np.ndarray:
        """Return the counts or positions (1, n) at ``times``."""
        counts, offsets = self._counting.at(times, self._pause(self.task))
        channel = self.channel
        if channel.measure == Measure.COUNT_EDGES:
            return np.asarray(np.mod(counts, _COUNTS), dtype=np.float64)[np.newaxis]
        if channel.units == TICKS:
            return np.asarray(offsets + counts)[np.newaxis]
        steps = {X1: 1, X2: 2, X4: 4, TWO_PULSES: 1}[channel.decoding]
        return np.asarray(offsets + counts / steps * channel.distance)[np.newaxis]

    def _scaled(self, seconds: np.ndarray) -> np.ndarray:
        """Return intervals (2, n) in the channel's unit, as the timebase resolves them."""
        channel = self.channel
        ticks = np.rint(seconds * TIMEBASE)
        whole = np.maximum(1.0, ticks)
        if channel.measure == Measure.FREQUENCY:
            return (ticks if channel.units == TICKS else TIMEBASE / whole)[:1]
        if channel.measure == Measure.PULSE_FREQUENCY:
            period = np.maximum(1.0, ticks[0] + ticks[1])
            return np.array([TIMEBASE / period, ticks[0] / period])
        if channel.measure == Measure.PULSE_TICKS:
            return ticks
        if channel.measure == Measure.PULSE_TIME:
            return ticks / TIMEBASE
        return (ticks if channel.units == TICKS else ticks / TIMEBASE)[:1]

    def still(self, samples: int, now: float) -> np.ndarray | None:  # noqa: ARG002
        if not self._running:
            return None
        if self.counts:
            return self._values(np.array([now]))
        self.watch(now)
        return None if self._last is None else self._scaled(self._last)

    def still_due(self, now: float) -> float | None:
        if self._waits.edge is not None:
            return self._waits.due()
        return now if self.counts else self._intervals.next(1)

    def due(self, samples: int | None, now: float) -> float | None:
        if self._waits.edge is not None:
            return self._waits.due()
        clock = self.task.clock
        if clock is not None and clock.implicit and self.samples is not None:
            return self._intervals.next(max(1, (samples or 1) - self._new(now)))
        return super().due(samples, now)

    def done(self, now: float) -> bool:
        return False if self.task.clock is None else super().done(now)
