"""Tasks of counters: channels, pulses and counts."""

from __future__ import annotations

from typing import Any

from dearig.sim_backend.daqmx.card.channels import Channel, CounterChannel, Pulse, PulseChannel
from dearig.sim_backend.daqmx.card.checks import may_add, not_running
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.names import named, physical_names
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.card.terminals import COUNTERS, Terminals
from dearig.sim_backend.daqmx.card.work import SampledInput
from dearig.sim_backend.daqmx.digital.counters import CounterInput
from dearig.sim_backend.daqmx.digital.pulses import CounterOutput, PulseSignal
from dearig.sim_backend.daqmx.running.states import TaskStates
from dearig.sim_backend.daqmx.setup.timing import Timing
from dearig.sim_backend.daqmx.setup.triggering import Triggering

__all__ = ["CounterTasks"]


class CounterTasks:
    """Tasks of the four counters, whose outputs are signals at ``terminals``."""

    def __init__(
        self,
        state: CardState,
        terminals: Terminals,
        timing: Timing,
        triggering: Triggering,
        states: TaskStates,
    ) -> None:
        self._state = state
        self._terminals = terminals
        self._timing = timing
        self._triggering = triggering
        self._states = states
        self._pulses = {counter: PulseSignal(idle_high=False) for counter in COUNTERS}
        for counter, signal in self._pulses.items():
            terminals.provide(f"{counter}internaloutput", signal)

    # channels

    def add_input(self, task: Task, counter: str, name: str, **settings: Any) -> None:
        """Add the counter ``counter`` as an input; ``settings`` are of a ``CounterChannel``."""
        with self._state.lock:
            may_add(task, Kind.CI)
            if task.counters:
                raise DaqmxError(Code.SEVERAL_COUNTERS, f"Task Name: {task.name}")
            (terminal,) = self._counters_of(counter)
            ((_, called),) = named(task, self._state.name, [terminal], name)
            channel = CounterChannel(called, terminal, **settings)
            task.kind = Kind.CI
            task.counters.append(channel)
            task.work = CounterInput(
                task,
                channel,
                self._terminals,
                self._triggering.sample_ticks,
                self._timing.buffer_size,
                self._triggering.pause_of,
                self._triggering.arm_edge,
            )

    def add_output(
        self, task: Task, counter: str, name: str, kind: int, pulse: Pulse, delay: float, idle: bool
    ) -> None:
        """Add counters as outputs of ``pulse``, after ``delay`` s; ``idle`` is True for high."""
        with self._state.lock:
            may_add(task, Kind.CO)
            terminals = self._counters_of(counter)
            for terminal, called in named(task, self._state.name, terminals, name):
                output = f"pfi{12 + int(terminal[-1])}"
                task.counters.append(
                    PulseChannel(called, terminal, kind, pulse, delay, idle, output)
                )
            task.kind = Kind.CO
            channels = [c for c in task.counters if isinstance(c, PulseChannel)]
            task.work = CounterOutput(
                task,
                channels,
                self._pulses,
                self._triggering.start_edge,
                self._triggering.clock_edge,
            )

    def _counters_of(self, physical: str) -> list[str]:
        names = physical_names(physical, self._state.name)
        for name in names:
            if name not in COUNTERS:
                raise DaqmxError(
                    Code.UNKNOWN_CHANNEL, f"Physical Channel: {self._state.name}/{name}"
                )
        return names

    def change(self, task: Task, channel: Channel, field: str, value: object) -> None:
        """Set a field of a counter's channel."""
        with self._state.lock:
            not_running(task)
            setattr(channel, field, value)

    # with time

    def settle(self, now: float) -> None:
        """Make the pulses up to ``now`` s."""
        for task in list(self._state.tasks.values()):
            if isinstance(task.work, CounterOutput) and task.running:
                task.work.settle(now)

    def sample(self, now: float) -> None:
        """Take the samples of counters and lines up to ``now`` s."""
        for task in list(self._state.tasks.values()):
            if isinstance(task.work, SampledInput) and task.running:
                task.work.watch(now)

    # calls of programs while tasks run

    def count(self, task: Task) -> int:
        """Return the present count of a task that counts edges."""
        with self._state.present() as now:
            if not (task.running and isinstance(task.work, CounterInput)):
                return 0
            value = task.work.still(1, now)
            return 0 if value is None else int(value[0, 0])

    def output_level(self, channel: PulseChannel) -> bool:
        """Return the present level of a counter output."""
        with self._state.present() as now:
            return self._pulses[channel.terminal].high(now)

    def change_pulse(self, task: Task, channel: PulseChannel, pulse: Pulse) -> None:
        """Set the pulse of a counter output, which may run."""
        with self._state.present() as now:
            if isinstance(task.work, CounterOutput):
                task.work.change({channel.terminal: pulse}, now)
            self._state.notify()

    def write(self, task: Task, pulses: list[Pulse], auto_start: bool) -> int:
        """Write pulses to a counter output: the next ones, or those of a buffered train."""
        with self._state.present() as now:
            work = task.work
            if not isinstance(work, CounterOutput):
                raise DaqmxError(Code.NOT_AN_OUTPUT, f"Task Name: {task.name}", written=0)
            clock = task.clock
            # a train of one pulse after the other has no buffer until several are written
            at_once = clock is None or (clock.implicit and not task.pulses and len(pulses) == 1)
            if at_once:
                if not (task.running or auto_start):
                    raise DaqmxError(Code.WRITE_WITHOUT_START, f"Task Name: {task.name}", written=0)
                work.change(
                    {c.terminal: p for c, p in zip(work.channels, pulses, strict=False)}, now
                )
            else:
                if not task.running:
                    self._states.commit(task)
                work.write(pulses, now)
            if auto_start and not task.running:
                self._states.start(task)
            self._state.notify()
            return len(pulses)
