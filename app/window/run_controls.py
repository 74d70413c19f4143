"""Left column of the Run page: high-voltage state, Arm, Start, STOP, progress and readouts."""

from __future__ import annotations

from PySide6.QtGui import QFont
from PySide6.QtWidgets import (
    QHBoxLayout,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from dearig.window.hv import HighVoltage, HighVoltageBadge
from dearig.window.live import RunSnapshot
from dearig.window.session import Session
from dearig.window.theme import SPACE, digits
from dearig.window.widgets import Message, Readout, button, card, label

__all__ = ["RunControls"]

_WIDTH = 268  # px
_STOP = "⬣  STOP"
_STOP_AGAIN = "⬣  0 V NOW"

#: Signal to (factor from SI to the readout's unit, decimals).
_SIGNALS = {
    "command": (1e-3, 3),
    "monitor": (1e-3, 3),
    "current": (1e3, 3),
    "displacement": (1e3, 4),
}


class RunControls(QWidget):
    """Buttons and readouts of a run. The page connects the buttons and says what to show."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.badge = HighVoltageBadge(session, large=True)
        self.arm_button = button("1  &Arm", "First step: no voltage yet (F5)", primary=True)
        self.arm_button.setCheckable(True)
        self.arm_button.setShortcut("F5")
        self.start_button = button("2  &Start", "Second step: play and record the sequence (F6)")
        self.start_button.setProperty("role", "primary")
        self.start_button.setShortcut("F6")
        self.stop_button = _stop_button()
        self.time_left = label("", "title")
        self.time_left.setFont(digits(15))
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

    def show_state(self, state: HighVoltage, detail: str) -> None:
        """Show the high-voltage state, with ``detail`` such as 7.9 kV beside it."""
        self.badge.show_state(state, detail)

    def show_stop(self, ramping: bool) -> None:
        """Label the STOP button with what its next press does."""
        self.stop_button.setText(_STOP_AGAIN if ramping else _STOP)

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


def _stop_button() -> QPushButton:
    """Large, red, with an octagon in its text: nothing else in the window looks like it."""
    made = QPushButton(_STOP)
    made.setObjectName("stop")
    made.setMinimumHeight(92)
    made.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
    font = QFont(made.font())
    font.setPointSize(26)
    font.setBold(True)
    made.setFont(font)
    made.setToolTip(
        "Ramp down to 0 V and end the run (Esc or Space); press again for 0 V at once, without "
        "a ramp"
    )
    made.setAccessibleName("STOP: ramp down to 0 V")
    made.setStyleSheet(
        "QPushButton { background: #b3001b; color: white; border: 3px solid #7a0012;"
        " border-radius: 10px; }"
        " QPushButton:hover { background: #cc1a33; }"
        " QPushButton:pressed { background: #7a0012; }"
        " QPushButton:focus { border: 3px solid #f0e442; }"
    )
    return made
