"""Left column of the Run page: high-voltage state, Arm, Start, STOP, progress and readouts."""

from __future__ import annotations

from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QKeyEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QProgressBar, QPushButton, QVBoxLayout, QWidget

from dearig.drivers.instruments.thermohygrometer import RoomReading
from dearig.window.high_voltage.bar import label_stop, stop_button
from dearig.window.high_voltage.state import HighVoltageBadge
from dearig.window.high_voltage.status import HighVoltageStatus
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, Readout, card, label, set_role
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


class StepButton(QPushButton):
    """Button of a step towards voltage: clicked, or by its own key, pressed once.

    It takes no focus, and no other key acts on it: Space is a stop key, and a key that is held
    repeats itself.
    """

    def __init__(self, text: str, tip: str, key: str, page: QWidget) -> None:
        super().__init__(text)
        self.setProperty("role", "primary")
        self.setToolTip(f"{tip} ({key})")
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        shortcut = QShortcut(QKeySequence(key), page)
        shortcut.setAutoRepeat(False)
        shortcut.activated.connect(self.click)

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
        self.badge = HighVoltageBadge(large=True)
        self.arm_button = StepButton("1  Arm", "First step: no voltage yet", "F5", self)
        self.arm_button.setCheckable(True)
        self.start_button = StepButton(
            "2  Start", "Second step: play and record the sequence", "F6", self
        )
        self.stop_button = stop_button(26, _STOP_HEIGHT)
        self.time_left = label("", "title")
        self.time_left.setWordWrap(True)
        self.of_sample = label("", "muted", "Time of the sample that the readouts show")
        self.segment = label("", "muted", "Segment that is playing")
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
        self.blocked = Message()  # why the rig cannot be armed
        column.addWidget(self.blocked)
        column.addWidget(self.stop_button)
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
        status, reading = self._status, self._status.reading
        self.badge.show_state(status.state, status.detail)
        label_stop(self.stop_button, status.state)
        past = reading is not None and not status.live
        if reading is not None and past:
            self.of_sample.setText(f"last sample, {reading.seconds:.2f} s")
        else:
            self.of_sample.setText("now" if status.live else "")
        set_role(self.of_sample, "muted")
        for readout in self.numbers.values():
            readout.show_past(past)

    def show_numbers(self, now: RunSnapshot) -> None:
        """Show the signals and the errors of the overlay models."""
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

    def show_room(self, newest: tuple[float, RoomReading] | None, seconds: float) -> None:
        """Show the newest reading of the room at ``seconds`` of the run, with its age."""
        celsius = percent = float("nan")
        words = "Room"
        if newest is not None:
            taken, reading = newest
            celsius, percent = reading.temperature, reading.humidity
            age = max(seconds - taken, 0.0)
            words = f"Room, {age:.0f} s ago" if reading.known else "Room: no value"
        self.room_title.setText(words)
        self.numbers["temperature"].show_number(celsius, 1)
        self.numbers["humidity"].show_number(percent, 1)

    @Slot()
    def _rig_changed(self) -> None:
        self._room_group.setVisible(self._session.rig_file.thermohygrometer is not None)

    def show_models(self) -> None:
        """Show one group of errors for each overlay model of the session."""
        overlays = self._session.overlays
        for place in (0, 1):
            self._model_groups[place].setVisible(place < len(overlays))
            if place < len(overlays):
                self._model_titles[place].setText(f"Error of {overlays[place].name}")

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
            title = label("", "heading")
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
