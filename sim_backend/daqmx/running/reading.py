"""Reads of input tasks of every kind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dearig.sim_backend.daqmx.card.checks import raise_failure
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import (
    CURRENT_READ,
    FIRST_PRETRIGGER,
    FIRST_SAMPLE,
    MOST_RECENT,
    REFERENCE_TRIGGER,
)
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import State, Task
from dearig.sim_backend.daqmx.card.work import Input
from dearig.sim_backend.daqmx.running.states import TaskStates

__all__ = ["Reader", "Reading"]


@dataclass(frozen=True)
class Reading:
    """Result of a read: ``values`` (rows, n) from sample ``first`` since the start on.

    ``complete`` unless it timed out.
    """

    values: np.ndarray
    complete: bool
    first: int = 0


class Reader:
    """Reads of input tasks: where each begins, how many samples it waits for."""

    def __init__(self, state: CardState, states: TaskStates) -> None:
        self._state = state
        self._states = states

    def read(self, task: Task, samples: int, timeout: float, most: int | None = None) -> Reading:
        """Return the next ``samples`` of every channel; -1: all present, or all of a finite task.

        ``most`` bounds the number for -1. ``timeout`` is in s; a negative one is unlimited.
        """
        work = self._input(task)
        with self._state.present():
            raise_failure(task, read=0)
            if task.clock is None and (task.read_from, task.read_offset) != (CURRENT_READ, 0):
                raise DaqmxError(
                    Code.INVALID_VALUE,
                    "Properties: RELATIVE_TO, OFFSET; without a sample clock there is no buffer "
                    f"with other places to read from. Task Name: {task.name}",
                    read=0,
                )
            started = self._start(task)
        if task.clock is None:
            return self._read_still(task, work, max(1, samples), timeout, started=started)
        reading = self._read_buffer(task, work, samples, timeout, most)
        with self._state.lock:
            if task.by_read and task.wanted is not None and task.delivered >= task.wanted:
                self._states.stop(task)
        return reading

    @staticmethod
    def _input(task: Task) -> Input:
        if not isinstance(task.work, Input):
            code = Code.NOT_AN_INPUT if task.work is not None else Code.NOT_WITHOUT_CHANNELS
            raise DaqmxError(code, f"Task Name: {task.name}", read=0)
        return task.work

    def _start(self, task: Task) -> bool:
        """Start ``task`` for a read unless it runs; returns True if it did."""
        if task.running:
            return False
        if task.auto_start:
            self._states.start(task)
            task.by_read = True
            return True
        if task.clock is None:
            raise DaqmxError(Code.READ_WITHOUT_START, f"Task Name: {task.name}", read=0)
        if task.state is not State.COMMITTED:
            raise DaqmxError(Code.READ_WITHOUT_COMMIT, f"Task Name: {task.name}", read=0)
        return False

    def _read_buffer(
        self, task: Task, work: Input, samples: int, timeout: float, most: int | None
    ) -> Reading:
        ran = task.running  # False for a task that was committed, and is started by another call
        newest: int | None = None  # acquired when the read began

        def attempt(now: float, last: bool) -> tuple[Reading | None, float | None]:
            nonlocal ran, newest
            raise_failure(task, read=0)
            if not task.running:
                if ran:
                    raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {task.name}", read=0)
                if last:
                    raise DaqmxError(
                        Code.SAMPLES_NOT_YET_AVAILABLE, f"Task Name: {task.name}", read=0
                    )
                return None, None
            ran = True
            work.watch(now)
            raise_failure(task, read=0)
            acquired = work.passed(now)
            newest = acquired if newest is None else newest
            first = _place(task, newest)
            wanted = _wanted(task, samples, first, acquired)
            if most is not None:
                wanted = min(wanted, most)
            there = acquired - first
            if there < wanted and not last:
                return None, work.due(first + wanted, now)
            if first < acquired - work.room():
                raise DaqmxError(Code.SAMPLES_OVERWRITTEN, f"Task Name: {task.name}", read=0)
            taken = max(0, min(work.at_most(wanted), there))
            task.delivered = first + taken
            return Reading(work.between(first, first + taken), there >= wanted, first), None

        return self._state.wait(timeout, attempt)

    def _read_still(
        self, task: Task, work: Input, samples: int, timeout: float, *, started: bool
    ) -> Reading:
        """Return ``samples`` of a task without timing, one after the other."""
        parts: list[np.ndarray] = []
        missing = samples

        def attempt(now: float, last: bool) -> tuple[np.ndarray | None, float | None]:
            values = work.still(missing, now)
            if values is None and last:
                raise DaqmxError(Code.SAMPLES_NOT_YET_AVAILABLE, f"Task Name: {task.name}", read=0)
            return values, None if values is not None else work.still_due(now)

        while missing:
            parts.append(self._state.wait(timeout, attempt))
            missing -= int(parts[-1].shape[1])
        if started:
            self._states.stop(task)
        return Reading(np.concatenate(parts, axis=1), True)

    def available(self, task: Task) -> int:
        """Return the samples per channel that are acquired and not read."""
        with self._state.present() as now:
            work = task.work
            if not isinstance(work, Input) or not task.running:
                return 0
            return _unread(task, work, work.passed(now), task.delivered)

    def default_samples(self, task: Task) -> int:
        """Return the samples per channel of a read of all that is there."""
        if task.clock is None:
            return 1
        if task.clock.finite and not task.read_available:
            return task.clock.samples
        with self._state.present() as now:
            work = task.work
            if not isinstance(work, Input) or not task.running:
                return 0
            acquired = work.passed(now)
            return _unread(task, work, acquired, _place(task, acquired))


def _unread(task: Task, work: Input, acquired: int, first: int) -> int:
    """Return how many of the ``acquired`` samples can be read from ``first`` on."""
    waiting = max(0, acquired - first)
    return min(waiting, work.room()) if task.overwrites else waiting


def _place(task: Task, newest: int) -> int:
    """Return the number of the first sample of a read, with ``newest`` samples acquired."""
    reference = task.reference if task.reference is not None and not task.reference.starts else None
    bases = {CURRENT_READ: task.delivered, FIRST_SAMPLE: 0, MOST_RECENT: newest}
    if reference is not None:
        bases |= {FIRST_PRETRIGGER: 0, REFERENCE_TRIGGER: reference.before}
    if task.read_from not in bases:
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Property: RELATIVE_TO; Requested Value: {task.read_from}; the task has no reference "
            f"trigger. Task Name: {task.name}",
            read=0,
        )
    first = bases[task.read_from] + task.read_offset
    if first < 0:
        raise DaqmxError(
            Code.NEGATIVE_SAMPLE, f"Sample Number: {first}; Task Name: {task.name}", read=0
        )
    return first


def _wanted(task: Task, samples: int, first: int, acquired: int) -> int:
    """Return how many samples a read from ``first`` on waits for, -1 being all."""
    present = max(0, acquired - first)
    if task.wanted is None:
        return present if samples == -1 else samples
    left = max(0, task.wanted - first)
    if samples > 0 and left == 0:
        raise DaqmxError(
            Code.SAMPLES_NEVER_AVAILABLE, f"Task Name: {task.name}; Samples Left: 0", read=0
        )
    if samples == -1:
        return present if task.read_available else left
    # the driver gives what is left of a finite acquisition without an error
    return min(samples, left)
