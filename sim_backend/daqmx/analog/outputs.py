"""Analog outputs: single values, and generations on a sample clock."""

from __future__ import annotations

import numpy as np

from dearig.drivers.channels import COUNT_MAX, COUNT_MIN
from dearig.sim_backend.daqmx.analog.parts import AnalogParts
from dearig.sim_backend.daqmx.card.acquisition import OwnTicks, SharedTicks
from dearig.sim_backend.daqmx.card.checks import of_kind, raise_failure
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import CURRENT_WRITE, WRITE_OFFSET, WRITE_RELATIVE_TO
from dearig.sim_backend.daqmx.card.output import Generation
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.card.work import CardWork
from dearig.sim_backend.daqmx.running.output_buffer import OutputBuffer, may_generate
from dearig.sim_backend.daqmx.running.states import TaskStates

__all__ = ["AnalogOutputWork", "AnalogOutputs"]

_INPUTS_START = "ai/starttrigger"


class AnalogOutputWork(CardWork):
    """Generation of an analog output ``task``; without a clock its values are set by writes."""

    def __init__(self, task: Task, parts: AnalogParts) -> None:
        super().__init__(task)
        self._parts = parts

    def check_start(self) -> None:
        if self.task.clock is not None:
            may_generate(self.task)

    def resources(self) -> list[str]:
        engine = ["analog output timing"] if self.task.clock is not None else []
        return engine + [channel.terminal for channel in self.task.outputs]

    def start(self, now: float) -> None:
        trigger = self.task.trigger
        waits = trigger and not (trigger == _INPUTS_START and self._parts.routes.starts(Kind.AI))
        if self.task.clock is not None and not waits:
            self.begin(now)

    def with_inputs(self, now: float) -> None:
        """Begin if the task waits for the start of the inputs."""
        task = self.task
        if task.running and task.generation is None and task.trigger == _INPUTS_START:
            self.begin(now)

    def begin(self, at: float) -> None:
        """Begin the generation, and the samples of the inputs on its clock."""
        task, clock, run = self.task, self.task.clock, self._parts.run
        if clock is None:
            return
        if task.waveform is None:
            raise DaqmxError(Code.OUTPUT_BUFFER_EMPTY, f"Task Name: {task.name}")
        generation = Generation(
            task.waveform, clock.rate, at, clock.samples if clock.finite else None
        )
        task.generation = generation
        self._parts.wire.begin(generation, [c.terminal for c in task.outputs], task.client)
        for reader in self._parts.state.tasks.values():
            if reader.kind is not Kind.AI or not reader.running:
                continue
            ticks = reader.ticks
            if isinstance(ticks, SharedTicks):
                ticks.follow(generation, 0, self._parts.wire.row(generation), at)
            elif (
                isinstance(ticks, OwnTicks)
                and ticks.start is None
                and reader.trigger == "ao/starttrigger"
            ):
                ticks.start = run.start = at
        run.clock_runs(at)
        fails = run.underflow_tick(at, clock.rate)
        if fails is not None:
            generation.breaks = min(generation.breaks, fails)

    def begin_by_edge(self, now: float) -> None:
        """Begin if the trigger has come by ``now``, again if the task is retriggerable."""
        task = self.task
        edge = self._parts.triggering.start_edge(task)
        if edge is None or task.clock is None:
            return
        while True:
            since = task.armed
            if task.generation is not None:
                generation = task.generation
                if not task.retriggers or generation.total is None or not generation.finished(now):
                    return
                since = max(since, generation.due(generation.total))
            at = edge.until(since, now)
            if at is None:
                task.armed = max(since, now)
                return
            if task.generation is not None:
                self._parts.wire.follow(at)
                self._parts.wire.end(task.generation)
            self.begin(at)

    def end(self, now: float) -> None:
        generation = self.task.generation
        if generation is not None:
            wire = self._parts.wire
            generation.stop(now)
            wire.follow(now)
            wire.end(generation)
            self.task.generation = None
            wire.forget(now)

    def done(self, now: float) -> bool:
        if self.task.retriggers:
            return False
        if self.task.clock is None:
            return True
        return self.task.generation is not None and self.task.generation.finished(now)

    def passed(self, now: float) -> int:
        return 0 if self.task.generation is None else self.task.generation.ticks(now)

    def due(self, samples: int | None, now: float) -> float | None:  # noqa: ARG002
        if self.task.generation is None:
            edge = self._parts.triggering.start_edge(self.task)
            return None if edge is None else edge.after(self.task.armed)
        return None if samples is None else self.task.generation.due(samples)


class AnalogOutputs:
    """Analog outputs of the card: what programs write to them, and what passes with time."""

    def __init__(self, parts: AnalogParts, states: TaskStates, buffer: OutputBuffer) -> None:
        self._state = parts.state
        self._wire = parts.wire
        self._states = states
        self._buffer = buffer

    # with time

    def settle(self, now: float) -> None:
        """Find generations that ran out of samples, and add the output to its history."""
        for task in self._state.tasks.values():
            generation = task.generation
            if generation is not None and generation.settle(now) is not None:
                task.failed = Code.OUTPUT_STARVED
        self._wire.follow(now)

    def start_by_edges(self, now: float) -> None:
        """Start the outputs whose trigger has come."""
        for task in list(self._state.tasks.values()):
            if isinstance(task.work, AnalogOutputWork) and task.running:
                task.work.begin_by_edge(now)

    # writes

    @staticmethod
    def to_counts(task: Task, volts: np.ndarray) -> np.ndarray:
        """Return counts (channels, n) for ``volts`` (channels, n); refuses values out of range."""
        counts = np.empty(volts.shape, dtype=np.int16)
        for row, values, channel in zip(counts, volts, task.outputs, strict=True):
            low, high = channel.limits
            slack = 1e-9 * max(abs(low), abs(high))  # of the rounding of a program's own arithmetic
            beyond = ~((values >= low - slack) & (values <= high + slack))  # includes NaN
            held = values if channel.scale is None else channel.scale.pre_scaled(values)
            if beyond.any():
                raise DaqmxError(
                    Code.INVALID_SAMPLE,
                    f"Value: {values[int(np.argmax(beyond))]:g}; Minimum Value: {low:g}; "
                    f"Maximum Value: {high:g}; Channel Name: {channel.name}",
                    written=0,
                )
            step = channel.range / (COUNT_MAX + 1)
            row[:] = np.clip(np.rint(held / step), COUNT_MIN, COUNT_MAX)
        return counts

    def write(self, task: Task, counts: np.ndarray, auto_start: bool, timeout: float) -> int:
        """Write ``counts`` (channels, n) to an output task; returns the samples per channel.

        ``timeout`` is in s; a negative one is unlimited.
        """
        with self._state.present() as now:
            of_kind(task, Kind.AO, Code.NOT_AN_OUTPUT)
            _check_place(task)
            raise_failure(task, written=0)
            if counts.shape[1] == 0:
                return 0
            if task.clock is None:
                return self._write_still(task, counts, auto_start, now)
        return self._buffer.write(task, counts, auto_start, timeout)

    def _write_still(self, task: Task, counts: np.ndarray, auto_start: bool, now: float) -> int:
        if not (auto_start or task.running):
            raise DaqmxError(Code.WRITE_WITHOUT_START, f"Task Name: {task.name}", written=0)
        self._states.check_free(task)
        for row, channel in zip(counts, task.outputs, strict=True):
            self.hold(channel.terminal, int(row[-1]), now, task.client)
        self._state.notify()
        return int(counts.shape[1])

    def hold(self, terminal: str, counts: int, now: float, client: str = "") -> None:
        """Hold the output ``terminal`` at ``counts`` from ``now`` on."""
        self._wire.set_output(terminal, counts, now, client)
        self._wire.forget(now)


def _check_place(task: Task) -> None:
    """Refuse a write to another place than where the last one ended."""
    kept = task.kept_properties
    if kept.get(WRITE_RELATIVE_TO, CURRENT_WRITE) != CURRENT_WRITE or kept.get(WRITE_OFFSET, 0):
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Properties: {WRITE_RELATIVE_TO}, {WRITE_OFFSET}; only the current position without "
            f"offset is simulated. Task Name: {task.name}",
        )
