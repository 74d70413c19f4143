"""Page Run: arm, start and watch a run, and stop it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QTimer, Signal, Slot
from PySide6.QtWidgets import (
    QCheckBox,
    QHBoxLayout,
    QLineEdit,
    QVBoxLayout,
    QWidget,
)

from dearig.acquisition.marks import RunMarks
from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.rigs import is_simulated
from dearig.analysis.hold import HoldPlan
from dearig.drivers.daqmx.watchdog import watchdog_text
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.high_voltage.status import OutputReading
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, button, label
from dearig.window.run.controls import RunControls
from dearig.window.run.display import RunDisplay
from dearig.window.run.hold_texts import answer_text, hold_text
from dearig.window.run.live import Live
from dearig.window.run.overlay_chooser import OverlayChooser
from dearig.window.run.runner import Play, RunEnd, Runner, RunRequest
from dearig.window.session.page import Page
from dearig.window.session.state import Session

__all__ = ["RunPage"]

_NUMBERS = 100  # ms between two updates of the readouts: faster ones cannot be read


class RunPage(Page):
    """Starts and stops runs, and shows them: ``runner`` plays, ``live`` has the curves."""

    title = "Run"
    at_start = True
    started = Signal(object)  #: what looks on at a run that has begun

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, parent)
        self.session = session
        self.runner = Runner(session, self)
        self.faults: tuple[str, ...] = ()  #: faults of the next simulated run
        self.live: Live | None = None
        self._played_hold: HoldPlan | None = None  # of the run that is shown
        self._runs = 0
        self._watched, self._watched_over = "", False  # name of a campaign's run that is shown
        self._run_number = -1  # of the status, for ``live``
        self._segments: tuple[tuple[str, float, float], ...] = ()
        self._last_recording: Path | None = None

        self.controls = RunControls(session, self.runner.status)
        self.badge = self.controls.badge
        self.arm_button = self.controls.arm_button
        self.start_button = self.controls.start_button
        self.stop_button = self.controls.stop_button
        self.blocked = self.controls.blocked
        self.overlays = OverlayChooser(session)
        self.display = RunDisplay(session)
        self.plots = self.display.plots
        self.alarms = self.display.alarms
        self._build()
        self._connect()
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
        if self.display.digest != preview.digest:
            self._refuse_unseen()
            return
        live, marks = Live(session.overlays, session.overlay_drive), RunMarks()
        request = RunRequest(
            preview.loaded, session.address, session.rig_file, session.rig_text, session.folder,
            operator=session.operator, film=session.film, notes=session.notes,
            seed=self._next_seed(), paced=self.paced.isChecked(), faults=self.faults,
            overlay=self._recorded_overlay(), marks=marks, waveform_digest=self.display.digest,
            feedback=None if session.hold is None else session.hold.feedback,
            rig_source=session.rig_source,
        )  # fmt: skip
        if not self.runner.start(request, live):
            return
        self._drop_live()
        self.live, self._segments = live, preview.segments
        self._run_number = self.runner.status.run_number
        self._played_hold = session.hold
        self.display.begin(live, preview, preview.loaded.sequence.name, marks)
        self.result.show_text("")
        self.show_button.hide()
        self._numbers.start()
        self.started.emit(live)
        session.set_running(True)
        self._refresh()

    @Slot(object, str)
    def watch(self, live: Live, name: str) -> None:
        """Show a run of a campaign, which ``live`` looks on at and the campaign closes."""
        self._end_watched("Ended", "the next run of the campaign has begun")
        self._drop_live()
        self.live, self._watched, self._segments = live, name, ()
        self._run_number = self.runner.status.run_number
        self._played_hold = None
        self.display.begin(live, None, name, None)
        self._forget_result()
        self._numbers.start()

    def _end_watched(self, headline: str, sentence: str, level: str = "info") -> None:
        """Show the end of a campaign's run, if one is shown that goes on."""
        if self._watched and not self._watched_over:
            self._watched_over = True
            self._update_readouts()
            self.display.end(headline, f"{self._watched}: {sentence}", level)

    def _drop_live(self) -> None:
        """Look on at no run any more; that of a campaign is closed by the campaign."""
        if self.live is not None and not self._watched:
            self.live.close()
        self.live, self._watched, self._watched_over = None, "", False

    def _refuse_unseen(self) -> None:
        """Disarm: what would be played is not what the plots show."""
        self.result.show_text(
            "Not started: the plots did not show what would have been played. Look at the plan "
            "that they show now, then arm it again.",
            "bad",
        )
        self.runner.disarm("disarmed: the plots did not show what would have been played")
        self.display.show_planned()

    @Slot()
    def stop(self) -> None:
        """Ramp down to 0 V; during the ramp, go to 0 V at once; before a run, disarm."""
        self.runner.stop("STOP on Run")

    def show_model(self, path: Path, place: int = 0) -> None:
        """Use the model in the file ``path`` as overlay model ``place``, 0 or 1."""
        self.overlays.load(path, place)

    def close_work(self) -> None:
        """Make the rig safe, and wait for every thread."""
        self.runner.stop("the end of the window")
        self.runner.wait()
        self._numbers.stop()
        self.display.forget_run()
        self.overlays.close_work()
        self._drop_live()

    @Slot(bool)
    def _arm(self, armed: bool) -> None:
        preview = self.session.preview
        playable = preview is not None and preview.playable
        if playable or not armed:
            self.runner.arm(armed)  # refused during a run, and while something blocks it
        self._refresh()

    # display

    @Slot(object)
    def _state_changed(self, state: HighVoltage) -> None:
        if state is HighVoltage.ARMED:
            self.display.show_planned()
            self._played_hold = None
        elif state is HighVoltage.BETWEEN:
            self._forget_result()  # a campaign goes on
            self._end_watched("Ended", self.runner.status.words)
        elif self.runner.playing is Play.RUN and not self.runner.status.live:
            self.display.view.ending()
        self._refresh()

    @Slot()
    def _refresh(self) -> None:
        session, running = self.session, self.runner.running
        preview = session.preview
        ready = preview is not None and preview.playable and not running and not session.blocks
        armed = self.runner.armed_for(Play.RUN)
        ready = ready and armed == self.runner.armed  # a campaign is not armed
        if not ready and armed:
            self.runner.disarm("disarmed: the plan is no longer that which was armed")
            armed = False
        self.arm_button.setEnabled(ready)
        self.arm_button.setChecked(armed)
        self.start_button.setEnabled(ready and armed and self.runner.status.may_start)
        for field in (self.operator, self.film, self.notes, self.paced):
            field.setEnabled(not running)
        self.paced.setVisible(is_simulated(session.address))
        self.blocked.show_text("\n".join(b.sentence for b in session.blocks.values()), "warn")
        self._describe_watchdog()
        self._describe_hold()
        if running:
            return
        self._describe_plan()
        self.to_sequence.setVisible(preview is not None and not preview.playable)

    def _describe_watchdog(self) -> None:
        """Show whether the card's hardware watchdog is wired; a simulated rig has no card."""
        session = self.session
        if not session.address.startswith("daqmx:"):
            self.watchdog.show_text("")
            return
        card = session.rig_file.card
        text = watchdog_text(card, simulated=None)
        if not (card.watchdog_s or card.i_have_no_watchdog):
            text += "; a run on a real card needs card.i_have_no_watchdog = true in the rig file"
        self.watchdog.show_text(f"Hardware watchdog: {text}", "" if card.watchdog_s else "warn")

    def _describe_hold(self) -> None:
        """Show the newest answer of the hold that plays or has played, else what is planned."""
        held, played = self.session.hold, self._played_hold
        shown = played is not None and (self.runner.running or held is played)
        answer = self.live.last_answer if shown and self.live is not None else None
        if answer is not None:
            self.hold_state.show_text(*answer_text(answer))
        else:
            self.hold_state.show_text("" if held is None else hold_text(held), "muted")

    def _describe_plan(self) -> None:
        preview = self.session.preview
        if preview is None:
            self.plan.show_text("Planning the sequence …", "muted")
        elif preview.plan is None:
            self.plan.show_text(preview.sentence, "bad")
        elif preview.loaded is not None:
            name = preview.loaded.sequence.name
            if preview.playable:
                self.plan.show_text("")  # the plots say what it is
            else:
                self.plan.show_text(
                    f"{name!r} is refused: {'; '.join(preview.plan.reasons)}", "bad"
                )

    @Slot()
    def _update_readouts(self) -> None:
        live = self.live
        if live is None:
            return
        if self._run_number != self.runner.status.run_number:  # of another rig or run
            self._numbers.stop()
            return
        now = live.now()
        self.display.take_events()
        if now is None:
            return
        self.controls.show_numbers(now)
        self.controls.show_room(live.newest_room(), now.samples / now.rate)
        failures = [
            f"{model.name}: {reason}"
            for model, reason in zip(self.session.overlays, now.words, strict=False)
            if reason
        ]
        self.overlay_failures.show_text("; ".join(failures), "warn")
        self._describe_hold()
        if self.runner.running:
            seconds, total = now.samples / now.rate, now.total / now.rate
            monitor = now.values.get("monitor", float("nan"))
            self.runner.status.show_reading(OutputReading(monitor, seconds, total, 1.0 / now.rate))
            playing = next((s[0] for s in self._segments if s[1] <= seconds < s[2]), "")
            self.controls.show_progress(now, playing)

    @Slot(object)
    def _run_ended(self, end: RunEnd) -> None:
        if end.play is not Play.RUN:
            self._end_watched(end.headline, end.sentence, _end_level(end))
            self._refresh()
            return
        self._update_readouts()
        self.controls.time_left.setText(end.headline)
        if end.result is not None:
            self.controls.progress.setValue(1000)
        self.controls.segment.show_text("")
        role = "good" if end.result is not None else "bad"
        named = end.path is None or str(end.path) in end.sentence
        where = "" if named else f" · recorded in {end.path}"
        self.result.show_text(f"{end.headline}: {end.sentence}{where}", role)
        self._last_recording = end.path
        self.show_button.setVisible(end.path is not None)
        self.display.end(end.headline, end.sentence, _end_level(end))
        self.session.set_running(False)
        self._refresh()
        if end.path is not None:
            self.session.recorded.emit(end.path)

    @Slot()
    def _forget_result(self) -> None:
        """Show no end of a run that another rig or run has replaced."""
        if not self.runner.running or self.runner.playing is not Play.RUN:
            self.result.show_text("")
            self.show_button.hide()

    @Slot()
    def _overlays_changed(self) -> None:
        self.controls.show_models()
        self.display.redraw()
        if self.live is not None:
            self.live.follow(self.session.overlays, self.session.overlay_drive)

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
        self.hold_state = Message()
        right.addWidget(self.hold_state)
        right.addWidget(self.display, 1)
        # each in the column itself: a layout of its own that has only a wrapped text in it asks for
        # the height of that text at its narrowest
        self.watchdog = Message()
        right.addWidget(self.watchdog)
        right.addLayout(self._plan_row())
        right.addLayout(self._result_row())
        outer.addLayout(right, 1)

    def _connect(self) -> None:
        session = self.session
        self.arm_button.clicked.connect(self._arm)
        self.start_button.clicked.connect(self.start)
        self.stop_button.pressed.connect(self.stop)
        self.runner.state_changed.connect(self._state_changed)
        self.runner.ended.connect(self._run_ended)
        self.runner.status.start_opened.connect(self._refresh)
        self.runner.status.acknowledged.connect(self.alarms.acknowledge)
        session.preview_changed.connect(self._refresh)
        session.preview_changed.connect(self.display.show_planned)
        session.outline_changed.connect(self.display.show_planned)
        session.sequence_changed.connect(self._refresh)
        session.sequence_changed.connect(self.display.show_planned)
        session.rig_changed.connect(self._forget_result)
        session.rig_changed.connect(self._refresh)
        session.rig_changed.connect(self.display.show_planned)
        self.display.mark_bar.left.connect(self.stop_button.setFocus)
        session.overlays_changed.connect(self._overlays_changed)
        session.blocks_changed.connect(self._refresh)
        session.hold_changed.connect(self._refresh)
        session.notes_changed.connect(self._refresh)  # a hold is of one film

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
        return row

    def _plan_row(self) -> QHBoxLayout:
        row = QHBoxLayout()
        self.plan = Message()
        self.to_sequence = button("Edit the &sequence", "Go to the Sequence page")
        self.to_sequence.clicked.connect(lambda: self.go_to.emit("Sequence"))
        row.addWidget(self.plan, 1)
        row.addWidget(self.to_sequence)
        return row

    def _result_row(self) -> QHBoxLayout:
        row = QHBoxLayout()
        self.result = Message()
        self.show_button = button("Show the &recording", "Go to the Recordings page")
        self.show_button.clicked.connect(self._show_last)
        self.show_button.hide()
        self.follow_button = button(
            "&Back to Follow", "What is learned from the run is shown there"
        )
        self.follow_button.clicked.connect(lambda: self.go_to.emit("Follow"))
        self.follow_button.hide()
        row.addWidget(self.result, 1)
        row.addWidget(self.show_button)
        row.addWidget(self.follow_button)
        return row


def _end_level(end: RunEnd) -> str:
    """Return the level of the end of a run in the list of alarms."""
    return "info" if end.result is not None or end.headline == "Stopped" else "fault"
