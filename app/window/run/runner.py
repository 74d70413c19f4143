"""Runs in a thread of their own: their state, their end, and how they are stopped."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from PySide6.QtCore import QObject, QThread, Signal, Slot

from dearig.acquisition.feedback import Feedback
from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.marks import RunMarks
from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.plan import Plan
from dearig.acquisition.rig_source import NO_RIG_FILE, SOURCE
from dearig.acquisition.run import RunObserver, RunOptions, RunResult, record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence
from dearig.drivers.instruments.thermohygrometer import RoomReading
from dearig.drivers.rig import Block, Event, RigIdentity
from dearig.errors import (
    DearigError,
    DiskFault,
    InputError,
    InstrumentFault,
    Interrupted,
    SafetyStop,
)
from dearig.model.control import HoldAnswer
from dearig.output_state import Known, OutputState
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.high_voltage.status import ARMED_FOR, HighVoltageStatus, LatchedAlarm
from dearig.window.run.live import Live
from dearig.window.session.state import Session

__all__ = [
    "PROGRAM_FAULT",
    "Play",
    "PlayThread",
    "RunEnd",
    "RunRequest",
    "Runner",
    "headline_of",
    "next_recording_path",
]

PROGRAM_FAULT = (
    "an error in the program ended the run: check that the amplifier is at 0 V; the log has the "
    "details of the error"
)
_ALARM_MAX = 1000  # characters of an alarm; the settings keep it
_ENDS: dict[type[DearigError], str] = {
    Interrupted: "Stopped",
    SafetyStop: "Stopped by an interlock",
    InstrumentFault: "Instrument fault",
    DiskFault: "Disk fault",
    InputError: "Refused",
}


def headline_of(error: DearigError) -> str:
    """Return the headline of what ``error`` ended."""
    return next((words for kind, words in _ENDS.items() if isinstance(error, kind)), "Ended")


class Play(Enum):
    """What is armed or played: one thing at a time."""

    RUN = "run"
    CAMPAIGN = "campaign"


@dataclass(frozen=True)
class RunRequest:
    """Everything that a run needs; the recording is written to ``folder``, named by the sequence.

    For a simulated rig, ``seed`` is that of its noise, ``paced`` runs it in real time, and
    ``faults`` occur in it. The displacement of the model ``overlay`` is kept in the recording, and
    so are the ``marks``. A waveform other than that of ``waveform_digest`` is refused. ``feedback``
    corrects the voltage while it is played.
    """

    loaded: LoadedSequence
    address: str
    rig_file: RigFile
    configuration: str
    folder: Path
    operator: str = ""
    film: str = ""
    notes: str = ""
    seed: int = 0
    paced: bool = True
    faults: tuple[str, ...] = ()
    overlay: OverlayModel | None = None
    marks: RunMarks | None = None
    waveform_digest: str = ""
    feedback: Feedback | None = None
    rig_source: str = NO_RIG_FILE


@dataclass(frozen=True)
class RunEnd:
    """How a run ended: a ``headline``, a ``sentence``, and the recording if there is one.

    ``output`` is what was measured of the output after it, None where the rig was not contacted:
    then it is as it was before. ``alarming`` is True where the operator must acknowledge the end.
    ``play`` says what has ended.
    """

    headline: str
    sentence: str
    path: Path | None
    output: OutputState | None
    result: RunResult | None = None
    alarming: bool = False
    play: Play = Play.RUN


class PlayThread(QThread):
    """Thread that plays something; its subclass sets ``end`` and obeys ``interrupts``.

    ``output_known`` carries the ``OutputState`` at the end of a run. ``ramping`` comes when a run
    is ramped down, whatever the cause, and may come repeatedly.
    """

    output_known = Signal(object)
    ramping = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.interrupts = Interrupts()
        self.end = RunEnd("Ended", PROGRAM_FAULT, None, None)


class Runner(QObject):
    """Plays runs and campaigns one after another, never two at once.

    ``status`` has the state of the high voltage. ``state_changed`` carries the ``HighVoltage``,
    ``ended`` the ``RunEnd``; both come in the interface thread. Only ``wait`` blocks it.
    """

    state_changed = Signal(object)
    ended = Signal(object)

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._thread: PlayThread | None = None
        self._armed_for = Play.RUN
        self.playing: Play | None = None  #: what goes on
        self.status = HighVoltageStatus(session, self)
        self.status.state_changed.connect(self.state_changed)
        self.status.disarm_due.connect(self._too_late)
        session.blocks_changed.connect(self._blocks_changed)
        for changed, what in (
            (session.rig_changed, "rig"),
            (session.sequence_changed, "sequence"),
            (session.hold_changed, "feedback"),
        ):
            changed.connect(lambda what=what: self.disarm(f"disarmed: the {what} was changed"))

    @property
    def state(self) -> HighVoltage:
        """Voltage that may be on the electrodes."""
        return self.status.state

    @property
    def running(self) -> bool:
        """True from ``start`` until ``ended``."""
        return self._thread is not None

    @property
    def armed(self) -> bool:
        """True while a next step would begin a run or a campaign."""
        return self.state is HighVoltage.ARMED

    def armed_for(self, play: Play) -> bool:
        """Return whether the rig is armed, and for ``play``."""
        return self.armed and self._armed_for is play

    def arm(self, armed: bool, play: Play = Play.RUN) -> bool:
        """Arm the rig for ``play``, or disarm it; return whether it is armed for that.

        What blocks arming is obeyed. A rig that is armed for something else stays so.
        """
        if not self.running and armed != self.armed and not (armed and self._session.blocks):
            if armed:
                self._session.arming.emit()
            self._armed_for = play
            self.status.set_phase(HighVoltage.ARMED if armed else None)
        return self.armed_for(play)

    def start(self, order: RunRequest, live: Live) -> bool:
        """Begin a run; return False if the rig is not armed for one."""
        thread = _RunThread(order, live, self)
        if not self.begin(thread, Play.RUN):
            thread.deleteLater()
            return False
        self.status.set_phase(HighVoltage.ON)
        return True

    def begin(self, thread: PlayThread, play: Play) -> bool:
        """Begin what ``thread`` plays; return False if the rig is not armed for ``play``.

        Before the operator can have seen that it is armed, nothing is begun either, nor while
        another window plays on the rig.
        """
        if self.running or not self.armed_for(play) or not self.status.may_start:
            return False
        if not self.status.run_begins():
            return False
        self._thread, self.playing = thread, play
        thread.output_known.connect(self.status.set_output)
        thread.ramping.connect(self._ramps)
        thread.finished.connect(self._finished)
        # the samples of the rig must be read in time, whatever the interface draws
        thread.start(QThread.Priority.TimeCriticalPriority)
        return True

    def stop(self, by: str) -> None:
        """Ramp down to 0 V and end the run, or go to 0 V at once in a ramp; without a run, disarm.

        After the run is at 0 V, or cannot be: stop waiting for the guardian or the disk. ``by``
        names what has stopped, as "key Esc on Recordings"; the bar shows it.
        """
        if self._thread is None:
            self.disarm(f"disarmed by {by}")
            return
        self.status.set_cause(f"stopped by {by}")
        if self.state is HighVoltage.RAMPING:
            self._thread.interrupts.ask_at_once()
        else:
            self._thread.interrupts.ask()
            self._ramps()

    @Slot()
    def _ramps(self) -> None:
        if self.status.live:
            self.status.set_phase(HighVoltage.RAMPING)

    def disarm(self, cause: str) -> None:
        """Disarm, if the rig is armed; ``cause`` says why, for the bar."""
        if self.armed and not self.running:
            self.arm(armed=False)
            self.status.set_cause(cause)

    def wait(self) -> None:
        """Wait until the run has ended; used when the window closes."""
        if self._thread is not None:
            self._thread.wait()

    @Slot()
    def _too_late(self) -> None:
        self.disarm(f"disarmed: not started within {ARMED_FOR:g} s")

    @Slot()
    def _blocks_changed(self) -> None:
        if self._session.blocks:
            self.disarm("disarmed: something blocks arming")

    @Slot()
    def _finished(self) -> None:
        thread, self._thread, self.playing = self._thread, None, None
        if thread is None:
            return
        thread.deleteLater()
        end = thread.end
        if end.output is not None:
            self.status.set_output(end.output)
        self.status.set_phase(None)
        self.status.run_ended(_alarm(end, self._session.address) if end.alarming else None)
        self.ended.emit(end)


def _alarm(end: RunEnd, address: str) -> LatchedAlarm:
    known = Known.UNKNOWN if end.output is None else end.output.known
    at = time.time() if end.output is None else end.output.at
    recording = "" if end.path is None else str(end.path)
    return LatchedAlarm(
        end.headline, end.sentence[:_ALARM_MAX], at, address, recording, known.value
    )


class LiveObserver(RunObserver):
    """Hands everything on to ``live``; a ramp, and what is known of the output, to ``thread``."""

    def __init__(self, live: Live, thread: PlayThread) -> None:
        self._live = live
        self._thread = thread
        self.output_state: OutputState | None = None

    def started(self, planned: Plan, identity: RigIdentity, rate: float) -> None:
        self._live.started(planned, identity, rate)

    def block(self, block: Block) -> None:
        self._live.block(block)

    def answered(self, time: float, answer: HoldAnswer) -> None:
        self._live.answered(time, answer)

    def room(self, time: float, reading: RoomReading) -> None:
        self._live.room(time, reading)

    def event(self, event: Event) -> None:
        self._live.event(event)

    def ramping(self) -> None:
        self._thread.ramping.emit()

    def output(self, state: OutputState) -> None:
        self.output_state = state
        self._thread.output_known.emit(state)


class _RunThread(PlayThread):
    def __init__(self, order: RunRequest, live: Live, parent: QObject) -> None:
        super().__init__(parent)
        self._order = order
        self._live = live

    def run(self) -> None:
        order = self._order
        try:
            order.folder.mkdir(parents=True, exist_ok=True)
            out = next_recording_path(order.folder, order.loaded.sequence.name)
        except OSError as error:
            self.end = RunEnd(
                "Refused",
                f"the folder {order.folder} cannot be used: {error.strerror or error}; nothing was "
                f"played; choose another one",
                None,
                None,
            )
            return
        observer = LiveObserver(self._live, self)
        try:
            options = RunOptions(
                order.configuration, order.operator, order.film, order.notes,
                seed=order.seed, paced=order.paced, faults=order.faults,
                waveform_digest=order.waveform_digest, provenance={SOURCE: order.rig_source},
            )  # fmt: skip
            result = record(
                order.loaded, order.address, order.rig_file, out, options, overlay=order.overlay,
                observer=observer, interrupts=self.interrupts, marks=order.marks,
                clock=time.monotonic, feedback=order.feedback,
            )  # fmt: skip
        except DearigError as error:
            self.end = _early_end(error, out)
        except BaseException:
            # an error of the program may leave a voltage
            known = observer.output_state or OutputState(Known.UNKNOWN, time.time())
            self.end = RunEnd("Ended", PROGRAM_FAULT, None, known, alarming=True)
            raise
        else:
            seconds = result.samples / result.rate_Hz
            self.end = RunEnd(
                "Finished",
                f"{result.samples:,} samples, {seconds:.1f} s at {result.rate_Hz:g} Hz",
                result.path,
                result.output_state,
                result=result,
                alarming=not result.output_state.confirmed,
            )


def _early_end(error: DearigError, out: Path) -> RunEnd:
    """Describe a run that ended early."""
    headline = headline_of(error)
    sentence = str(error).removeprefix("interrupted: ")
    return RunEnd(
        headline, sentence, out if out.exists() else None, error.output_state,
        alarming=error.needs_inspection,
    )  # fmt: skip


def next_recording_path(folder: Path, name: str) -> Path:
    """Return the file of the next recording: ``name`` and a number, as ``thesis-007.h5``."""
    stem = re.sub(r"[^\w.]+", "-", name).strip("-.") or "run"
    stem = stem[:60]
    taken = [
        int(found[1])
        for path in folder.iterdir()
        if (found := re.fullmatch(re.escape(stem) + r"-(\d{3,6})\.h5", path.name))
    ]
    return folder / f"{stem}-{max(taken, default=0) + 1:03d}.h5"
