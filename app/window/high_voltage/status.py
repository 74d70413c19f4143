"""High voltage of the window's rig: its state, the last readings, and the alarm that is latched.

There is one ``HighVoltageStatus``; the bar of the main window and the Run page both show it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from PySide6.QtCore import QLockFile, QObject, QSettings, Qt, QTimer, Signal, Slot

from dearig.acquisition.rigs import is_simulated
from dearig.clock import TOLERANCE, ClockWatch
from dearig.output_state import Known, OutputState
from dearig.window.high_voltage.state import HighVoltage, kilovolts, state_at_rest
from dearig.window.session.recovery import lock_of, unsaved_folder
from dearig.window.session.settings import kept_text, write_apart
from dearig.window.session.state import Session

__all__ = [
    "ARMED_FOR",
    "REACTION",
    "SILENT",
    "HighVoltageStatus",
    "LatchedAlarm",
    "OutputReading",
    "Responsiveness",
    "recording_of",
]

log = logging.getLogger(__name__)

#: s without a sample, on top of the time between two, after which the last one is out of date.
SILENT = 1.0
ARMED_FOR = 30.0  #: s after which a rig that was armed and not started is disarmed
_CLOCK = 1.0  # s between two looks at the computer's clock
_TICK = 250  # ms between two updates of the countdown
_KEY = "alarm"  # of the settings; with the address of the rig
_BLOCK = "alarm"  # of the session
_ELSEWHERE = "played elsewhere"  # the same


@dataclass(frozen=True)
class LatchedAlarm:
    """What ended a run at ``at`` s since 1970, on the rig ``address``; latched until acknowledged.

    ``recording`` is the path of the run's recording, empty where there is none. ``known`` says how
    the output was known then.
    """

    headline: str
    sentence: str
    at: float
    address: str
    recording: str = ""
    known: str = Known.UNKNOWN.value

    @property
    def text(self) -> str:
        """The alarm in one sentence, with its time of day and the rig where that is real."""
        return f"{self.headline}{self._where} at {_clock(self.at)}: {self.sentence}"

    @property
    def summary(self) -> str:
        """The headline with rig and time of day."""
        return f"{self.headline}{self._where} at {_clock(self.at)}"

    @property
    def _where(self) -> str:
        return "" if is_simulated(self.address) else f" on {self.address}"


@dataclass(frozen=True)
class OutputReading:
    """Voltage monitor in V, and the time ``seconds`` of ``total`` s in the sequence.

    ``interval`` is the time in s between two samples.
    """

    monitor: float
    seconds: float
    total: float
    interval: float = 0.0


class HighVoltageStatus(QObject):
    """What is known of the high voltage; ``changed`` comes with everything that is shown.

    ``output`` is what was measured after the last run on the rig of the session, or by a check of
    it; None where this program has not contacted that rig. ``reading`` belongs to the rig and to
    the run ``run_number``: both change with each run that begins, and with the rig. A latched
    ``alarm`` blocks arming. It is kept in the settings for a rig that is not simulated, so that
    another start of the program shows it again. While another window of this computer plays on the
    rig, the state is unknown here and nothing is armed; the output is then to be read again.
    ``disarm_due`` comes when the time to start an armed rig is over. An armed rig can be started
    once the state ARMED has been on the screen for twice the time of a reaction, which
    ``start_opened`` tells: ``may_start``.
    """

    changed = Signal()
    state_changed = Signal(object)
    disarm_due = Signal()
    start_opened = Signal()
    acknowledged = Signal(str)  #: name of the person

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        # armed, on, ramping, or between two runs of a campaign; None at rest
        self._phase: HighVoltage | None = None
        self._next = ""  # what a campaign does next
        self._output: OutputState | None = None
        self._address = session.address  # of the rig that ``output`` belongs to
        self._is_final = False  # during a run: the output at its end is known
        self._state = HighVoltage.NOT_CONTACTED
        self._deadline = 0.0
        self._cause = ""  # what has stopped or disarmed, and when
        self.responsiveness = Responsiveness(self)
        self._may_start = False
        self._opening = QTimer(self, interval=round(2 * REACTION * 1000), singleShot=True)
        self._opening.setTimerType(Qt.TimerType.PreciseTimer)
        self._opening.timeout.connect(self._open_start)
        self._ticks = QTimer(self, interval=_TICK)
        self._ticks.timeout.connect(self._tick)
        self._clock_watch = ClockWatch()
        self._clock_looks = QTimer(self, interval=round(1000 * _CLOCK))
        self._clock_looks.timeout.connect(self._look_at_clock)
        self._clock_looks.start()
        self.reading: OutputReading | None = None
        self._read_at = 0.0  # when ``reading`` came
        self._silence = 0  # whole s without a sample, 0 while they come
        self.run_number = 0
        self._lock: QLockFile | None = None  # while a run goes on
        self._elsewhere = ""  # time of day from which on another window was seen to play
        self._unread = "the voltage was not read yet"
        self.alarm: LatchedAlarm | None = None
        session.rig_changed.connect(self._rig_changed)
        session.output_read.connect(self.set_read_at_rest)
        self._restore()
        self._look_elsewhere()

    @property
    def state(self) -> HighVoltage:
        """Voltage that may be on the electrodes."""
        return self._state

    @property
    def output(self) -> OutputState | None:
        """What was measured after the last run; None for a rig that was not contacted."""
        return self._output if self._address == self._session.address else None

    @property
    def running(self) -> bool:
        """True while the voltage may be up, or on its way down."""
        return self._phase in (HighVoltage.ON, HighVoltage.RAMPING)

    @property
    def live(self) -> bool:
        """True while the voltage may be up and its end is not known."""
        return self.running and not self._is_final

    @property
    def current(self) -> bool:
        """True while ``reading`` is that of this moment."""
        return self.live and not self._silence

    @property
    def silence(self) -> str:
        """How long no sample has come during a run, in words; "" while they come."""
        return f"no sample for {self._silence} s" if self.live and self._silence else ""

    @property
    def seconds_to_start(self) -> int:
        """Whole s until the rig is disarmed."""
        return max(0, int(self._deadline - _now() + 0.999))

    @property
    def may_start(self) -> bool:
        """True once the operator has been able to see the state ARMED."""
        return self._may_start and self._phase is HighVoltage.ARMED

    @property
    def cause(self) -> str:
        """What has stopped the last run, or disarmed, and when; "" for what came to its end."""
        return self._cause

    @property
    def words(self) -> str:
        """Sentence on the state: the countdown, or what was measured and when."""
        words = ""
        if self._state is HighVoltage.ARMED:
            words = f"not started yet; disarms in {self.seconds_to_start} s"
        elif self.live:
            words = self.silence
        elif self._elsewhere:
            words = f"another window plays (seen {self._elsewhere}): STOP works there only"
        else:
            output = self.output
            words = self._unread if output is None else output.sentence
            if output is not None and output.at > time.time() + TOLERANCE:
                words = f"{words}; the computer's clock was set back since then"
            if self._state is HighVoltage.BETWEEN:
                words = f"{words}; {self._next}"
        simulated = is_simulated(self._session.address)
        parts = (words, self._cause, "simulated" if simulated else "")
        return " · ".join(part for part in parts if part)

    @property
    def detail(self) -> str:
        """The same, with the voltage during a run."""
        if self.current and self.reading is not None:
            return f"{kilovolts(self.reading.monitor)}  {self.words}".rstrip()
        return self.words

    @property
    def brief(self) -> str:
        """What fits below the state: the voltage and its moment, or the time to start."""
        if self._state is HighVoltage.ARMED:
            return f"not started yet; disarms in {self.seconds_to_start} s"
        volts, belongs_to = self.number
        if math.isnan(volts):
            return self.words
        moment = belongs_to.replace("\n", " ").replace("monitor at", "at")
        return kilovolts(volts) if self.current else f"{kilovolts(volts)} {moment}"

    # what the runner reports

    def set_phase(self, phase: HighVoltage | None) -> None:
        """Set ARMED, ON, RAMPING, or None for rest."""
        self._may_start = False
        self._opening.stop()
        if phase is HighVoltage.ARMED:
            self._deadline = _now() + ARMED_FOR
            self._ticks.start()
        else:
            self._ticks.stop()
        if phase in (HighVoltage.ARMED, HighVoltage.ON):
            self._cause = ""
        if phase is HighVoltage.ON:
            self._is_final = False
            self._forget_numbers()
        self._phase = phase
        self._refresh()

    def set_cause(self, words: str) -> None:
        """Say what has stopped or disarmed; the first of several counts."""
        if not self._cause:
            self._cause = f"{words}, {_clock(time.time())}"
            log.info("%s", self._cause)
            self.changed.emit()

    @Slot(object)
    def painted(self, state: HighVoltage) -> None:
        """Take that ``state`` has been drawn."""
        waits = not (self._may_start or self._opening.isActive())
        if waits and state is HighVoltage.ARMED and self._phase is HighVoltage.ARMED:
            self._opening.start()

    @Slot()
    def _open_start(self) -> None:
        if self._phase is not HighVoltage.ARMED:
            return
        if not self.responsiveness.now:  # the state may not have reached the screen
            self._opening.start()
            return
        self._may_start = True
        self.start_opened.emit()

    def set_between(self, words: str) -> None:
        """Set that a campaign is between two runs; ``words`` say what it does next."""
        self._next = words
        self.set_phase(HighVoltage.BETWEEN)

    def set_output(self, output: OutputState) -> None:
        """Set what was measured of the output at the end of a run, also before the run's end."""
        self._output, self._address, self._is_final = output, self._session.address, True
        self._unread = "the voltage was not read yet"
        self._refresh()

    @Slot(object)
    def set_read_at_rest(self, output: OutputState) -> None:
        """Set what a check of the rig has read; nothing while a run or a campaign goes on."""
        if self._phase in (None, HighVoltage.ARMED):
            self.set_output(output)

    def _forget_numbers(self) -> None:
        self.reading, self._silence = None, 0
        self.run_number += 1

    @property
    def number(self) -> tuple[float, str]:
        """Voltage at the monitor in V, and what it belongs to; NaN and "" where there is none.

        During a run it is the newest sample. After it, it is what the state was measured with, so
        that the two never contradict each other; only where nothing was read after the run, it is
        the last sample.
        """
        reading, output = self.reading, self.output
        if self.live and reading is None:
            return math.nan, ""
        if self.current and reading is not None:
            return reading.monitor, f"{reading.seconds:.1f} of {reading.total:.1f} s"
        if not self.live and output is not None and output.monitor is not None:
            return output.monitor, f"monitor at\n{output.time}"
        if reading is not None and self._state is not HighVoltage.BETWEEN:
            return reading.monitor, f"last sample,\n{reading.seconds:.2f} s"
        return math.nan, ""

    def show_reading(self, reading: OutputReading) -> None:
        """Show the newest samples of a run; to be called again and again, also without new ones."""
        now, new = _now(), reading != self.reading
        if new:
            self.reading, self._read_at = reading, now
        waited = now - self._read_at
        silence = int(waited) if self.live and waited > SILENT + reading.interval else 0
        if new or silence != self._silence:
            self._silence = silence
            self.changed.emit()

    def run_begins(self) -> bool:
        """Keep a note of the run, for a start of the program after this one has died in it.

        Returns False where another window of this computer plays on the rig: it has its own note.
        """
        if not is_simulated(self._session.address):
            lock = self._lock_of(self._session.address)
            if _is_held(lock):
                self._look_elsewhere()
                return False
            self._lock = lock
        self._keep(
            LatchedAlarm(
                # shown with the time that follows it, which is that of the start
                "The program ended during what was started",
                "what is on the output is unknown: switch the amplifier off, and read the log",
                time.time(),
                self._session.address,
            ),
            QSettings.sync,  # there is no voltage yet, so that it may take its time
        )
        return True

    def run_ended(self, alarm: LatchedAlarm | None) -> None:
        """Latch ``alarm``; None for a run that ended as it should."""
        self._keep(alarm)
        if self._lock is not None:
            self._lock.unlock()
            self._lock = None
        self._latch(alarm)

    def acknowledge(self, name: str) -> LatchedAlarm | None:
        """Release the latch in the ``name`` of a person; return the alarm that was latched."""
        alarm = self.alarm
        if alarm is None or not name.strip():
            return None
        log.warning("%s acknowledged the alarm: %s", name.strip(), alarm.text)
        self._keep(None)
        self._latch(None)
        self._restore()  # another rig may have left one too
        self.acknowledged.emit(name.strip())
        return alarm

    def _latch(self, alarm: LatchedAlarm | None) -> None:
        self.alarm = alarm
        if alarm is None:
            self._session.unblock(_BLOCK)
        else:
            self._session.block(
                _BLOCK,
                f"{alarm.summary}: look at the rig, then acknowledge the alarm in the bar at the "
                f"top",
            )
        self._refresh()

    def _refresh(self) -> None:
        state = self._shown()
        if state is not self._state:
            self._state = state
            self._session.set_armed(state is HighVoltage.ARMED)
            self.state_changed.emit(state)
        self.changed.emit()

    def _shown(self) -> HighVoltage:
        if self._phase is HighVoltage.ARMED or self.live:
            return self._phase or HighVoltage.UNKNOWN
        if self._elsewhere:
            return HighVoltage.UNKNOWN
        output = self.output
        if self._phase is HighVoltage.BETWEEN and (output is None or output.confirmed):
            return HighVoltage.BETWEEN
        if output is not None:
            return state_at_rest(output.known)
        return HighVoltage.NOT_CONTACTED

    @Slot()
    def _tick(self) -> None:
        if _now() >= self._deadline:
            self.disarm_due.emit()
        else:
            self.changed.emit()

    @Slot()
    def _look_at_clock(self) -> None:
        """Say that the computer's clock was set: the bar shows times of day."""
        self._look_elsewhere()
        if change := self._clock_watch.change():
            log.warning("%s", change)
            self._session.message.emit(f"{change[0].upper()}{change[1:]}")
            self.changed.emit()

    @Slot()
    def _rig_changed(self) -> None:
        if not self.running:
            self._cause = ""
            self._forget_numbers()
            if self.alarm is None:
                self._restore()
            self._look_elsewhere()
            self._refresh()

    def _look_elsewhere(self) -> None:
        """Look whether another window of this computer plays on the rig of the session.

        What this window has measured is then no longer so, and it arms nothing.
        """
        lock = None if self._lock is not None else self._lock_file(self._session.address)
        played = lock is not None and _is_held(lock)
        if lock is not None and not played:
            lock.unlock()  # of a window that was killed in its run
        elif played == bool(self._elsewhere):
            return
        self._forget_numbers()
        self._output = None
        if played:
            self._elsewhere = _clock(time.time())
            self._session.block(
                _ELSEWHERE, "another window of this computer plays on this rig: wait for its end"
            )
        else:
            self._elsewhere = ""
            self._unread = "the voltage was not read since another window played on this rig"
            self._session.unblock(_ELSEWHERE)
            if self.alarm is None:
                self._session.settings.sync()  # what the other window has left
                self._restore()
        self._refresh()

    def _lock_file(self, address: str) -> QLockFile | None:
        """Return the lock of the rig at ``address`` where a window holds it or was killed with it.

        Without its file no one holds it, and to take it would be in the way of who wants to.
        """
        lock = None if is_simulated(address) else self._lock_of(address)
        return lock if lock is not None and Path(lock.fileName()).exists() else None

    # the settings

    def _keep(
        self,
        alarm: LatchedAlarm | None,
        write: Callable[[QSettings], object] = write_apart,
    ) -> None:
        address = self._session.address if self.alarm is None else self.alarm.address
        if is_simulated(address):
            return
        lock = None if self._lock is not None else self._lock_file(address)
        if lock is not None and _is_held(lock):
            return  # the note there is that of another window, which plays
        key = f"{_KEY}/{address}"
        if alarm is None:
            self._session.settings.remove(key)
        else:
            self._session.settings.setValue(key, json.dumps(asdict(alarm)))
        write(self._session.settings)  # the program may die in the next moment

    def _restore(self) -> None:
        """Latch what an earlier start of the program has left: for this rig, else for another."""
        settings = self._session.settings
        settings.beginGroup(_KEY)
        left = [address for address in settings.childKeys() if not is_simulated(address)]
        settings.endGroup()
        for address in sorted(left, key=lambda address: address != self._session.address):
            lock = self._lock_of(address)
            if not lock.tryLock(0):  # its program goes on
                continue
            lock.unlock()
            self._latch_kept(address)
            return

    def _latch_kept(self, address: str) -> None:
        kept = kept_text(self._session.settings, f"{_KEY}/{address}")
        try:
            alarm = LatchedAlarm(**json.loads(kept))
        except (TypeError, ValueError):
            log.warning("the alarm that is kept in the settings cannot be read: %r", kept)
            alarm = LatchedAlarm(
                "An alarm of an earlier run", "it cannot be read any more", time.time(), address
            )
        if alarm.known != Known.CONFIRMED.value:
            self._output, self._address = OutputState(Known.UNKNOWN, alarm.at), address
        self._latch(alarm)

    def _lock_of(self, address: str) -> QLockFile:
        """Return the lock that a window holds while it plays on the rig at ``address``."""
        folder = unsaved_folder(self._session.settings).parent / "playing"
        with contextlib.suppress(OSError):  # a folder that cannot be made locks nothing
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        return lock_of(folder / hashlib.sha256(address.encode()).hexdigest()[:16])


def _is_held(lock: QLockFile) -> bool:
    """Take ``lock``; return whether another process holds it, and not only that no file can be."""
    return not lock.tryLock(0) and lock.error() is QLockFile.LockError.LockFailedError


def _now() -> float:
    return time.monotonic()


def _clock(at: float) -> str:
    return time.strftime("%H:%M:%S", time.localtime(at))


def recording_of(alarm: LatchedAlarm) -> Path | None:
    """Return the recording of the run that ``alarm`` ended, where there is one."""
    path = Path(alarm.recording)
    return path if alarm.recording and path.is_file() else None


#: s that a person needs to answer something seen: the mean of 1469 adults was 0.231 s (Woods et
#: al., "Factors influencing the latency of simple reaction time", Front. Hum. Neurosci. 9:131,
#: 2015). A shorter pause hides nothing that could have been answered.
REACTION = 0.25
_BEAT = 100  # ms


class Responsiveness(QObject):
    """Watches the event loop of the interface thread.

    A key or click that is handled while ``now`` is True was made at most 2 ``REACTION`` before:
    neither the pause before the last beat nor that after it was longer than ``REACTION``. The time
    stamps of the events say less: on Windows they are those of their reading.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._last = time.monotonic()  # of the beats
        self._doubtful = 0.0  # until then what waited during a pause may still come
        self._beats = QTimer(self, interval=_BEAT)
        self._beats.timeout.connect(self._beat)
        self._beats.start()

    @property
    def now(self) -> bool:
        """True where the window has answered in time up to this moment."""
        now = time.monotonic()
        return now - self._last <= REACTION and now >= self._doubtful

    @Slot()
    def _beat(self) -> None:
        now = time.monotonic()
        if now - self._last > REACTION:
            self._doubtful = now + REACTION
        self._last = now
