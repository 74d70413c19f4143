"""Triggers, clocks from outside and routes of the simulated card, for its analog part too."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from dearig.drivers.settings import RigSettings
from dearig.sim_backend.clock import Clock
from dearig.sim_backend.daqmx.card.acquisition import SharedTicks, Ticks
from dearig.sim_backend.daqmx.card.device import Device
from dearig.sim_backend.daqmx.card.engine import Reading
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.setup import CLOCK_OF
from dearig.sim_backend.daqmx.card.signals import ClockSignal, Events, Series, Signal
from dearig.sim_backend.daqmx.card.tasks import (
    ANALOG_EDGE,
    RISING,
    Kind,
    Task,
    physical_names,
)
from dearig.sim_backend.daqmx.card.triggers import (
    Edge,
    EdgeTicks,
    Pause,
    Reference,
    SampleTicks,
    TriggeredTicks,
)
from dearig.sim_backend.plant import Plant

__all__ = ["TriggeredDevice"]

#: Exported signals by DAQmx's number.
_SIGNALS = {
    12487: "SAMP_CLK",
    12491: "START_TRIG",
    12490: "REF_TRIG",
    12494: "CTR_OUT_EVENT",
    12486: "20_MHZ_TIMEBASE",
    12536: "10_MHZ_REF_CLK",
}
#: Delay in s of clocks and triggers inside the card. Without it a start would come at the time up
#: to which the tasks that wait for it have looked already.
_INSIDE_S = 2e-9
_CHECKED = 100_000  # samples that are compared with a level at a time
_TIMEBASES = {"20_MHZ_TIMEBASE": "20mhztimebase", "10_MHZ_REF_CLK": "10mhzrefclk"}
_START_OF = {kind: name.replace("sampleclock", "starttrigger") for kind, name in CLOCK_OF.items()}


class TriggeredDevice(Device):
    """Card with triggers and routes, and ``signals`` at its digital terminals; see ``Device``."""

    def __init__(
        self,
        settings: RigSettings,
        plant: Plant,
        clock: Clock,
        *,
        signals: Mapping[str, str] | None = None,
        **others: Any,
    ) -> None:
        super().__init__(settings, plant, clock, signals=signals, **others)
        inside: dict[str, Signal] = {
            "ai/referencetrigger": Events(self._reference_times),
            **{CLOCK_OF[kind]: self._clock_of_kind(kind) for kind in CLOCK_OF},
            **{_START_OF[kind]: Events(self._starts(kind)) for kind in _START_OF},
        }
        for name, signal in inside.items():
            self.terminals.provide(name, signal)

    # signals within the card

    def _clock_of_kind(self, kind: Kind) -> Signal:
        return ClockSignal(lambda: self._clock_series(kind))

    def _of(self, kind: Kind) -> Task | None:
        """Return the running task of ``kind`` on a clock, of which there is at most one."""
        return next(
            (t for t in self._tasks.values() if t.kind is kind and t.running and t.clock), None
        )

    def _clock_series(self, kind: Kind) -> Series | None:
        task = self._of(kind)
        if task is None:
            return None
        if task.generation is not None:
            generation = task.generation
            total = generation.total if generation.ended is None else generation.ended
            return Series(generation.start + _INSIDE_S, np.zeros(1), 1.0 / generation.rate, total)
        ticks = task.ticks if task.work is None else getattr(task.work, "ticks", None)
        if isinstance(ticks, EdgeTicks | SharedTicks) or ticks is None or ticks.start is None:
            return None
        return Series(ticks.start + _INSIDE_S, np.zeros(1), 1.0 / ticks.rate, task.wanted)

    def _starts(self, kind: Kind) -> Callable[[], Sequence[float]]:
        def times() -> Sequence[float]:
            task = self._of(kind)
            if task is None:
                return ()
            if task.generation is not None:
                return (task.generation.start + _INSIDE_S,)
            ticks = task.ticks if task.work is None else getattr(task.work, "ticks", None)
            start = getattr(ticks, "start", None)
            return () if start is None else (start + _INSIDE_S,)

        return times

    def _reference_times(self) -> Sequence[float]:
        task = self._of(Kind.AI)
        at = None if task is None or task.reference is None else task.reference.at
        return () if at is None else (at,)

    # triggers and clocks

    def start_edge(self, task: Task) -> Edge | None:
        """Return the edge that starts ``task``, or None where it starts at once."""
        if not task.trigger:
            return None
        return Edge(self.terminals.signal(task.trigger), task.trigger_edge == RISING)

    def pause_of(self, task: Task) -> Pause | None:
        """Return what makes the clock of ``task`` stand still, or None."""
        if task.pause is None:
            return None
        terminal, when_high = task.pause
        return Pause(self.terminals.signal(terminal), when_high)

    def clock_edge(self, task: Task) -> Edge | None:
        """Return the edge of the clock from outside, or None where the task has its own."""
        source = self.clock_source(task)
        if task.clock is None or not source:
            return None
        return Edge(self.terminals.signal(source), task.clock.edge == RISING)

    def sample_ticks(self, task: Task, now: float) -> SampleTicks:
        """Return the times of the samples of ``task``, which is armed ``now``."""
        clock = task.timing
        edge, trigger, pause = self.clock_edge(task), self.start_edge(task), self.pause_of(task)
        if edge is not None:
            return EdgeTicks(clock.rate, now, edge, trigger, pause)
        again = clock.samples if task.retriggers and clock.finite else None
        return TriggeredTicks(clock.rate, now, trigger, again=again, pause=pause)

    def _special_ticks(self, task: Task, now: float) -> SampleTicks | None:
        """Return the samples of an analog input with a trigger or clock from elsewhere, or None."""
        outside = self.clock_source(task)
        if outside == "ao/sampleclock":
            return None
        triggered = task.trigger not in ("", "ao/starttrigger")
        if outside or triggered or task.retriggers or task.pause is not None:
            return self.sample_ticks(task, now)
        return None

    def set_reference(self, task: Task, reference: Reference | None) -> None:
        """Give an analog input a reference trigger, or an analog start trigger; None: neither."""
        with self._lock:
            self._not_running(task)
            if reference is None:
                task.reference = None
                return
            self._of_kind(task, Kind.AI)
            if reference.level is None:
                reference.terminal = self.terminals.name(reference.terminal)
            else:
                reference.terminal = self._trigger_channel(task, reference)
            if reference.starts:
                task.trigger_type = ANALOG_EDGE
            task.reference = reference

    def set_trigger_type(self, task: Task, kind: int) -> None:
        """Set the type of the start trigger; its source is checked with the task."""
        with self._lock:
            super().set_trigger_type(task, kind)
            if task.reference is not None and task.reference.starts and kind != ANALOG_EDGE:
                task.reference = None

    def _verify(self, task: Task) -> None:
        super()._verify(task)
        if task.reference is not None and not task.reference.starts:
            self._check_pretrigger(task, task.reference)

    def _check_pretrigger(self, task: Task, reference: Reference) -> None:
        clock = task.timing
        if not clock.finite:
            raise DaqmxError(Code.REFERENCE_WHEN_CONTINUOUS, f"Task Name: {task.name}")
        if not 2 <= reference.before <= clock.samples - 2:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: RefTrig.PretrigSamples; Requested Value: {reference.before}; Minimum "
                f"Value: 2; Maximum Value: {clock.samples - 2}; Task Name: {task.name}",
            )

    @staticmethod
    def _trigger_channel(task: Task, reference: Reference) -> str:
        """Return the terminal of the input of the task that an analog trigger names."""
        wanted = reference.terminal.strip().lower()
        for channel in task.inputs:
            if wanted in (channel.name.lower(), channel.terminal) or wanted.endswith(
                f"/{channel.terminal}"
            ):
                return channel.terminal
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Property: AnlgEdge.Src; Requested Value: {reference.terminal}; the source of an "
            f"analog trigger is a channel of the task here. Task Name: {task.name}",
        )

    def set_pause(self, task: Task, pause: tuple[str, bool] | None) -> None:
        """Let the clock of ``task`` stand still while a terminal has a level (True: high)."""
        with self._lock:
            self._not_running(task)
            if task.kind not in (Kind.AI, Kind.DI, Kind.CI):
                raise DaqmxError(
                    Code.NOT_SUPPORTED_IN_TASK,
                    f"A pause of outputs is not simulated. Task Name: {task.name}",
                )
            task.pause = pause and (pause[0] and self.terminals.name(pause[0]), pause[1])

    def set_retriggers(self, task: Task, again: bool) -> None:
        """Set whether each further edge of the start trigger starts a finite task again."""
        with self._lock:
            self._not_running(task)
            task.retriggers = again

    # time

    def _settle_after(self, now: float) -> None:
        """Find the triggers of the analog tasks that have come."""
        tasks = list(self._tasks.values())
        for task in tasks:
            if task.kind is Kind.AI and isinstance(task.ticks, SampleTicks):
                task.ticks.advance(now)
                if self._run_start is None:
                    self._run_start = task.ticks.start
            if task.kind is Kind.AI and task.reference is not None and task.ticks is not None:
                self._find_reference(task, now)
        for task in tasks:
            if task.kind is Kind.AO and task.running:
                self._start_by_edge(task, now)

    def _start_by_edge(self, task: Task, now: float) -> None:
        """Start an analog output whose trigger has come, again if it is retriggerable."""
        edge, clock = self.start_edge(task), task.clock
        if edge is None or clock is None:
            return
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
            self._wire.follow(at, self._oldest)
            self._wire.end(task.generation)
        self._generate(task, clock, at)
        self._start_by_edge(task, now)

    def trigger_due(self, task: Task) -> float | None:
        """Return when the start trigger of ``task`` may come, or None where it is unknown."""
        edge = self.start_edge(task)
        return None if edge is None else edge.after(task.armed)

    def _find_reference(self, task: Task, now: float) -> None:
        """Find the reference trigger of an analog input, after the samples before it."""
        reference, ticks = task.reference, task.ticks
        if reference is None or ticks is None or reference.at is not None:
            return
        if ticks.passed(now) < reference.before:
            return
        if reference.level is not None:
            self._find_level(task, now)
            return
        # it counts from when the samples before it are there
        ready = float(ticks.times(reference.before - 1, reference.before)[0])
        edge = Edge(self.terminals.signal(reference.terminal), reference.rising)
        at = edge.until(max(ready, reference.seen), now)
        reference.seen = now
        if at is not None:
            reference.found(at, self._samples_until(ticks, at, now))

    @staticmethod
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

    def _find_level(self, task: Task, now: float) -> None:
        """Find the first sample with which an analog trigger's level is passed."""
        reference, ticks = task.reference, task.ticks
        if reference is None or ticks is None or reference.level is None:
            return
        if task.run is None:
            task.run = self._new_run(task)
        place = [c.terminal for c in task.inputs].index(reference.terminal)
        first, last = reference.checked, ticks.passed(now)
        while first < last:
            until = min(last, first + _CHECKED)
            counts = self._scan(task, first, until)[place].astype(np.float64)
            volts = np.polynomial.polynomial.polyval(
                counts, self.scaling(task, task.inputs[place].name)
            )
            found = reference.crossing(volts, max(1, reference.before) - first)
            if found is not None:
                sample = first + found
                reference.found(float(ticks.times(sample, sample + 1)[0]), sample)
                return
            first = reference.checked = until

    def reference_due(self, task: Task, now: float) -> float | None:
        """Return when the reference trigger of ``task`` may come, or None where it is unknown."""
        reference, ticks = task.reference, task.ticks
        if reference is None or ticks is None:
            return None
        if ticks.passed(now) < max(1, reference.before):
            return ticks.due(max(1, reference.before), now)
        if reference.level is not None:
            return ticks.due(ticks.passed(now) + math.ceil(ticks.rate * 0.01), now)
        edge = Edge(self.terminals.signal(reference.terminal), reference.rising)
        ready = float(ticks.times(reference.before - 1, reference.before)[0])
        return edge.after(max(ready, reference.seen))

    # states

    def start(self, task: Task) -> None:
        """Start ``task``: at once, or to wait for its clock or trigger."""
        with self._lock:
            self._not_running(task)
            task.armed = self._settle()
            if task.reference is not None:
                task.reference.rearm()
                task.reference.seen = task.armed
            super().start(task)
            self._put_out(task)

    def _start_outputs(self, task: Task, now: float) -> None:
        special = self._special_ticks(task, now)
        if special is not None:
            task.ticks = special
            self._run_start = special.start
            if special.start is None:
                return  # the outputs start with the inputs in ``_settle_after``
        super()._start_outputs(task, now)

    def _waits_for(self, task: Task, trigger: str, kind: Kind) -> bool:
        if not task.trigger:
            return False
        return task.trigger != trigger or not self._starts(kind)()

    def stop(self, task: Task) -> None:
        """Stop ``task``; the output keeps its value. Raises the error that stopped it earlier."""
        with self._lock:
            self._settle()
            super().stop(task)

    def _ahead(self, task: Task, samples: int | None, now: float) -> float | None:
        if task.reference is not None and task.reference.at is None:
            return self.reference_due(task, now)
        if task.reference is not None and samples is not None:
            samples += task.reference.offset
        if task.kind is Kind.AO and task.generation is None:
            return self.trigger_due(task)
        return super()._ahead(task, samples, now)

    def _done(self, task: Task, now: float) -> bool:
        return not (task.retriggers and task.running) and super()._done(task, now)

    def _acquired(self, task: Task, now: float) -> int:
        reference = task.reference
        if reference is None or task.ticks is None:
            return super()._acquired(task, now)
        if reference.at is None:
            return 0
        passed = max(0, task.ticks.passed(now) - reference.offset)
        return passed if task.wanted is None else min(passed, task.wanted)

    # samples

    def _deliver(self, task: Task, samples: int, complete: bool) -> Reading:
        """Deliver from the first sample before the reference trigger on."""
        if task.reference is None or not samples:
            return super()._deliver(task, samples, complete)
        offset = task.reference.offset
        task.delivered += offset
        try:
            return super()._deliver(task, samples, complete)
        finally:
            task.delivered -= offset

    def _scan(self, task: Task, first: int, last: int) -> np.ndarray:
        """Return counts (inputs, n) of the samples ``first`` to before ``last``."""
        kept, task.delivered = task.delivered, first
        try:
            return super()._deliver(task, last - first, True).counts
        finally:
            task.delivered = kept

    # routes

    def connect(self, source: str, destination: str) -> None:
        """Put the signal of ``source`` out at the terminal ``destination``."""
        with self._lock:
            self._settle()
            self.terminals.connect(source, destination)
            self._notify()

    def disconnect(self, destination: str) -> None:
        """Put nothing out at ``destination`` any more."""
        with self._lock:
            self._settle()
            self.terminals.disconnect(destination)
            self._notify()

    def export(self, task: Task, signal: int, destinations: str) -> None:
        """Put a signal of ``task``, by DAQmx's number, out at the terminals ``destinations``."""
        name = _SIGNALS.get(signal)
        if name is None or (self._exported(task, name) is None and task.kind is not Kind.EMPTY):
            raise DaqmxError(Code.SIGNAL_NOT_EXPORTED, f"Signal: {signal}; Task Name: {task.name}")
        with self._lock:
            task.exports[name] = destinations

    def _put_out(self, task: Task) -> None:
        """Put the exported signals of ``task`` out at their terminals."""
        for name, destinations in task.exports.items():
            source = self._exported(task, name)
            for destination in destinations.split(","):
                if destination.strip() and source is not None:
                    self.terminals.connect(source, destination)

    def _exported(self, task: Task, name: str) -> str | None:
        """Return the terminal within the card that has a signal of ``task``; None: it has none."""
        if name == "CTR_OUT_EVENT" and task.counters:
            return f"{task.counters[0].terminal}internaloutput"
        if name == "REF_TRIG" and task.kind is Kind.AI:
            return "ai/referencetrigger"
        if name == "SAMP_CLK":
            return CLOCK_OF.get(task.kind)
        if name == "START_TRIG":
            return _START_OF.get(task.kind)
        return _TIMEBASES.get(name)

    def check_channel(self, physical: str) -> None:
        """Refuse a physical channel of another device, or of bad syntax."""
        physical_names(physical, self.name)
