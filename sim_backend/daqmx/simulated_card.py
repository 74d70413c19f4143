"""The simulated card, composed of its parts: who owns it sees its tasks and what is at the film."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from dearig.drivers.channels import COUNT_MAX
from dearig.drivers.settings import RigSettings
from dearig.sim_backend.clock import Clock
from dearig.sim_backend.daqmx.analog.inputs import AnalogInputs, AnalogInputWork
from dearig.sim_backend.daqmx.analog.outputs import AnalogOutputs, AnalogOutputWork
from dearig.sim_backend.daqmx.analog.parts import AnalogParts
from dearig.sim_backend.daqmx.analog.run import RigRun
from dearig.sim_backend.daqmx.card import events
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.hardware import LINES, OUTPUTS
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, Listener, Task
from dearig.sim_backend.daqmx.card.terminals import Terminals
from dearig.sim_backend.daqmx.card.wire import Change, Wire
from dearig.sim_backend.daqmx.card.wiring import Wiring
from dearig.sim_backend.daqmx.card.work import CardWork
from dearig.sim_backend.daqmx.digital.counter_tasks import CounterTasks
from dearig.sim_backend.daqmx.digital.line_levels import LineLevels
from dearig.sim_backend.daqmx.digital.lines import DigitalLines
from dearig.sim_backend.daqmx.digital.watchdogs import Watchdogs
from dearig.sim_backend.daqmx.running.output_buffer import OutputBuffer
from dearig.sim_backend.daqmx.running.reading import Reader
from dearig.sim_backend.daqmx.running.states import TaskStates
from dearig.sim_backend.daqmx.setup.channels import AnalogChannels
from dearig.sim_backend.daqmx.setup.conversions import Conversions
from dearig.sim_backend.daqmx.setup.custom_scales import CustomScales
from dearig.sim_backend.daqmx.setup.routes import Routes
from dearig.sim_backend.daqmx.setup.timing import Timing
from dearig.sim_backend.daqmx.setup.triggering import Triggering
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.plant import Plant

__all__ = ["SimulatedCard"]

_TASKS_MAX = 1000  # of programs that never clear theirs


class SimulatedCard:
    """PCIe-6361 with the rig of ``settings`` behind it; ``plant`` is the film at rest.

    Every run of its inputs starts with the film at rest. ``noise_seed`` is that of the instruments'
    noise. With ``sine`` no instrument is wired to the inputs: each reads a sine within its limits,
    and the lines a count, as NI's own simulated devices give them. ``signals`` are at the digital
    terminals, see ``Terminals``.

    Programs work with the parts: ``channels``, ``scales``, ``timing``, ``conversions``,
    ``triggering``, ``routes`` set tasks up, ``states`` starts and stops them, ``reader``,
    ``inputs``, ``outputs``, ``buffer``, ``lines``, ``counters`` and ``watchdogs`` move their data.
    All methods are thread-safe, and all may raise ``DaqmxError``. Those with a ``timeout`` in s
    (negative: unlimited) wait.
    """

    def __init__(
        self,
        settings: RigSettings,
        plant: Plant,
        clock: Clock,
        *,
        noise_seed: tuple[int, ...] = (0,),
        faults: FaultPlan | None = None,
        sine: bool = False,
        signals: Mapping[str, str] | None = None,
    ) -> None:
        self.settings = settings
        self.name = settings.card.device
        self._numbered = 0
        self.state = state = CardState(settings, clock)
        self.terminals = Terminals(self.name, signals)
        plan = faults or FaultPlan()
        wiring = Wiring(settings, plant, noise_seed, plan, sine=sine)
        wiring.warm_up()
        self.wire = Wire(state, wiring, OUTPUTS, LINES)
        self.run = RigRun(state, plan)
        # set-up
        self.scales = CustomScales(state)
        self.channels = AnalogChannels(state, self.scales, wiring, self._analog_work)
        self.timing = Timing(state, self.terminals)
        self.conversions = Conversions(state, self.timing)
        self.triggering = Triggering(state, self.terminals, self.timing)
        self.routes = Routes(state, self.terminals)
        # states and data
        parts = (self.routes, self.channels, self.triggering, self.timing, self.conversions)
        self.states = TaskStates(state, self.timing, self.routes, [part.check for part in parts])
        self.buffer = OutputBuffer(state, self.states)
        self.reader = Reader(state, self.states)
        self._analog = AnalogParts(
            state,
            self.timing,
            self.conversions,
            self.triggering,
            self.routes,
            self.wire,
            wiring,
            self.run,
        )
        self.inputs = AnalogInputs(self._analog, self.reader)
        self.outputs = AnalogOutputs(self._analog, self.states, self.buffer)
        self.levels = LineLevels(state, self.terminals, self.wire)
        self.watchdogs = Watchdogs(state, self.levels)
        self.lines = DigitalLines(
            state,
            self.terminals,
            self.timing,
            self.triggering,
            self.states,
            self.buffer,
            self.levels,
            self.watchdogs,
            counting=sine,
        )
        self.counters = CounterTasks(
            state, self.terminals, self.timing, self.triggering, self.states
        )
        state.steps = (
            self.lines.settle,  # until a watchdog takes the lines
            self.watchdogs.settle,
            self.outputs.settle,
            self.counters.settle,  # makes edges that the triggers below wait for
            self.inputs.settle,
            self.outputs.start_by_edges,  # of the inputs too
            self.counters.sample,
            self.levels.forget,  # what was sampled above
        )

    def _analog_work(self, task: Task, kind: Kind) -> CardWork:
        work = AnalogInputWork if kind is Kind.AI else AnalogOutputWork
        return work(task, self._analog)

    # what is at the film and at the terminals

    def wire_voltage(self) -> float:
        """Return the present command in V at the film."""
        with self.state.present() as now:
            return self.wire.film_voltage(now)

    def output_voltage(self) -> float:
        """Return the present voltage in V at the output to the amplifier."""
        with self.state.present() as now:
            return self.wire.output_voltage(now)

    def history(self) -> tuple[Change, ...]:
        """Return the changes of the film's voltage from and to zero, and single values, by time."""
        with self.state.present():
            return tuple(self.wire.history)

    def live(self) -> bool:
        """Return True while the voltage at the film exceeds the limits' tolerance for zero."""
        return abs(self.wire_voltage()) > self.settings.limits.zero_tolerance_kV * 1e3

    def drives(self, client: str) -> bool:
        """Return True if ``client`` was the last one to change the output to the amplifier."""
        return self.wire.client == client

    def displacement(self) -> float:
        """Return the laser's last reading in m, or the film at rest before the first run."""
        laser = self.settings.laser
        with self.state.lock:
            if self.run.laser is None:
                return laser.rest_position_mm * 1e-3
            counts, limit = self.run.laser
            return laser.direction * laser.mm_per_V * 1e-3 * counts * limit / (COUNT_MAX + 1)

    def line(self, name: str) -> bool:
        """Return the level of the digital line ``name``, such as ``port0/line0``."""
        return self.levels.level(name)

    # tasks

    def create(self, name: str, client: str, *, attach: bool = True) -> tuple[Task, bool]:
        """Return the task called ``name`` (empty: a unique name), and whether it is new."""
        tasks = self.state.tasks
        with self.state.lock:
            if name and name in tasks:
                if attach:
                    return tasks[name], False
                raise DaqmxError(Code.DUPLICATE_TASK, f"Task Name: {name}")
            if len(tasks) >= _TASKS_MAX:
                raise DaqmxError(
                    Code.MEMORY_FULL,
                    f"The card keeps {_TASKS_MAX} tasks that no program has cleared; clear some.",
                )
            while not name or name in tasks:
                name = f"_unnamedTask<{self._numbered:X}>"
                self._numbered += 1
            task = tasks[name] = Task(name, client)
            return task, True

    def create_watchdog(self, name: str, client: str, device: str, timeout: float) -> Task:
        """Return a task of the watchdog timer, which expires ``timeout`` s after its last reset."""
        with self.state.lock:
            self.check_device(device)
            self.watchdogs.check_timeout(timeout)
            task, _ = self.create(name, client, attach=False)
            self.watchdogs.make(task, timeout)
            return task

    def task(self, name: str) -> Task:
        """Return the task called ``name``."""
        with self.state.lock:
            if name not in self.state.tasks:
                raise DaqmxError(Code.INVALID_TASK, f"Task Name: {name}")
            return self.state.tasks[name]

    def tasks_of(self, client: str) -> list[Task]:
        """Return the tasks of ``client``."""
        with self.state.lock:
            return [task for task in self.state.tasks.values() if task.client == client]

    def clear(self, task: Task) -> None:
        """Abort ``task`` and forget it; the output keeps its value."""
        with self.state.lock:
            self.states.forget(task)
            self.state.tasks.pop(task.name, None)

    # listeners to the events of tasks

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
        with self.state.lock:
            events.check_registration(task, every, direction, signal)
            listener = Listener(every, owner, signal)
            task.listeners.append(listener)
            return listener

    def forget(self, task: Task, listener: Listener) -> None:
        """End ``listener``."""
        with self.state.lock:
            if listener in task.listeners:
                task.listeners.remove(listener)

    def due_events(self, task: Task, listener: Listener) -> Sequence[int]:
        """Return the status of each event that happened since the last call."""
        with self.state.present() as now:
            if task.running:
                self.states.observe(task, now)
            return events.collect(listener)

    # the device as a whole

    def check_device(self, name: str) -> None:
        """Refuse a device that is not this one; a channel of it stands for it too."""
        if name.partition("/")[0].lower() != self.name.lower():
            raise DaqmxError(Code.UNKNOWN_DEVICE, f"Device Specified: {name}")

    def reset(self, device: str) -> None:
        """Abort every task, 0 V on every output, every line low and an input again."""
        self.check_device(device)
        with self.state.present() as now:
            for task in self.state.tasks.values():
                self.states.abort(task, now, "The device was reset.")
                if task.watchdog is not None:
                    task.watchdog.expired = False
            for terminal in OUTPUTS:
                self.outputs.hold(terminal, 0, now)
            for line in LINES:
                self.levels.put(line, False, now)
            self.terminals.release()
            self.state.notify()

    def make_safe(self, client: str | None = None, why: str = "The card was made safe.") -> None:
        """Abort the tasks of ``client`` (None: all tasks), set 0 V and the enable line low.

        ``why`` is a sentence for the client.
        """
        with self.state.present() as now:
            for task in self.state.tasks.values():
                if client in (None, task.client):
                    self.states.abort(task, now, why)
            self.outputs.hold(self.settings.card.ao_command, 0, now)
            self.wire.disable(now)
            self.state.notify()
