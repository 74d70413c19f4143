"""Tasks on the card with their channels and their timing."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from dearig.sim_backend.daqmx.card.acquisition import Run, Ticks
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.output import Generation, Waveform
from dearig.sim_backend.daqmx.card.scales import Scale
from dearig.sim_backend.daqmx.card.sensors import Sensor
from dearig.sim_backend.daqmx.card.triggers import Reference
from dearig.sim_backend.daqmx.card.work import Work

__all__ = [
    "ANALOG_EDGE",
    "CURRENT_READ",
    "CURRENT_WRITE",
    "DIGITAL_EDGE",
    "FALLING",
    "FIRST_PRETRIGGER",
    "FIRST_SAMPLE",
    "HIGH",
    "LINES_RATE",
    "LOW",
    "MOST_RECENT",
    "NO_CHANGE",
    "NO_TRIGGER",
    "REFERENCE_TRIGGER",
    "RISING",
    "TIMEBASE",
    "TRISTATE",
    "WRITE_OFFSET",
    "WRITE_RELATIVE_TO",
    "AnalogInput",
    "AnalogOutput",
    "Channel",
    "CounterChannel",
    "Kind",
    "Lines",
    "Listener",
    "Pulse",
    "PulseChannel",
    "SampleClock",
    "State",
    "Task",
    "Watchdog",
    "counted_on",
    "expanded",
    "physical_names",
]


RISING, FALLING = 10280, 10171  #: DAQmx: edges
HIGH, LOW, TRISTATE, NO_CHANGE = 10192, 10214, 10310, 10160  #: DAQmx: levels of a line
NO_TRIGGER, DIGITAL_EDGE, ANALOG_EDGE = 10230, 10150, 10099  #: DAQmx: types of a trigger
CURRENT_READ, CURRENT_WRITE = 10425, 10430  #: DAQmx: reads and writes go on where they were
FIRST_SAMPLE, MOST_RECENT = 10424, 10428  #: DAQmx: where a read begins
REFERENCE_TRIGGER, FIRST_PRETRIGGER = 10426, 10427  #: DAQmx: where it begins with such a trigger
#: Keys of properties that are kept, and refused when they would take effect.
WRITE_RELATIVE_TO, WRITE_OFFSET = "write relative to", "write offset"
TIMEBASE = 1e8  #: Hz; the counters' timebase of 100 MHz
LINES_RATE = 10e6  #: Hz; the fastest sample clock of the lines of port 0


class Kind(Enum):
    """Kind of a task; its value is DAQmx's channel type."""

    EMPTY = 0
    AI = 10100
    AO = 10102
    DI = 10151
    DO = 10153
    CI = 10131
    CO = 10132
    WATCHDOG = -1

    @property
    def is_input(self) -> bool:
        """Return True if tasks of this kind are read."""
        return self in (Kind.AI, Kind.DI, Kind.CI)


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
    """Channel of digital lines, such as ``port0/line0``.

    ``columns`` are the same in the order of a waveform's data, which has the highest line of a
    whole port first.
    """

    name: str
    lines: tuple[str, ...]
    columns: tuple[str, ...] = ()
    kept: dict[object, Any] = field(default_factory=dict)


@dataclass
class CounterChannel:
    """Channel of a counter input with its settings; those that it does not use are ignored.

    ``terminals`` are by role: ``input`` and for some ``second``, ``direction``, ``a``, ``b``,
    ``z``. ``limits`` are in ``units``, in which the values are too. ``measure`` and the other
    numbers are DAQmx's.
    """

    name: str
    terminal: str
    measure: int
    limits: tuple[float, float] = (0.0, 0.0)
    units: int = 10364
    edge: int = RISING
    second_edge: int = RISING
    initial: float = 0.0
    direction: int = 10128
    method: int = 10105
    decoding: int = 10092
    index: bool = False
    index_value: float = 0.0
    index_phase: int = 10040
    distance: float = 1.0  # units of position for each period of the encoder
    pulses: int = 24
    terminals: dict[str, str] = field(default_factory=dict)
    kept: dict[object, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Pulse:
    """Pulse of ``high`` and ``low`` s."""

    high: float
    low: float

    @classmethod
    def of_frequency(cls, frequency: float, duty: float) -> Pulse:
        """Return the pulse of a train of ``frequency`` Hz."""
        if not (frequency > 0.0 and 0.0 < duty < 1.0):
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: CO.Pulse.Freq or CO.Pulse.DutyCyc; Requested Values: {frequency:g}, "
                f"{duty:g}",
            )
        return cls(duty / frequency, (1.0 - duty) / frequency)

    @classmethod
    def of_times(cls, high: float, low: float) -> Pulse:
        """Return the pulse of ``high`` and ``low`` s; both are at least two ticks long."""
        if not min(high, low) * TIMEBASE >= 2.0 - 1e-6:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: CO.Pulse.HighTime or CO.Pulse.LowTime; Requested Values: {high:g}, "
                f"{low:g}; Minimum Value: {2.0 / TIMEBASE:g}",
            )
        return cls(high, low)

    @classmethod
    def of_ticks(cls, high: int, low: int) -> Pulse:
        """Return the pulse of ``high`` and ``low`` ticks of the counters' timebase."""
        return cls.of_times(high / TIMEBASE, low / TIMEBASE)


@dataclass
class PulseChannel:
    """Channel of a counter output; ``delay`` s before the first pulse, in the idle state.

    ``kind`` is DAQmx's number of how its pulses are given.
    """

    name: str
    terminal: str
    kind: int
    pulse: Pulse
    delay: float
    idle_high: bool
    output: str
    kept: dict[object, Any] = field(default_factory=dict)


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
    edge: int = RISING
    implicit: bool = False  # True where each edge of the measured or made signal is a sample


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


Channel = AnalogInput | AnalogOutput | Lines | CounterChannel | PulseChannel


@dataclass(eq=False)
class Task:
    """Task with its settings and its present state."""

    name: str
    client: str
    kind: Kind = Kind.EMPTY
    inputs: list[AnalogInput] = field(default_factory=list)
    outputs: list[AnalogOutput] = field(default_factory=list)
    lines: list[Lines] = field(default_factory=list)
    counters: list[CounterChannel | PulseChannel] = field(default_factory=list)
    work: Work | None = None  # what it does while it runs; None without channels
    watchdog: Watchdog | None = None
    timing: SampleClock = field(default_factory=lambda: SampleClock(1000.0, "", False, 1000))
    clocked: bool = False  # False: samples on demand
    trigger: str = ""
    trigger_edge: int = RISING
    trigger_type: int = NO_TRIGGER
    exports: dict[str, str] = field(default_factory=dict)  # terminals by signal
    retriggers: bool = False  # True if each further edge starts it again
    armed: float = 0.0  # s; edges after this may start it
    reference: Reference | None = None
    pause: tuple[str, bool] | None = None  # terminal, and True if it pauses while that is high
    arm: tuple[str, bool] | None = None  # terminal that arms a counter, and True if by rising
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
    pulses: list[Pulse] = field(default_factory=list)  # that were written to a counter
    generation: Generation | None = None
    # of an input task
    run: Run | None = None
    run_number: int = 0
    ticks: Ticks | None = None
    delivered: int = 0
    by_read: bool = False  # True if a read started it
    auto_start: bool = True  # True if a read may start it
    read_from: int = CURRENT_READ  # DAQmx: what the first sample of a read is relative to
    read_offset: int = 0  # samples from there
    overwrites: bool = False  # True if unread samples may be overwritten
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
        return [*self.inputs, *self.outputs, *self.lines, *self.counters]

    @property
    def rows(self) -> int:
        """Return the rows of a written sample: outputs, or digital lines."""
        return len(self.outputs) or len(self.line_names)

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
    def sample_times(self) -> Ticks | None:
        """Return the times of the samples of a running input; None for others."""
        return self.ticks if self.work is None or self.ticks is not None else self.work.ticks

    @property
    def wanted(self) -> int | None:
        """Return the samples after which a finite task is done; None for a continuous one."""
        if self.retriggers:
            return None
        return self.clock.samples if self.clock and self.clock.finite else None


_RANGE = re.compile(r"^(.*?)(\d+):(?:\1)?(\d+)$", re.IGNORECASE)
_LONGEST_RANGE = 64  # names


def expanded(name: str) -> list[str]:
    """Return the names in a range such as ``ai0:2`` or ``ai0:ai2``, or the name itself.

    Leading zeros of the first number give the width of all: ``in08:10`` is in08, in09, in10.
    """
    found = _RANGE.match(name)
    if not found:
        return [name]
    first, last = int(found[2]), int(found[3])
    if abs(last - first) > _LONGEST_RANGE:
        raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {name}")
    step = 1 if last >= first else -1
    width = _width(found[2])
    return [f"{found[1]}{n:0{width}d}" for n in range(first, last + step, step)]


def _width(number: str) -> int:
    """Return the width to which DAQmx fills the numbers of a range that begins at ``number``."""
    return len(number) if number.startswith("0") and int(number) else 0


def counted_on(name: str, count: int) -> list[str]:
    """Return ``count`` names: DAQmx counts on from the number at the end of ``name``, or from 0."""
    base = name.rstrip("0123456789")
    number = name[len(base) :] or "0"
    width, first = _width(number), int(number)
    return [f"{base}{n:0{width}d}" for n in range(first, first + count)]


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
