"""The page on which a sequence is played: arm, start, watch, STOP."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Signal, Slot
from PySide6.QtGui import QFont
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFileDialog,
    QHBoxLayout,
    QLineEdit,
    QPlainTextEdit,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from dearig.acquisition.overlay import OverlayModel
from dearig.config.modelfile import load_actuator, load_model
from dearig.config.toml_input import read_text
from dearig.sim_backend.faults import FaultPlan
from dearig.window.background import Background
from dearig.window.hv import HighVoltage, HighVoltageBadge
from dearig.window.live import Live, RunSnapshot
from dearig.window.run_plots import RunPlots
from dearig.window.running import RunEnd, Runner, RunRequest, simulated
from dearig.window.session import Session
from dearig.window.theme import SPACE, digits
from dearig.window.widgets import Message, Readout, button, card, label

__all__ = ["RunPage"]

_FRAME = 16  # ms between two looks at the curves
_NUMBERS = 100  # ms between two looks at the numbers: faster ones cannot be read
_ARMED = 30_000  # ms; who has armed and gone away must arm again
_WINDOWS = {"last 2 s": 2.0, "last 5 s": 5.0, "last 10 s": 10.0, "last 30 s": 30.0,
            "last 60 s": 60.0, "whole run": None}  # fmt: skip
_NONE, _OPEN = "no model", "Open a model file …"


class RunPage(QWidget):
    """Shows and asks; the run itself is in ``runner``, its curves in a ``Live``."""

    title = "Run"
    shortcut = "Ctrl+3"

    show_recording = Signal(Path)
    show_sequence = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.runner = Runner(self)
        self.faults: FaultPlan | None = None  #: what goes wrong in the next simulated run
        self.live: Live | None = None
        self._drawn: tuple[int, float | None] = (-1, None)
        self._runs = 0
        self._segments: tuple[tuple[str, float, float], ...] = ()
        self._asked: list[tuple[int, Path]] = []  # models that are being read, and for which place
        self._last: Path | None = None
        self._loading = Background(self)
        self._loading.done.connect(self._model_loaded)
        self._loading.failed.connect(self._model_failed)

        self.badge = HighVoltageBadge(session, large=True)
        self.arm_button = button("1  &Arm", "First step: nothing moves yet (F5)", primary=True)
        self.arm_button.setCheckable(True)
        self.start_button = button("2  &Start", "Second step: plays the sequence (F6)", True)
        self.stop_button = _stop_button()
        self.plots = RunPlots(session)
        self._build()

        self.arm_button.clicked.connect(self._arm)
        self.start_button.clicked.connect(self.start)
        self.stop_button.clicked.connect(self.stop)
        self.arm_button.setShortcut("F5")
        self.start_button.setShortcut("F6")
        self.runner.state_changed.connect(self._state_changed)
        self.runner.ended.connect(self._ended)
        session.preview_changed.connect(self._refresh)
        session.sequence_changed.connect(self._sequence_changed)
        session.rig_changed.connect(self._refresh)
        session.overlays_changed.connect(self._overlays_changed)
        self._disarm = QTimer(self)
        self._disarm.setSingleShot(True)
        self._disarm.setInterval(_ARMED)
        self._disarm.timeout.connect(self._disarmed)
        self._frames = QTimer(self)
        self._frames.setTimerType(Qt.TimerType.PreciseTimer)
        self._frames.setInterval(_FRAME)
        self._frames.timeout.connect(self._draw)
        self._numbers = QTimer(self)
        self._numbers.setInterval(_NUMBERS)
        self._numbers.timeout.connect(self._count)
        self._overlays_changed()
        self._refresh()

    # what is asked

    @Slot()
    def start(self) -> None:
        """The second step: play and record the sequence."""
        session, preview = self.session, self.session.preview
        if preview is None or preview.loaded is None or not preview.playable:
            return
        live = Live(session.overlays, session.overlay_drive)
        order = RunRequest(
            preview.loaded, session.address, session.rig_file, session.rig_text, session.folder,
            operator=session.operator, film=session.film, notes=session.notes,
            seed=self._seed(), paced=self.paced.isChecked(), faults=self.faults,
            overlay=self._kept(),
        )  # fmt: skip
        if not self.runner.start(order, live):
            return
        if self.live is not None:
            self.live.close()
        self.live, self._drawn, self._segments = live, (-1, None), preview.segments
        self.plots.show_prediction(preview)
        self.plots.start()
        self.log.clear()
        self.result.show_text("")
        self.show_button.hide()
        self._frames.start()
        self._numbers.start()
        session.set_running(True)
        self._refresh()
        self.stop_button.setFocus()

    @Slot()
    def stop(self) -> None:
        """Ramp down to 0 V, the second time at once; or take the first step back."""
        if self.runner.state is HighVoltage.RAMPING:
            self.runner.stop_without_ramp()
            return
        self.runner.stop()
        if not self.runner.running:
            self._disarmed()

    def show_model(self, path: Path, place: int = 0) -> None:
        """Let the model in a file run beside the measurement, in ``place`` 0 or 1."""
        self._asked.append((place, path))
        self._load_next()

    def close_work(self) -> None:
        """Make safe, and wait for every thread."""
        self.runner.stop()
        self.runner.wait()
        self._frames.stop()
        self._numbers.stop()
        self._disarm.stop()
        self._loading.close()
        if self.live is not None:
            self.live.close()
            self.live = None

    @Slot(bool)
    def _arm(self, armed: bool) -> None:
        preview = self.session.preview
        if self.runner.running or preview is None or not preview.playable:
            self.arm_button.setChecked(False)
            return
        self.runner.arm(armed)
        if armed:
            self._disarm.start()
            self.start_button.setEnabled(True)
            self.start_button.setFocus()
        else:
            self._disarmed()

    @Slot()
    def _disarmed(self) -> None:
        self._disarm.stop()
        self.runner.arm(armed=False)
        self._refresh()

    # what is shown

    @Slot(object)
    def _state_changed(self, state: HighVoltage) -> None:
        self.badge.show_state(state, self._kind())
        ramping = state is HighVoltage.RAMPING
        self.stop_button.setText(_STOP_AGAIN if ramping else _STOP)

    def _kind(self) -> str:
        return "simulated" if simulated(self.session.address) else ""

    @Slot()
    def _sequence_changed(self) -> None:
        if self.runner.state is HighVoltage.ARMED:
            self._disarmed()  # what was armed is not what would be played
        self._refresh()

    @Slot()
    def _refresh(self) -> None:
        session, running = self.session, self.runner.running
        preview = session.preview
        ready = preview is not None and preview.playable and not running
        armed = self.runner.state is HighVoltage.ARMED
        if not ready and armed:
            self.runner.arm(armed=False)
            armed = False
        self.arm_button.setEnabled(ready)
        self.arm_button.setChecked(armed)
        self.start_button.setEnabled(ready and armed)
        for field in (self.operator, self.film, self.notes, self.paced):
            field.setEnabled(not running)
        self.paced.setVisible(simulated(session.address))
        if not running:
            self.badge.show_state(self.runner.state, self._kind())
        if running:
            return
        if preview is None:
            self.about.show_text("The sequence is being planned …", "muted")
        elif preview.plan is None:
            self.about.show_text(preview.sentence, "bad")
        elif preview.loaded is not None:
            name, seconds = preview.loaded.sequence.name, float(preview.plan.time[-1])
            if preview.playable:
                rate = preview.plan.rate
                self.about.show_text(
                    f"{name}: {seconds:.1f} s at {rate:g} Hz on {session.address}", ""
                )
            else:
                self.about.show_text(f"{name} is refused: {'; '.join(preview.plan.reasons)}", "bad")
        self.to_sequence.setVisible(preview is not None and not preview.playable)
        if preview is not None and self.live is None:
            self.plots.show_prediction(preview)

    @Slot()
    def _draw(self) -> None:
        live = self.live
        now = None if live is None else live.now()
        if live is None or now is None or not self.isVisible():
            return
        mark = (now.revision, self.plots.window)
        if mark == self._drawn:
            return
        self._drawn = mark
        self.plots.draw(live, now.samples / now.rate)

    @Slot()
    def _count(self) -> None:
        live = self.live
        if live is None:
            return
        for event in live.take_events():
            now = live.now()
            at = f"{event.sample / now.rate:8.2f} s" if now is not None else ""
            self.log.appendPlainText(f"{at}  {event.level}: {event.message}")
        now = live.now()
        if now is None:
            return
        self._show_numbers(now)
        if self.runner.running:
            seconds = now.samples / now.rate
            left = max(0.0, now.total / now.rate - seconds)
            self.left.setText(f"{left:.1f} s left")
            self.progress.setValue(round(1000 * now.samples / max(now.total, 1)))
            playing = next((s for s in self._segments if s[1] <= seconds < s[2]), None)
            self.segment.setText(f"now: {playing[0]}" if playing else "")
            kilovolts = now.values.get("monitor", float("nan")) * 1e-3
            self.badge.show_state(self.runner.state, f"{kilovolts:.2f} kV  {self._kind()}".rstrip())

    def _show_numbers(self, now: RunSnapshot) -> None:
        for name, (scale, decimals) in _NUMBERS_SHOWN.items():
            self.numbers[name].show_number(now.values.get(name, float("nan")) * scale, decimals)
        for place in (0, 1):
            there = place < len(now.errors)
            errors = now.errors[place] if there else None
            for name, value, decimals in (
                ("rms", errors.rms * 1e6 if errors else float("nan"), 2),
                ("recent", errors.recent * 1e6 if errors else float("nan"), 2),
                ("nrmse", errors.nrmse_pct if errors else float("nan"), 2),
            ):
                self.numbers[f"{name} {place}"].show_number(value, decimals)
        words = [
            f"{model.name}: {why}"
            for model, why in zip(self.session.overlays, now.words, strict=False)
            if why
        ]
        self.model_words.show_text("; ".join(words), "warn")

    @Slot(object)
    def _ended(self, end: RunEnd) -> None:
        self._count()
        self.badge.show_state(self.runner.state, self._kind())
        self.left.setText(end.headline)
        if end.result is not None:
            self.progress.setValue(1000)
        self.segment.setText("")
        role = "good" if end.result is not None else "bad"
        where = f" · recorded in {end.path}" if end.path is not None else ""
        if end.path is not None and str(end.path) in end.sentence:
            where = ""
        self.result.show_text(f"{end.headline}: {end.sentence}{where}", role)
        self._last = end.path
        self.show_button.setVisible(end.path is not None)
        self.session.set_running(False)
        self._refresh()
        if end.path is not None:
            self.session.recorded.emit(end.path)

    # models beside the measurement

    @Slot()
    def _overlays_changed(self) -> None:
        session = self.session
        known = [session.thesis_model, *(m for m in session.overlays if m.path is not None)]
        for place, choice in enumerate(self.models):
            choice.blockSignals(True)
            choice.clear()
            choice.addItem(_NONE, None)
            for model in known:
                choice.addItem(model.name, model)
                if model.path is not None:
                    choice.setItemData(
                        choice.count() - 1, str(model.path), Qt.ItemDataRole.ToolTipRole
                    )
            choice.addItem(_OPEN, _OPEN)
            chosen = session.overlays[place] if place < len(session.overlays) else None
            choice.setCurrentIndex(0 if chosen is None else 1 + known.index(chosen))
            choice.blockSignals(False)
        for place in (0, 1):
            there = place < len(session.overlays)
            self.model_numbers[place].setVisible(there)
            if there:
                self.model_titles[place].setText(f"against {session.overlays[place].name}")
        self._drawn = (-1, None)
        if self.live is not None:
            self.live.follow(session.overlays, session.overlay_drive)

    def _model_chosen(self, place: int) -> None:
        choice = self.models[place]
        chosen = choice.currentData()
        if chosen == _OPEN:
            self._overlays_changed()  # until it is read, what was there stays
            name, _ = QFileDialog.getOpenFileName(
                self, "Model to run beside the measurement", str(self.session.folder),
                "Models (*.toml)",
            )  # fmt: skip
            if name:
                self.show_model(Path(name), place)
            return
        self._place_model(place, chosen)

    def _place_model(self, place: int, model: OverlayModel | None) -> None:
        overlays = list(self.session.overlays)
        if model is None:
            overlays = overlays[:place] + overlays[place + 1 :]
        elif place < len(overlays):
            overlays[place] = model
        else:
            overlays.append(model)
        self.session.set_overlays(tuple(overlays), self.drive.currentData())

    @Slot()
    def _drive_changed(self) -> None:
        self.session.set_overlays(self.session.overlays, self.drive.currentData())

    def _load_next(self) -> None:
        if self._asked and not self._loading.busy:
            _, path = self._asked[0]
            self._loading.start(lambda: _read_model(path))

    @Slot(object)
    def _model_loaded(self, model: OverlayModel) -> None:
        place, _ = self._asked.pop(0)
        self.model_words.show_text("")
        self._place_model(place, model)
        self._load_next()

    @Slot(str)
    def _model_failed(self, sentence: str) -> None:
        self._asked.pop(0)
        self.model_words.show_text(sentence, "bad")
        self._load_next()

    @Slot()
    def _window_changed(self) -> None:
        self.plots.window = self.view.currentData()
        self._drawn = (-1, None)
        self._draw()

    def _show_last(self) -> None:
        if self._last is not None:
            self.show_recording.emit(self._last)

    def _kept(self) -> OverlayModel | None:
        """What the recording keeps of the models: the first one, where the command drives it."""
        first = next(iter(self.session.overlays), None)
        if first is None or self.session.overlay_drive != "command":
            return None
        return first

    def _seed(self) -> int:
        """Of the simulated noise: another one each time, as on the bench."""
        self._runs += 1
        return self._runs - 1

    # how it is laid out

    def _build(self) -> None:
        outer = QHBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.setSpacing(SPACE)
        outer.addWidget(self._controls())
        right = QVBoxLayout()
        right.setSpacing(SPACE // 2)
        right.addLayout(self._asked_before())
        right.addLayout(self._overlay_row())
        self.model_words = Message()
        right.addWidget(self.model_words)
        right.addWidget(self.plots, 1)
        right.addLayout(self._end_row())
        outer.addLayout(right, 1)

    def _controls(self) -> QWidget:
        column = QVBoxLayout()
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(SPACE)
        column.addWidget(self.badge)
        steps = QHBoxLayout()
        for step in (self.arm_button, self.start_button):
            step.setMinimumHeight(40)
            steps.addWidget(step)
        column.addLayout(steps)
        column.addWidget(self.stop_button)
        self.left = label("", "title")
        self.left.setFont(digits(15))
        self.segment = label("", "muted", "The segment that is playing now")
        self.progress = QProgressBar()
        self.progress.setRange(0, 1000)
        self.progress.setTextVisible(False)
        self.progress.setFixedHeight(8)
        column.addWidget(self.left)
        column.addWidget(self.segment)
        column.addWidget(self.progress)
        numbers = QVBoxLayout()
        numbers.setSpacing(0)
        self.numbers = {
            "command": Readout("Command", "kV", "Voltage that the card commands, in kV"),
            "monitor": Readout("Monitor", "kV", "Voltage that the amplifier reports, in kV"),
            "current": Readout("Current", "mA", "Current that the amplifier reports, in mA"),
            "displacement": Readout(
                "Moved", "mm", "Displacement from the loaded rest state, in mm; down is positive"
            ),
        }
        for readout in self.numbers.values():
            numbers.addWidget(readout)
        self.model_titles, self.model_numbers = [], []
        for place in (0, 1):
            group = QVBoxLayout()
            group.setContentsMargins(0, 4, 0, 0)
            group.setSpacing(0)
            heading = label("", "heading")
            group.addWidget(heading)
            for name, words, unit, tip in (
                ("rms", "RMS", "µm", "Root mean square of measured less model so far, in µm"),
                ("recent", "last 1 s", "µm", "The same over the last second, in µm"),
                ("nrmse", "NRMSE", "%", "RMS over the measured range so far, in per cent"),
            ):
                readout = Readout(words, unit, tip, 13)
                self.numbers[f"{name} {place}"] = readout
                group.addWidget(readout)
            holder = QWidget()
            holder.setLayout(group)
            numbers.addWidget(holder)
            self.model_titles.append(heading)
            self.model_numbers.append(holder)
        column.addWidget(card(numbers))
        column.addStretch(1)
        holder = QWidget()
        holder.setLayout(column)
        holder.setFixedWidth(268)
        return holder

    def _asked_before(self) -> QHBoxLayout:
        session = self.session
        row = QHBoxLayout()
        self.operator = QLineEdit(session.operator)
        self.film = QLineEdit(session.film)
        self.notes = QLineEdit(session.notes)
        for words, field, tip, share in (
            ("&Operator", self.operator, "Who runs it; kept in the recording", 2),
            ("&Film", self.film, "Which film hangs there; kept in the recording", 2),
            ("&Notes", self.notes, "Anything else; kept in the recording", 5),
        ):
            caption = label(words)
            caption.setBuddy(field)
            field.setToolTip(tip)
            row.addWidget(caption)
            row.addWidget(field, share)
            field.textChanged.connect(self._noted)
        self.paced = QCheckBox("Real &time")
        self.paced.setChecked(True)
        self.paced.setToolTip("Let the simulated rig take its time, as a real one does")
        row.addWidget(self.paced)
        return row

    @Slot()
    def _noted(self) -> None:
        if not self.runner.running:
            self.session.set_notes(self.operator.text(), self.film.text(), self.notes.text())

    def _overlay_row(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.addWidget(label("Model beside it"))
        self.models = [QComboBox(), QComboBox()]
        for place, choice in enumerate(self.models):
            choice.setToolTip("A model that runs in step with the data; may be changed at any time")
            choice.setSizeAdjustPolicy(
                QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
            )
            choice.setMinimumContentsLength(12)
            choice.activated.connect(lambda _, place=place: self._model_chosen(place))
            row.addWidget(choice, 1)
        self.drive = QComboBox()
        self.drive.addItem("driven by the command", "command")
        self.drive.addItem("driven by the monitor", "monitor")
        self.drive.setToolTip("Which voltage (kV) the models are driven by")
        self.drive.activated.connect(self._drive_changed)
        row.addWidget(self.drive)
        row.addStretch(1)
        self.view = QComboBox()
        for words, seconds in _WINDOWS.items():
            self.view.addItem(f"Show {words}", seconds)
        self.view.setCurrentIndex(2)
        self.view.setToolTip("How much of the run the plots show, in s")
        self.view.activated.connect(self._window_changed)
        row.addWidget(self.view)
        return row

    def _end_row(self) -> QVBoxLayout:
        column = QVBoxLayout()
        column.setSpacing(SPACE // 2)
        row = QHBoxLayout()
        self.about = Message()
        self.to_sequence = button("Mend the &sequence", "Go to the Sequence page")
        self.to_sequence.clicked.connect(self.show_sequence)
        row.addWidget(self.about, 1)
        row.addWidget(self.to_sequence)
        column.addLayout(row)
        row = QHBoxLayout()
        self.result = Message()
        self.show_button = button("Show it among the &recordings", "Go to the Recordings page")
        self.show_button.clicked.connect(self._show_last)
        self.show_button.hide()
        row.addWidget(self.result, 1)
        row.addWidget(self.show_button)
        column.addLayout(row)
        self.log = QPlainTextEdit()
        self.log.setReadOnly(True)
        self.log.setMaximumBlockCount(1000)
        self.log.setFixedHeight(58)
        self.log.setPlaceholderText("Events of the run")
        self.log.setTabChangesFocus(True)
        column.addWidget(self.log)
        return column


def _read_model(path: Path) -> OverlayModel:
    actuator = load_actuator(path)
    name = load_model(path).name
    return OverlayModel(name or path.stem, actuator, path, read_text(path, "model file"))


_NUMBERS_SHOWN = {
    "command": (1e-3, 3),
    "monitor": (1e-3, 3),
    "current": (1e3, 3),
    "displacement": (1e3, 4),
}


_STOP = "⬣  STOP"
_STOP_AGAIN = "⬣  0 V NOW"


def _stop_button() -> QPushButton:
    """Large, red, and octagonal in its words: nothing else in the window looks like it."""
    made = QPushButton(_STOP)
    made.setObjectName("stop")
    made.setMinimumHeight(92)
    made.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
    font = QFont(made.font())
    font.setPointSize(26)
    font.setBold(True)
    made.setFont(font)
    made.setToolTip(
        "Ramp down to 0 V and end the run (Esc, or the space bar); again: 0 V at once, no ramp"
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
