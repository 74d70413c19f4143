"""Tasks of digital lines: channels, generations and writes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dearig.sim_backend.daqmx.card.channels import Lines
from dearig.sim_backend.daqmx.card.checks import may_add, of_kind, raise_failure
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.names import named, physical_names
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.card.terminals import Terminals
from dearig.sim_backend.daqmx.digital.digital import DigitalInput, DigitalOutput
from dearig.sim_backend.daqmx.digital.line_levels import LineLevels
from dearig.sim_backend.daqmx.digital.watchdogs import Watchdogs
from dearig.sim_backend.daqmx.running.output_buffer import OutputBuffer
from dearig.sim_backend.daqmx.running.states import TaskStates
from dearig.sim_backend.daqmx.setup.timing import Timing
from dearig.sim_backend.daqmx.setup.triggering import Triggering

__all__ = ["DigitalLines"]


class DigitalLines:
    """Tasks of digital lines. With ``counting`` a line without a driver reads a count."""

    def __init__(
        self,
        state: CardState,
        terminals: Terminals,
        timing: Timing,
        triggering: Triggering,
        states: TaskStates,
        buffer: OutputBuffer,
        levels: LineLevels,
        watchdogs: Watchdogs,
        *,
        counting: bool,
    ) -> None:
        self._state = state
        self._terminals = terminals
        self._timing = timing
        self._triggering = triggering
        self._states = states
        self._buffer = buffer
        self._levels = levels
        self._watchdogs = watchdogs
        self._counting = counting

    def add(
        self, task: Task, physical: str, name: str, *, together: bool, kind: Kind = Kind.DO
    ) -> None:
        """Add digital lines, a channel each or all ``together`` in one; ``kind`` is DI or DO."""
        with self._state.lock:
            may_add(task, kind)
            device = self._state.name
            lines = self._levels.lines_of(physical)
            if together:
                # the driver's name for several lines is that of the first one and three dots
                whole = [p for p in physical_names(physical, device) if "/" not in p]
                more = "..." if len(lines) > 1 else ""
                given = name or f"{device}/{whole[0] if whole else lines[0] + more}"
                columns = tuple(self._levels.columns_of(physical))
                groups = [Lines(given, tuple(lines), columns)]
            else:
                groups = [
                    Lines(called, (line,), (line,))
                    for line, called in named(task, device, lines, name)
                ]
            if {group.name for group in groups} & set(task.channel_names):
                raise DaqmxError(Code.CHANNEL_ALREADY_IN_TASK, f"Channel Name: {groups[0].name}")
            task.lines += groups
            if task.kind is Kind.EMPTY:
                task.kind = kind
                task.work = self._input(task) if kind is Kind.DI else self._output(task)

    def _input(self, task: Task) -> DigitalInput:
        return DigitalInput(
            task,
            self._terminals,
            self._triggering.sample_ticks,
            self._timing.buffer_size,
            self._levels.is_free if self._counting else None,
        )

    def _output(self, task: Task) -> DigitalOutput:
        return DigitalOutput(
            task,
            self._terminals,
            self._put_generated,
            self._triggering.start_edge,
            self._watchdogs.check,
        )

    # with time

    def settle(self, now: float) -> None:
        """Let the outputs do what is due by ``now`` s, until a watchdog takes their lines."""
        expires = self._watchdogs.next_expiry()
        for task in list(self._state.tasks.values()):
            if isinstance(task.work, DigitalOutput) and task.running:
                task.work.settle(min(now, expires))
                if expires <= now and task.clock is not None:
                    task.work.end(expires)
                    task.failed = Code.WRITE_AFTER_WATCHDOG

    def _put_generated(self, line: str, level: bool, now: float) -> None:
        """Set a line from a generation; one that a watchdog has taken keeps its level."""
        if not self._watchdogs.holds:
            self._levels.put(line, level, now)

    # reads and writes

    def times_of_last(self, task: Task, samples: int) -> tuple[float, float]:
        """Return how long ago the first of the last ``samples`` was taken, and their interval.

        Both in s; for digital inputs on a sample clock.
        """
        with self._state.lock:
            rate, ticks = task.timing.rate, task.sample_times
            if ticks is None or not samples:  # it came to its end with this read
                return samples / rate, 1.0 / rate
            first = task.delivered - samples
            return self._state.now() - float(ticks.times(first, first + 1)[0]), 1.0 / rate

    def write(self, task: Task, levels: np.ndarray, auto_start: bool, timeout: float) -> int:
        """Write ``levels`` (lines, n) to digital outputs; returns the samples per channel.

        ``timeout`` is in s; a negative one is unlimited.
        """
        with self._state.present() as now:
            of_kind(task, Kind.DO, Code.NOT_AN_OUTPUT)
            raise_failure(task, written=0)
            if levels.shape[1] == 0:
                return 0
            if task.clock is None:
                self._write_still(task, levels[:, -1].tolist(), auto_start, now)
                return int(levels.shape[1])
            self._watchdogs.check(task)
        return self._buffer.write(task, levels.astype(np.int16), auto_start, timeout)

    def _write_still(
        self, task: Task, levels: Sequence[bool], auto_start: bool, now: float
    ) -> None:
        """Set the lines of a task, one level each."""
        if not (auto_start or task.running):
            raise DaqmxError(Code.WRITE_WITHOUT_START, f"Task Name: {task.name}", written=0)
        self._watchdogs.check(task)
        self._states.check_free(task)
        for line, level in zip(task.line_names, levels, strict=True):
            self._levels.put(line, bool(level), now)
        self._state.notify()
