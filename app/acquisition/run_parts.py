"""Options, result and observer of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from dearig.acquisition.feedback import FeedbackReport
from dearig.acquisition.plan import Plan
from dearig.drivers.gate import Margin
from dearig.drivers.instruments.thermohygrometer import RoomReading
from dearig.drivers.rig import Block, Event, RigIdentity
from dearig.errors import InputError
from dearig.model.control import HoldAnswer
from dearig.model.simulation.actuator import Actuator
from dearig.output_state import OutputState
from dearig.sim_backend.faults import FaultPlan

__all__ = ["RunObserver", "RunOptions", "RunResult"]


@dataclass(frozen=True)
class RunOptions:
    """Options of a run, and metadata for its recording.

    ``configuration`` is the text of the rig file, kept with the recording. ``operator``,
    ``film_id`` (by default the rig file's film) and ``notes`` are kept too. With ``overwrite`` an
    existing file is replaced; with ``fsync`` flushed data survive a power cut. ``waveform_digest``
    is that of the plan that was shown and armed: another waveform is refused; "" admits any.
    ``provenance`` has further texts for the recording's provenance, by name, such as where the rig
    file came from.

    Only for a simulated rig: ``seed`` of its noise, ``paced`` for real time, ``actuator`` in place
    of the film that ``sim`` has by default, and the ``faults`` that occur in it, such as
    ``arc@3.2``. Raises ``InputError`` if one cannot be read.
    """

    configuration: str = ""
    operator: str = ""
    film_id: str = ""
    notes: str = ""
    overwrite: bool = False
    fsync: bool = False
    waveform_digest: str = ""
    seed: int = 0
    paced: bool = False
    actuator: Actuator | None = None
    faults: Iterable[str] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Read the faults now, before anything is opened; an iterator is read once."""
        object.__setattr__(self, "faults", tuple(self.faults))
        _ = self.fault_plan

    @cached_property
    def fault_plan(self) -> FaultPlan:
        """The plan of ``faults``."""
        try:
            return FaultPlan.parse(self.faults)
        except ValueError as error:
            raise InputError(str(error)) from error


@dataclass(frozen=True)
class RunResult:
    """A recorded run: its file, size, outcome and events.

    ``path`` is not the wanted one where another program has deleted, moved or replaced that file;
    the ``events`` say so.

    ``margins`` are the distances of the voltage from each limit of the gate, and ``output_state``
    is what was known of the rig's output after the run. ``feedback`` is what a feedback did. Each
    sample is the mean of ``average`` conversions.
    """

    path: Path
    samples: int
    rate_Hz: float
    outcome: str
    events: tuple[str, ...]
    margins: tuple[Margin, ...]
    output_state: OutputState
    feedback: FeedbackReport | None = None
    average: int = 1


class RunObserver:
    """Receives samples and events of a run while it goes on; the methods here do nothing.

    The thread that runs the rig calls them and waits for them: an observer that draws or computes
    must copy the samples and return at once.
    """

    def started(self, planned: Plan, identity: RigIdentity, rate: float) -> None:
        """Receive the plan before the sample clock of ``rate`` Hz starts."""

    def block(self, block: Block) -> None:
        """Receive the next samples, as they were recorded."""

    def answered(self, time: float, answer: HoldAnswer) -> None:
        """Receive the feedback's answer to the readings about ``time`` s of the run."""

    def room(self, time: float, reading: RoomReading) -> None:
        """Receive a reading of the room, taken ``time`` s after the first sample."""

    def event(self, event: Event) -> None:
        """Receive an event that is in the recording."""

    def ramping(self) -> None:
        """Receive that the voltage is ramped down, whatever the cause; it may come repeatedly."""

    def output(self, state: OutputState) -> None:
        """Receive what is known of the output after the run.

        It comes a second time where the guardian goes on trying after the run could not set 0 V.
        """
