"""Watchdog timers: what the lines do when a program is silent for too long."""

from __future__ import annotations

import math

from dearig.sim_backend.daqmx.card.checks import not_running
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import HIGH, LOW, NO_CHANGE, TRISTATE
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, Task, Watchdog
from dearig.sim_backend.daqmx.card.work import CardWork
from dearig.sim_backend.daqmx.digital.line_levels import LineLevels

__all__ = ["Watchdogs"]

# s; NI's X Series User Manual, chapter Digital I/O, section Watchdog Timer
_LONGEST = (2**32 - 1) * 8e-9


class _WatchdogWork(CardWork):
    """Timer of the ``watchdog`` of ``task``."""

    def __init__(self, task: Task, watchdog: Watchdog) -> None:
        super().__init__(task)
        self._watchdog = watchdog

    def resources(self) -> list[str]:
        return ["watchdog"]

    def start(self, now: float) -> None:
        if self._watchdog.timeout >= 0.0 and not self._watchdog.expired:
            self._watchdog.deadline = now + self._watchdog.timeout

    def end(self, now: float) -> None:  # noqa: ARG002
        self._watchdog.deadline = None

    def done(self, now: float) -> bool:  # noqa: ARG002
        return False

    def passed(self, now: float) -> int:  # noqa: ARG002
        return 0

    def due(self, samples: int | None, now: float) -> float | None:  # noqa: ARG002
        return None


class Watchdogs:
    """Watchdog timers of the card; an expired one holds its ``levels`` until it is cleared."""

    def __init__(self, state: CardState, levels: LineLevels) -> None:
        self._state = state
        self._levels = levels

    # with time

    def settle(self, now: float) -> None:
        """Let the watchdogs expire whose time is over."""
        for task in list(self._state.tasks.values()):
            watchdog = task.watchdog
            if watchdog is not None and watchdog.deadline is not None and now >= watchdog.deadline:
                at, watchdog.deadline = watchdog.deadline, None
                watchdog.expired = True
                for line, level in watchdog.states.items():
                    if level != NO_CHANGE:
                        # a line that no one drives is pulled down by the card
                        self._levels.put(line, level == HIGH, at)

    def next_expiry(self) -> float:
        """Return the time in s at which the next one expires; infinite without one."""
        return min(
            (
                task.watchdog.deadline
                for task in self._state.tasks.values()
                if task.watchdog is not None and task.watchdog.deadline is not None
            ),
            default=math.inf,
        )

    @property
    def holds(self) -> bool:
        """Return True while an expired watchdog holds the lines."""
        return any(
            t.watchdog is not None and t.watchdog.expired for t in self._state.tasks.values()
        )

    def check(self, task: Task) -> None:
        """Refuse a write by ``task`` while one holds the lines."""
        if self.holds:
            raise DaqmxError(Code.WRITE_AFTER_WATCHDOG, f"Task Name: {task.name}", written=0)

    # calls of programs

    @staticmethod
    def make(task: Task, timeout: float) -> None:
        """Make ``task`` that of a watchdog, which expires ``timeout`` s after its last reset."""
        task.kind, task.watchdog = Kind.WATCHDOG, Watchdog(timeout)
        task.work = _WatchdogWork(task, task.watchdog)

    @staticmethod
    def check_timeout(timeout: float) -> None:
        """Refuse a time-out in s that the card's watchdog timer does not have; -1: never."""
        if timeout != -1.0 and not 0.0 < timeout <= _LONGEST:
            raise DaqmxError(Code.WATCHDOG_TIMEOUT, f"Requested Value: {timeout:g}")

    def set_timeout(self, task: Task, timeout: float) -> None:
        """Set the time in s after which the watchdog of ``task`` expires; -1: never."""
        with self._state.lock:
            watchdog = _of(task)
            not_running(task)
            self.check_timeout(timeout)
            watchdog.timeout = timeout

    def set_expiration(self, task: Task, physical: str, level: int) -> None:
        """Set DAQmx's level of the lines ``physical`` when the watchdog of ``task`` expires."""
        with self._state.lock:
            watchdog = _of(task)
            not_running(task)
            if level not in (HIGH, LOW, TRISTATE, NO_CHANGE):
                raise DaqmxError(
                    Code.INVALID_VALUE, f"Property: DO_EXPIR_STATE; Requested Value: {level}"
                )
            for line in self._levels.lines_of(physical):
                watchdog.states[line] = level

    def expiration(self, task: Task, physical: str) -> int:
        """Return the level that the first of the lines ``physical`` takes then."""
        with self._state.lock:
            line = self._levels.lines_of(physical)[0]
            states = _of(task).states
            if line not in states:
                raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, f"Lines: {physical}")
            return states[line]

    def expired(self, task: Task) -> bool:
        """Return True if the watchdog of ``task`` has expired."""
        with self._state.present():
            return _of(task).expired

    def control(self, task: Task, clear: bool) -> None:
        """Reset the timer, or ``clear`` the lock after its expiration."""
        with self._state.present() as now:
            watchdog = _of(task)
            if clear:
                watchdog.expired = False
            elif watchdog.expired:
                raise DaqmxError(Code.WATCHDOG_EXPIRED_NO_RESET, f"Task Name: {task.name}")
            if task.running and task.work is not None:
                task.work.start(now)


def _of(task: Task) -> Watchdog:
    if task.watchdog is None:
        raise DaqmxError(Code.WATCHDOG_ONLY, f"Task Name: {task.name}")
    return task.watchdog
