"""Left column of the Run page: high-voltage state, Arm, Start, STOP, progress and readouts."""

from __future__ import annotations

import math

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QKeyEvent, QKeySequence, QMouseEvent, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QProgressBar, QPushButton, QVBoxLayout, QWidget

from dearig.drivers.instruments.thermohygrometer import RoomReading
from dearig.window.high_voltage.bar import label_stop, stop_button
from dearig.window.high_voltage.state import HighVoltage, HighVoltageBadge
from dearig.window.high_voltage.status import HighVoltageStatus
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel, Message, Readout, card, label
from dearig.window.run.live import RunSnapshot
from dearig.window.session.state import Session

__all__ = ["RunControls", "StepButton"]

_WIDTH = 268  # px
_STOP_HEIGHT = 92  # px

#: Signal to (factor from SI to the readout's unit, decimals).
_SIGNALS = {
    "command": (1e-3, 3),
    "monitor": (1e-3, 3),
    "current": (1e3, 3),
    "displacement": (1e3, 4),
}

#: What a run waits for that is being ended: its ramp, its end, or a guardian that goes on trying.
_ENDING = {
    HighVoltage.RAMPING: "Ramping down to 0 V",
    HighVoltage.CONFIRMED: "At 0 V, the recording is being closed",
    HighVoltage.COMMANDED: "0 V not confirmed, the run is ending",
    HighVoltage.UNKNOWN: "Output unknown, the run is ending",
}


class StepButton(QPushButton):
    """Button of a step towards voltage: clicked, or by its own key, pressed once.

    It takes no focus, and no other key acts on it: Space is a stop key, and a key that is held
    repeats itself. What was pressed while the window did not answer is dropped, and ``dropped``
    says so: no one has seen what it would act on.
    """

    dropped = Signal(str)

    def __init__(
        self, text: str, tip: str, key: str, page: QWidget, status: HighVoltageStatus
    ) -> None:
        super().__init__(text)
        self._responsiveness = status.responsiveness
        self._key = key
        self.setProperty("role", "primary")
        self.setToolTip(f"{tip} ({key})")
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        shortcut = QShortcut(QKeySequence(key), page)
        shortcut.setAutoRepeat(False)
        shortcut.activated.connect(self._pressed_key)

    @property
    def answers(self) -> bool:
        """True where a press would be obeyed: the window answers in time."""
        return self._responsiveness.now

    @Slot()
    def _pressed_key(self) -> None:
        if self.answers:
            self.click()
        else:
            self.dropped.emit(f"{self._key} was pressed while the window was busy: press it again")

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        if self.answers:
            super().mousePressEvent(event)
        else:
            event.accept()
            self.dropped.emit(f"{self.text()} was pressed while the window was busy: press again")

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        event.ignore()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        event.ignore()


class RunControls(QWidget):
    """Buttons and readouts of a run. The page connects the buttons and says what to show."""

    def __init__(
        self, session: Session, status: HighVoltageStatus, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._status = status
        self._numbers_of = status.run_number  # that the readouts belong to
        self.badge = HighVoltageBadge(large=True)
        self.arm_button = StepButton("1  Arm", "First step: no output yet", "F5", self, status)
        self.arm_button.setCheckable(True)
        self.start_button = StepButton(
            "2  Start", "Second step: play and record the sequence", "F6", self, status
        )
        for step in (self.arm_button, self.start_button):
            step.dropped.connect(session.message)
        self.badge.painted.connect(status.painted)
        self.stop_button = stop_button(26, _STOP_HEIGHT)
        self.time_left = label("", "title")
        self.time_left.setWordWrap(True)
        self.of_sample = label("", "muted", "Time of the sample that the readouts show")
        self.segment = ElidedLabel("muted")
        self.progress = QProgressBar()
        self.progress.setRange(0, 1000)
        self.progress.setTextVisible(False)
        self.progress.setFixedHeight(8)
        self.progress.setAccessibleName("Progress of the run")

        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(SPACE)
        column.addWidget(self.badge)
        steps = QHBoxLayout()
        for step in (self.arm_button, self.start_button):
            step.setMinimumHeight(40)
            steps.addWidget(step)
        column.addLayout(steps)
        self.rig = ElidedLabel("muted")  # that is in force
        column.addWidget(self.rig)
        column.addWidget(self.stop_button)
        # below STOP: texts of any length must not move it
        self.blocked = Message()  # why the rig cannot be armed
        column.addWidget(self.blocked)
        for widget in (self.time_left, self.segment, self.progress):
            column.addWidget(widget)
        column.addWidget(card(self._readouts()))
        column.addStretch(1)
        self.setFixedWidth(_WIDTH)
        status.changed.connect(self._refresh)
        session.rig_changed.connect(self._rig_changed)
        self._rig_changed()
        self._refresh()

    @Slot()
    def _refresh(self) -> None:
        """Show the high voltage, and whether the readouts are those of this moment."""
        status = self._status
        self.badge.show_state(status.state, status.brief)
        label_stop(self.stop_button, status.state)
        if self._numbers_of != status.run_number:
            self._clear()
        self._show_moment()

    def _show_moment(self) -> None:
        """Say what moment the readouts belong to; at rest they must not contradict the state."""
        status, reading = self._status, self._status.reading
        known = reading is not None and self._numbers_of == status.run_number
        past, output = known and not status.current, status.output
        if not known or reading is None:
            text = ""
        elif status.current:
            text = "now"
        elif not status.live and output is not None and output.monitor is not None:
            text = f"monitor at {output.time}"
            for name in _SIGNALS:
                volts = output.monitor if name == "monitor" else math.nan
                self.numbers[name].show_number(volts * 1e-3, 3)
        else:
            text = f"last sample, {reading.seconds:.2f} s"
        self.of_sample.setText(text)
        for readout in self.numbers.values():
            readout.show_past(past)

    def _clear(self) -> None:
        """Show no numbers: rig or run have changed since those that were shown."""
        self._numbers_of = self._status.run_number
        for readout in self.numbers.values():
            readout.show_number(math.nan, 0)
        self.time_left.setText("")
        self.segment.show_text("")
        self.progress.setValue(0)

    def show_numbers(self, now: RunSnapshot) -> None:
        """Show the signals and the errors of the overlay models."""
        self._numbers_of = self._status.run_number
        for name, (scale, decimals) in _SIGNALS.items():
            self.numbers[name].show_number(now.values.get(name, float("nan")) * scale, decimals)
        for place in (0, 1):
            errors = now.errors[place] if place < len(now.errors) else None
            for name, value in (
                ("rms", errors.rms * 1e6 if errors else float("nan")),
                ("recent", errors.recent * 1e6 if errors else float("nan")),
                ("nrmse", errors.nrmse_pct if errors else float("nan")),
            ):
                self.numbers[f"{name} {place}"].show_number(value, 2)
        self._show_moment()

    def show_progress(self, now: RunSnapshot, segment: str) -> None:
        """Show how far the run is and what plays; once its output is known, what is waited for."""
        status = self._status
        if not status.current or status.state is HighVoltage.RAMPING:
            words = status.silence or _ENDING.get(status.state, status.state.value)
            self.time_left.setText(words[:1].upper() + words[1:])
            self.segment.show_text("")
            return
        left = max(0.0, (now.total - now.samples) / now.rate)
        self.time_left.setText(f"{left:.1f} s left")
        self.progress.setValue(round(1000 * now.samples / max(now.total, 1)))
        self.segment.show_text(f"playing: {segment}" if segment else "")

    def show_room(self, newest: tuple[float, RoomReading] | None, seconds: float) -> None:
        """Show the newest reading of the room at ``seconds`` of the run, with its age."""
        celsius = percent = float("nan")
        text = "Room"
        if newest is not None:
            taken, reading = newest
            celsius, percent = reading.temperature, reading.humidity
            age = max(seconds - taken, 0.0)
            text = f"Room, {age:.0f} s ago" if reading.known else "Room: no value"
        self.room_title.setText(text)
        self.numbers["temperature"].show_number(celsius, 1)
        self.numbers["humidity"].show_number(percent, 1)

    @Slot()
    def _rig_changed(self) -> None:
        session = self._session
        self.rig.show_text(f"{session.address} with {session.rig_name}")
        self._room_group.setVisible(self._session.rig_file.thermohygrometer is not None)

    def show_models(self) -> None:
        """Show one group of errors for each overlay model of the session."""
        overlays = self._session.overlays
        for place in (0, 1):
            self._model_groups[place].setVisible(place < len(overlays))
            if place < len(overlays):
                self._model_titles[place].show_text(f"Error of {overlays[place].name}")

    def _readouts(self) -> QVBoxLayout:
        column = QVBoxLayout()
        column.setSpacing(0)
        column.addWidget(self.of_sample)
        self.numbers = {
            "command": Readout("Command", "kV", "Voltage that the card commands, in kV"),
            "monitor": Readout("Monitor", "kV", "Voltage that the amplifier reports, in kV"),
            "current": Readout("Current", "mA", "Current that the amplifier reports, in mA"),
            "displacement": Readout(
                "Displacement",
                "mm",
                "Displacement from the loaded rest state, in mm; down is positive",
                16,
            ),
        }
        for readout in self.numbers.values():
            column.addWidget(readout)
        self.room_title = label("Room", "heading", "Readings of the thermo-hygrometer")
        room = QVBoxLayout()
        room.setContentsMargins(0, 4, 0, 0)
        room.setSpacing(0)
        room.addWidget(self.room_title)
        for name, words, unit, tip in (
            ("temperature", "Temperature", "°C", "Temperature of the room, measured, in °C"),
            ("humidity", "Humidity", "%", "Relative humidity of the room, measured, in %"),
        ):
            self.numbers[name] = Readout(words, unit, tip, 13)
            room.addWidget(self.numbers[name])
        self._room_group = QWidget()
        self._room_group.setLayout(room)
        column.addWidget(self._room_group)
        self._model_titles, self._model_groups = [], []
        for place in (0, 1):
            group = QVBoxLayout()
            group.setContentsMargins(0, 4, 0, 0)
            group.setSpacing(0)
            title = ElidedLabel("heading")
            group.addWidget(title)
            for name, words, unit, tip in (
                ("rms", "RMS, whole run", "µm", "RMS of measured minus model since the start"),
                ("recent", "RMS, last 1 s", "µm", "RMS of measured minus model, last second"),
                ("nrmse", "NRMSE", "%", "RMS in percent of the range measured so far"),
            ):
                readout = Readout(words, unit, tip, 13)
                self.numbers[f"{name} {place}"] = readout
                group.addWidget(readout)
            holder = QWidget()
            holder.setLayout(group)
            column.addWidget(holder)
            self._model_titles.append(title)
            self._model_groups.append(holder)
        return column
