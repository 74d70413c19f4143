"""The simulated card at work: tasks, clocks and buffers, on an injected clock.

It has no thread of its own: whoever asks finds it as it is at that moment, and everything that
happened since it was last asked is worked out then.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from dearig.drivers.channels import COUNT_MAX, COUNT_MIN
from dearig.drivers.settings import RigSettings
from dearig.sim_backend.clock import Clock
from dearig.sim_backend.daqmx.acquisition import OwnTicks, Run, SharedTicks
from dearig.sim_backend.daqmx.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.output import Generation, Waveform
from dearig.sim_backend.daqmx.setup import LINES, OUTPUTS, Setup
from dearig.sim_backend.daqmx.tasks import Kind, SampleClock, State, Task, Watchdog
from dearig.sim_backend.daqmx.wire import Change, Wire
from dearig.sim_backend.daqmx.wiring import Behind
from dearig.sim_backend.faults import Fault, FaultKind, FaultPlan
from dearig.sim_backend.plant import Plant

__all__ = ["Device", "Reading"]

_LONGEST_WATCHDOG = 429.0  # s; 2**32 ticks of 10 MHz

T = TypeVar("T")


@dataclass(frozen=True)
class Reading:
    """What a read brings: ``counts`` (channels, n) int16, all of it ``complete`` or not yet."""

    counts: np.ndarray
    complete: bool


class Device(Setup):
    """A PCIe-6361 with the rig of ``settings`` behind it, whose film is ``plant`` at rest.

    Every run of its inputs starts with the film at rest. All calls may come from any thread, and
    all may raise ``DaqmxError``; those that take a ``timeout`` in s (negative: for ever) wait.
    """

    def __init__(
        self,
        settings: RigSettings,
        plant: Plant,
        clock: Clock,
        *,
        noise_seed: tuple[int, ...] = (0,),
        faults: FaultPlan | None = None,
    ) -> None:
        super().__init__(settings)
        self._clock = clock
        self._born = clock.now()
        self._faults = faults or FaultPlan()
        self._behind = Behind(settings, plant, noise_seed, self._faults)
        self._behind.warm_up()
        self._wire = Wire(self._card, self._behind, OUTPUTS, LINES, self._born)
        self._waiting: set[threading.Event] = set()
        self._tasks: dict[str, Task] = {}
        self._numbered = 0
        self._reserved: dict[str, Task] = {}
        self._runs = 0
        self._readings = 0
        self._laser: tuple[int, float] | None = None  # counts and range of its last reading
        self._run_start: float | None = None
        self._fired: set[Fault] = set()

    # what a test may ask

    def wire_voltage(self) -> float:
        """Voltage in V that is commanded at the film now."""
        with self._lock:
            return self._wire.film_voltage(self._settle())

    def displacement(self) -> float:
        """What the laser read last, in m; with the film at rest before the first run."""
        laser = self.settings.laser
        with self._lock:
            if self._laser is None:
                return laser.rest_position_mm * 1e-3
            counts, limit = self._laser
            return laser.direction * laser.mm_per_V * 1e-3 * counts * limit / (COUNT_MAX + 1)

    def live(self) -> bool:
        """Whether there is more voltage at the film than the rig's limits take for none."""
        return abs(self.wire_voltage()) > self.settings.limits.zero_tolerance_kV * 1e3

    def drives(self, client: str) -> bool:
        """Whether ``client`` was the last to move the output to the amplifier."""
        return self._wire.client == client

    def output_voltage(self) -> float:
        """Voltage in V at the output to the amplifier now."""
        with self._lock:
            return self._wire.output_voltage(self._settle())

    def history(self) -> tuple[Change, ...]:
        """When the film's voltage left or reached zero, and what was set, in time's order."""
        with self._lock:
            self._settle()
            return tuple(self._wire.history)

    def line(self, name: str) -> bool:
        """Level of the digital line ``name``, such as ``port0/line0``."""
        with self._lock:
            self._settle()
            return self._wire.levels[name]

    def fault(self, kind: FaultKind) -> Fault | None:
        """A fault of ``kind`` that goes on now, counted from the start of the run's clock."""
        with self._lock:
            elapsed = self._elapsed(self._settle())
        found = (f for f in self._faults.of(kind) if f.at <= elapsed < f.end)
        return next(found, None)

    def fires(self, kind: FaultKind) -> Fault | None:
        """A fault of ``kind`` whose time has come, once in a run."""
        with self._lock:
            elapsed = self._elapsed(self._settle())
            for fault in self._faults.of(kind):
                if fault.at <= elapsed and fault not in self._fired:
                    self._fired.add(fault)
                    return fault
            return None

    # tasks

    def create(self, name: str, client: str, *, attach: bool = True) -> tuple[Task, bool]:
        """A task called ``name``, or like no other; and whether it is new."""
        with self._lock:
            if name and name in self._tasks:
                if attach:
                    return self._tasks[name], False
                raise DaqmxError(Code.DUPLICATE_TASK, f"Task Name: {name}")
            while not name or name in self._tasks:
                name = f"_unnamedTask<{self._numbered:X}>"
                self._numbered += 1
            task = self._tasks[name] = Task(name, client)
            return task, True

    def create_watchdog(self, name: str, client: str, device: str, timeout: float) -> Task:
        """A task of the watchdog timer that expires ``timeout`` s after its last reset."""
        with self._lock:
            self.check_device(device)
            if timeout != -1.0 and not 0.0 < timeout <= _LONGEST_WATCHDOG:
                raise DaqmxError(Code.WATCHDOG_TIMEOUT, f"Requested Value: {timeout:g}")
            task, new = self.create(name, client, attach=False)
            if new:
                task.kind = Kind.WATCHDOG
                task.watchdog = Watchdog(timeout)
            return task

    def task(self, name: str) -> Task:
        """The task called ``name``."""
        with self._lock:
            if name not in self._tasks:
                raise DaqmxError(Code.INVALID_TASK, f"Task Name: {name}")
            return self._tasks[name]

    def tasks_of(self, client: str) -> list[Task]:
        """The tasks that ``client`` made."""
        with self._lock:
            return [task for task in self._tasks.values() if task.client == client]

    def clear(self, task: Task) -> None:
        """Abort ``task`` and forget it; the output keeps its value."""
        with self._lock:
            now = self._settle()
            self._end(task, now)
            self._release(task)
            self._tasks.pop(task.name, None)
            self._notify()

    def reset(self, device: str) -> None:
        """Abort every task, 0 V on every output, every line low."""
        with self._lock:
            self.check_device(device)
            now = self._settle()
            for task in self._tasks.values():
                self._abort(task, now)
                if task.watchdog is not None:
                    task.watchdog.expired = False
            for terminal in OUTPUTS:
                self._set_output(terminal, 0, now)
            for line in LINES:
                self._wire.set_line(line, False, now)
            self._notify()

    def make_safe(self, client: str | None = None) -> None:
        """Abort the tasks of ``client`` (None: of everybody), 0 V, and the enable line low."""
        with self._lock:
            now = self._settle()
            for task in self._tasks.values():
                if client in (None, task.client):
                    self._abort(task, now)
            self._set_output(self._card.ao_command, 0, now)
            self._wire.disable(now)
            self._notify()

    def scaling(self, task: Task, name: str) -> tuple[float, ...]:
        """Volts over counts of the input called ``name``; counts over volts of an output."""
        for channel in task.inputs:
            if channel.name == name:
                return self._behind.coefficients(channel)
        for output in task.outputs:
            if output.name == name:
                return (0.0, (COUNT_MAX + 1) / output.range)
        raise DaqmxError(Code.INVALID_CHANNEL_NAME, f"Channel Name: {name}")

    # states

    def control(self, task: Task, action: int) -> None:
        """DAQmx's task modes: start, stop, verify, commit, reserve, unreserve, abort."""
        with self._lock:
            if action == 0:
                self.start(task)
            elif action == 1:
                self.stop(task)
            elif action == 2:
                self._verify(task)
            elif action in (3, 4):
                if task.running:
                    return
                self._verify(task)
                self._reserve(task)
                task.state = State.COMMITTED if action == 3 else State.RESERVED
                task.kept = task.state
            elif action == 5:
                self._not_running(task)
                self._release(task)
            elif action == 6:
                now = self._settle()
                self._end(task, now)
                task.failed = None
                self._release(task)
                self._notify()
            else:
                raise DaqmxError(Code.INVALID_VALUE, f"Action: {action}")

    def start(self, task: Task) -> None:
        """Start ``task``: at once, or to wait for its clock or trigger."""
        with self._lock:
            now = self._settle()
            if task.running:
                return
            self._verify(task)
            if task.kind is Kind.AO and task.clock is not None:
                self._may_generate(task)
            self._reserve(task)
            task.failed = None
            task.state = State.RUNNING
            if task.watchdog is not None:
                self._start_watchdog(task.watchdog, now)
            elif task.kind is Kind.AI and task.clock is not None:
                self._start_acquisition(task, task.clock, now)
            elif (
                task.kind is Kind.AO
                and task.clock is not None
                and not self._waits_for(task, "ai/starttrigger", Kind.AI)
            ):
                self._generate(task, task.clock, now)
            self._notify()

    def stop(self, task: Task) -> None:
        """Stop ``task``; the output keeps its value. Raises what had stopped it before."""
        with self._lock:
            now = self._settle()
            failed = task.failed
            self._end(task, now)
            task.failed = None
            if task.kept is State.VERIFIED:
                self._release(task)
            elif not task.regenerates:
                task.waveform = None  # what was put out is gone
            self._notify()
            if failed is not None:
                raise DaqmxError(failed, f"Task Name: {task.name}")

    def is_done(self, task: Task) -> bool:
        """True once ``task`` has done all it was asked for; raises what has stopped it."""
        with self._lock:
            now = self._settle()
            self._raise_failure(task)
            return self._done(task, now)

    def wait_done(self, task: Task, timeout: float) -> None:
        """Wait until it is."""

        def attempt(now: float, last: bool) -> tuple[bool | None, float | None]:
            self._raise_failure(task)
            if self._done(task, now):
                return True, None
            if last:
                raise DaqmxError(Code.NOT_DONE_IN_TIME, f"Task Name: {task.name}")
            due = None
            wanted = task.wanted
            if wanted is not None and task.generation is not None:
                due = task.generation.due(wanted)
            elif wanted is not None and task.ticks is not None:
                due = task.ticks.due(wanted, now)
            return None, due

        self._wait(timeout, attempt)

    # reading

    def available(self, task: Task) -> int:
        """Samples a channel that wait for their reader."""
        with self._lock:
            now = self._settle()
            return self._acquired(task, now) - task.delivered

    def acquired(self, task: Task) -> int:
        """Samples a channel since the start."""
        with self._lock:
            return self._acquired(task, self._settle())

    def read(self, task: Task, samples: int, timeout: float, most: int | None = None) -> Reading:
        """Next ``samples`` of every channel; -1: all there are, or will be of a finite task.

        All there are is no more than ``most``.
        """
        self._of_kind(task, Kind.AI, Code.NOT_AN_INPUT)
        with self._lock:
            self._raise_failure(task, read=0)
            if task.clock is None:
                return self._read_still(task, max(1, samples))
            if not task.running:
                self.start(task)
                task.by_read = True

        def attempt(now: float, last: bool) -> tuple[Reading | None, float | None]:
            self._raise_failure(task, read=0)
            if not task.running or task.ticks is None:
                raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {task.name}", read=0)
            acquired = self._acquired(task, now)
            waiting = acquired - task.delivered
            if task.wanted is None and waiting > self.buffer_size(task):
                task.failed = Code.SAMPLES_OVERWRITTEN
            elapsed = self._elapsed(now)
            if any(fault.at <= elapsed for fault in self._faults.of(FaultKind.AI_OVERFLOW)):
                task.failed = Code.SAMPLES_OVERWRITTEN
            self._raise_failure(task, read=0)
            wanted = samples
            if task.wanted is not None:
                left = task.wanted - task.delivered
                if samples > left:
                    raise DaqmxError(
                        Code.SAMPLES_NEVER_AVAILABLE,
                        f"Task Name: {task.name}; Samples Left: {left}",
                        read=0,
                    )
                wanted = left if samples == -1 else samples
            elif samples == -1:
                wanted = waiting
            if most is not None:
                wanted = min(wanted, most)
            if waiting >= wanted or last:
                short = wanted
                if wanted > 1 and self.fires(FaultKind.SHORT_READ) is not None:
                    short = wanted // 2
                return self._deliver(task, min(short, waiting), waiting >= wanted), None
            return None, task.ticks.due(task.delivered + wanted, now)

        reading = self._wait(timeout, attempt)
        with self._lock:
            if task.by_read and task.wanted is not None and task.delivered >= task.wanted:
                self.stop(task)
        return reading

    # writing

    def to_counts(self, task: Task, volts: np.ndarray) -> np.ndarray:
        """Counts (channels, n) for ``volts`` (channels, n); refuses what the range has not."""
        counts = np.empty(volts.shape, dtype=np.int16)
        for row, values, channel in zip(counts, volts, task.outputs, strict=True):
            beyond = ~(np.abs(values) <= channel.range)  # a NaN is beyond as well
            if beyond.any():
                raise DaqmxError(
                    Code.INVALID_SAMPLE,
                    f"Value: {values[int(np.argmax(beyond))]:g}; Minimum Value: "
                    f"{-channel.range:g}; Maximum Value: {channel.range:g}; Channel Name: "
                    f"{channel.name}",
                    written=0,
                )
            step = channel.range / (COUNT_MAX + 1)
            row[:] = np.clip(np.rint(values / step), COUNT_MIN, COUNT_MAX)
        return counts

    def write(self, task: Task, counts: np.ndarray, auto_start: bool, timeout: float) -> int:
        """Write ``counts`` (channels, n) to an output task; returns the samples a channel."""
        with self._lock:
            now = self._settle()
            self._of_kind(task, Kind.AO, Code.NOT_AN_OUTPUT)
            self._raise_failure(task, written=0)
            if counts.shape[1] == 0:
                return 0
            if task.clock is None:
                return self._write_still(task, counts, auto_start, now)
            if not task.running:
                self._verify(task)
                self._reserve(task)
                task.state = max(task.state, State.COMMITTED, key=lambda state: state.value)
                self._write_ahead(task, counts)
                if auto_start:
                    self.start(task)
                return int(counts.shape[1])
        return self._write_behind(task, counts, timeout)

    def written(self, task: Task) -> int:
        """Samples a channel written since the task was set up or stopped."""
        return task.waveform.written if task.waveform is not None else 0

    def space(self, task: Task) -> int:
        """Samples a channel that the output buffer would take now."""
        with self._lock:
            now = self._settle()
            return self._space(task, now)

    def generated(self, task: Task) -> int:
        """Samples a channel that were put out since the start."""
        with self._lock:
            now = self._settle()
            return task.generation.ticks(now) if task.generation is not None else 0

    def write_lines(self, task: Task, levels: Sequence[bool], auto_start: bool) -> None:
        """Set the lines of a digital task, one level each."""
        with self._lock:
            now = self._settle()
            self._of_kind(task, Kind.DO, Code.NOT_AN_OUTPUT)
            self._raise_failure(task, written=0)
            if not (auto_start or task.running):
                raise DaqmxError(Code.WRITE_WITHOUT_START, f"Task Name: {task.name}", written=0)
            if any(t.watchdog is not None and t.watchdog.expired for t in self._tasks.values()):
                raise DaqmxError(Code.WRITE_AFTER_WATCHDOG, f"Task Name: {task.name}", written=0)
            self._check_free(task)
            for line, level in zip(task.line_names, levels, strict=True):
                self._wire.set_line(line, bool(level), now)
            self._notify()

    # the watchdog

    def set_expiration(self, task: Task, physical: str, high: bool) -> None:
        """What the lines ``physical`` do when the watchdog of ``task`` expires."""
        with self._lock:
            watchdog = self._watchdog(task)
            self._not_running(task)
            for line in self.lines_of(physical):
                watchdog.states[line] = high

    def expiration(self, task: Task, physical: str) -> bool:
        """What the first of the lines ``physical`` does then."""
        with self._lock:
            line = self.lines_of(physical)[0]
            states = self._watchdog(task).states
            if line not in states:
                raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, f"Lines: {physical}")
            return states[line]

    def expired(self, task: Task) -> bool:
        """Whether the watchdog of ``task`` has expired."""
        with self._lock:
            self._settle()
            return self._watchdog(task).expired

    def control_watchdog(self, task: Task, clear: bool) -> None:
        """Reset the timer, or ``clear`` what its expiration has locked."""
        with self._lock:
            now = self._settle()
            watchdog = self._watchdog(task)
            if clear:
                watchdog.expired = False
                if task.running:
                    self._start_watchdog(watchdog, now)
            elif watchdog.expired:
                raise DaqmxError(Code.WATCHDOG_EXPIRED_NO_RESET, f"Task Name: {task.name}")
            elif task.running:
                self._start_watchdog(watchdog, now)

    # time

    def _now(self) -> float:
        # counted from the card's birth: a tick's time in doubles is then exact enough for hours
        return self._clock.now() - self._born

    def _settle(self) -> float:
        """Work out what has happened up to now; returns that time."""
        now = self._now()
        for task in list(self._tasks.values()):
            watchdog = task.watchdog
            if watchdog is not None and watchdog.deadline is not None and now >= watchdog.deadline:
                at, watchdog.deadline = watchdog.deadline, None
                watchdog.expired = True
                self._wire.follow(at, self._oldest)
                for line, level in watchdog.states.items():
                    self._wire.set_line(line, level, at)
        for task in self._tasks.values():
            generation = task.generation
            if generation is not None and generation.settle(now) is not None:
                task.failed = Code.OUTPUT_STARVED
        self._wire.follow(now, self._oldest)
        return now

    def _wait(
        self,
        timeout: float,
        attempt: Callable[[float, bool], tuple[T | None, float | None]],
    ) -> T:
        """Try until there is a result; ``attempt(now, last)`` says when to look again."""
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
                wake.wait()  # nothing that time could bring
            with self._lock:
                self._waiting.discard(wake)

    def _notify(self) -> None:
        for wake in self._waiting:
            wake.set()

    def _elapsed(self, now: float) -> float:
        """Time in s since the sample clock of the present run started; less than 0 before it."""
        return -1.0 if self._run_start is None else now - self._run_start

    # what is still asked for

    def _oldest(self, generation: Generation) -> int:
        """First tick of ``generation`` that a reader may still ask for; the last one: none may."""
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
                time = task.ticks.start + keeps / task.ticks.rate
                oldest = min(oldest, math.floor((time - generation.start) * generation.rate) - 1)
        return oldest

    def _looks_back(self, now: float) -> float:
        """The earliest time in s whose output somebody may still ask for."""
        earliest = now
        for task in self._tasks.values():
            if task.ticks is not None and task.running and task.ticks.passed(now):
                keeps = task.run.keeps if task.run is not None else 0
                earliest = min(earliest, float(task.ticks.times(keeps, keeps + 1)[0]))
        return earliest

    def _set_output(self, terminal: str, counts: int, now: float, client: str = "") -> None:
        self._wire.set_output(terminal, counts, now, client)
        self._wire.forget_before(self._looks_back(now))

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
            raise DaqmxError(task.failed, f"Task Name: {task.name}", read=read, written=written)

    # starting and ending

    def _waits_for(self, task: Task, trigger: str, kind: Kind) -> bool:
        """Whether ``task`` has to wait for the start of a task of ``kind`` that is not running."""
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
                if t.generation is not None and not t.generation.finished(now)
            ),
            None,
        )
        if clock.source:
            task.ticks = SharedTicks()
            if generation is not None:
                self._share(task, generation, generation.ticks(now) + 1, now)
        else:
            waits = self._waits_for(task, "ao/starttrigger", Kind.AO)
            task.ticks = OwnTicks(clock.rate, None if waits else now)
            if not waits:
                self._run_start = now
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
        """Let an output task generate, and with it the inputs that hang on its clock."""
        waveform = task.waveform
        if waveform is None:
            raise DaqmxError(Code.OUTPUT_BUFFER_EMPTY, f"Task Name: {task.name}")
        generation = Generation(waveform, clock.rate, now, task.wanted)
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
        """Let an input task convert on the ticks of ``generation``, from ``tick`` on."""
        if isinstance(task.ticks, SharedTicks):
            task.ticks.follow(generation, tick, self._wire.row(generation), now)
        if self._run_start is None:
            self._run_start = now

    def _abort(self, task: Task, now: float) -> None:
        """End ``task`` whatever it does; who goes on with it is told."""
        busy = task.state is not State.VERIFIED
        self._end(task, now)
        self._release(task)
        if busy:
            task.failed = Code.RUNTIME_ABORTED

    def _end(self, task: Task, now: float) -> None:
        if task.generation is not None:
            task.generation.stop(now)
            self._wire.follow(now, self._oldest)
            self._wire.end(task.generation)
            task.generation = None
            self._wire.forget_before(self._looks_back(now))
        if task.ticks is not None:
            task.ticks, task.run = None, None
        if task.watchdog is not None:
            task.watchdog.deadline = None
        if task.running:
            task.state = task.kept

    def _done(self, task: Task, now: float) -> bool:
        if not task.running:
            return True
        if task.kind is Kind.AO and task.clock is not None:
            return task.generation is not None and task.generation.finished(now)
        if task.kind is Kind.AI and task.wanted is not None:
            return self._acquired(task, now) >= task.wanted
        return task.clock is None and task.kind is not Kind.WATCHDOG

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
        # while the amplifier is not enabled the film gets 0 V whatever the output says
        output = counts[0]
        if self._wire.switched:
            output = ticks.commands(first, last, self._wire.track)
        task.delivered = last
        self._laser = self._behind.laser_reading(counts, task.inputs)
        return Reading(self._behind.as_read(counts, output, task.inputs), complete)

    def _new_run(self, task: Task) -> Run:
        ticks = task.ticks
        if ticks is None or task.clock is None:
            raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {task.name}", read=0)
        us = self._card.timebase_MHz
        first, step = self.delay_ticks(task) / us, self.convert_ticks(task) / us
        skews = [(first + place * step) * 1e-6 for place in range(len(task.inputs))]
        rate = ticks.rate
        path, state = self._behind.run(task.run_number, rate, task.inputs, skews)
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
        film, output = self._wire.film_voltage(now), self._wire.track.standing(now)
        counts = self._behind.still(task.inputs, samples, self._readings, film, output, self._laser)
        return Reading(counts, True)

    def _write_still(self, task: Task, counts: np.ndarray, auto_start: bool, now: float) -> int:
        if not (auto_start or task.running):
            raise DaqmxError(Code.WRITE_WITHOUT_START, f"Task Name: {task.name}", written=0)
        self._check_free(task)
        for row, channel in zip(counts, task.outputs, strict=True):
            self._set_output(channel.terminal, int(row[-1]), now, task.client)
        self._notify()
        return int(counts.shape[1])

    def _write_ahead(self, task: Task, counts: np.ndarray) -> None:
        """Write before the start, when the buffer takes what it has room for and no more."""
        samples = counts.shape[1]
        if task.waveform is None:
            task.waveform = Waveform(len(task.outputs), task.regenerates)
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

    def _write_behind(self, task: Task, counts: np.ndarray, timeout: float) -> int:
        """Write to a task that generates, waiting for room in its buffer."""
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
            # when a good part of the buffer, or all that is wanted, has gone on to the converter
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
        """Size of the output buffer: as it was set, or as the first write made it."""
        return task.buffer if task.buffer is not None else task.first_write

    def _space(self, task: Task, now: float) -> int:
        waveform = task.waveform
        if waveform is None:
            return task.buffer or 0
        if waveform.loops:
            return waveform.size
        gone = 0
        if task.generation is not None:
            # the card's FIFO takes samples out of the buffer before they are put out
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
