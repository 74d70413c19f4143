"""One run in a thread of its own, and what the window has to know of it."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, QThread, Signal, Slot

from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.overlay import OverlayModel
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
from dearig.sim_backend.factory import is_simulated
from dearig.sim_backend.faults import FaultPlan
from dearig.window.hv import HighVoltage
from dearig.window.live import Live

__all__ = ["RunEnd", "RunRequest", "Runner", "next_recording_path"]

_PROGRAM_FAULT = (
    "a fault of the program ended the run: see that the amplifier is at 0 V; what it was stands in "
    "the terminal"
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
    """Everything that a run needs; ``folder`` gets the recording, in a file named by the sequence.

    ``seed`` is of the simulated noise, ``paced`` lets a simulated rig take its time, and ``faults``
    go wrong in it. ``overlay`` is the model whose displacement the recording keeps.
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


@dataclass(frozen=True)
class RunEnd:
    """How a run ended: a ``headline``, a ``sentence``, and the recording if there is one.

    ``safe`` is True where the program knows that its output is at 0 V, False where it does not, and
    None where nothing was played: then it is as it was before.
    """

    headline: str
    sentence: str
    path: Path | None
    safe: bool | None
    result: RunResult | None = None


class Runner(QObject):
    """Runs one order after another, never two at once.

    ``state_changed`` tells the high voltage's state, ``ended`` how the run ended; both in the
    interface thread, which waits for nothing here but in ``wait``.
    """

    state_changed = Signal(object)
    ended = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._thread: _RunThread | None = None
        self._state = HighVoltage.SAFE
        self._before = HighVoltage.SAFE  # what it was when it was armed

    @property
    def state(self) -> HighVoltage:
        """What may be on the electrodes."""
        return self._state

    @property
    def running(self) -> bool:
        """True from ``start`` until ``ended``."""
        return self._thread is not None

    def arm(self, armed: bool) -> None:
        """The first step of two, or back."""
        if self.running or armed == (self._state is HighVoltage.ARMED):
            return
        if armed:
            self._before = self._state
        self._set_state(HighVoltage.ARMED if armed else self._before)

    def start(self, order: RunRequest, live: Live) -> bool:
        """The second step: begins a run that was armed; False where it was not."""
        if self.running or self._state is not HighVoltage.ARMED:
            return False
        self._thread = _RunThread(order, live, self)
        self._thread.finished.connect(self._finished)
        self._set_state(HighVoltage.ON)
        # what the rig gives must be read in time, whatever the screen draws
        self._thread.start(QThread.Priority.TimeCriticalPriority)
        return True

    def stop(self) -> None:
        """Ramp down to 0 V and end the run; also takes back the first step."""
        if self._thread is None:
            self.arm(armed=False)
            return
        self._thread.interrupts.ask()
        self._set_state(HighVoltage.RAMPING)

    def stop_without_ramp(self) -> None:
        """0 V without a ramp: for whoever pressed STOP and finds the ramp too slow."""
        if self._thread is not None:
            self._thread.interrupts.ask_at_once()

    def wait(self) -> None:
        """Wait until the run has ended; for a window that closes."""
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
                f"the folder {order.folder} cannot be used: {error.strerror or error}; choose "
                f"another one; nothing was played",
                None,
                safe=None,
            )
            return
        try:
            options = RunOptions(
                order.configuration, order.operator, order.film, order.notes,
                seed=order.seed, paced=order.paced, faults=order.faults,
            )  # fmt: skip
            result = record(
                order.loaded, order.address, order.rig_file, out, options, overlay=order.overlay,
                observer=self._live, interrupts=self.interrupts, clock=time.monotonic,
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
    """An instrument that failed is believed to be safe only where it says so."""
    safe = not isinstance(error, NotSafe) if played else None
    headline = next((words for kind, words in _ENDS.items() if isinstance(error, kind)), "Ended")
    sentence = str(error).removeprefix("interrupted: ")
    return RunEnd(headline, sentence, out if out.exists() else None, safe)


def next_recording_path(folder: Path, name: str) -> Path:
    """A file for a recording: the name of its sequence and the next number, ``thesis-007.h5``."""
    stem = re.sub(r"[^\w.]+", "-", name).strip("-.") or "run"
    stem = stem[:60]
    taken = [
        int(found[1])
        for path in folder.iterdir()
        if (found := re.fullmatch(re.escape(stem) + r"-(\d{3,6})\.h5", path.name))
    ]
    return folder / f"{stem}-{max(taken, default=0) + 1:03d}.h5"


def simulated(address: str) -> bool:
    """True where no high voltage is switched at all."""
    return is_simulated(address)
