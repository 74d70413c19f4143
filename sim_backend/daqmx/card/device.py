"""Simulated card with the calls of NI-DAQmx, each with immediate effect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dearig.drivers.channels import COUNT_MAX, COUNT_MIN
from dearig.sim_backend.daqmx.card import events
from dearig.sim_backend.daqmx.card.engine import Reading, TimingEngine
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.setup import LINES, OUTPUTS
from dearig.sim_backend.daqmx.card.tasks import (
    CURRENT_READ,
    CURRENT_WRITE,
    HIGH,
    LOW,
    NO_CHANGE,
    READ_OFFSET,
    READ_RELATIVE_TO,
    TRISTATE,
    WRITE_OFFSET,
    WRITE_RELATIVE_TO,
    Kind,
    Listener,
    State,
    Task,
    Watchdog,
)
from dearig.sim_backend.daqmx.card.wire import Change
from dearig.sim_backend.faults import Fault, FaultKind

__all__ = ["Device", "Reading"]

_TASKS_MAX = 1000  # of programs that never clear theirs
# s; NI's X Series User Manual, chapter Digital I/O, section Watchdog Timer
_LONGEST_WATCHDOG = (2**32 - 1) * 8e-9


def _check_watchdog(timeout: float) -> None:
    """Raise ``DaqmxError`` for a time-out in s that the card's watchdog timer does not have."""
    if timeout != -1.0 and not 0.0 < timeout <= _LONGEST_WATCHDOG:
        raise DaqmxError(Code.WATCHDOG_TIMEOUT, f"Requested Value: {timeout:g}")


class Device(TimingEngine):
    """PCIe-6361 with the rig of ``settings`` behind it; ``plant`` is the film at rest.

    Every run of its inputs starts with the film at rest. All methods are thread-safe, and all may
    raise ``DaqmxError``. Those with a ``timeout`` in s (negative: unlimited) wait.
    """

    # state for tests

    def wire_voltage(self) -> float:
        """Return the present command in V at the film."""
        with self._lock:
            return self._wire.film_voltage(self._settle())

    def displacement(self) -> float:
        """Return the laser's last reading in m, or the film at rest before the first run."""
        laser = self.settings.laser
        with self._lock:
            if self._laser is None:
                return laser.rest_position_mm * 1e-3
            counts, limit = self._laser
            return laser.direction * laser.mm_per_V * 1e-3 * counts * limit / (COUNT_MAX + 1)

    def live(self) -> bool:
        """Return True while the voltage at the film exceeds the limits' tolerance for zero."""
        return abs(self.wire_voltage()) > self.settings.limits.zero_tolerance_kV * 1e3

    def drives(self, client: str) -> bool:
        """Return True if ``client`` was the last one to change the output to the amplifier."""
        return self._wire.client == client

    def output_voltage(self) -> float:
        """Return the present voltage in V at the output to the amplifier."""
        with self._lock:
            return self._wire.output_voltage(self._settle())

    def history(self) -> tuple[Change, ...]:
        """Return the changes of the film's voltage from and to zero, and single values, by time."""
        with self._lock:
            self._settle()
            return tuple(self._wire.history)

    def line(self, name: str) -> bool:
        """Return the level of the digital line ``name``, such as ``port0/line0``."""
        with self._lock:
            self._settle()
            return self._wire.levels[name]

    def fault(self, kind: FaultKind) -> Fault | None:
        """Return an active fault of ``kind``, timed from the start of the run's clock, or None."""
        with self._lock:
            elapsed = self._elapsed(self._settle())
        found = (f for f in self._faults.of(kind) if f.at <= elapsed < f.end)
        return next(found, None)

    def fires(self, kind: FaultKind) -> Fault | None:
        """Return a fault of ``kind`` that is due, once in a run, or None."""
        with self._lock:
            elapsed = self._elapsed(self._settle())
            for fault in self._faults.of(kind):
                if fault.at <= elapsed and fault not in self._fired:
                    self._fired.add(fault)
                    return fault
            return None

    # tasks

    def create(self, name: str, client: str, *, attach: bool = True) -> tuple[Task, bool]:
        """Return the task called ``name`` (empty: a unique name), and whether it is new."""
        with self._lock:
            if name and name in self._tasks:
                if attach:
                    return self._tasks[name], False
                raise DaqmxError(Code.DUPLICATE_TASK, f"Task Name: {name}")
            if len(self._tasks) >= _TASKS_MAX:
                raise DaqmxError(
                    Code.MEMORY_FULL,
                    f"The card keeps {_TASKS_MAX} tasks that no program has cleared; clear some.",
                )
            while not name or name in self._tasks:
                name = f"_unnamedTask<{self._numbered:X}>"
                self._numbered += 1
            task = self._tasks[name] = Task(name, client)
            return task, True

    def create_watchdog(self, name: str, client: str, device: str, timeout: float) -> Task:
        """Return a task of the watchdog timer, which expires ``timeout`` s after its last reset."""
        with self._lock:
            self.check_device(device)
            _check_watchdog(timeout)
            task, new = self.create(name, client, attach=False)
            if new:
                task.kind = Kind.WATCHDOG
                task.watchdog = Watchdog(timeout)
            return task

    def task(self, name: str) -> Task:
        """Return the task called ``name``."""
        with self._lock:
            if name not in self._tasks:
                raise DaqmxError(Code.INVALID_TASK, f"Task Name: {name}")
            return self._tasks[name]

    def tasks_of(self, client: str) -> list[Task]:
        """Return the tasks of ``client``."""
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
                self._abort(task, now, "The device was reset.")
                if task.watchdog is not None:
                    task.watchdog.expired = False
            for terminal in OUTPUTS:
                self._set_output(terminal, 0, now)
            for line in LINES:
                self._put_line(line, False, now)
            self._notify()

    def make_safe(self, client: str | None = None, why: str = "The card was made safe.") -> None:
        """Abort the tasks of ``client`` (None: all tasks), set 0 V and the enable line low.

        ``why`` is a sentence for the client.
        """
        with self._lock:
            now = self._settle()
            for task in self._tasks.values():
                if client in (None, task.client):
                    self._abort(task, now, why)
            self._set_output(self._card.ao_command, 0, now)
            self._wire.disable(now)
            self._notify()

    def scaling(self, task: Task, name: str) -> tuple[float, ...]:
        """Return volts over counts of the input ``name``, or counts over volts of an output."""
        for channel in task.inputs:
            if channel.name == name:
                return self._wiring.coefficients(channel)
        for output in task.outputs:
            if output.name == name:
                return (0.0, (COUNT_MAX + 1) / output.range)
        raise DaqmxError(Code.CHANNEL_NOT_IN_TASK, f"Channel Name: {name}")

    # states

    def control(self, task: Task, action: int) -> None:
        """Apply a task mode of DAQmx: start, stop, verify, commit, reserve, unreserve, abort."""
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
                task.failed, task.failed_why = None, ""
                self._release(task)
                self._notify()
            else:
                raise DaqmxError(Code.INVALID_VALUE, f"Action: {action}")

    def start(self, task: Task) -> None:
        """Start ``task``: at once, or to wait for its clock or trigger."""
        with self._lock:
            now = self._settle()
            self._not_running(task)
            self._verify(task)
            if task.kind is Kind.AO and task.clock is not None:
                self._may_generate(task)
            events.check_intervals(task, self.buffer_size(task))
            self._reserve(task)
            task.failed, task.failed_why = None, ""
            events.restart(task)
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
        """Stop ``task``; the output keeps its value. Raises the error that stopped it earlier."""
        with self._lock:
            now = self._settle()
            failed, why = task.failed, task.failed_why
            self._end(task, now)
            task.failed, task.failed_why = None, ""
            if task.kept is State.VERIFIED:
                self._release(task)
            elif not task.regenerates:
                task.waveform = None  # a new start needs a new waveform
            self._notify()
            if failed is not None:
                raise DaqmxError(failed, f"{why} Task Name: {task.name}".strip())

    def is_done(self, task: Task) -> bool:
        """Return True once ``task`` is complete; raises the error that stopped it."""
        with self._lock:
            now = self._settle()
            self._raise_failure(task)
            return self._done(task, now)

    def wait_done(self, task: Task, timeout: float) -> None:
        """Wait until ``task`` is done."""

        def attempt(now: float, last: bool) -> tuple[bool | None, float | None]:
            self._raise_failure(task)
            if self._done(task, now):
                return True, None
            if last:
                raise DaqmxError(Code.NOT_DONE_IN_TIME, f"Task Name: {task.name}")
            return None, self._ahead(task, task.wanted, now)

        self._wait(timeout, attempt)

    def _ahead(self, task: Task, samples: int | None, now: float) -> float | None:
        """Return when ``task`` may have ``samples``, or None where it is unknown."""
        if samples is None:
            return None
        if task.generation is not None:
            return task.generation.due(samples)
        return None if task.ticks is None else task.ticks.due(samples, now)

    # events

    def listen(
        self,
        task: Task,
        every: int | None,
        owner: object,
        direction: int = 0,
        signal: int | None = None,
    ) -> Listener:
        """Return a new listener to ``task``: every ``every`` samples, or None for its end.

        ``owner`` is the call that listens, ``direction`` DAQmx's type of an event by samples,
        ``signal`` that of an event by a signal.
        """
        with self._lock:
            events.check_registration(task, every, direction, signal)
            listener = Listener(every, owner, signal)
            task.listeners.append(listener)
            return listener

    def forget(self, task: Task, listener: Listener) -> None:
        """End ``listener``."""
        with self._lock:
            if listener in task.listeners:
                task.listeners.remove(listener)

    def due_events(self, task: Task, listener: Listener) -> Sequence[int]:
        """Return the status of each event that happened since the last call."""
        with self._lock:
            now = self._settle()
            if task.running:
                self._observe(task, now)
            return events.collect(listener)

    # reading

    def available(self, task: Task) -> int:
        """Return the samples per channel that are acquired and not read."""
        with self._lock:
            now = self._settle()
            return self._acquired(task, now) - task.delivered

    def acquired(self, task: Task) -> int:
        """Return the samples per channel since the start."""
        with self._lock:
            return self._acquired(task, self._settle())

    def default_samples(self, task: Task) -> int:
        """Return the samples per channel of a read of all that is there."""
        if task.clock is None:
            return 1
        if task.clock.finite and not task.read_available:
            return task.clock.samples
        return self.available(task)

    def read(self, task: Task, samples: int, timeout: float, most: int | None = None) -> Reading:
        """Return the next ``samples`` of every channel; -1: all present, or all of a finite task.

        ``most`` bounds the number for -1.
        """
        self._of_kind(task, Kind.AI, Code.NOT_AN_INPUT)
        _check_place(task, READ_RELATIVE_TO, CURRENT_READ, READ_OFFSET)
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
                if samples > 0 and left == 0:
                    raise DaqmxError(
                        Code.SAMPLES_NEVER_AVAILABLE,
                        f"Task Name: {task.name}; Samples Left: 0",
                        read=0,
                    )
                # the driver gives what is left of a finite acquisition without an error
                wanted = left if samples == -1 else min(samples, left)
                if samples == -1 and task.read_available:
                    wanted = waiting
            elif samples == -1:
                wanted = waiting
            if most is not None:
                wanted = min(wanted, most)
            if waiting >= wanted or last:
                short = wanted
                if wanted > 1 and self.fires(FaultKind.SHORT_READ) is not None:
                    short = wanted // 2
                return self._deliver(task, min(short, waiting), waiting >= wanted), None
            return None, self._ahead(task, task.delivered + wanted, now)

        reading = self._wait(timeout, attempt)
        with self._lock:
            if task.by_read and task.wanted is not None and task.delivered >= task.wanted:
                self.stop(task)
        return reading

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
        with self._lock:
            now = self._settle()
            at = now
            if task.ticks is not None and task.ticks.passed(now) > sample:
                at = float(task.ticks.times(sample, sample + 1)[0])
            return self._born_at + at

    # writing

    def to_counts(self, task: Task, volts: np.ndarray) -> np.ndarray:
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
        """Write ``counts`` (channels, n) to an output task; returns the samples per channel."""
        with self._lock:
            now = self._settle()
            self._of_kind(task, Kind.AO, Code.NOT_AN_OUTPUT)
            _check_place(task, WRITE_RELATIVE_TO, CURRENT_WRITE, WRITE_OFFSET)
            self._raise_failure(task, written=0)
            if counts.shape[1] == 0:
                return 0
            if task.clock is None:
                return self._write_still(task, counts, auto_start, now)
        return self._write_buffered(task, counts, auto_start, timeout)

    def _write_buffered(
        self, task: Task, counts: np.ndarray, auto_start: bool, timeout: float
    ) -> int:
        """Write ``counts`` (channels, n) to the buffer of a task with a sample clock."""
        with self._lock:
            if not task.running:
                self._verify(task)
                self._reserve(task)
                task.state = max(task.state, State.COMMITTED, key=lambda state: state.value)
                self._write_before_start(task, counts)
                if auto_start:
                    self.start(task)
                return int(counts.shape[1])
        return self._write_while_running(task, counts, timeout)

    def written(self, task: Task) -> int:
        """Return the samples per channel written since the task was set up or stopped."""
        return task.waveform.written if task.waveform is not None else 0

    def space(self, task: Task) -> int:
        """Return the samples per channel that the output buffer has room for."""
        with self._lock:
            now = self._settle()
            return self._space(task, now)

    def generated(self, task: Task) -> int:
        """Return the samples per channel that were output since the start."""
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
                self._put_line(line, bool(level), now)
            self._notify()

    # the watchdog

    def set_expiration(self, task: Task, physical: str, level: int) -> None:
        """Set DAQmx's level of the lines ``physical`` when the watchdog of ``task`` expires."""
        with self._lock:
            watchdog = self._watchdog(task)
            self._not_running(task)
            if level not in (HIGH, LOW, TRISTATE, NO_CHANGE):
                raise DaqmxError(
                    Code.INVALID_VALUE, f"Property: DO_EXPIR_STATE; Requested Value: {level}"
                )
            for line in self.lines_of(physical):
                watchdog.states[line] = level

    def set_watchdog_timeout(self, task: Task, timeout: float) -> None:
        """Set the time in s after which the watchdog of ``task`` expires; -1: never."""
        with self._lock:
            watchdog = self._watchdog(task)
            self._not_running(task)
            _check_watchdog(timeout)
            watchdog.timeout = timeout

    def expiration(self, task: Task, physical: str) -> int:
        """Return the level that the first of the lines ``physical`` takes then."""
        with self._lock:
            line = self.lines_of(physical)[0]
            states = self._watchdog(task).states
            if line not in states:
                raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, f"Lines: {physical}")
            return states[line]

    def expired(self, task: Task) -> bool:
        """Return True if the watchdog of ``task`` has expired."""
        with self._lock:
            self._settle()
            return self._watchdog(task).expired

    def control_watchdog(self, task: Task, clear: bool) -> None:
        """Reset the timer, or ``clear`` the lock after its expiration."""
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


def _check_place(task: Task, relative_to: str, current: int, offset: str) -> None:
    """Refuse a read or a write from another place than where the last one ended."""
    kept = task.kept_properties
    if kept.get(relative_to, current) != current or kept.get(offset, 0) != 0:
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Properties: {relative_to}, {offset}; only the current position without offset is "
            f"simulated. Task Name: {task.name}",
        )
