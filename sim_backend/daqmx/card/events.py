"""Software events of a task: those that are due to each program that listens."""

from __future__ import annotations

from collections.abc import Sequence

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import Kind, Listener, Task

__all__ = ["check_intervals", "check_registration", "collect", "observe", "restart"]

_SIGNALS = (12487, 12530)  # DAQmx: sample clock, sample complete: one with every sample
_ACQUIRED, _TRANSFERRED = 1, 2  # DAQmx: samples acquired into, or transferred from, the buffer

# events that wait for a program to hear them; more become due once it has heard some
_DUE_MAX = 10_000


def check_registration(
    task: Task, every: int | None, direction: int, signal: int | None = None
) -> None:
    """Refuse an event that ``task`` cannot have; ``every`` is None for the done event."""
    if task.running:
        raise DaqmxError(Code.EVENT_WHILE_RUNNING, f"Task Name: {task.name}")
    if signal is not None:
        if signal not in _SIGNALS:
            raise DaqmxError(Code.SIGNAL_NOT_SUPPORTED, f"Signal: {signal}; Task: {task.name}")
        if any(listener.signal is not None for listener in task.listeners):
            raise DaqmxError(Code.SIGNAL_EVENT_REGISTERED, f"Task Name: {task.name}")
        return
    if every is None:
        if any(listener.every is None for listener in task.listeners):
            raise DaqmxError(Code.DONE_EVENT_REGISTERED, f"Task Name: {task.name}")
        return
    is_input = task.kind.is_input
    if direction == _ACQUIRED and not is_input:
        raise DaqmxError(Code.ACQUIRED_NOT_FOR_OUTPUT, f"Task Name: {task.name}")
    if direction == _TRANSFERRED and is_input:
        raise DaqmxError(Code.TRANSFERRED_NOT_FOR_INPUT, f"Task Name: {task.name}")
    if every < 1:
        raise DaqmxError(Code.EVENT_INTERVAL_ZERO, f"N Samples: {every}; Task Name: {task.name}")
    if any(one.every is not None and one.signal is None for one in task.listeners):
        raise DaqmxError(
            Code.ACQUIRED_EVENT_REGISTERED if is_input else Code.TRANSFERRED_EVENT_REGISTERED,
            f"Task Name: {task.name}",
        )


def check_intervals(task: Task, buffer: int) -> None:
    """Refuse the start of ``task`` if its ``buffer`` is not a multiple of an event's interval."""
    for listener in task.listeners:
        if listener.every is None or listener.signal is not None:
            continue
        if task.clock is None:
            raise DaqmxError(Code.EVENT_WITHOUT_BUFFER, f"Task Name: {task.name}")
        if task.kind is Kind.AI and buffer % listener.every:
            raise DaqmxError(
                Code.BUFFER_NOT_MULTIPLE,
                f"Event Interval: {listener.every}; Buffer Size: {buffer}; Task Name: {task.name}",
            )


def restart(task: Task) -> None:
    """Count the samples of a new start from zero; events of the previous one stay due."""
    for listener in task.listeners:
        listener.reported = 0


def observe(task: Task, samples: int, status: int | None) -> None:
    """Make events due: ``samples`` per channel since the start; ``status`` None: not done."""
    for listener in task.listeners:
        if listener.every is not None:
            passed = samples // listener.every
            more = max(0, min(passed - listener.reported, _DUE_MAX - len(listener.due)))
            listener.due += [0] * more
            listener.reported += more
        elif status is not None and not listener.reported:
            listener.reported = 1
            listener.due.append(status)


def collect(listener: Listener) -> Sequence[int]:
    """Return the status of each event that is due, which is then told."""
    due, listener.due = listener.due, []
    return due
