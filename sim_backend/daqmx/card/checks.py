"""Checks of a task's state and kind, with DAQmx's codes."""

from __future__ import annotations

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.hardware import CLOCKED_KINDS
from dearig.sim_backend.daqmx.card.tasks import Kind, Task

__all__ = [
    "has_timing",
    "may_add",
    "not_running",
    "not_set_while_running",
    "of_kind",
    "raise_failure",
]


def not_running(task: Task) -> None:
    """Refuse an operation while ``task`` runs."""
    if task.running:
        raise DaqmxError(Code.NOT_WHILE_RUNNING, f"Task Name: {task.name}")


def not_set_while_running(task: Task) -> None:
    """Refuse to set a property while ``task`` runs."""
    if task.running:
        raise DaqmxError(Code.PROPERTY_WHILE_RUNNING, f"Task Name: {task.name}")


def of_kind(task: Task, kind: Kind, code: Code = Code.NOT_SUPPORTED_IN_TASK) -> None:
    """Refuse a task of another kind with ``code``."""
    if task.kind is Kind.EMPTY:
        code = Code.NOT_WITHOUT_CHANNELS
    if task.kind is not kind:
        raise DaqmxError(code, f"Task Name: {task.name}")


def may_add(task: Task, kind: Kind) -> None:
    """Refuse a channel of ``kind`` in a task that runs or has channels of another kind."""
    not_running(task)
    if task.kind not in (Kind.EMPTY, kind):
        raise DaqmxError(Code.MIXED_CHANNELS, f"Task Name: {task.name}")


def has_timing(task: Task) -> None:
    """Refuse a task that cannot have a sample clock."""
    if task.kind is Kind.EMPTY:
        raise DaqmxError(Code.NOT_WITHOUT_CHANNELS, f"Task Name: {task.name}")
    if task.kind not in CLOCKED_KINDS:
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, f"Task Name: {task.name}")


def raise_failure(task: Task, *, read: int | None = None, written: int | None = None) -> None:
    """Raise the error that stopped ``task``, if any."""
    if task.failed is not None:
        why = f"{task.failed_why} " if task.failed_why else ""
        raise DaqmxError(task.failed, f"{why}Task Name: {task.name}", read=read, written=written)
