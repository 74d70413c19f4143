"""Bar across the top of the main window: high voltage, its alarm, and STOP, on every page."""

from __future__ import annotations

import math

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QFont, QFontMetrics
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from dearig.recording.writing.late_event import add_event
from dearig.window.documents.dialogs import run_dialog
from dearig.window.high_voltage.state import HighVoltage, HighVoltageBadge, kilovolts
from dearig.window.high_voltage.status import HighVoltageStatus, recording_of
from dearig.window.jobs.background import Background
from dearig.window.kit.theme import SPACE, digits
from dearig.window.kit.widgets import ElidedLabel, button, label, plain_tip, set_role
from dearig.window.session.state import Session

__all__ = ["STOP_NAME", "HighVoltageBar", "label_stop", "stop_button"]

STOP_NAME = "stop"  #: name of the object of each button that stops

_STOP = "⬣  STOP"
_STOP_AGAIN = "⬣  0 V NOW"
_HEIGHT = 44  # px
_NOTICES = 28  # px of the line below it, for the alarm and the notices
_WORDS = 200  # px of the sentence on the state, in two or three lines


def stop_button(points: int, height: int) -> QPushButton:
    """Make a STOP button: red, with an octagon; nothing else in the window looks like it.

    It acts when it is pressed, not when it is released, and takes no focus from a field.
    """
    made = QPushButton(_STOP)
    made.setObjectName(STOP_NAME)
    made.setFixedHeight(height)
    made.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    font = QFont(made.font())
    font.setPointSize(points)
    font.setBold(True)
    made.setFont(font)
    made.setMinimumWidth(QFontMetrics(font).horizontalAdvance(_STOP_AGAIN) + 28)
    made.setToolTip(
        "Ramp down to 0 V and end the run (Esc or Space); press again for 0 V at once, without "
        "a ramp. Before a run: disarm"
    )
    made.setAccessibleName("STOP: ramp down to 0 V")
    made.setStyleSheet(
        "QPushButton { background: #b3001b; color: white; border: 3px solid #7a0012;"
        " border-radius: 8px; padding: 0px 8px; }"
        " QPushButton:hover { background: #cc1a33; }"
        " QPushButton:pressed { background: #7a0012; }"
    )
    return made


def label_stop(stop: QPushButton, state: HighVoltage) -> None:
    """Label a STOP button with what its next press does."""
    words = _STOP_AGAIN if state is HighVoltage.RAMPING else _STOP
    if stop.text() != words:
        stop.setText(words)


class HighVoltageBar(QFrame):
    """State, monitor voltage, sequence time, latched alarm with its acknowledgement, and STOP.

    ``stop_pressed`` comes when STOP is pressed.
    """

    stop_pressed = Signal()

    def __init__(
        self, status: HighVoltageStatus, session: Session, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._status = status
        self._session = session
        self._noting = Background(self)
        self._noting.failed.connect(session.message)
        self.setProperty("role", "bar")
        self.badge = HighVoltageBadge(large=False)
        self.badge.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.monitor = label("", "", "Voltage that the amplifier's monitor reports")
        self.monitor.setFont(digits(17))
        self.monitor.setMinimumWidth(
            QFontMetrics(self.monitor.font()).horizontalAdvance("-10.00 kV")
        )
        self.monitor.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.time = label("", "muted", "Time in the sequence, or when the monitor was read")
        self.detail = label("")
        self.detail.setWordWrap(True)  # "switch the amplifier off" must not be cut
        self.detail.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Ignored)
        self.detail.setMinimumWidth(_WORDS)
        self.alarm = ElidedLabel("bad")
        self.acknowledge_button = button(
            "Acknowledge …", "Release the alarm in the name of a person who has looked at the rig"
        )
        self.stop_button = stop_button(17, _HEIGHT)
        row = QHBoxLayout()
        row.setSpacing(SPACE)
        row.addWidget(self.badge)
        row.addWidget(self.monitor)
        row.addWidget(self.time)
        row.addWidget(self.detail, 1)
        row.addWidget(self.stop_button)
        # of one height, whether it shows something or not: what comes and goes must not move STOP
        notices = QWidget()
        notices.setFixedHeight(_NOTICES)
        self._notices = QHBoxLayout(notices)
        self._notices.setContentsMargins(0, 0, 0, 0)
        self._notices.setSpacing(SPACE)
        self._notices.addWidget(self.alarm, 1)
        self._notices.addWidget(self.acknowledge_button)
        rows = QVBoxLayout(self)
        rows.setContentsMargins(SPACE, SPACE // 2, SPACE, SPACE // 2)
        rows.setSpacing(SPACE // 2)
        rows.addLayout(row)
        rows.addWidget(notices)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self.badge.painted.connect(status.painted)
        self.stop_button.pressed.connect(self.stop_pressed)
        self.acknowledge_button.clicked.connect(self._ask_name)
        status.changed.connect(self._refresh)
        self._refresh()

    def add_notices(self, notices: QWidget) -> None:
        """Put ``notices`` into the line of the alarm, behind it."""
        self._notices.addWidget(notices, 1)

    def acknowledge(self, name: str) -> None:
        """Release the alarm in the ``name`` of a person, in the log and in the recording."""
        alarm = self._status.acknowledge(name)
        if alarm is None:
            return
        path = recording_of(alarm)
        if path is not None:
            message = f"{name.strip()} acknowledged: {alarm.text}"
            self._noting.start(lambda: add_event(path, "info", message))

    def close_work(self) -> None:
        """Wait until the acknowledgement is in the recording."""
        self._noting.close()

    @Slot()
    def _refresh(self) -> None:
        status = self._status
        self.badge.show_state(status.state, status.brief)
        self.detail.setText(status.words)
        self.detail.setToolTip(plain_tip(status.words))
        label_stop(self.stop_button, status.state)
        volts, belongs_to = status.number
        self.monitor.setText("— kV" if math.isnan(volts) else kilovolts(volts))
        self.time.setText(belongs_to)
        set_role(self.monitor, "" if status.current else "muted")
        alarm = status.alarm
        self.alarm.setVisible(alarm is not None)
        self.acknowledge_button.setVisible(alarm is not None)
        if alarm is not None:
            self.alarm.show_text(f"⚠ {alarm.text}")

    @Slot()
    def _ask_name(self) -> None:
        alarm = self._status.alarm
        if alarm is None:
            return
        dialog = _Acknowledge(
            f"{alarm.text}\n\n{self._status.detail}", self._session.operator, self
        )
        if run_dialog(dialog, self._session):
            self.acknowledge(dialog.name.text())


class _Acknowledge(QDialog):
    """Ask for the name of the person who has looked at the rig."""

    def __init__(self, text: str, name: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Acknowledge the alarm")
        words = label(text)
        words.setWordWrap(True)
        words.setMinimumWidth(420)
        self.name = QLineEdit(name)
        self.name.setAccessibleName("Name")
        buttons = QDialogButtonBox()
        self.accept_button = buttons.addButton(
            "Acknowledge", QDialogButtonBox.ButtonRole.AcceptRole
        )
        buttons.addButton("Cancel", QDialogButtonBox.ButtonRole.RejectRole)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        column = QVBoxLayout(self)
        column.addWidget(words)
        column.addWidget(label("Your name, after you have looked at the rig"))
        column.addWidget(self.name)
        column.addWidget(buttons)
        self.name.textChanged.connect(self._name_changed)
        self._name_changed()

    @Slot()
    def _name_changed(self) -> None:
        self.accept_button.setEnabled(bool(self.name.text().strip()))
