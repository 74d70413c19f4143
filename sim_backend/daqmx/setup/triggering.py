"""Triggers of tasks: start, reference, pause and arm, and the edges that each waits for."""

from __future__ import annotations

from dearig.sim_backend.daqmx.card.checks import not_running, of_kind
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import (
    ANALOG_EDGE,
    DIGITAL_EDGE,
    FALLING,
    NO_TRIGGER,
    RISING,
)
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.card.terminals import Terminals
from dearig.sim_backend.daqmx.card.triggers import (
    Edge,
    EdgeTicks,
    Pause,
    Reference,
    SampleTicks,
    TriggeredTicks,
)
from dearig.sim_backend.daqmx.setup.timing import Timing

__all__ = ["Triggering"]


class Triggering:
    """Triggers of tasks at ``terminals``."""

    def __init__(self, state: CardState, terminals: Terminals, timing: Timing) -> None:
        self._state = state
        self._terminals = terminals
        self._timing = timing

    # set-up

    def set_start(self, task: Task, source: str, edge: int = RISING) -> None:
        """Make ``task`` wait for a digital ``edge`` on ``source`` at its start; empty: no wait.

        The pulses within the card have no length here, so both of their edges are at one time.
        """
        with self._state.lock:
            not_running(task)
            if edge not in (RISING, FALLING):
                raise DaqmxError(
                    Code.INVALID_VALUE, f"Property: DigEdge.StartTrig.Edge; Value: {edge}"
                )
            task.trigger = self._terminals.source(source) if source else ""
            task.trigger_edge = edge
            task.trigger_type = DIGITAL_EDGE if source else NO_TRIGGER

    def set_start_edge(self, task: Task, edge: int) -> None:
        """Set the edge of the start trigger."""
        with self._state.lock:
            kind = task.trigger_type
            self.set_start(task, task.trigger, edge)
            task.trigger_type = kind

    def set_start_type(self, task: Task, kind: int) -> None:
        """Set the type of the start trigger; its source is checked with the task."""
        with self._state.lock:
            not_running(task)
            task.trigger_type = kind
            if kind == NO_TRIGGER:
                task.trigger = ""
            if task.reference is not None and task.reference.starts and kind != ANALOG_EDGE:
                task.reference = None

    def set_retriggers(self, task: Task, again: bool) -> None:
        """Set whether each further edge of the start trigger starts a finite task again."""
        with self._state.lock:
            not_running(task)
            task.retriggers = again

    def set_reference(self, task: Task, reference: Reference | None) -> None:
        """Give an analog input a reference trigger, or an analog start trigger; None: neither."""
        with self._state.lock:
            not_running(task)
            if reference is None:
                task.reference = None
                return
            of_kind(task, Kind.AI)
            if reference.level is None:
                reference.terminal = self._terminals.name(reference.terminal)
            else:
                reference.terminal = _trigger_channel(task, reference)
            if reference.starts:
                task.trigger_type = ANALOG_EDGE
            task.reference = reference

    def set_pause(self, task: Task, pause: tuple[str, bool] | None) -> None:
        """Let the clock of ``task`` stand still while a terminal has a level (True: high)."""
        with self._state.lock:
            not_running(task)
            if task.kind not in (Kind.AI, Kind.DI, Kind.CI):
                raise DaqmxError(
                    Code.NOT_SUPPORTED_IN_TASK,
                    f"A pause of outputs is not simulated. Task Name: {task.name}",
                )
            task.pause = pause and (pause[0] and self._terminals.name(pause[0]), pause[1])

    def set_arm(self, task: Task, edge: tuple[str, bool] | None) -> None:
        """Let an edge of a terminal (True: rising) arm a counter input."""
        with self._state.lock:
            not_running(task)
            of_kind(task, Kind.CI)
            task.arm = edge and (edge[0] and self._terminals.name(edge[0]), edge[1])

    def check(self, task: Task) -> None:
        """Refuse triggers that ``task`` cannot have with its timing."""
        if task.clock is None:
            if task.trigger_type != NO_TRIGGER and task.kind is not Kind.CO:
                raise DaqmxError(Code.TRIGGER_ON_DEMAND, f"Task Name: {task.name}")
            return
        reference = task.reference
        analog_start = reference is not None and reference.starts
        if task.trigger_type not in (NO_TRIGGER, DIGITAL_EDGE) and not analog_start:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: START_TRIG_TYPE; Requested Value: {task.trigger_type}; You Can Select: "
                f"{NO_TRIGGER}, {DIGITAL_EDGE}; Task Name: {task.name}",
            )
        if task.trigger_type == DIGITAL_EDGE and not task.trigger:
            raise DaqmxError(Code.INVALID_ROUTE_SOURCE, f"Source Terminal: ; Task: {task.name}")
        if reference is not None and not reference.starts:
            _check_pretrigger(task, reference)

    # what a task waits for

    def start_edge(self, task: Task) -> Edge | None:
        """Return the edge that starts ``task``, or None where it starts at once."""
        if not task.trigger:
            return None
        return Edge(self._terminals.signal(task.trigger), task.trigger_edge == RISING)

    def arm_edge(self, task: Task) -> Edge | None:
        """Return the edge that arms a counter, or None where it is armed at once."""
        if task.arm is None:
            return self.start_edge(task)
        terminal, rising = task.arm
        return Edge(self._terminals.signal(terminal), rising)

    def reference_edge(self, reference: Reference) -> Edge:
        """Return the edge of a digital reference trigger."""
        return Edge(self._terminals.signal(reference.terminal), reference.rising)

    def pause_of(self, task: Task) -> Pause | None:
        """Return what makes the clock of ``task`` stand still, or None."""
        if task.pause is None:
            return None
        terminal, when_high = task.pause
        return Pause(self._terminals.signal(terminal), when_high)

    def clock_edge(self, task: Task) -> Edge | None:
        """Return the edge of the clock from outside, or None where the task has its own."""
        source = self._timing.source(task)
        if task.clock is None or not source:
            return None
        return Edge(self._terminals.signal(source), task.clock.edge == RISING)

    def sample_ticks(self, task: Task, now: float) -> SampleTicks:
        """Return the times of the samples of ``task``, which is armed ``now``."""
        clock = task.timing
        edge, trigger, pause = self.clock_edge(task), self.start_edge(task), self.pause_of(task)
        if edge is not None:
            return EdgeTicks(clock.rate, now, edge, trigger, pause)
        again = clock.samples if task.retriggers and clock.finite else None
        return TriggeredTicks(clock.rate, now, trigger, again=again, pause=pause)


def _check_pretrigger(task: Task, reference: Reference) -> None:
    clock = task.timing
    if not clock.finite:
        raise DaqmxError(Code.REFERENCE_WHEN_CONTINUOUS, f"Task Name: {task.name}")
    if not 2 <= reference.before <= clock.samples - 2:
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Property: RefTrig.PretrigSamples; Requested Value: {reference.before}; Minimum "
            f"Value: 2; Maximum Value: {clock.samples - 2}; Task Name: {task.name}",
        )


def _trigger_channel(task: Task, reference: Reference) -> str:
    """Return the terminal of the input of the task that an analog trigger names."""
    wanted = reference.terminal.strip().lower()
    for channel in task.inputs:
        if wanted in (channel.name.lower(), channel.terminal) or wanted.endswith(
            f"/{channel.terminal}"
        ):
            return channel.terminal
    raise DaqmxError(
        Code.INVALID_VALUE,
        f"Property: AnlgEdge.Src; Requested Value: {reference.terminal}; the source of an "
        f"analog trigger is a channel of the task here. Task Name: {task.name}",
    )
