"""Timing of the simulated card: clocks, buffers and reserved resources, on an injected clock.

It has no thread: each call first computes everything that happened since the previous call.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from dearig.drivers.settings import RigSettings
from dearig.sim_backend.clock import Clock
from dearig.sim_backend.daqmx.card import events
from dearig.sim_backend.daqmx.card.acquisition import OwnTicks, Run, SharedTicks
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.output import Generation, Waveform
from dearig.sim_backend.daqmx.card.setup import LINES, OUTPUTS, Setup
from dearig.sim_backend.daqmx.card.tasks import (
    HIGH,
    NO_CHANGE,
    Kind,
    SampleClock,
    State,
    Task,
    Watchdog,
)
from dearig.sim_backend.daqmx.card.wire import Wire
from dearig.sim_backend.daqmx.card.wiring import Wiring
from dearig.sim_backend.faults import Fault, FaultKind, FaultPlan
from dearig.sim_backend.plant import Plant

__all__ = ["Reading", "TimingEngine"]

T = TypeVar("T")


@dataclass(frozen=True)
class Reading:
    """Result of a read: ``counts`` (channels, n) int16; ``complete`` unless it timed out."""

    counts: np.ndarray
    complete: bool


class TimingEngine(Setup):
    """Timing of the card of a rig with ``settings``; ``Device`` has the calls.

    ``plant`` is the film at rest, ``noise_seed`` that of the instruments' noise. With ``sine``
    no instrument is wired to the inputs: each reads a sine within its limits, as NI's own simulated
    devices give one.
    """

    def __init__(
        self,
        settings: RigSettings,
        plant: Plant,
        clock: Clock,
        *,
        noise_seed: tuple[int, ...] = (0,),
        faults: FaultPlan | None = None,
        sine: bool = False,
        signals: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(settings, signals)
        self._clock = clock
        self._born = clock.now()
        self._born_at = time.time()  # s since 1970, for the time stamps of waveforms
        self._faults = faults or FaultPlan()
        self._wiring = Wiring(settings, plant, noise_seed, self._faults, sine=sine)
        self._wiring.warm_up()
        self._wire = Wire(self._card, self._wiring, OUTPUTS, LINES, self._born)
        self._waiting: set[threading.Event] = set()
        self._tasks: dict[str, Task] = {}
        self._numbered = 0
        self._reserved: dict[str, Task] = {}
        self._runs = 0
        self._readings = 0
        self._laser: tuple[int, float] | None = None  # counts and range of the last reading
        self._run_start: float | None = None
        self._fired: set[Fault] = set()

    # time

    def _now(self) -> float:
        # from the card's creation, so that a tick's time is exact enough in doubles for hours
        return self._clock.now() - self._born

    def _settle(self) -> float:
        """Compute everything up to now; returns the present time."""
        now = self._now()
        self._settle_before(now)
        for task in list(self._tasks.values()):
            watchdog = task.watchdog
            if watchdog is not None and watchdog.deadline is not None and now >= watchdog.deadline:
                at, watchdog.deadline = watchdog.deadline, None
                watchdog.expired = True
                self._wire.follow(at, self._oldest)
                for line, level in watchdog.states.items():
                    if level != NO_CHANGE:
                        # a line that nobody drives is pulled down by the card
                        self._put_line(line, level == HIGH, at)
        for task in self._tasks.values():
            generation = task.generation
            if generation is not None and generation.settle(now) is not None:
                task.failed = Code.OUTPUT_STARVED
        self._wire.follow(now, self._oldest)
        self._settle_after(now)
        return now

    def _settle_before(self, now: float) -> None:
        """Do what is due in a part of the card that knows more, before the analog part."""

    def _settle_after(self, now: float) -> None:
        """Do what is due there after the analog part."""

    def _put_line(self, line: str, level: bool, now: float) -> None:
        """Set a digital line."""
        self._wire.set_line(line, level, now)

    def _wait(
        self,
        timeout: float,
        attempt: Callable[[float, bool], tuple[T | None, float | None]],
    ) -> T:
        """Repeat ``attempt(now, last)`` until it has a result; it returns the time to try again."""
        with self._lock:
            deadline = math.inf if timeout < 0.0 else self._now() + timeout
        while True:
            with self._lock:
                now = self._settle()
                result, due = attempt(now, now >= deadline)
                if result is not None:
                    return result
                wake = threading.Event()
                self._waiting.add(wake)
            until = min(deadline, math.inf if due is None else due)
            if until < math.inf:
                self._clock.wait(self._born + until, wake)
            else:
                wake.wait()  # only another call can help
            with self._lock:
                self._waiting.discard(wake)

    def _notify(self) -> None:
        for wake in self._waiting:
            wake.set()

    def _elapsed(self, now: float) -> float:
        """Return the time in s since the present run's sample clock started; negative before."""
        return -1.0 if self._run_start is None else now - self._run_start

    # data that is still needed

    def _oldest(self, generation: Generation) -> int:
        """Return the first tick of ``generation`` that a reader may still need, or its last one."""
        oldest = generation.waveform.written
        for task in self._tasks.values():
            if task.ticks is None or not task.running:
                continue
            keeps = task.run.keeps if task.run is not None else 0
            if isinstance(task.ticks, SharedTicks):
                needed = task.ticks.needs(generation, keeps)
                if needed is not None:
                    oldest = min(oldest, needed)
            elif task.ticks.start is not None:
                time = float(task.ticks.times(keeps, keeps + 1)[0])
                oldest = min(oldest, math.floor((time - generation.start) * generation.rate) - 1)
        return oldest

    def _earliest_needed(self, now: float) -> float:
        """Return the earliest time in s whose output a task may still read."""
        earliest = now
        for task in self._tasks.values():
            if task.ticks is not None and task.running and task.ticks.passed(now):
                keeps = task.run.keeps if task.run is not None else 0
                earliest = min(earliest, float(task.ticks.times(keeps, keeps + 1)[0]))
        return earliest

    def _set_output(self, terminal: str, counts: int, now: float, client: str = "") -> None:
        self._wire.set_output(terminal, counts, now, client)
        self._wire.forget_before(self._earliest_needed(now))

    # reservations

    def _resources(self, task: Task) -> list[str]:
        if task.kind is Kind.AI:
            return ["analog input"]
        if task.kind is Kind.AO:
            engine = ["analog output timing"] if task.clock is not None else []
            return engine + [channel.terminal for channel in task.outputs]
        if task.kind is Kind.WATCHDOG:
            return ["watchdog"]
        return task.line_names

    def _check_free(self, task: Task) -> None:
        for resource in self._resources(task):
            owner = self._reserved.get(resource)
            if owner is not None and owner is not task:
                raise DaqmxError(
                    Code.RESOURCE_RESERVED,
                    f"Device: {self.name}; Resource: {resource}; Task Name: {task.name}; reserved "
                    f"by: {owner.name}",
                )

    def _reserve(self, task: Task) -> None:
        self._check_free(task)
        for resource in self._resources(task):
            self._reserved[resource] = task

    def _release(self, task: Task) -> None:
        task.state = task.kept = State.VERIFIED
        task.waveform = None
        self._reserved = {r: owner for r, owner in self._reserved.items() if owner is not task}

    def _raise_failure(
        self, task: Task, *, read: int | None = None, written: int | None = None
    ) -> None:
        if task.failed is not None:
            why = f"{task.failed_why} " if task.failed_why else ""
            raise DaqmxError(
                task.failed, f"{why}Task Name: {task.name}", read=read, written=written
            )

    # starting and ending

    def _waits_for(self, task: Task, trigger: str, kind: Kind) -> bool:
        """Return True if ``task`` waits for the start of a task of ``kind`` that is not running."""
        if not task.trigger:
            return False
        started = any(
            t.running and t.kind is kind and t.clock is not None for t in self._tasks.values()
        )
        return task.trigger != trigger or not started

    def _start_watchdog(self, watchdog: Watchdog, now: float) -> None:
        if watchdog.timeout >= 0.0 and not watchdog.expired:
            watchdog.deadline = now + watchdog.timeout

    def _start_acquisition(self, task: Task, clock: SampleClock, now: float) -> None:
        task.delivered, task.run, task.by_read = 0, None, False
        task.run_number = self._runs
        self._runs += 1
        self._run_start = None
        self._fired.clear()
        generation = next(
            (
                t.generation
                for t in self._tasks.values()
                if t.kind is Kind.AO and t.generation and not t.generation.finished(now)
            ),
            None,
        )
        if self.clock_source(task) == "ao/sampleclock":
            task.ticks = SharedTicks()
            if generation is not None:
                self._share(task, generation, generation.ticks(now) + 1, now)
        else:
            waits = self._waits_for(task, "ao/starttrigger", Kind.AO)
            task.ticks = OwnTicks(clock.rate, None if waits else now)
            if not waits:
                self._run_start = now
        self._start_outputs(task, now)

    def _start_outputs(self, task: Task, now: float) -> None:  # noqa: ARG002
        """Start the outputs that wait for the start of the inputs of ``task``."""
        for output in self._tasks.values():
            if (
                output.kind is Kind.AO
                and output.running
                and output.generation is None
                and output.trigger == "ai/starttrigger"
                and output.clock is not None
            ):
                self._generate(output, output.clock, now)

    def _generate(self, task: Task, clock: SampleClock, now: float) -> None:
        """Start the generation of an output task, and the inputs on its clock."""
        waveform = task.waveform
        if waveform is None:
            raise DaqmxError(Code.OUTPUT_BUFFER_EMPTY, f"Task Name: {task.name}")
        total = clock.samples if clock.finite else None
        generation = Generation(waveform, clock.rate, now, total)
        task.generation = generation
        self._wire.begin(generation, [c.terminal for c in task.outputs], task.client)
        for reader in self._tasks.values():
            if reader.kind is not Kind.AI or not reader.running:
                continue
            if isinstance(reader.ticks, SharedTicks):
                self._share(reader, generation, 0, now)
            elif (
                isinstance(reader.ticks, OwnTicks)
                and reader.ticks.start is None
                and reader.trigger == "ao/starttrigger"
            ):
                reader.ticks.start = now
                self._run_start = now
        if self._run_start is None:
            self._run_start = now
        for fault in self._faults.of(FaultKind.AO_UNDERFLOW):
            at = math.ceil((self._run_start + fault.at - now) * clock.rate)
            if at > 0:
                generation.breaks = min(generation.breaks, at)

    def _share(self, task: Task, generation: Generation, tick: int, now: float) -> None:
        """Make an input task convert on the ticks of ``generation``, from ``tick`` on."""
        if isinstance(task.ticks, SharedTicks):
            task.ticks.follow(generation, tick, self._wire.row(generation), now)
        if self._run_start is None:
            self._run_start = now

    def _abort(self, task: Task, now: float, why: str) -> None:
        """End ``task`` in any state; its client gets the error and ``why`` in its next call."""
        busy, running = task.state is not State.VERIFIED, task.running
        self._end(task, now)
        self._release(task)
        if busy:
            task.failed, task.failed_why = Code.RUNTIME_ABORTED, why
        if running:
            events.observe(task, 0, Code.RUNTIME_ABORTED)

    def _end(self, task: Task, now: float) -> None:
        if task.running:
            self._observe(task, now)
        if task.generation is not None:
            task.generation.stop(now)
            self._wire.follow(now, self._oldest)
            self._wire.end(task.generation)
            task.generation = None
            self._wire.forget_before(self._earliest_needed(now))
        if task.ticks is not None:
            task.ticks, task.run = None, None
        if task.watchdog is not None:
            task.watchdog.deadline = None
        if task.running:
            task.state, task.delivered = task.kept, 0

    def _done(self, task: Task, now: float) -> bool:
        if not task.running:
            return True
        if task.kind is Kind.AO and task.clock is not None:
            return task.generation is not None and task.generation.finished(now)
        if task.kind is Kind.AI and task.wanted is not None:
            return self._acquired(task, now) >= task.wanted
        return task.clock is None and task.kind is not Kind.WATCHDOG

    def _observe(self, task: Task, now: float) -> None:
        """Make the events due that have happened since the start of ``task``."""
        if not task.listeners:
            return
        if task.kind.is_input:
            samples = self._acquired(task, now)
        else:
            samples = task.generation.ticks(now) if task.generation is not None else 0
        done = task.failed if task.failed is not None else None
        if done is None and self._done(task, now):
            events.observe(task, samples, 0)
        else:
            events.observe(task, samples, done)

    # samples

    def _acquired(self, task: Task, now: float) -> int:
        if task.ticks is None:
            return 0
        passed = task.ticks.passed(now)
        return passed if task.wanted is None else min(passed, task.wanted)

    def _deliver(self, task: Task, samples: int, complete: bool) -> Reading:
        first, last = task.delivered, task.delivered + samples
        if samples == 0 or task.ticks is None:
            return Reading(np.empty((len(task.inputs), 0), dtype=np.int16), complete)
        ticks = task.ticks
        if task.run is None:
            task.run = self._new_run(task)
        counts = task.run.read(first, last)
        outputs = {
            terminal: ticks.commands(
                first, last, self._wire.track_of(terminal), wired=self._wire.is_wired(terminal)
            )
            for terminal in self._wiring.monitored(task.inputs)
        }
        task.delivered = last
        self._laser = self._wiring.laser_reading(counts, task.inputs)
        return Reading(self._wiring.as_read(counts, outputs, task.inputs, first), complete)

    def _new_run(self, task: Task) -> Run:
        ticks = task.ticks
        if ticks is None or task.clock is None:
            raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {task.name}", read=0)
        us = self._card.timebase_MHz
        first, step = self.delay_ticks(task) / us, self.convert_ticks(task) / us
        skews = [(first + place * step) * 1e-6 for place in range(len(task.inputs))]
        rate = ticks.rate
        path, state = self._wiring.run(task.run_number, rate, task.inputs, skews)
        wire = self._wire

        def command(start: int, end: int) -> np.ndarray:
            counts = ticks.commands(start, end, wire.track)
            return wire.gated(counts, ticks.times(start, end)) if wire.switched else counts

        return Run(path, state, command)

    def _read_still(self, task: Task, samples: int) -> Reading:
        now = self._settle()
        self._verify(task)
        self._check_free(task)
        self._readings += 1
        counts = self._wiring.still(
            task.inputs,
            samples,
            self._readings,
            self._wire.film_voltage(now),
            {terminal: self._wire.track_of(terminal).standing(now) for terminal in OUTPUTS},
            self._laser,
        )
        return Reading(counts, True)

    def _write_still(self, task: Task, counts: np.ndarray, auto_start: bool, now: float) -> int:
        if not (auto_start or task.running):
            raise DaqmxError(Code.WRITE_WITHOUT_START, f"Task Name: {task.name}", written=0)
        self._check_free(task)
        for row, channel in zip(counts, task.outputs, strict=True):
            self._set_output(channel.terminal, int(row[-1]), now, task.client)
        self._notify()
        return int(counts.shape[1])

    def _write_before_start(self, task: Task, counts: np.ndarray) -> None:
        """Write before the start, up to the room in the buffer."""
        samples = counts.shape[1]
        if task.waveform is None:
            task.waveform = Waveform(task.rows, task.regenerates)
            task.first_write = samples
        waveform = task.waveform
        self._within_finite(task, samples)
        if task.buffer is not None and waveform.written + samples > task.buffer:
            raise DaqmxError(
                Code.SAMPLES_NOT_YET_WRITTEN,
                f"Buffer Size: {task.buffer}; Task Name: {task.name}",
                written=0,
            )
        if task.buffer is None and waveform.written and not task.regenerates:
            raise DaqmxError(Code.BUFFER_SIZE_FIXED, f"Task Name: {task.name}", written=0)
        waveform.append(counts)

    def _write_while_running(self, task: Task, counts: np.ndarray, timeout: float) -> int:
        """Write to a task that generates; waits for room in its buffer."""
        total = counts.shape[1]
        done = 0

        def attempt(now: float, last: bool) -> tuple[int | None, float | None]:
            nonlocal done
            self._raise_failure(task, written=done)
            waveform, generation = task.waveform, task.generation
            if not task.running or waveform is None:
                raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {task.name}", written=done)
            if waveform.loops and generation is not None:
                waveform.replace(counts, generation.ticks(now))
                self._notify()
                return total, None
            self._within_finite(task, total - done)
            room = min(self._space(task, now), total - done)
            if room > 0:
                waveform.append(counts[:, done : done + room])
                done += room
                self._notify()
            if done == total:
                return total, None
            if last:
                raise DaqmxError(
                    Code.SAMPLES_NOT_YET_WRITTEN, f"Task Name: {task.name}", written=done
                )
            if generation is None:
                return None, None
            # when a quarter of the buffer, or all that is needed, has moved on to the converter
            need = min(total - done, max(1, self._buffer_room(task) // 4))
            gone = waveform.written + need - self._buffer_room(task)
            return None, generation.due(max(0, gone - self._card.ao_fifo_samples) + 1)

        return self._wait(timeout, attempt)

    def _within_finite(self, task: Task, samples: int) -> None:
        wanted, waveform = task.wanted, task.waveform
        if wanted is None or waveform is None:
            return
        if waveform.written + samples > wanted and not waveform.loops:
            raise DaqmxError(
                Code.BEYOND_FINITE,
                f"Samples: {wanted}; Task Name: {task.name}",
                written=0,
            )

    def _buffer_room(self, task: Task) -> int:
        """Return the size of the output buffer: the set one, or that of the first write."""
        return task.buffer if task.buffer is not None else task.first_write

    def _space(self, task: Task, now: float) -> int:
        waveform = task.waveform
        if waveform is None:
            return task.buffer or 0
        if waveform.loops:
            return waveform.size
        gone = 0
        if task.generation is not None:
            # the card's FIFO takes samples out of the buffer before they are output
            gone = task.generation.ticks(now) + self._card.ao_fifo_samples
        return max(0, self._buffer_room(task) - (waveform.written - min(waveform.written, gone)))

    def _may_generate(self, task: Task) -> None:
        if task.waveform is None or task.waveform.written == 0:
            raise DaqmxError(Code.OUTPUT_BUFFER_EMPTY, f"Task Name: {task.name}")
        if self._buffer_room(task) < 2:
            raise DaqmxError(
                Code.OUTPUT_BUFFER_TOO_SMALL,
                f"Buffer Size: {self._buffer_room(task)}; Task Name: {task.name}",
            )
