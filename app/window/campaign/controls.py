"""Lower part of the page Campaign: what is armed, the two steps, the present run, the queue."""

from __future__ import annotations

import math

from PySide6.QtCore import QSignalBlocker, Qt, Signal, Slot
from PySide6.QtWidgets import (
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QLineEdit,
    QProgressBar,
    QVBoxLayout,
    QWidget,
)

from dearig.batch.campaign import Arming
from dearig.config.campaignfile import RUNS_MAX
from dearig.window.high_voltage.status import HighVoltageStatus
from dearig.window.kit.number_box import NumberBox, WholeBox
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel, Message, Readout, button, card, label
from dearig.window.run.controls import StepButton
from dearig.window.run.live import RunSnapshot

__all__ = ["CampaignControls"]

_HOURS_MAX = 8760.0  # a year
_MARGIN = 1.25  # of the forecast time, for what the forecast does not know
_STEP = 0.1  # h
_STEP_WIDTH = 110  # px


class CampaignControls(QWidget):
    """Fields and buttons; the page connects the buttons and says what may be pressed.

    ``changed``: another batch is declared; ``operator_changed`` carries the name of the operator.
    """

    changed = Signal()
    operator_changed = Signal(str)

    def __init__(self, status: HighVoltageStatus, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._status = status
        self._left = 0  # runs that wait
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(SPACE)
        column.addLayout(self._queue_rows())
        inner = QVBoxLayout()
        inner.setSpacing(SPACE // 2)
        inner.addLayout(self._batch_rows())
        inner.addWidget(self._halt_row())
        self.blocked = Message()
        inner.addWidget(self.blocked)
        inner.addLayout(self._present_row())
        column.addWidget(card(inner))

    @property
    def fields(self) -> tuple[QWidget, ...]:
        """Fields of the batch."""
        return (self.operator, self.runs, self.hours, self.paced, self.seen)

    def arming(self, halted: bool, shown: tuple[str, ...]) -> Arming:
        """Return what is declared; ``halted``: what was seen is acknowledged."""
        return Arming(
            self.operator.text().strip(),
            self.runs.value(),
            self.hours.value(),
            self.seen.text().strip() if halted else "",
            shown,
        )

    def propose(self, runs: int, seconds: float) -> None:
        """Declare all ``runs`` that wait, and their time in s with a margin."""
        if runs == self._left:
            return
        self._left = runs
        hours = math.ceil(_MARGIN * seconds / 3600.0 / _STEP) * _STEP
        with QSignalBlocker(self.runs), QSignalBlocker(self.hours):
            self.runs.setMaximum(max(runs, 1))
            self.runs.setValue(runs)
            self.hours.setValue(max(hours, _STEP))

    def forget_proposal(self) -> None:
        """Let the next proposal replace what is declared."""
        self._left = 0

    def show_halt(self, reason: str) -> None:
        """Ask what was seen at the rig after a halt; "" for none."""
        self.halt.show_text(f"Halted: {reason}." if reason else "", "bad")
        self._halted.setVisible(bool(reason))
        if not reason:
            self.seen.clear()

    def show_numbers(self, now: RunSnapshot | None) -> None:
        """Show the newest samples of the present run; no numbers where None is given."""
        for name, readout in self.numbers.items():
            value = math.nan if now is None else now.values.get(name, math.nan)
            readout.show_number(value * (1e-3 if name == "monitor" else 1e3), 3)
            readout.show_past(not self._status.current)
        if now is None:
            self.progress.setValue(0)
            self.time_left.setText("")
            return
        self.progress.setValue(round(1000 * now.samples / max(now.total, 1)))
        left = max(0.0, (now.total - now.samples) / now.rate)
        self.time_left.setText(self._status.silence or f"{left:.1f} s left")

    # layout

    def _queue_rows(self) -> QVBoxLayout:
        self.pause = button("Pa&use after this run", "Start no run until Go on is pressed")
        self.go_on = button("&Go on", "Start the next run")
        self.end = button("End a&fter this run", "End the campaign at 0 V; it can be continued")
        self.first = button("Play ne&xt", "Play the selected runs before all others that wait")
        self.skip = button("&Leave out", "Leave the selected runs out")
        rows = QVBoxLayout()
        for made in ((self.first, self.skip), (self.pause, self.go_on, self.end)):
            row = QHBoxLayout()
            for part in made:
                row.addWidget(part)
            row.addStretch(1)
            rows.addLayout(row)
        return rows

    def _batch_rows(self) -> QVBoxLayout:
        self.operator = QLineEdit()
        self.operator.setMinimumWidth(90)
        self.operator.setToolTip("Name of the person who arms; kept in journal and recordings")
        self.runs = WholeBox(1, RUNS_MAX, 1)
        self.runs.setToolTip("Number of runs that are armed")
        self.hours = NumberBox(_STEP, _HOURS_MAX, _STEP, decimals=1, unit=" h")
        self.hours.setSingleStep(_STEP)
        self.hours.setToolTip("Time from now on; no run starts that would end later")
        self.paced = QCheckBox("Real t&ime")
        self.paced.setToolTip(
            "Run the simulated rig in real time, with rests; otherwise as fast as it can"
        )
        row = QHBoxLayout()
        for words, field, share in (
            ("Opera&tor", self.operator, 1), ("&Runs", self.runs, 0), ("Wit&hin", self.hours, 0),
        ):  # fmt: skip
            caption = label(words)
            caption.setBuddy(field)
            row.addWidget(caption)
            row.addWidget(field, share)
        steps = QHBoxLayout()
        steps.addWidget(self.paced)
        steps.addStretch(1)
        self.arm = StepButton("1  Arm", "First step: no output yet", "F5", self, self._status)
        self.arm.setCheckable(True)
        self.start = StepButton("2  Start", "Second step: play the batch", "F6", self, self._status)
        for step in (self.arm, self.start):
            step.setMinimumSize(_STEP_WIDTH, 36)
            steps.addWidget(step)
        rows = QVBoxLayout()
        rows.addLayout(row)
        rows.addLayout(steps)
        self.operator.textChanged.connect(self.operator_changed)
        self.operator.textChanged.connect(self.changed)
        self.runs.valueChanged.connect(self.changed)
        self.hours.valueChanged.connect(self.changed)
        self.paced.toggled.connect(self.changed)
        return rows

    def _halt_row(self) -> QWidget:
        self.halt = Message()
        self.seen = QLineEdit()
        self.seen.setToolTip("What you saw at the rig, the amplifier and the film")
        self.seen.textChanged.connect(self.changed)
        caption = label("What was &seen at the rig")
        caption.setBuddy(self.seen)
        self._halted = QWidget()
        rows = QVBoxLayout(self._halted)
        rows.setContentsMargins(0, 0, 0, 0)
        rows.setSpacing(SPACE // 2)
        rows.addWidget(self.halt)
        row = QHBoxLayout()
        row.addWidget(caption)
        row.addWidget(self.seen, 1)
        rows.addLayout(row)
        self._halted.hide()
        return self._halted

    def _present_row(self) -> QGridLayout:
        self.present = ElidedLabel("heading")
        self.time_left = label("", "muted")
        self.progress = QProgressBar()
        self.progress.setRange(0, 1000)
        self.progress.setTextVisible(False)
        self.progress.setFixedHeight(8)
        self.progress.setAccessibleName("Progress of the present run")
        self.numbers = {
            "monitor": Readout("Monitor", "kV", "Voltage that the amplifier reports, in kV", 15),
            "displacement": Readout(
                "Displacement", "mm", "Displacement from the loaded rest state, in mm", 15
            ),
        }
        grid = QGridLayout()
        grid.setHorizontalSpacing(3 * SPACE)
        grid.addWidget(self.present, 0, 0)
        grid.addWidget(self.time_left, 0, 1, Qt.AlignmentFlag.AlignRight)
        grid.addWidget(self.progress, 1, 0, 1, 2)
        for place, readout in enumerate(self.numbers.values()):
            grid.addWidget(readout, 0, 2 + place, 2, 1)
        grid.setColumnStretch(0, 1)
        return grid

    @Slot(bool)
    def set_editable(self, editable: bool) -> None:
        """Let the batch be declared, or not."""
        for field in self.fields:
            field.setEnabled(editable)
