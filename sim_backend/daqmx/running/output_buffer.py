"""Buffers of output tasks with a sample clock: writes before the start and while it generates."""

from __future__ import annotations

import numpy as np

from dearig.sim_backend.daqmx.card.checks import raise_failure
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.output import Waveform
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Task
from dearig.sim_backend.daqmx.running.states import TaskStates

__all__ = ["OutputBuffer", "may_generate"]


class OutputBuffer:
    """Buffers of output tasks, analog and digital."""

    def __init__(self, state: CardState, states: TaskStates) -> None:
        self._state = state
        self._states = states
        self._fifo = state.settings.card.ao_fifo_samples

    def write(self, task: Task, counts: np.ndarray, auto_start: bool, timeout: float) -> int:
        """Write ``counts`` (channels, n) to a task with a sample clock; returns n.

        ``timeout`` is in s; a negative one is unlimited.
        """
        with self._state.lock:
            if not task.running:
                self._states.commit(task)
                self._write_before_start(task, counts)
                if auto_start:
                    self._states.start(task)
                return int(counts.shape[1])
        return self._write_while_running(task, counts, timeout)

    def space(self, task: Task) -> int:
        """Return the samples per channel that the output buffer has room for."""
        with self._state.present() as now:
            return self._space(task, now)

    @staticmethod
    def _write_before_start(task: Task, counts: np.ndarray) -> None:
        """Write before the start, up to the room in the buffer."""
        samples = counts.shape[1]
        if task.waveform is None:
            task.waveform = Waveform(task.rows, task.regenerates)
            task.first_write = samples
        waveform = task.waveform
        _within_finite(task, samples)
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
            raise_failure(task, written=done)
            waveform, generation = task.waveform, task.generation
            if not task.running or waveform is None:
                raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {task.name}", written=done)
            if waveform.loops and generation is not None:
                waveform.replace(counts, generation.ticks(now))
                self._state.notify()
                return total, None
            _within_finite(task, total - done)
            room = min(self._space(task, now), total - done)
            if room > 0:
                waveform.append(counts[:, done : done + room])
                done += room
                self._state.notify()
            if done == total:
                return total, None
            if last:
                raise DaqmxError(
                    Code.SAMPLES_NOT_YET_WRITTEN, f"Task Name: {task.name}", written=done
                )
            if generation is None:
                return None, None
            # when a quarter of the buffer, or all that is needed, has moved on to the converter
            need = min(total - done, max(1, _size(task) // 4))
            gone = waveform.written + need - _size(task)
            return None, generation.due(max(0, gone - self._fifo) + 1)

        return self._state.wait(timeout, attempt)

    def _space(self, task: Task, now: float) -> int:
        waveform = task.waveform
        if waveform is None:
            return task.buffer or 0
        if waveform.loops:
            return waveform.size
        gone = 0
        if task.generation is not None:
            # the card's FIFO takes samples out of the buffer before they are output
            gone = task.generation.ticks(now) + self._fifo
        return max(0, _size(task) - (waveform.written - min(waveform.written, gone)))


def _size(task: Task) -> int:
    """Return the size of the output buffer: the set one, or that of the first write."""
    return task.buffer if task.buffer is not None else task.first_write


def _within_finite(task: Task, samples: int) -> None:
    wanted, waveform = task.wanted, task.waveform
    if wanted is None or waveform is None:
        return
    if waveform.written + samples > wanted and not waveform.loops:
        raise DaqmxError(
            Code.BEYOND_FINITE,
            f"Samples: {wanted}; Task Name: {task.name}",
            written=0,
        )


def may_generate(task: Task) -> None:
    """Refuse the start of a generation without samples."""
    if task.waveform is None or task.waveform.written == 0:
        raise DaqmxError(Code.OUTPUT_BUFFER_EMPTY, f"Task Name: {task.name}")
    if _size(task) < 2:
        raise DaqmxError(
            Code.OUTPUT_BUFFER_TOO_SMALL,
            f"Buffer Size: {_size(task)}; Task Name: {task.name}",
        )
