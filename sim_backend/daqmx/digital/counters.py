"""Counter inputs: what the four counters of the card measure on digital signals."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import IntEnum

import numpy as np

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.signals import Signal
from dearig.sim_backend.daqmx.card.tasks import RISING, TIMEBASE, CounterChannel, Task
from dearig.sim_backend.daqmx.card.terminals import Terminals
from dearig.sim_backend.daqmx.card.triggers import AwaitedEdge, Edge, Pause, SampleTicks
from dearig.sim_backend.daqmx.card.work import SampledInput, Samples

__all__ = ["PULSES", "CounterInput", "Measure", "default_terminal"]

_COUNTS = 1 << 32  # the counters have 32 bits
_FEW = 64  # times for which edges are only counted
_MOST_EDGES = 1 << 20  # edges that are looked at in one step


class Measure(IntEnum):
    """What a counter measures; its values are DAQmx's."""

    COUNT_EDGES = 10125
    FREQUENCY = 10179
    PERIOD = 10256
    PULSE_WIDTH = 10359
    SEMI_PERIOD = 10289
    TWO_EDGE_SEPARATION = 10267
    ANGLE = 10360
    LENGTH = 10361
    PULSE_FREQUENCY = 15864
    PULSE_TIME = 15865
    PULSE_TICKS = 15866


#: Measurements of which a sample is two numbers.
PULSES = (Measure.PULSE_FREQUENCY, Measure.PULSE_TIME, Measure.PULSE_TICKS)
_ENCODERS = (Measure.ANGLE, Measure.LENGTH)

UP, DOWN, BY_TERMINAL = 10128, 10124, 10326  #: DAQmx: count directions
TICKS, HERTZ, SECONDS = 10304, 10373, 10364  #: DAQmx: units
DEGREES, RADIANS, METRES, INCHES = 10146, 10273, 10219, 10379
X1, X2, X4, TWO_PULSES = 10090, 10091, 10092, 10313  #: DAQmx: decodings of an encoder

#: Terminals of the counters by their part: source, gate, auxiliary (or A, Z and B).
_PINS = {
    "ctr0": {"source": 8, "gate": 9, "aux": 10},
    "ctr1": {"source": 3, "gate": 4, "aux": 11},
    "ctr2": {"source": 0, "gate": 1, "aux": 2},
    "ctr3": {"source": 5, "gate": 6, "aux": 7},
}


def default_terminal(counter: str, part: str) -> str:
    """Return the PFI terminal of ``part`` (source, gate, aux) of a counter, as the card has it."""
    return f"pfi{_PINS[counter][part]}"


class _Counting:
    """Value of a counter that counts edges or turns of an encoder, over time."""

    def __init__(self, channel: CounterChannel, signals: Callable[[str], Signal]) -> None:
        self._channel = channel
        self._signals = signals
        self._seen = 0.0
        self._value = 0
        self._offset = channel.initial  # position at a count of 0

    def start(self, now: float) -> None:
        """Begin at ``now``."""
        self._seen = now
        self._value = int(self._channel.initial) if self._is_count else 0
        self._offset = self._channel.initial

    @property
    def _is_count(self) -> bool:
        return self._channel.measure == Measure.COUNT_EDGES

    def at(self, times: np.ndarray, pause: Pause | None) -> tuple[np.ndarray, np.ndarray]:
        """Return the counts (n,) at ``times`` and the positions (n,) at which they are 0.

        The times are in rising order, and none is before the last ones.
        """
        if times.size < _FEW or self._channel.index:
            counts, offsets = np.zeros(times.size, dtype=np.int64), np.zeros(times.size)
            for i, time in enumerate(times.tolist()):
                counts[i], offsets[i] = self._advance(time, pause), self._offset
            return counts, offsets
        edges, steps = self._events(self._seen, float(times[-1]), pause)
        sums = self._value + np.concatenate(([0], np.cumsum(steps)))
        self._value, self._seen = int(sums[-1]), float(times[-1])
        counts = sums[np.searchsorted(edges, times, side="right")]
        return counts, np.full(times.size, self._offset)

    def _advance(self, time: float, pause: Pause | None) -> int:
        channel = self._channel
        if self._is_count and pause is None and channel.direction != BY_TERMINAL:
            counted = self._signals("input").count(self._seen, time, channel.edge == RISING)
            self._value += counted if channel.direction == UP else -counted
            self._seen = max(self._seen, time)
            return self._value
        reset = self._index(self._seen, time) if channel.index else None
        if reset is not None:
            self._seen, self._value, self._offset = reset, 0, channel.index_value
        _, steps = self._events(self._seen, time, pause)
        self._value += int(np.sum(steps))
        self._seen = max(self._seen, time)
        return self._value

    def _events(
        self, first: float, last: float, pause: Pause | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the times of the counter's steps, and by how much each steps."""
        if not self._is_count:
            return self._turns(first, last)
        channel = self._channel
        edges = self._signals("input").edges(first, last, channel.edge == RISING)
        if pause is not None and edges.size:
            edges = edges[pause.signal.level(edges) != pause.when_high]
        if channel.direction == BY_TERMINAL:
            steps = np.where(self._signals("direction").level(edges), 1, -1)
        else:
            steps = np.full(edges.size, 1 if channel.direction == UP else -1)
        return edges, steps

    def _turns(self, first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
        a, b = self._signals("a"), self._signals("b")
        decoding = self._channel.decoding
        if decoding == TWO_PULSES:
            up, down = a.edges(first, last, True), b.edges(first, last, True)
            return _in_order((up, np.ones(up.size)), (down, -np.ones(down.size)))
        # forwards A leads B: A rises while B is low
        parts = []
        a_up, a_down = a.edges(first, last, True), a.edges(first, last, False)
        up_forward, down_forward = ~b.level(a_up), b.level(a_down)
        if decoding == X1:
            parts = [(a_up, up_forward * 1), (a_down, ~down_forward * -1)]
        else:
            parts = [
                (a_up, np.where(up_forward, 1, -1)),
                (a_down, np.where(down_forward, 1, -1)),
            ]
        if decoding == X4:
            b_up, b_down = b.edges(first, last, True), b.edges(first, last, False)
            parts += [
                (b_up, np.where(a.level(b_up), 1, -1)),
                (b_down, np.where(a.level(b_down), -1, 1)),
            ]
        return _in_order(*parts)

    def _index(self, first: float, last: float) -> float | None:
        """Return when the index of the encoder last reset the position in this time, or None."""
        phase = self._channel.index_phase
        a_high, b_high = phase in (10040, 10041), phase in (10040, 10042)
        rises = [
            signal.edges(first, last, rising)
            for role, signal, rising in (
                ("z", self._signals("z"), True),
                ("a", self._signals("a"), a_high),
                ("b", self._signals("b"), b_high),
            )
        ]
        times = np.sort(np.concatenate(rises))
        if not times.size:
            return None
        matches = (
            self._signals("z").level(times)
            & (self._signals("a").level(times) == a_high)
            & (self._signals("b").level(times) == b_high)
        )
        found = times[matches]
        return float(found[-1]) if found.size else None


def _in_order(*parts: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    times = np.concatenate([part[0] for part in parts])
    steps = np.concatenate([part[1] for part in parts]).astype(np.int64)
    order = np.argsort(times, kind="stable")
    return times[order], steps[order]


class _Intervals:
    """Lengths of time between edges: each complete one, in s, with the time of its end."""

    def __init__(self, channel: CounterChannel, signals: Callable[[str], Signal]) -> None:
        self._channel = channel
        self._signals = signals
        self._seen = 0.0
        self._edges: list[float] = []  # those of the interval that is not complete

    def start(self, now: float) -> None:
        """Begin at ``now``."""
        self._seen = now
        self._edges = []

    def most(self, now: float) -> int:
        """Return how many more can be complete at ``now``, at most."""
        return self._signals("input").count(self._seen, now, self._channel.edge == RISING)

    @property
    def _both(self) -> bool:
        """Return True for what needs the edges of both directions."""
        return self._channel.measure not in (Measure.FREQUENCY, Measure.PERIOD)

    def _step(self, first: float, last: float) -> np.ndarray:
        """Return the edges (times, kinds) in order; the kind is 0 for a first one, 1 for others."""
        channel = self._channel
        one = self._signals("input")
        if channel.measure == Measure.TWO_EDGE_SEPARATION:
            other = self._signals("second").edges(first, last, channel.second_edge == RISING)
        elif self._both:
            other = one.edges(first, last, channel.edge != RISING)
        else:
            other = np.empty(0)
        own = one.edges(first, last, channel.edge == RISING)
        times = np.concatenate((own, other))
        kinds = np.concatenate((np.zeros(own.size), np.ones(other.size)))
        order = np.argsort(times, kind="stable")
        return np.array([times[order], kinds[order]])

    def complete(self, now: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the new complete ones (2, n) in s, and when each ended (n,).

        The second row is for pulses, whose sample is the time of either level.
        """
        values: list[tuple[float, float]] = []
        ends: list[float] = []
        first = self._seen
        pieces = max(1, math.ceil(self.most(now) / _MOST_EDGES))
        for i in range(pieces):
            last = now if i == pieces - 1 else first + (now - self._seen) / pieces
            for time, kind in self._step(first, last).T.tolist():
                self._take(time, bool(kind), values, ends)
            first = last
        self._seen = max(self._seen, now)
        return np.array(values).reshape(-1, 2).T, np.array(ends)

    def _take(
        self, time: float, other: bool, values: list[tuple[float, float]], ends: list[float]
    ) -> None:
        measure, edges = self._channel.measure, self._edges
        if measure == Measure.SEMI_PERIOD:
            if edges or not other:
                if edges:
                    values.append((time - edges[0], 0.0))
                    ends.append(time)
                self._edges = [time]
        elif measure in PULSES:
            if not other and len(edges) == 2:
                values.append((edges[1] - edges[0], time - edges[1]))
                ends.append(time)
                self._edges = [time]
            elif (other and len(edges) == 1) or (not other and not edges):
                edges.append(time)
        elif measure in (Measure.PULSE_WIDTH, Measure.TWO_EDGE_SEPARATION):
            if other and edges:
                values.append((time - edges[0], 0.0))
                ends.append(time)
                self._edges = []
            elif not other and not edges:
                edges.append(time)
        else:
            if edges:
                values.append((time - edges[0], 0.0))
                ends.append(time)
            self._edges = [time]

    def next(self, missing: int) -> float | None:
        """Return when ``missing`` more may be complete, or None where it is unknown."""
        channel = self._channel
        one = self._signals("input")
        ahead = missing if self._edges else missing + 1
        if channel.measure == Measure.TWO_EDGE_SEPARATION:
            return self._signals("second").nth(
                self._seen, max(1, missing), channel.second_edge == RISING
            )
        if channel.measure == Measure.PULSE_WIDTH:
            return one.nth(self._seen, max(1, missing), channel.edge != RISING)
        if channel.measure == Measure.SEMI_PERIOD:
            nth = max(1, ahead // 2)
            found = [one.nth(self._seen, nth, rising) for rising in (True, False)]
            return None if None in found else min(t for t in found if t is not None)
        return one.nth(self._seen, max(1, ahead), channel.edge == RISING)


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
        self._counting = _Counting(channel, self._signal)
        self._intervals = _Intervals(channel, self._signal)
        self._ready: list[np.ndarray] = []  # values that the buffer has not
        self._ends = np.empty(0)
        self._last: np.ndarray | None = None  # the newest value of a task without timing
        self._waits = AwaitedEdge()
        self._running = False

    @property
    def counts(self) -> bool:
        """Return True for a value that exists at any time; others come with edges."""
        return self.channel.measure == Measure.COUNT_EDGES or self.channel.measure in _ENCODERS

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
            self.samples = Samples(rows, self._buffer_size(self.task), np.float64)
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
