"""Tasks on the card with their settings and their state."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from dearig.sim_backend.daqmx.card.acquisition import Run, Ticks
from dearig.sim_backend.daqmx.card.channels import (
    AnalogInput,
    AnalogOutput,
    Channel,
    CounterChannel,
    Lines,
    Pulse,
    PulseChannel,
)
from dearig.sim_backend.daqmx.card.errors import Code
from dearig.sim_backend.daqmx.card.numbers import CURRENT_READ, NO_TRIGGER, RISING
from dearig.sim_backend.daqmx.card.output import Generation, Waveform
from dearig.sim_backend.daqmx.card.triggers import Reference
from dearig.sim_backend.daqmx.card.work import CardWork

__all__ = ["Kind", "Listener", "SampleClock", "State", "Task", "Watchdog"]


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

    ``owner`` is the call that waits for the events. ``reported`` counts those since the last start;
    ``due`` has the status of each that was not sent yet.
    """

    every: int | None
    owner: object
    signal: int | None = None
    reported: int = 0
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
    counters: list[CounterChannel | PulseChannel] = field(default_factory=list)
    work: CardWork | None = None  # what it does while it runs; None without channels
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
