"""The whole simulated card: the analog part with digital lines, counters, triggers and routes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dearig.drivers.settings import RigSettings
from dearig.sim_backend.clock import Clock
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import (
    LINES_RATE,
    TIMEBASE,
    Channel,
    CounterChannel,
    Kind,
    Pulse,
    PulseChannel,
    SampleClock,
    State,
    Task,
    physical_names,
)
from dearig.sim_backend.daqmx.card.terminals import COUNTERS
from dearig.sim_backend.daqmx.card.triggered_device import TriggeredDevice
from dearig.sim_backend.daqmx.card.triggers import Edge
from dearig.sim_backend.daqmx.card.work import InputWork
from dearig.sim_backend.daqmx.digital.counters import CounterInput
from dearig.sim_backend.daqmx.digital.digital import (
    DigitalInput,
    DigitalOutput,
    check_clocked_lines,
)
from dearig.sim_backend.daqmx.digital.pulses import CounterOutput, PulseSignal
from dearig.sim_backend.plant import Plant

__all__ = ["SimulatedCard"]


class SimulatedCard(TriggeredDevice):
    """PCIe-6361 of the rig of ``settings`` with ``signals`` at its digital terminals.

    See ``Device`` for the analog part and ``Terminals`` for the signals.
    """

    def __init__(
        self,
        settings: RigSettings,
        plant: Plant,
        clock: Clock,
        **others: Any,
    ) -> None:
        super().__init__(settings, plant, clock, **others)
        self._sine = bool(others.get("sine"))
        self._pulses = {counter: PulseSignal(idle_high=False) for counter in COUNTERS}
        for counter, signal in self._pulses.items():
            self.terminals.provide(f"{counter}internaloutput", signal)

    def _counts(self, line: str) -> bool:
        """Return True if no task puts a level on ``line``."""
        return not any(t.kind is Kind.DO and line in t.line_names for t in self._tasks.values())

    # channels

    def add_lines(
        self, task: Task, physical: str, name: str, *, together: bool, kind: Kind = Kind.DO
    ) -> None:
        """Add digital lines, a channel each or all ``together`` in one; ``kind`` is DI or DO."""
        with self._lock:
            super().add_lines(task, physical, name, together=together, kind=kind)
            if task.work is not None:
                return
            if kind is Kind.DI:
                task.work = DigitalInput(
                    task,
                    self.terminals,
                    self.sample_ticks,
                    self.buffer_size,
                    self._counts if self._sine else None,
                )
            else:
                task.work = DigitalOutput(
                    task, self.terminals, self._put_generated, self.start_edge
                )

    def add_counter_input(self, task: Task, counter: str, name: str, **settings: Any) -> None:
        """Add the counter ``counter`` as an input; ``settings`` are of a ``CounterChannel``."""
        with self._lock:
            self._may_add(task, Kind.CI)
            if task.counters:
                raise DaqmxError(Code.SEVERAL_COUNTERS, f"Task Name: {task.name}")
            (terminal,) = self._counters_of(counter)
            ((_, called),) = self._named(task, [terminal], name)
            channel = CounterChannel(called, terminal, **settings)
            task.kind = Kind.CI
            task.counters.append(channel)
            task.work = CounterInput(
                task,
                channel,
                self.terminals,
                self.sample_ticks,
                self.buffer_size,
                self.pause_of,
                self.arm_edge,
            )

    def add_counter_output(
        self, task: Task, counter: str, name: str, kind: int, pulse: Pulse, delay: float, idle: bool
    ) -> None:
        """Add counters as outputs of ``pulse``, after ``delay`` s; ``idle`` is True for high."""
        with self._lock:
            self._may_add(task, Kind.CO)
            for terminal, called in self._named(task, self._counters_of(counter), name):
                output = f"pfi{12 + int(terminal[-1])}"
                task.counters.append(
                    PulseChannel(called, terminal, kind, pulse, delay, idle, output)
                )
            task.kind = Kind.CO
            channels = [c for c in task.counters if isinstance(c, PulseChannel)]
            task.work = CounterOutput(
                task, channels, self._pulses, self.start_edge, self.clock_edge
            )

    def _counters_of(self, physical: str) -> list[str]:
        names = physical_names(physical, self.name)
        for name in names:
            if name not in COUNTERS:
                raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {self.name}/{name}")
        return names

    def change_channel(self, task: Task, channel: Channel, field: str, value: object) -> None:
        """Set a field of a counter's channel."""
        with self._lock:
            self._not_running(task)
            setattr(channel, field, value)

    def change_pulse(self, task: Task, channel: PulseChannel, pulse: Pulse) -> None:
        """Set the pulse of a counter output, which may run."""
        with self._lock:
            now = self._settle()
            if isinstance(task.work, CounterOutput):
                task.work.change({channel.terminal: pulse}, now)
            self._notify()

    def count(self, task: Task) -> int:
        """Return the present count of a task that counts edges."""
        with self._lock:
            now = self._settle()
            if not (task.running and isinstance(task.work, CounterInput)):
                return 0
            value = task.work.still(now)
            return 0 if value is None else int(value[0, 0])

    def output_level(self, channel: PulseChannel) -> bool:
        """Return the present level of a counter output."""
        with self._lock:
            return self._pulses[channel.terminal].high(self._settle())

    # timing

    def arm_edge(self, task: Task) -> Edge | None:
        """Return the edge that arms a counter, or None where it is armed at once."""
        if task.arm is None:
            return self.start_edge(task)
        terminal, rising = task.arm
        return Edge(self.terminals.signal(terminal), rising)

    def _verify(self, task: Task) -> None:
        super()._verify(task)
        clock = task.clock
        if clock is None or clock.implicit:
            return
        if task.kind in (Kind.DI, Kind.DO):
            check_clocked_lines(task)
        elif task.kind in (Kind.CI, Kind.CO) and not self.clock_source(task):
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: SAMP_CLK_SRC; Requested Value: {clock.source or 'OnboardClock'}; a "
                f"counter needs a clock from a terminal. Task Name: {task.name}",
            )

    def samples_of(self, task: Task) -> int:
        """Return the samples per channel; refuses a number that a finite task cannot have."""
        # a single pulse, or the measurement of one, is a task
        return task.timing.samples if task.timing.implicit else super().samples_of(task)

    def set_implicit(self, task: Task, finite: bool, samples: int) -> None:
        """Let each edge of the measured signal, or each pulse, be a sample of a counter task."""
        with self._lock:
            self._not_running(task)
            if task.kind not in (Kind.CI, Kind.CO) or (
                isinstance(task.work, CounterInput) and task.work.counts
            ):
                raise DaqmxError(
                    Code.NOT_WITHOUT_CHANNELS if task.kind is Kind.EMPTY else Code.INVALID_VALUE,
                    f"Property: SampTimingType; Requested Value: Implicit; Task Name: {task.name}",
                )
            if finite and samples < 1:
                raise DaqmxError(
                    Code.INVALID_VALUE, f"Property: SampQuant.SampPerChan; Value: {samples}"
                )
            task.timing = SampleClock(task.timing.rate, "", finite, samples, implicit=True)
            task.clocked = True

    def fastest(self, task: Task) -> float:
        """Return the highest rate in Hz of the sample clock of ``task``."""
        if task.kind in (Kind.DI, Kind.DO):
            return LINES_RATE
        if task.kind in (Kind.CI, Kind.CO):
            return TIMEBASE
        return super().fastest(task)

    def buffer_size(self, task: Task) -> int:
        """Return the size of the task's buffer in samples per channel; 0 without a buffer."""
        if task.buffer is None and task.clock is not None:
            if task.kind is Kind.DO:
                return task.first_write if task.waveform is not None else 0
            if task.kind is Kind.CO and isinstance(task.work, CounterOutput):
                return len(task.work.written)
            if task.clock.implicit and not task.clock.finite:
                # the rate is not known; DAQmx then takes the largest of its sizes below 1 MHz
                return max(1_000_000, task.clock.samples)
        return super().buffer_size(task)

    def set_arm(self, task: Task, edge: tuple[str, bool] | None) -> None:
        """Let an edge of a terminal (True: rising) arm a counter input."""
        with self._lock:
            self._not_running(task)
            self._of_kind(task, Kind.CI)
            task.arm = edge and (edge[0] and self.terminals.name(edge[0]), edge[1])

    # time

    def _settle_before(self, now: float) -> None:
        """Let the outputs of lines do what is due, until a watchdog takes them."""
        expires = min(
            (
                t.watchdog.deadline
                for t in self._tasks.values()
                if t.watchdog is not None and t.watchdog.deadline is not None
            ),
            default=math.inf,
        )
        for task in list(self._tasks.values()):
            if isinstance(task.work, DigitalOutput) and task.running:
                task.work.settle(min(now, expires))
                if expires <= now and task.clock is not None:
                    task.work.end(expires)
                    task.failed = Code.WRITE_AFTER_WATCHDOG

    def _expired_watchdog(self) -> bool:
        return any(t.watchdog is not None and t.watchdog.expired for t in self._tasks.values())

    def _put_generated(self, line: str, level: bool, now: float) -> None:
        """Set a line from a generation; one that a watchdog has taken keeps its level."""
        if not self._expired_watchdog():
            self._put_line(line, level, now)

    def _settle_after(self, now: float) -> None:
        """Make the pulses, find triggers that have come, and take the samples of lines."""
        tasks = [task for task in self._tasks.values() if task.running]
        for task in tasks:
            if isinstance(task.work, CounterOutput):
                task.work.settle(now)
        super()._settle_after(now)
        for task in tasks:
            if isinstance(task.work, InputWork):
                task.work.settle(now)
        for line in self.terminals.lines.values():
            line.forget_before(now)

    # states

    def start(self, task: Task) -> None:
        """Start ``task``: at once, or to wait for its clock or trigger."""
        with self._lock:
            self._not_running(task)
            if task.kind is Kind.DO and task.clock is not None:
                self._check_watchdog(task)
                self._may_generate(task)
            if task.pause is not None and not task.pause[0]:
                raise DaqmxError(
                    Code.INVALID_VALUE,
                    f"Property: PauseTrig.DigLvl.Src is not set; Task Name: {task.name}",
                )
            super().start(task)
            if task.work is None:
                return
            self._route(task)
            try:
                task.work.start(task.armed)
            except DaqmxError:
                self._end(task, task.armed)
                raise
            self._notify()

    def _route(self, task: Task) -> None:
        """Put the pulses of a counter output task on its terminals."""
        for channel in task.counters:
            if isinstance(channel, PulseChannel):
                self.terminals.connect(f"{channel.terminal}internaloutput", channel.output)

    def reset(self, device: str) -> None:
        """Abort every task, 0 V on every output, every line low and an input again."""
        with self._lock:
            super().reset(device)
            self.terminals.release()

    def _ahead(self, task: Task, samples: int | None, now: float) -> float | None:
        if task.work is not None:
            return task.work.due(samples or 1, now)
        return super()._ahead(task, samples, now)

    def _resources(self, task: Task) -> list[str]:
        if task.work is not None:
            return task.work.resources()
        if task.kind is Kind.CO:
            return [channel.terminal for channel in task.counters if task.counters]
        return super()._resources(task)

    def _end(self, task: Task, now: float) -> None:
        if task.work is not None and task.running:
            self._observe(task, now)
            task.work.end(now)
        super()._end(task, now)

    def _done(self, task: Task, now: float) -> bool:
        if task.work is not None:
            return not task.running or task.work.done(now)
        return super()._done(task, now)

    def _acquired(self, task: Task, now: float) -> int:
        if task.work is not None:
            return task.work.passed(now) if task.running else 0
        return super()._acquired(task, now)

    def generated(self, task: Task) -> int:
        """Return the samples per channel that were output since the start."""
        if task.work is None:
            return super().generated(task)
        with self._lock:
            return task.work.passed(self._settle()) if task.running else 0

    def _put_line(self, line: str, level: bool, now: float) -> None:
        self._wire.follow(now, self._oldest)
        super()._put_line(line, level, now)
        generated = any(
            t.generation is not None and line in t.line_names for t in self._tasks.values()
        )
        if not generated:
            self.terminals.drive(line).set(now, level)

    # reading and writing

    def read_samples(
        self, task: Task, samples: int, timeout: float, most: int | None = None
    ) -> tuple[np.ndarray, bool]:
        """Return the next ``samples`` (rows, n) of lines or of a counter, and if they are all.

        -1: all present, or all of a finite task; ``most`` bounds their number then.
        """
        work = task.work
        if not isinstance(work, InputWork):
            raise DaqmxError(Code.NOT_AN_INPUT, f"Task Name: {task.name}", read=0)
        with self._lock:
            self._settle()
            self._raise_failure(task, read=0)
            started = not task.running
            if started:
                self.start(task)
                task.by_read = True
        if task.clock is None:
            return self._read_at_once(task, work, max(1, samples), timeout, started)

        def attempt(now: float, last: bool) -> tuple[tuple[np.ndarray, bool] | None, float | None]:
            self._raise_failure(task, read=0)
            buffer = work.buffered()
            work.settle(now)
            self._raise_failure(task, read=0)
            wanted = self._wanted(task, samples, buffer.taken, buffer.waiting)
            if most is not None:
                wanted = min(wanted, most)
            if buffer.waiting >= wanted or last:
                complete = buffer.waiting >= wanted
                values = buffer.take(min(wanted, buffer.waiting))
                task.delivered = buffer.taken
                return (values, complete), None
            return None, work.due(buffer.taken + wanted, now)

        values = self._wait(timeout, attempt)
        with self._lock:
            if task.by_read and task.wanted is not None and task.delivered >= task.wanted:
                self.stop(task)
        return values

    @staticmethod
    def _wanted(task: Task, samples: int, taken: int, waiting: int) -> int:
        if task.wanted is None:
            return waiting if samples == -1 else samples
        left = task.wanted - taken
        if samples > 0 and left == 0:
            raise DaqmxError(
                Code.SAMPLES_NEVER_AVAILABLE, f"Task Name: {task.name}; Samples Left: 0", read=0
            )
        return left if samples == -1 else min(samples, left)

    def _read_at_once(
        self, task: Task, work: InputWork, samples: int, timeout: float, started: bool
    ) -> tuple[np.ndarray, bool]:
        """Return ``samples`` of a task without timing, one after the other."""

        def attempt(now: float, last: bool) -> tuple[np.ndarray | None, float | None]:
            value = work.still(now)
            if value is None and last:
                raise DaqmxError(Code.SAMPLES_NOT_YET_AVAILABLE, f"Task Name: {task.name}", read=0)
            return value, None if value is not None else work.still_due(now)

        values = [self._wait(timeout, attempt) for _ in range(samples)]
        if started:
            self.stop(task)
        return np.concatenate(values, axis=1), True

    def available(self, task: Task) -> int:
        """Return the samples per channel that are acquired and not read."""
        if not isinstance(task.work, InputWork):
            return super().available(task)
        with self._lock:
            self._settle()
            return 0 if task.work.samples is None else task.work.samples.waiting

    def times_of_last(self, task: Task, samples: int) -> tuple[float, float]:
        """Return how long ago the first of the last ``samples`` was taken, and their interval.

        Both in s; for digital inputs on a sample clock.
        """
        with self._lock:
            rate = task.timing.rate
            ticks = task.work.ticks if isinstance(task.work, InputWork) else None
            if ticks is None or not samples:  # it came to its end with this read
                return samples / rate, 1.0 / rate
            first = task.delivered - samples
            return self._now() - float(ticks.times(first, first + 1)[0]), 1.0 / rate

    def write_digital(
        self, task: Task, levels: np.ndarray, auto_start: bool, timeout: float
    ) -> int:
        """Write ``levels`` (lines, n) to digital outputs; returns the samples per channel."""
        with self._lock:
            self._of_kind(task, Kind.DO, Code.NOT_AN_OUTPUT)
            self._settle()
            self._raise_failure(task, written=0)
            if levels.shape[1] == 0:
                return 0
            if task.clock is None:
                self.write_lines(task, levels[:, -1].tolist(), auto_start)
                return int(levels.shape[1])
            self._check_watchdog(task)
        return self._write_buffered(task, levels.astype(np.int16), auto_start, timeout)

    def _check_watchdog(self, task: Task) -> None:
        if self._expired_watchdog():
            raise DaqmxError(Code.WRITE_AFTER_WATCHDOG, f"Task Name: {task.name}", written=0)

    def write_pulses(self, task: Task, pulses: list[Pulse], auto_start: bool) -> int:
        """Write pulses to a counter output: the next ones, or those of a buffered train."""
        with self._lock:
            now = self._settle()
            work = task.work
            if not isinstance(work, CounterOutput):
                raise DaqmxError(Code.NOT_AN_OUTPUT, f"Task Name: {task.name}", written=0)
            clock = task.clock
            # a train of one pulse after the other has no buffer until several are written
            at_once = clock is None or (clock.implicit and not work.written and len(pulses) == 1)
            if at_once:
                if not (task.running or auto_start):
                    raise DaqmxError(Code.WRITE_WITHOUT_START, f"Task Name: {task.name}", written=0)
                work.change(
                    {c.terminal: p for c, p in zip(work.channels, pulses, strict=False)}, now
                )
            else:
                if not task.running:
                    self._verify(task)
                    self._reserve(task)
                    task.state = max(task.state, State.COMMITTED, key=lambda state: state.value)
                work.write(pulses, now)
            if auto_start and not task.running:
                self.start(task)
            self._notify()
            return len(pulses)
