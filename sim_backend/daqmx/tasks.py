"""Tasks on the card with their channels and their timing."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from dearig.sim_backend.daqmx.acquisition import Run, Ticks
from dearig.sim_backend.daqmx.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.output import Generation, Waveform
from dearig.sim_backend.daqmx.scales import Scale
from dearig.sim_backend.daqmx.sensors import Sensor

__all__ = [
    "CURRENT_READ",
    "CURRENT_WRITE",
    "DIGITAL_EDGE",
    "FALLING",
    "HIGH",
    "LOW",
    "NO_CHANGE",
    "NO_TRIGGER",
    "READ_OFFSET",
    "READ_RELATIVE_TO",
    "RISING",
    "TRISTATE",
    "WRITE_OFFSET",
    "WRITE_RELATIVE_TO",
    "AnalogInput",
    "AnalogOutput",
    "Channel",
    "Kind",
    "Lines",
    "Listener",
    "SampleClock",
    "State",
    "Task",
    "Watchdog",
    "expanded",
    "physical_names",
]


RISING, FALLING = 10280, 10171  #: DAQmx: edges
HIGH, LOW, TRISTATE, NO_CHANGE = 10192, 10214, 10310, 10160  #: DAQmx: levels of a line
NO_TRIGGER, DIGITAL_EDGE = 10230, 10150  #: DAQmx: types of a trigger
CURRENT_READ, CURRENT_WRITE = 10425, 10430  #: DAQmx: reads and writes go on where they were
#: Keys of properties that are kept, and refused when they would take effect.
READ_RELATIVE_TO, READ_OFFSET = "read relative to", "read offset"
WRITE_RELATIVE_TO, WRITE_OFFSET = "write relative to", "write offset"


class Kind(Enum):
    """Kind of a task; its value is DAQmx's channel type."""

    EMPTY = 0
    AI = 10100
    AO = 10102
    DO = 10153
    WATCHDOG = -1

    @property
    def is_input(self) -> bool:
        """Return True if tasks of this kind are read."""
        return self is Kind.AI


class State(Enum):
    """State of a task, in the order from set-up to running."""

    VERIFIED = 0
    RESERVED = 1
    COMMITTED = 2
    RUNNING = 3


@dataclass
class AnalogInput:
    """Input channel: ``limits`` were requested, ``range`` V, plus and minus, is in use.

    With a ``scale`` or a sensor the limits are in its unit, otherwise in V. ``kept`` has the
    properties without effect.
    """

    name: str
    terminal: str
    limits: tuple[float, float]
    range: float
    wiring: int
    scale: Scale | Sensor | None = None
    kept: dict[object, Any] = field(default_factory=dict)

    @property
    def volts(self) -> tuple[float, float]:
        """Return the limits in V."""
        return self.limits if self.scale is None else self.scale.limits(self.limits)


@dataclass
class AnalogOutput:
    """Output channel, with the same fields."""

    name: str
    terminal: str
    limits: tuple[float, float]
    range: float
    scale: Scale | None = None
    kept: dict[object, Any] = field(default_factory=dict)

    @property
    def volts(self) -> tuple[float, float]:
        """Return the limits in V."""
        return self.limits if self.scale is None else self.scale.limits(self.limits)


@dataclass
class Lines:
    """Channel of digital lines, such as ``port0/line0``."""

    name: str
    lines: tuple[str, ...]
    kept: dict[object, Any] = field(default_factory=dict)


Channel = AnalogInput | AnalogOutput | Lines


@dataclass
class SampleClock:
    """Sample clock of actual ``rate`` Hz; ``source`` is empty for the task's own clock.

    The driver checks ``source`` and ``samples`` when the task is verified, not when they are set.

    ``samples`` is the requested number; with ``finite`` the task ends after it.
    """

    rate: float
    source: str
    finite: bool
    samples: int


@dataclass
class Watchdog:
    """Watchdog timer: ``timeout`` s, the lines' levels of DAQmx on expiration, and its time."""

    timeout: float
    states: dict[str, int] = field(default_factory=dict)
    deadline: float | None = None
    expired: bool = False


@dataclass(eq=False)
class Listener:
    """Program that listens to an event of a task: each ``every`` samples, or None for its end.

    ``signal`` is DAQmx's signal of an event by a signal, which comes with every sample.

    ``owner`` is the call that listens. ``told`` counts the events of the present start; ``due``
    has the status of each unsent one.
    """

    every: int | None
    owner: object
    signal: int | None = None
    told: int = 0
    due: list[int] = field(default_factory=list)


@dataclass(eq=False)
class Task:
    """Task with its settings and its present state."""

    name: str
    client: str
    kind: Kind = Kind.EMPTY
    inputs: list[AnalogInput] = field(default_factory=list)
    outputs: list[AnalogOutput] = field(default_factory=list)
    lines: list[Lines] = field(default_factory=list)
    watchdog: Watchdog | None = None
    timing: SampleClock = field(default_factory=lambda: SampleClock(1000.0, "", False, 1000))
    clocked: bool = False  # False: samples on demand
    trigger: str = ""
    trigger_edge: int = RISING
    trigger_type: int = NO_TRIGGER
    exports: dict[str, str] = field(default_factory=dict)  # terminals by signal
    convert_ticks: int | None = None  # of the timebase, between two conversions
    delay_ticks: int | None = None  # from the sample clock to the first conversion
    delay_units: int = 10304
    buffer: int | None = None  # set size; None for the default
    regenerates: bool = True
    state: State = State.VERIFIED
    kept: State = State.VERIFIED  # state after a stop
    failed: Code | None = None
    failed_why: str = ""  # sentence for the client, where the code does not say it
    kept_properties: dict[object, Any] = field(default_factory=dict)  # without effect
    listeners: list[Listener] = field(default_factory=list)
    # of an output task
    waveform: Waveform | None = None
    first_write: int = 0  # samples; the buffer's size where none was set
    generation: Generation | None = None
    # of an input task
    run: Run | None = None
    run_number: int = 0
    ticks: Ticks | None = None
    delivered: int = 0
    by_read: bool = False  # True if a read started it
    read_available: bool = False  # True if a read of all takes what a finite task has by now

    def listens(self, owner: object) -> bool:
        """Return True while ``owner`` has a listener to an event of the task."""
        return any(listener.owner is owner for listener in self.listeners)

    @property
    def running(self) -> bool:
        """Return True from the task's start to its stop."""
        return self.state is State.RUNNING

    @property
    def channels(self) -> list[Channel]:
        """Return the task's channels, which are of one kind."""
        return [*self.inputs, *self.outputs, *self.lines]

    @property
    def channel_names(self) -> list[str]:
        """Return the names of the channels in their order."""
        return [channel.name for channel in self.channels]

    @property
    def line_names(self) -> list[str]:
        """Return the digital lines in their order."""
        return [line for channel in self.lines for line in channel.lines]

    @property
    def clock(self) -> SampleClock | None:
        """Return the sample clock; None on demand."""
        return self.timing if self.clocked else None

    @property
    def wanted(self) -> int | None:
        """Return the samples after which a finite task is done; None for a continuous one."""
        return self.clock.samples if self.clock and self.clock.finite else None


_RANGE = re.compile(r"^(.*?)(\d+):(?:\1)?(\d+)$", re.IGNORECASE)
_LONGEST_RANGE = 64  # names


def expanded(name: str) -> list[str]:
    """Return the names in a range such as ``ai0:2`` or ``ai0:ai2``, or the name itself."""
    found = _RANGE.match(name)
    if not found:
        return [name]
    first, last = int(found[2]), int(found[3])
    if abs(last - first) > _LONGEST_RANGE:
        raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {name}")
    step = 1 if last >= first else -1
    return [f"{found[1]}{n}" for n in range(first, last + step, step)]


def physical_names(text: str, device: str) -> list[str]:
    """Return the names within ``device`` of physical channels such as ``Dev1/ai0:2, Dev1/ai5``.

    Raises ``DaqmxError`` for another device or an invalid syntax.
    """
    names: list[str] = []
    for part in text.split(","):
        owner, slash, rest = part.strip().lstrip("/").partition("/")
        if not slash or not rest:
            raise DaqmxError(Code.INVALID_SYNTAX, f"Input: {text!r}")
        if owner.lower() != device.lower():
            raise DaqmxError(Code.UNKNOWN_DEVICE, f"Device Specified: {owner}")
        names += [name.lower() for name in expanded(rest)]
    return names
