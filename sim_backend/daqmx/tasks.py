"""Tasks on the card with their channels and their timing."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import Enum

from dearig.sim_backend.daqmx.acquisition import Run, Ticks
from dearig.sim_backend.daqmx.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.output import Generation, Waveform

__all__ = [
    "AnalogInput",
    "AnalogOutput",
    "Kind",
    "Lines",
    "SampleClock",
    "State",
    "Task",
    "Watchdog",
    "physical_names",
]


class Kind(Enum):
    """What a task does; its value is DAQmx's channel type."""

    EMPTY = 0
    AI = 10100
    AO = 10102
    DO = 10153
    WATCHDOG = -1


class State(Enum):
    """How far a task has gone towards running."""

    VERIFIED = 0
    RESERVED = 1
    COMMITTED = 2
    RUNNING = 3


@dataclass
class AnalogInput:
    """An input channel: ``limits`` V were asked for, ``range`` V, plus and minus, was taken."""

    name: str
    terminal: str
    limits: tuple[float, float]
    range: float
    wiring: int


@dataclass
class AnalogOutput:
    """An output channel, as above."""

    name: str
    terminal: str
    limits: tuple[float, float]
    range: float


@dataclass
class Lines:
    """A channel of digital lines, such as ``port0/line0``."""

    name: str
    lines: tuple[str, ...]


@dataclass
class SampleClock:
    """``rate`` Hz as the card makes it, ``source`` empty for its own clock, ``samples`` asked for.

    ``finite`` says whether it ends by itself after ``samples``.
    """

    rate: float
    source: str
    finite: bool
    samples: int


@dataclass
class Watchdog:
    """The timer of digital lines: ``timeout`` s, what the lines do then, and when that will be."""

    timeout: float
    states: dict[str, bool] = field(default_factory=dict)
    deadline: float | None = None
    expired: bool = False


@dataclass(eq=False)
class Task:
    """A task with all that was set, and what it is doing."""

    name: str
    client: str
    kind: Kind = Kind.EMPTY
    inputs: list[AnalogInput] = field(default_factory=list)
    outputs: list[AnalogOutput] = field(default_factory=list)
    lines: list[Lines] = field(default_factory=list)
    watchdog: Watchdog | None = None
    clock: SampleClock | None = None
    trigger: str = ""
    convert_ticks: int | None = None  # between two conversions, of the timebase
    delay_ticks: int | None = None  # from the sample clock to the first conversion
    delay_units: int = 10304
    buffer: int | None = None  # as it was set
    regenerates: bool = True
    state: State = State.VERIFIED
    kept: State = State.VERIFIED  # where it goes back to when it stops
    failed: Code | None = None
    listened: bool = False  # a client listens to its events
    # an output task's own
    waveform: Waveform | None = None
    first_write: int = 0  # samples; they make the buffer where no size was set
    generation: Generation | None = None
    # an input task's own
    run: Run | None = None
    run_number: int = 0
    ticks: Ticks | None = None
    delivered: int = 0
    by_read: bool = False  # it was started by reading

    @property
    def running(self) -> bool:
        """True from its start to its stop."""
        return self.state is State.RUNNING

    @property
    def channels(self) -> list[AnalogInput | AnalogOutput | Lines]:
        """Its channels, which are of one kind."""
        return [*self.inputs, *self.outputs, *self.lines]

    @property
    def channel_names(self) -> list[str]:
        """Names of its channels in their order."""
        return [channel.name for channel in self.channels]

    @property
    def line_names(self) -> list[str]:
        """Its digital lines in their order."""
        return [line for channel in self.lines for line in channel.lines]

    @property
    def wanted(self) -> int | None:
        """Samples after which a finite task is done; None for one that goes on."""
        return self.clock.samples if self.clock and self.clock.finite else None


_RANGE = re.compile(r"^(.*?)(\d+):(\d+)$")


def physical_names(text: str, device: str) -> list[str]:
    """Names within ``device`` of the physical channels in ``text``: ``Dev1/ai0:2, Dev1/ai5``.

    Raises ``DaqmxError`` for a device or a syntax that is not known.
    """
    names: list[str] = []
    for part in text.split(","):
        owner, slash, rest = part.strip().lstrip("/").partition("/")
        if not slash or not rest:
            raise DaqmxError(Code.INVALID_SYNTAX, f"Input: {text!r}")
        if owner.lower() != device.lower():
            raise DaqmxError(Code.UNKNOWN_DEVICE, f"Device Specified: {owner}")
        found = _RANGE.match(rest)
        if found:
            first, last = int(found[2]), int(found[3])
            if abs(last - first) > 64:
                raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {part.strip()}")
            step = 1 if last >= first else -1
            names.extend(f"{found[1]}{n}".lower() for n in range(first, last + step, step))
        else:
            names.append(rest.lower())
    return names
