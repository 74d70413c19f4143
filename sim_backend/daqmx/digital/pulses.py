"""Counter outputs: pulses and pulse trains."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from dearig.sim_backend.daqmx.card.channels import Pulse, PulseChannel
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import TIMEBASE
from dearig.sim_backend.daqmx.card.signals import SAME_S, Series, Signal
from dearig.sim_backend.daqmx.card.tasks import Task
from dearig.sim_backend.daqmx.card.triggers import AwaitedEdge, Edge
from dearig.sim_backend.daqmx.card.work import CardWork

__all__ = ["Burst", "CounterOutput", "PulseSignal"]

_SHORTEST = 2  # ticks of the timebase from a start to the first pulse


@dataclass
class Burst:
    """Pulses from ``start`` s on: each is idle and then active, for these times in s (n,).

    The first one is idle for ``delay`` instead. With ``loops`` the n pulses repeat; ``total``
    limits their number. The burst was cut off at ``ended``.
    """

    start: float
    active: np.ndarray
    idle: np.ndarray
    delay: float
    total: int | None
    ended: float = math.inf

    def __post_init__(self) -> None:
        lengths = self.active + self.idle
        self.cycle = float(lengths.sum())
        before = np.concatenate(([0.0], np.cumsum(lengths)[:-1]))
        first = self.start + self.delay - float(self.idle[0])
        self.begins = Series(first, before + self.idle, self.cycle, self.total)
        self.ends = Series(first, before + lengths, self.cycle, self.total)

    def boundary(self, time: float) -> float:
        """Return the end of the pulse that is not over at ``time``."""
        number = self.ends.until(time - 2.0 * SAME_S)
        return float(self.ends.time(number))


class PulseSignal(Signal):
    """Output of a counter over time."""

    def __init__(self, idle_high: bool) -> None:
        self.idle_high = idle_high
        self.bursts: list[Burst] = []

    def _edges(self, burst: Burst, first: float, last: float, *, active: bool) -> np.ndarray:
        end = min(last, burst.ended)
        times = (burst.begins if active else burst.ends).between(max(first, burst.start), end)
        if active:
            return times[times < burst.ended]
        # what was cut off in a pulse goes back to idle then
        cut = first < burst.ended <= last and self._active_before_end(burst)
        return np.concatenate((times[times < burst.ended], [burst.ended])) if cut else times

    def _active_before_end(self, burst: Burst) -> bool:
        before = burst.ended - 2.0 * SAME_S
        return burst.begins.until(before) > burst.ends.until(before)

    def level(self, times: np.ndarray) -> np.ndarray:
        times = np.asarray(times, dtype=float)
        active = np.zeros(times.shape, dtype=bool)
        for burst in self.bursts:
            within = (times >= burst.start - SAME_S) & (times < burst.ended - SAME_S)
            active[within] = [
                burst.begins.until(t) > burst.ends.until(t) for t in times[within].tolist()
            ]
        return np.asarray(active != self.idle_high)

    def edges(self, first: float, last: float, rising: bool) -> np.ndarray:
        active = rising != self.idle_high
        parts = [
            self._edges(burst, first, last, active=active)
            for burst in self.bursts
            if burst.start <= last and burst.ended >= first
        ]
        return np.concatenate(parts) if parts else np.empty(0)

    def count(self, first: float, last: float, rising: bool) -> int:
        total = 0
        for burst in self.bursts:
            if burst.start <= last and burst.ended >= first:
                series = burst.begins if rising != self.idle_high else burst.ends
                if burst.ended > last:
                    total += series.until(last) - series.until(max(first, burst.start))
                else:
                    total += self._edges(burst, first, last, active=rising != self.idle_high).size
        return total

    def nth(self, after: float, n: int, rising: bool) -> float | None:
        if not self.bursts or math.isfinite(self.bursts[-1].ended):
            return None
        burst = self.bursts[-1]
        series = burst.begins if rising != self.idle_high else burst.ends
        return series.nth(max(after, burst.start), n)

    def forget_before(self, time: float) -> None:
        """Discard the bursts that ended before ``time`` s."""
        self.bursts = [b for b in self.bursts if b.ended >= time]


class CounterOutput(CardWork):
    """Pulses of the channels of ``task``.

    ``signals`` are the counters' outputs. ``trigger(task)`` is the edge that starts them, or None;
    ``clock(task, now)`` the edge of a sample clock, at which the next written pulse is taken.
    """

    may_be_implicit = True

    def __init__(
        self,
        task: Task,
        channels: list[PulseChannel],
        signals: dict[str, PulseSignal],
        trigger: Callable[[Task], Edge | None],
        clock: Callable[[Task], Edge | None],
    ) -> None:
        super().__init__(task)
        self.channels = channels
        self._signals = signals
        self._trigger = trigger
        self._clock = clock
        self._waits = AwaitedEdge()
        self._sampled: tuple[Edge, float] | None = None  # the sample clock, and until when
        self._samples = 0

    def resources(self) -> list[str]:
        return [channel.terminal for channel in self.channels]

    def signal(self, channel: PulseChannel) -> PulseSignal:
        """Return the output of ``channel``."""
        return self._signals[channel.terminal]

    def start(self, now: float) -> None:
        clock = self.task.clock
        if clock is not None and not clock.implicit and not self.task.pulses:
            raise DaqmxError(Code.OUTPUT_BUFFER_EMPTY, f"Task Name: {self.task.name}")
        for channel in self.channels:
            self.signal(channel).idle_high = channel.idle_high
            self.signal(channel).bursts = []
        edge = self._trigger(self.task)
        self._waits.begin(edge, now)
        if edge is None:
            self._begin(now)

    @property
    def total(self) -> int | None:
        """Return the number of pulses; None: without end."""
        clock = self.task.clock
        if clock is None:
            return 1
        return clock.samples if clock.finite else None

    def _begin(self, at: float) -> None:
        clock = self.task.clock
        self._samples = 0
        self._sampled = None
        buffered = self.task.pulses and clock is not None and clock.implicit
        for channel in self.channels:
            pulses = self.task.pulses if buffered else [channel.pulse]
            total = self.total
            if clock is not None and not clock.implicit:
                total = None
            elif buffered and not self.task.regenerates and total is None:
                total = len(pulses)
            delay = max(channel.delay, _SHORTEST / TIMEBASE)
            self.signal(channel).bursts.append(self._burst(channel, pulses, at, delay, total))
        if clock is not None and not clock.implicit:
            edge = self._clock(self.task)
            self._sampled = None if edge is None else (edge, at)

    @staticmethod
    def _burst(
        channel: PulseChannel,
        pulses: list[Pulse],
        at: float,
        delay: float,
        total: int | None,
    ) -> Burst:
        high = np.array([pulse.high for pulse in pulses])
        low = np.array([pulse.low for pulse in pulses])
        active, idle = (low, high) if channel.idle_high else (high, low)
        return Burst(at, active, idle, delay, total)

    def settle(self, now: float) -> None:
        while (edge := self._waits.edge) and (at := self._waits.passed(now)) is not None:
            self._begin(at)
            self._again(edge)
        if self._sampled is not None:
            edge, since = self._sampled
            for at in edge.signal.edges(since, now, edge.rising).tolist():
                if self.total is not None and self._samples >= self.total:
                    break
                self._load(self.task.pulses[self._samples % len(self.task.pulses)], at)
                self._samples += 1
            self._sampled = (edge, now)

    def _again(self, edge: Edge) -> None:
        """Wait for the next edge of a retriggerable start, after the pulses."""
        burst = self.signal(self.channels[0]).bursts[-1]
        if self.task.retriggers and burst.total is not None:
            self._waits.begin(edge, float(burst.ends.time(burst.total - 1)))

    def change(self, pulses: Mapping[str, Pulse], now: float) -> None:
        """Take ``pulses``, by counter, from the end of the present ones on."""
        for channel in self.channels:
            pulse = pulses.get(channel.terminal)
            if pulse is not None:
                channel.pulse = pulse
                if self.task.running and self.signal(channel).bursts:
                    self._load(pulse, now, channel)

    def write(self, pulses: list[Pulse], now: float) -> None:
        """Write ``pulses`` to the buffer; a train that runs takes them after the present pulse."""
        clock = self.task.clock
        sampled = clock is not None and not clock.implicit
        if not self.task.running or (sampled and not self.task.regenerates):
            self.task.pulses = self.task.pulses + pulses
        else:
            self.task.pulses = list(pulses)
            if clock is not None and clock.implicit:
                self._replace(now)

    def _replace(self, now: float) -> None:
        """Continue a buffered train with what is written now, after the present pulse."""
        channel = self.channels[0]
        signal = self.signal(channel)
        if not signal.bursts:
            return
        burst = signal.bursts[-1]
        burst.ended = burst.boundary(now)
        idle = self.task.pulses[0].high if channel.idle_high else self.task.pulses[0].low
        total = None if self.task.regenerates else len(self.task.pulses)
        signal.bursts.append(self._burst(channel, self.task.pulses, burst.ended, idle, total))

    def _load(self, pulse: Pulse, at: float, channel: PulseChannel | None = None) -> None:
        for each in self.channels if channel is None else [channel]:
            signal = self.signal(each)
            burst = signal.bursts[-1]
            if burst.start > at:  # a pulse that was loaded but has not begun is replaced
                signal.bursts.pop()
                start = burst.start
            else:
                start = burst.boundary(at)
                burst.ended = start
            total = burst.total
            if total is not None:
                total = max(1, total - burst.ends.until(start))
            idle = pulse.high if each.idle_high else pulse.low
            signal.bursts.append(self._burst(each, [pulse], start, idle, total))

    def end(self, now: float) -> None:
        self._waits.begin(None, now)
        self._sampled = None
        for channel in self.channels:
            signal = self.signal(channel)
            for burst in signal.bursts:
                burst.ended = min(burst.ended, now)

    def done(self, now: float) -> bool:
        if self.task.retriggers or self._waits.edge is not None:
            return False
        clock = self.task.clock
        if clock is not None and not clock.implicit:
            return self.total is not None and self._samples >= self.total
        bursts = self.signal(self.channels[0]).bursts
        if not bursts or bursts[-1].total is None:
            return False
        burst = bursts[-1]
        return burst.total is not None and burst.ends.until(now) >= burst.total

    def passed(self, now: float) -> int:
        clock = self.task.clock
        if clock is not None and not clock.implicit:
            return self._samples
        return sum(burst.ends.until(min(now, burst.ended)) for burst in self._own())

    def _own(self) -> list[Burst]:
        return self.signal(self.channels[0]).bursts if self.task.running else []

    def due(self, samples: int | None, now: float) -> float | None:
        if self._waits.edge is not None:
            return self._waits.due(now)
        if self._sampled is not None:
            return self._sampled[0].after(now)
        burst = self.signal(self.channels[0]).bursts[-1]
        if burst.total is not None:
            return float(burst.ends.time(burst.total - 1))
        return burst.ends.nth(now, max(1, (samples or 1) - self.passed(now)))
