"""States of tasks: verified, reserved, committed, running, and what each change needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from dearig.sim_backend.daqmx.card import events
from dearig.sim_backend.daqmx.card.checks import not_running, raise_failure
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import State, Task
from dearig.sim_backend.daqmx.card.work import CardWork
from dearig.sim_backend.daqmx.setup.routes import Routes
from dearig.sim_backend.daqmx.setup.timing import Timing

__all__ = ["TaskStates"]


class TaskStates:
    """States of the tasks of the card, and the resources that they reserve.

    ``checks`` refuse a task whose settings do not agree, when it is verified. What a task does
    while it runs is its ``work``.
    """

    def __init__(
        self,
        state: CardState,
        timing: Timing,
        routes: Routes,
        checks: Sequence[Callable[[Task], None]],
    ) -> None:
        self._state = state
        self._timing = timing
        self._routes = routes
        self._checks = checks
        self._reserved: dict[str, Task] = {}

    # changes of state that a program asks for

    def control(self, task: Task, action: int) -> None:
        """Apply a task mode of DAQmx: start, stop, verify, commit, reserve, unreserve, abort."""
        with self._state.lock:
            if action == 0:
                self.start(task)
            elif action == 1:
                self.stop(task)
            elif action == 2:
                self.verify(task)
            elif action in (3, 4):
                if task.running:
                    return
                self.verify(task)
                self._reserve(task)
                task.state = State.COMMITTED if action == 3 else State.RESERVED
                task.kept = task.state
            elif action == 5:
                not_running(task)
                self.release(task)
            elif action == 6:
                self.forget(task)
            else:
                raise DaqmxError(Code.INVALID_VALUE, f"Action: {action}")

    def start(self, task: Task) -> None:
        """Start ``task``: at once, or to wait for its clock or trigger."""
        with self._state.present() as now:
            not_running(task)
            work = self.verify(task)
            if task.pause is not None and not task.pause[0]:
                raise DaqmxError(
                    Code.INVALID_VALUE,
                    f"Property: PauseTrig.DigLvl.Src is not set; Task Name: {task.name}",
                )
            work.check_start()
            events.check_intervals(task, self._timing.buffer_size(task))
            self._reserve(task)
            task.armed, task.by_read = now, False
            task.failed, task.failed_why = None, ""
            events.restart(task)
            task.state = State.RUNNING
            self._routes.put_out(task)
            try:
                work.start(now)
            except DaqmxError:
                self.end(task, now)
                raise
            self._state.notify()

    def stop(self, task: Task) -> None:
        """Stop ``task``; the output keeps its value. Raises the error that stopped it earlier."""
        with self._state.present() as now:
            failed, why = task.failed, task.failed_why
            self.end(task, now)
            task.failed, task.failed_why = None, ""
            if task.kept is State.VERIFIED:
                self.release(task)
            elif not task.regenerates:
                task.waveform = None  # a new start needs a new waveform
            self._state.notify()
            if failed is not None:
                raise DaqmxError(failed, f"{why} Task Name: {task.name}".strip())

    def forget(self, task: Task) -> None:
        """Abort ``task`` as its program asks, and forget its error; the output keeps its value."""
        with self._state.present() as now:
            self.end(task, now)
            task.failed, task.failed_why = None, ""
            self.release(task)
            self._state.notify()

    # questions

    def is_done(self, task: Task) -> bool:
        """Return True once ``task`` is complete; raises the error that stopped it."""
        with self._state.present() as now:
            raise_failure(task)
            return self._done(task, now)

    def wait_done(self, task: Task, timeout: float) -> None:
        """Wait until ``task`` is done, for ``timeout`` s at most (negative: unlimited)."""

        def attempt(now: float, last: bool) -> tuple[bool | None, float | None]:
            raise_failure(task)
            if self._done(task, now):
                return True, None
            if last:
                raise DaqmxError(Code.NOT_DONE_IN_TIME, f"Task Name: {task.name}")
            return None, None if task.work is None else task.work.due(task.wanted, now)

        self._state.wait(timeout, attempt)

    def passed(self, task: Task) -> int:
        """Return the samples per channel that were acquired or generated since the start."""
        with self._state.present() as now:
            return _passed(task, now)

    @staticmethod
    def _done(task: Task, now: float) -> bool:
        return not task.running or task.work is None or task.work.done(now)

    def observe(self, task: Task, now: float) -> None:
        """Make the events due that have happened since the start of ``task``."""
        if task.listeners:
            done = 0 if task.failed is None and self._done(task, now) else task.failed
            events.observe(task, _passed(task, now), done)

    # parts of changes of state, at the time ``now`` in s

    def verify(self, task: Task) -> CardWork:
        """Refuse ``task`` where its settings do not agree; returns what it does."""
        if task.work is None:
            raise DaqmxError(Code.NOT_WITHOUT_CHANNELS, f"Task Name: {task.name}")
        for check in self._checks:
            check(task)
        return task.work

    def commit(self, task: Task) -> None:
        """Verify and reserve ``task`` for what a program writes before the start."""
        self.verify(task)
        self._reserve(task)
        task.state = max(task.state, State.COMMITTED, key=lambda state: state.value)

    def check_free(self, task: Task) -> None:
        """Refuse ``task`` while another one has a resource that it needs."""
        for resource in [] if task.work is None else task.work.resources():
            owner = self._reserved.get(resource)
            if owner is not None and owner is not task:
                raise DaqmxError(
                    Code.RESOURCE_RESERVED,
                    f"Device: {self._state.name}; Resource: {resource}; Task Name: {task.name}; "
                    f"reserved by: {owner.name}",
                )

    def _reserve(self, task: Task) -> None:
        self.check_free(task)
        for resource in [] if task.work is None else task.work.resources():
            self._reserved[resource] = task

    def release(self, task: Task) -> None:
        """Give the resources of ``task`` back."""
        task.state = task.kept = State.VERIFIED
        task.waveform = None
        self._reserved = {r: owner for r, owner in self._reserved.items() if owner is not task}

    def end(self, task: Task, now: float) -> None:
        """End the work of ``task``, which keeps its resources."""
        if not task.running or task.work is None:
            return
        self.observe(task, now)
        task.work.end(now)
        task.state, task.delivered = task.kept, 0

    def abort(self, task: Task, now: float, why: str) -> None:
        """End ``task`` in any state; its client gets the error and ``why`` in its next call."""
        busy, running = task.state is not State.VERIFIED, task.running
        self.end(task, now)
        self.release(task)
        if busy:
            task.failed, task.failed_why = Code.RUNTIME_ABORTED, why
        if running:
            events.observe(task, 0, Code.RUNTIME_ABORTED)


def _passed(task: Task, now: float) -> int:
    return task.work.passed(now) if task.running and task.work is not None else 0
