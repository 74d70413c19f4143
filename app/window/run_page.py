"""Page Run: arm, start and watch a run, and stop it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Signal, Slot
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QHBoxLayout,
    QLineEdit,
    QPlainTextEdit,
    QVBoxLayout,
    QWidget,
)

from dearig.acquisition.overlay import OverlayModel
from dearig.drivers.daqmx.watchdog import watchdog_words
from dearig.drivers.settings import ChannelSettings
from dearig.sim_backend.faults import FaultPlan
from dearig.window.channel_plots import ChannelPlots
from dearig.window.hv import HighVoltage
from dearig.window.live import Live
from dearig.window.overlay_chooser import OverlayChooser
from dearig.window.run_controls import RunControls
from dearig.window.run_plots import RunPlots
from dearig.window.running import RunEnd, Runner, RunRequest, simulated
from dearig.window.session import Session
from dearig.window.theme import SPACE
from dearig.window.widgets import Message, button, label

__all__ = ["RunPage"]

_FRAME = 16  # ms between two frames of the plots
_NUMBERS = 100  # ms between two updates of the readouts: faster ones cannot be read
_ARMED = 30_000  # ms after which a rig that was armed and not started is disarmed
_SPANS = {"last 2 s": 2.0, "last 5 s": 5.0, "last 10 s": 10.0, "last 30 s": 30.0,
          "last 60 s": 60.0, "whole run": None}  # fmt: skip
_NOT_DRAWN = (-1, None)


class RunPage(QWidget):
    """Starts and stops runs, and shows them: ``runner`` plays, ``live`` has the curves."""

    title = "Run"
    shortcut = "Ctrl+3"

    show_recording = Signal(Path)
    show_sequence = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.runner = Runner(self)
        self.faults: FaultPlan | None = None  #: faults of the next simulated run
        self.live: Live | None = None
        self._drawn: tuple[int, float | None] = _NOT_DRAWN  # revision and span of the last frame
        self._runs = 0
        self._segments: tuple[tuple[str, float, float], ...] = ()
        self._last_recording: Path | None = None
        self._channels: tuple[ChannelSettings, ...] = ()  # declared, of the run that is drawn

        self.controls = RunControls(session)
        self.badge = self.controls.badge
        self.arm_button = self.controls.arm_button
        self.start_button = self.controls.start_button
        self.stop_button = self.controls.stop_button
        self.blocked = self.controls.blocked
        self.overlays = OverlayChooser(session)
        self.plots = RunPlots(session)
        self.channel_plots = ChannelPlots(session)
        self._build()
        self._connect()
        self._disarm = QTimer(self, singleShot=True, interval=_ARMED)
        self._disarm.timeout.connect(self._disarmed)
        self._frames = QTimer(self, interval=_FRAME, timerType=Qt.TimerType.PreciseTimer)
        self._frames.timeout.connect(self._draw)
        self._numbers = QTimer(self, interval=_NUMBERS)
        self._numbers.timeout.connect(self._update_readouts)
        self._overlays_changed()
        self._refresh()

    # commands

    @Slot()
    def start(self) -> None:
        """Play and record the sequence; the second of the two steps."""
        session, preview = self.session, self.session.preview
        if preview is None or preview.loaded is None or not preview.playable:
            return
        live = Live(session.overlays, session.overlay_drive)
        request = RunRequest(
            preview.loaded, session.address, session.rig_file, session.rig_text, session.folder,
            operator=session.operator, film=session.film, notes=session.notes,
            seed=self._next_seed(), paced=self.paced.isChecked(), faults=self.faults,
            overlay=self._recorded_overlay(),
        )  # fmt: skip
        if not self.runner.start(request, live):
            return
        if self.live is not None:
            self.live.close()
        self.live, self._drawn, self._segments = live, _NOT_DRAWN, preview.segments
        self.plots.show_prediction(preview)
        self.plots.start()
        self._channels = session.rig_file.channel
        self.channel_plots.show_channels([(c.shown, c.unit) for c in self._channels])
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
        """Ramp down to 0 V; during the ramp, go to 0 V at once; before a run, disarm."""
        if self.runner.state is HighVoltage.RAMPING:
            self.runner.stop_without_ramp()
            return
        self.runner.stop()
        if not self.runner.running:
            self._disarmed()

    def show_model(self, path: Path, place: int = 0) -> None:
        """Use the model in the file ``path`` as overlay model ``place``, 0 or 1."""
        self.overlays.load(path, place)

    def close_work(self) -> None:
        """Make the rig safe, and wait for every thread."""
        self.runner.stop()
        self.runner.wait()
        self._frames.stop()
        self._numbers.stop()
        self._disarm.stop()
        self.overlays.close_work()
        if self.live is not None:
            self.live.close()
            self.live = None

    @Slot(bool)
    def _arm(self, armed: bool) -> None:
        preview = self.session.preview
        refused = preview is None or not preview.playable or bool(self.session.blocks)
        if self.runner.running or (armed and refused):
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

    # display

    @Slot(object)
    def _state_changed(self, state: HighVoltage) -> None:
        self.session.set_armed(state is HighVoltage.ARMED)
        self.controls.show_state(state, self._simulated_label())
        self.controls.show_stop(ramping=state is HighVoltage.RAMPING)

    def _simulated_label(self) -> str:
        return "simulated" if simulated(self.session.address) else ""

    @Slot()
    def _sequence_changed(self) -> None:
        if self.runner.state is HighVoltage.ARMED:
            self._disarmed()  # another sequence was armed
        self._refresh()

    @Slot()
    def _refresh(self) -> None:
        session, running = self.session, self.runner.running
        preview = session.preview
        ready = preview is not None and preview.playable and not running and not session.blocks
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
        self.blocked.show_text("\n".join(b.sentence for b in session.blocks.values()), "warn")
        self._describe_watchdog()
        if running:
            return
        self.controls.show_state(self.runner.state, self._simulated_label())
        self._describe_plan()
        self.to_sequence.setVisible(preview is not None and not preview.playable)
        if preview is not None and self.live is None:
            self.plots.show_prediction(preview)

    def _describe_watchdog(self) -> None:
        """Show whether the card's hardware watchdog is wired; a simulated rig has no card."""
        session = self.session
        if not session.address.startswith("daqmx:"):
            self.watchdog.show_text("")
            return
        card = session.rig_file.card
        words = watchdog_words(card, simulated=None)
        if not (card.watchdog_s or card.i_have_no_watchdog):
            words += "; a run on a real card needs card.i_have_no_watchdog = true in the rig file"
        self.watchdog.show_text(f"Hardware watchdog: {words}", "" if card.watchdog_s else "warn")

    def _describe_plan(self) -> None:
        session, preview = self.session, self.session.preview
        if preview is None:
            self.plan.show_text("Planning the sequence …", "muted")
        elif preview.plan is None:
            self.plan.show_text(preview.sentence, "bad")
        elif preview.loaded is not None:
            name, seconds = preview.loaded.sequence.name, preview.plan.duration
            if preview.playable:
                rate = preview.plan.rate
                self.plan.show_text(
                    f"{name}: {seconds:.1f} s at {rate:g} Hz on {session.address}", ""
                )
            else:
                self.plan.show_text(
                    f"{name!r} is refused: {'; '.join(preview.plan.reasons)}", "bad"
                )

    @Slot()
    def _draw(self) -> None:
        live = self.live
        now = None if live is None else live.now()
        if live is None or now is None or not self.isVisible():
            return
        frame = (now.revision, self.plots.window)
        if frame == self._drawn:
            return
        self._drawn = frame
        end = now.samples / now.rate
        self.plots.draw(live, end)
        names = [channel.name for channel in self._channels]
        self.channel_plots.draw(live, names, self.plots.window, end)

    @Slot()
    def _update_readouts(self) -> None:
        live = self.live
        if live is None:
            return
        now = live.now()
        for event in live.take_events():
            at = f"{event.sample / now.rate:8.2f} s" if now is not None else ""
            self.log.appendPlainText(f"{at}  {event.level}: {event.message}")
        if now is None:
            return
        self.controls.show_numbers(now)
        failures = [
            f"{model.name}: {reason}"
            for model, reason in zip(self.session.overlays, now.words, strict=False)
            if reason
        ]
        self.overlay_failures.show_text("; ".join(failures), "warn")
        if self.runner.running:
            seconds = now.samples / now.rate
            left = max(0.0, now.total / now.rate - seconds)
            self.controls.time_left.setText(f"{left:.1f} s left")
            self.controls.progress.setValue(round(1000 * now.samples / max(now.total, 1)))
            playing = next((s for s in self._segments if s[1] <= seconds < s[2]), None)
            self.controls.segment.setText(f"playing: {playing[0]}" if playing else "")
            kilovolts = now.values.get("monitor", float("nan")) * 1e-3
            detail = f"{kilovolts:.2f} kV  {self._simulated_label()}".rstrip()
            self.controls.show_state(self.runner.state, detail)

    @Slot(object)
    def _run_ended(self, end: RunEnd) -> None:
        self._update_readouts()
        self.controls.show_state(self.runner.state, self._simulated_label())
        self.controls.time_left.setText(end.headline)
        if end.result is not None:
            self.controls.progress.setValue(1000)
        self.controls.segment.setText("")
        role = "good" if end.result is not None else "bad"
        named = end.path is None or str(end.path) in end.sentence
        where = "" if named else f" · recorded in {end.path}"
        self.result.show_text(f"{end.headline}: {end.sentence}{where}", role)
        self._last_recording = end.path
        self.show_button.setVisible(end.path is not None)
        self.session.set_running(False)
        self._refresh()
        if end.path is not None:
            self.session.recorded.emit(end.path)

    @Slot()
    def _overlays_changed(self) -> None:
        self.controls.show_models()
        self._drawn = _NOT_DRAWN
        if self.live is not None:
            self.live.follow(self.session.overlays, self.session.overlay_drive)

    @Slot()
    def _span_changed(self) -> None:
        self.plots.window = self.span.currentData()
        self._drawn = _NOT_DRAWN
        self._draw()

    @Slot()
    def _show_last(self) -> None:
        if self._last_recording is not None:
            self.show_recording.emit(self._last_recording)

    def _recorded_overlay(self) -> OverlayModel | None:
        """Return the model whose output is recorded: the first, where the command drives it."""
        first = next(iter(self.session.overlays), None)
        return first if self.session.overlay_drive == "command" else None

    def _next_seed(self) -> int:
        """Return a seed for the simulated noise, another one for each run."""
        self._runs += 1
        return self._runs - 1

    # layout

    def _build(self) -> None:
        outer = QHBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.setSpacing(SPACE)
        outer.addWidget(self.controls)
        right = QVBoxLayout()
        right.setSpacing(SPACE // 2)
        right.addLayout(self._metadata_row())
        right.addLayout(self._overlay_row())
        self.overlay_failures = Message()
        right.addWidget(self.overlays.message)
        right.addWidget(self.overlay_failures)
        right.addWidget(self.plots, 1)
        right.addWidget(self.channel_plots)
        right.addLayout(self._end_row())
        outer.addLayout(right, 1)

    def _connect(self) -> None:
        session = self.session
        self.arm_button.clicked.connect(self._arm)
        self.start_button.clicked.connect(self.start)
        self.stop_button.clicked.connect(self.stop)
        self.runner.state_changed.connect(self._state_changed)
        self.runner.ended.connect(self._run_ended)
        session.preview_changed.connect(self._refresh)
        session.sequence_changed.connect(self._sequence_changed)
        session.rig_changed.connect(self._refresh)
        session.overlays_changed.connect(self._overlays_changed)
        session.blocks_changed.connect(self._refresh)

    def _metadata_row(self) -> QHBoxLayout:
        session = self.session
        row = QHBoxLayout()
        self.operator = QLineEdit(session.operator)
        self.film = QLineEdit(session.film)
        self.notes = QLineEdit(session.notes)
        for words, field, tip, share in (
            ("&Operator", self.operator, "Name of the operator; kept in the recording", 2),
            ("&Film", self.film, "Name of the film on the rig; kept in the recording", 2),
            ("&Notes", self.notes, "Any other remarks; kept in the recording", 5),
        ):
            caption = label(words)
            caption.setBuddy(field)
            field.setToolTip(tip)
            row.addWidget(caption)
            row.addWidget(field, share)
            field.textChanged.connect(self._metadata_changed)
        self.paced = QCheckBox("Real &time")
        self.paced.setChecked(True)
        self.paced.setToolTip("Run the simulated rig in real time; otherwise as fast as it can")
        row.addWidget(self.paced)
        return row

    @Slot()
    def _metadata_changed(self) -> None:
        if not self.runner.running:
            self.session.set_notes(self.operator.text(), self.film.text(), self.notes.text())

    def _overlay_row(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.addWidget(self.overlays, 3)
        row.addStretch(1)
        self.span = QComboBox()
        for words, seconds in _SPANS.items():
            self.span.addItem(f"Show {words}", seconds)
        self.span.setCurrentIndex(2)
        self.span.setToolTip("Time span of the plots, in s")
        self.span.setAccessibleName("Time span of the plots")
        self.span.activated.connect(self._span_changed)
        row.addWidget(self.span)
        return row

    def _end_row(self) -> QVBoxLayout:
        column = QVBoxLayout()
        column.setSpacing(SPACE // 2)
        row = QHBoxLayout()
        self.plan = Message()
        self.watchdog = Message()
        column.addWidget(self.watchdog)
        self.to_sequence = button("Edit the &sequence", "Go to the Sequence page")
        self.to_sequence.clicked.connect(self.show_sequence)
        row.addWidget(self.plan, 1)
        row.addWidget(self.to_sequence)
        column.addLayout(row)
        row = QHBoxLayout()
        self.result = Message()
        self.show_button = button("Show the &recording", "Go to the Recordings page")
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
        self.log.setAccessibleName("Events of the run")
        self.log.setTabChangesFocus(True)
        column.addWidget(self.log)
        return column
