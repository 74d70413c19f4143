"""Analog inputs: samples of a run of the rig, on their own clock, the output's or another."""

from __future__ import annotations

import math

import numpy as np

from dearig.sim_backend.daqmx.analog.outputs import AnalogOutputWork
from dearig.sim_backend.daqmx.analog.parts import AnalogParts
from dearig.sim_backend.daqmx.card.acquisition import OwnTicks, Run, SharedTicks, Ticks
from dearig.sim_backend.daqmx.card.checks import of_kind
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.hardware import OUTPUTS
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.card.triggers import Reference, SampleTicks
from dearig.sim_backend.daqmx.card.work import CardSamples, Input
from dearig.sim_backend.daqmx.running.reading import Reader, Reading
from dearig.sim_backend.faults import FaultKind

__all__ = ["AnalogInputWork", "AnalogInputs"]

_OUTPUTS_START, _OUTPUTS_CLOCK = "ao/starttrigger", "ao/sampleclock"
_AT_ONCE = 100_000  # samples that are computed, or compared with a level, at a time
_KEPT = 1 << 22  # samples that are kept for reads from an earlier place, at most


class AnalogInputWork(Input):
    """Acquisition of the analog input ``task``."""

    def __init__(self, task: Task, parts: AnalogParts) -> None:
        super().__init__(task)
        self._parts = parts
        self._samples = CardSamples(0, 0, np.int16)

    def resources(self) -> list[str]:
        return ["analog input"]

    # start and end

    def start(self, now: float) -> None:
        task, run = self.task, self._parts.run
        if task.reference is not None:
            task.reference.rearm()
            task.reference.seen = task.armed
        if task.clock is None:
            return
        task.delivered, task.run = 0, None
        task.run_number = run.begin()
        self._samples = CardSamples(len(task.inputs), min(self.room(), _KEPT) + _AT_ONCE, np.int16)
        task.ticks = self._special_ticks(now)
        if task.ticks is None:
            task.ticks = self._usual_ticks(now)
        elif isinstance(task.ticks, SampleTicks):
            run.start = task.ticks.start
            if run.start is None:
                return  # the outputs start with the inputs in ``settle``
        self._start_outputs(now)

    def _special_ticks(self, now: float) -> SampleTicks | None:
        """Return the samples of a task with a trigger or clock from elsewhere, or None."""
        task = self.task
        outside = self._parts.timing.source(task)
        if outside == _OUTPUTS_CLOCK:
            return None
        triggered = task.trigger not in ("", _OUTPUTS_START)
        if outside or triggered or task.retriggers or task.pause is not None:
            return self._parts.triggering.sample_ticks(task, now)
        return None

    def _usual_ticks(self, now: float) -> Ticks:
        """Return the samples on the task's own clock, or on that of the outputs."""
        task, run = self.task, self._parts.run
        if self._parts.timing.source(task) == _OUTPUTS_CLOCK:
            shared = SharedTicks()
            for other in self._parts.state.tasks.values():
                generation = other.generation
                if other.kind is Kind.AO and generation and not generation.finished(now):
                    row = self._parts.wire.row(generation)
                    shared.follow(generation, generation.ticks(now) + 1, row, now)
                    run.clock_runs(now)
                    break
            return shared
        waits = task.trigger and not self._parts.routes.starts(Kind.AO)
        if not waits:
            run.start = now
        return OwnTicks(task.timing.rate, None if waits else now)

    def _start_outputs(self, now: float) -> None:
        """Start the outputs that wait for the start of the inputs."""
        for other in self._parts.state.tasks.values():
            if isinstance(other.work, AnalogOutputWork):
                other.work.with_inputs(now)

    def end(self, now: float) -> None:  # noqa: ARG002
        self.task.ticks, self.task.run = None, None
        self._samples = CardSamples(0, 0, np.int16)

    # with time

    def advance(self, now: float) -> None:
        """Find the samples and the triggers that have come by ``now``."""
        task = self.task
        if isinstance(task.ticks, SampleTicks):
            task.ticks.advance(now)
            self._parts.run.clock_runs(task.ticks.start)
        if task.reference is not None and task.ticks is not None:
            self._find_reference(task.reference, task.ticks, now)

    def _find_reference(self, reference: Reference, ticks: Ticks, now: float) -> None:
        """Find the reference trigger, after the samples before it."""
        if reference.at is not None or ticks.passed(now) < reference.before:
            return
        if reference.level is not None:
            self._find_level(reference, ticks, now)
            return
        # it counts from when the samples before it are there
        ready = float(ticks.times(reference.before - 1, reference.before)[0])
        edge = self._parts.triggering.reference_edge(reference)
        at = edge.until(max(ready, reference.seen), now)
        reference.seen = now
        if at is not None:
            reference.found(at, _samples_until(ticks, at, now))

    def _find_level(self, reference: Reference, ticks: Ticks, now: float) -> None:
        """Find the first sample with which an analog trigger's level is passed."""
        task = self.task
        place = [c.terminal for c in task.inputs].index(reference.terminal)
        coefficients = self._parts.wiring.coefficients(task.inputs[place])
        first, last = reference.checked, ticks.passed(now)
        while first < last:
            until = min(last, first + _AT_ONCE)
            counts = self._counts(first, until)[place].astype(np.float64)
            volts = np.polynomial.polynomial.polyval(counts, coefficients)
            found = reference.crossing(volts, max(1, reference.before) - first)
            if found is not None:
                sample = first + found
                reference.found(float(ticks.times(sample, sample + 1)[0]), sample)
                return
            first = reference.checked = until

    # questions

    def done(self, now: float) -> bool:
        if self.task.retriggers:
            return False
        if self.task.wanted is not None:
            return self.passed(now) >= self.task.wanted
        return self.task.clock is None

    def passed(self, now: float) -> int:
        task, reference = self.task, self.task.reference
        if task.ticks is None or (reference is not None and reference.at is None):
            return 0
        passed = max(0, task.ticks.passed(now) - self._offset)
        return passed if task.wanted is None else min(passed, task.wanted)

    @property
    def _offset(self) -> int:
        """Return the number of samples before the first one that is read."""
        return 0 if self.task.reference is None else self.task.reference.offset

    def due(self, samples: int | None, now: float) -> float | None:
        reference, ticks = self.task.reference, self.task.ticks
        if ticks is None:
            return None
        if reference is not None and reference.at is None:
            return self._reference_due(reference, ticks, now)
        return None if samples is None else ticks.due(samples + self._offset, now)

    def _reference_due(self, reference: Reference, ticks: Ticks, now: float) -> float | None:
        """Return when the reference trigger may come, or None where it is unknown."""
        if ticks.passed(now) < max(1, reference.before):
            return ticks.due(max(1, reference.before), now)
        if reference.level is not None:
            return ticks.due(ticks.passed(now) + math.ceil(ticks.rate * 0.01), now)
        edge = self._parts.triggering.reference_edge(reference)
        ready = float(ticks.times(reference.before - 1, reference.before)[0])
        return edge.after(max(ready, reference.seen))

    # reads

    def watch(self, now: float) -> None:
        task = self.task
        waiting = self.passed(now) - task.delivered
        if task.wanted is None and waiting > self.room() and not task.overwrites:
            task.failed = Code.SAMPLES_OVERWRITTEN
        if self._parts.run.overflows(now):
            task.failed = Code.SAMPLES_OVERWRITTEN

    def room(self) -> int:
        return max(self._parts.timing.buffer_size(self.task), self.task.wanted or 0)

    def at_most(self, samples: int) -> int:
        if samples > 1 and self._parts.run.fires(FaultKind.SHORT_READ) is not None:
            return samples // 2
        return samples

    def between(self, first: int, last: int) -> np.ndarray:
        return self._counts(first + self._offset, last + self._offset)

    def _counts(self, first: int, last: int) -> np.ndarray:
        """Return counts (inputs, n) of the samples ``first`` to before ``last`` since the start."""
        while self._samples.total < last:
            start = self._samples.total
            self._samples.append(self._computed(start, min(last, start + _AT_ONCE)))
        return self._samples.between(first, last)

    def _computed(self, first: int, last: int) -> np.ndarray:
        task, parts = self.task, self._parts
        if task.ticks is None:
            raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {task.name}", read=0)
        if task.run is None:
            task.run = self._new_run(task.ticks)
        counts = task.run.read(first, last)
        outputs = {
            terminal: task.ticks.commands(
                first, last, parts.wire.track_of(terminal), wired=parts.wire.is_wired(terminal)
            )
            for terminal in parts.wiring.monitored(task.inputs)
        }
        parts.run.laser = parts.wiring.laser_reading(counts, task.inputs)
        return parts.wiring.as_read(counts, outputs, task.inputs, first)

    def _new_run(self, ticks: Ticks) -> Run:
        task, wire = self.task, self._parts.wire
        skews = self._parts.conversions.skews(task)
        path, at_rest = self._parts.wiring.run(task.run_number, ticks.rate, task.inputs, skews)

        def command(start: int, end: int) -> np.ndarray:
            counts = ticks.commands(start, end, wire.track)
            return wire.gated(counts, ticks.times(start, end)) if wire.switched else counts

        return Run(path, at_rest, command)

    def still(self, samples: int, now: float) -> np.ndarray:
        parts = self._parts
        parts.run.readings += 1
        return parts.wiring.still(
            self.task.inputs,
            samples,
            parts.run.readings,
            parts.wire.film_voltage(now),
            {terminal: parts.wire.track_of(terminal).standing(now) for terminal in OUTPUTS},
            parts.run.laser,
        )

    def still_due(self, now: float) -> float:
        return now


class AnalogInputs:
    """Analog inputs of the card: what passes with time, and what programs read."""

    def __init__(self, parts: AnalogParts, reader: Reader) -> None:
        self._state = parts.state
        self._wiring = parts.wiring
        self._reader = reader

    def settle(self, now: float) -> None:
        """Find the samples and the triggers that have come by ``now``."""
        for task in list(self._state.tasks.values()):
            if isinstance(task.work, AnalogInputWork):
                task.work.advance(now)

    def read(self, task: Task, samples: int, timeout: float, most: int | None = None) -> Reading:
        """Return counts of an analog input task; see ``Reader``."""
        of_kind(task, Kind.AI, Code.NOT_AN_INPUT)
        return self._reader.read(task, samples, timeout, most)

    def scaled(self, task: Task, counts: np.ndarray) -> np.ndarray:
        """Return what a program reads for ``counts`` (channels, n): V, or a custom scale's unit."""
        values = np.empty(counts.shape)
        for row, raw, channel in zip(values, counts, task.inputs, strict=True):
            coefficients = self._wiring.coefficients(channel)
            row[:] = np.polynomial.polynomial.polyval(raw.astype(np.float64), coefficients)
            if channel.scale is not None:
                row[:] = channel.scale.scaled(row)
        return values

    def time_of(self, task: Task, sample: int) -> float:
        """Return the time of ``sample`` of ``task`` in s since 1970; the present without a run."""
        with self._state.present() as now:
            at = now
            sample += 0 if task.reference is None else task.reference.offset
            if task.ticks is not None and task.ticks.passed(now) > sample:
                at = float(task.ticks.times(sample, sample + 1)[0])
            return self._state.born_at + at


def _samples_until(ticks: Ticks, at: float, now: float) -> int:
    """Return how many samples were taken not later than ``at``."""
    first, last = 0, ticks.passed(now) + 1
    while first < last:
        middle = (first + last) // 2
        if float(ticks.times(middle, middle + 1)[0]) <= at + 1e-9:
            first = middle + 1
        else:
            last = middle
    return first
