"""Runs in a thread of their own: their state, their end, and how they are stopped."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, QThread, Signal, Slot

from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.marks import RunMarks
from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.rigs import is_simulated
from dearig.acquisition.run import RunOptions, RunResult, record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence
from dearig.errors import (
    DearigError,
    DiskFault,
    InputError,
    InstrumentFault,
    Interrupted,
    NotSafe,
    SafetyStop,
)
from dearig.sim_backend.faults import FaultPlan
from dearig.window.hv import HighVoltage
from dearig.window.live import Live

__all__ = ["RunEnd", "RunRequest", "Runner", "next_recording_path"]

_PROGRAM_FAULT = (
    "an error in the program ended the run: check that the amplifier is at 0 V; the log has the "
    "details of the error"
)
_ENDS: dict[type[DearigError], str] = {
    Interrupted: "Stopped",
    SafetyStop: "Stopped by an interlock",
    InstrumentFault: "Instrument fault",
    DiskFault: "Disk fault",
    InputError: "Refused",
}


@dataclass(frozen=True)
class RunRequest:
    """Everything that a run needs; the recording is written to ``folder``, named by the sequence.

    For a simulated rig, ``seed`` is that of its noise, ``paced`` runs it in real time, and
    ``faults`` occur in it. The displacement of the model ``overlay`` is kept in the recording, and
    so are the ``marks``. A waveform other than that of ``waveform_digest`` is refused.
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
    faults: FaultPlan | None = None
    overlay: OverlayModel | None = None
    marks: RunMarks | None = None
    waveform_digest: str = ""


@dataclass(frozen=True)
class RunEnd:
    """How a run ended: a ``headline``, a ``sentence``, and the recording if there is one.

    ``safe`` is True if the program knows that its output is at 0 V, False if it does not, and None
    if nothing was played: then the output is as it was before.
    """

    headline: str
    sentence: str
    path: Path | None
    safe: bool | None
    result: RunResult | None = None


class Runner(QObject):
    """Plays one run after another, never two at once.

    ``state_changed`` carries the ``HighVoltage``, ``ended`` the ``RunEnd``; both come in the
    interface thread. Only ``wait`` blocks it.
    """

    state_changed = Signal(object)
    ended = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._thread: _RunThread | None = None
        self._state = HighVoltage.SAFE
        self._before = HighVoltage.SAFE  # state before it was armed

    @property
    def state(self) -> HighVoltage:
        """Voltage that may be on the electrodes."""
        return self._state

    @property
    def running(self) -> bool:
        """True from ``start`` until ``ended``."""
        return self._thread is not None

    def arm(self, armed: bool) -> None:
        """Arm or disarm the rig."""
        if self.running or armed == (self._state is HighVoltage.ARMED):
            return
        if armed:
            self._before = self._state
        self._set_state(HighVoltage.ARMED if armed else self._before)

    def start(self, order: RunRequest, live: Live) -> bool:
        """Begin a run; return False if the rig is not armed."""
        if self.running or self._state is not HighVoltage.ARMED:
            return False
        self._thread = _RunThread(order, live, self)
        self._thread.finished.connect(self._finished)
        self._set_state(HighVoltage.ON)
        # the samples of the rig must be read in time, whatever the interface draws
        self._thread.start(QThread.Priority.TimeCriticalPriority)
        return True

    def stop(self) -> None:
        """Ramp down to 0 V and end the run; without a run, disarm."""
        if self._thread is None:
            self.arm(armed=False)
            return
        self._thread.interrupts.ask()
        self._set_state(HighVoltage.RAMPING)

    def stop_without_ramp(self) -> None:
        """Set 0 V without a ramp; for an operator who finds the ramp too slow."""
        if self._thread is not None:
            self._thread.interrupts.ask_at_once()

    def wait(self) -> None:
        """Wait until the run has ended; used when the window closes."""
        if self._thread is not None:
            self._thread.wait()

    @Slot()
    def _finished(self) -> None:
        thread, self._thread = self._thread, None
        if thread is None:
            return
        thread.deleteLater()
        end = thread.end
        after = {None: self._before, True: HighVoltage.SAFE, False: HighVoltage.UNCONFIRMED}
        self._set_state(after[end.safe])
        self.ended.emit(end)

    def _set_state(self, state: HighVoltage) -> None:
        if state is not self._state:
            self._state = state
            self.state_changed.emit(state)


class _RunThread(QThread):
    def __init__(self, order: RunRequest, live: Live, parent: QObject) -> None:
        super().__init__(parent)
        self._order = order
        self._live = live
        self.interrupts = Interrupts()
        self.end = RunEnd("Ended", _PROGRAM_FAULT, None, safe=False)

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
                safe=None,
            )
            return
        try:
            options = RunOptions(
                order.configuration, order.operator, order.film, order.notes,
                seed=order.seed, paced=order.paced, faults=order.faults,
                waveform_digest=order.waveform_digest,
            )  # fmt: skip
            result = record(
                order.loaded, order.address, order.rig_file, out, options, overlay=order.overlay,
                observer=self._live, interrupts=self.interrupts, marks=order.marks,
                clock=time.monotonic,
            )  # fmt: skip
        except DearigError as error:
            played = self._live.now() is not None
            self.end = _early_end(error, out, played)
        else:
            seconds = result.samples / result.rate_Hz
            self.end = RunEnd(
                "Finished",
                f"{result.samples:,} samples, {seconds:.1f} s at {result.rate_Hz:g} Hz",
                result.path,
                safe=True,
                result=result,
            )


def _early_end(error: DearigError, out: Path, played: bool) -> RunEnd:
    """Describe a run that ended early; ``NotSafe`` says that 0 V is not confirmed."""
    safe = not isinstance(error, NotSafe) if played else None
    headline = next((words for kind, words in _ENDS.items() if isinstance(error, kind)), "Ended")
    sentence = str(error).removeprefix("interrupted: ")
    return RunEnd(headline, sentence, out if out.exists() else None, safe)


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


def simulated(address: str) -> bool:
    """Return True for a rig without real instruments."""
    return is_simulated(address)
