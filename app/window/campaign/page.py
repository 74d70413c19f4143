"""Page Campaign: many runs from a plan, armed once, played one after the other.

The engine and its journal are those of ``dearig campaign``; the page shows what the journal says.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.acquisition.rig_source import SOURCE
from dearig.acquisition.rigs import is_simulated
from dearig.acquisition.run import RunOptions
from dearig.batch.ask import ask
from dearig.batch.queue import DONE, WAITING, Queue
from dearig.errors import InputError
from dearig.recording.result_folder import numbered_folder
from dearig.report.pages.campaign import duration_text
from dearig.units import runs_text
from dearig.window.campaign.controls import CampaignControls
from dearig.window.campaign.plan import (
    OpenedCampaign,
    PlanEditor,
    PlanSurvey,
    Surveyor,
    SurveyRequest,
    open_campaign,
    with_requests,
    write_report,
)
from dearig.window.campaign.present_run import PresentRun
from dearig.window.campaign.table import CampaignTable, QueueRows, rows_of_plan
from dearig.window.campaign.texts import arming_block, counted, crash_text, plan_text
from dearig.window.campaign.thread import CampaignRequest, CampaignThread
from dearig.window.documents import dialogs
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.jobs.background import Background
from dearig.window.jobs.job_controls import result_side, splitter
from dearig.window.jobs.worker import Worker
from dearig.window.kit.browser import open_in_browser
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, button, card, label
from dearig.window.run.live import Live
from dearig.window.run.page import RunPage
from dearig.window.run.runner import Play, RunEnd, Runner
from dearig.window.session.layout_state import remember
from dearig.window.session.page import Page, Pages
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile

__all__ = ["CampaignPage"]

_LEFT = 330  # px, default width of the left column
_ROWS = [2000, 3000]  # shares of the table, and of the curves of a run
_BLOCK = "campaign"  # of the session
#: Entries of the journal after which a campaign may be between two runs.
_BETWEEN = ("recorded", "ended", "not-started", "request")
_PLANNED = "the runs are planned, and the first one starts automatically"
_NEXT = "the next run starts automatically"
_PAUSED = "the campaign is paused"


class CampaignPage(Page):
    """Plans, arms and plays campaigns with ``runner``, and continues them."""

    title = "Campaign"
    at_start = True
    edits = "plan"
    watch_run = Signal(object, str)  #: what looks on at a run that has begun, and its name

    def __init__(self, session: Session, runner: Runner, parent: QWidget | None = None) -> None:
        super().__init__(session, parent)
        self._session = session
        self._runner = runner
        self.faults: tuple[str, ...] = ()  #: faults of the next simulated campaign
        self._worker = Worker(self)
        self._folder: Path | None = None  # of the campaign that was begun
        self._queue = Queue()  # its state, as its journal says
        self._soon = self._queue  # with the requests that it has not taken yet
        self._survey: PlanSurvey | None = None  # of the present text
        self._sizes: dict[str, int] = {}
        self._rows = QueueRows()
        self._thread: CampaignThread | None = None
        self._stage = ""

        self.surveyor = Surveyor(self)
        self.surveyor.unfolded.connect(self._unfolded)
        self.surveyor.done.connect(self._surveyed)
        self.surveyor.progressed.connect(self._survey_progressed)
        self._opening = Background(self)
        self._opening.done.connect(self._opened)
        self._opening.failed.connect(self._fail)

        self.split = splitter(
            Qt.Orientation.Horizontal, self._make_plan(), self._make_runs(), growing=1
        )
        self.reset_layout()
        remember(self.split, session.settings, "campaign/columns")
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.addWidget(self.split)
        self._connect()
        self._refresh()

    @classmethod
    def make(cls, session: Session, pages: Pages) -> Self:
        """Return the page; it plays with the runner of the page Run, which shows its runs."""
        run = pages.page(RunPage)
        page = cls(session, run.runner)
        page.watch_run.connect(run.watch)
        return page

    def restore(self, text: str, file: EditedFile) -> None:
        """Replace the plan by the unsaved one of an earlier window."""
        self.plan.restore(text, file)

    # what the page offers

    @property
    def folder(self) -> Path | None:
        """Folder of the campaign that was begun or opened."""
        return self._folder

    @property
    def queue(self) -> Queue:
        """State of the campaign that was begun."""
        return self._queue

    @property
    def ready(self) -> bool:
        """True where the runs that wait are surveyed and can be armed, apart from the rig."""
        return not self._arming_block()

    def open_campaign(self, folder: Path) -> None:
        """Show the campaign in ``folder``, to continue it."""
        self._opening.start(lambda: open_campaign(folder))

    @Slot()
    def start(self) -> None:
        """Play the armed batch; the second of the two steps."""
        session, found = self._session, self._survey
        if (
            found is None
            or found.campaign is None
            or found.forecast is None
            or self._arming_block()
        ):
            return
        resume = self._folder is not None
        try:
            folder = self._folder or numbered_folder(session.folder, "campaign")
            if self._soon.paused:  # who starts it wants it to go on
                ask(folder, [("continue", "")], session.operator)
        except InputError as error:
            self._fail(str(error))
            return
        options = RunOptions(
            session.rig_text, session.operator, session.film, session.notes,
            paced=self.controls.paced.isChecked(), faults=self.faults,
            provenance={SOURCE: session.rig_source},
        )  # fmt: skip
        arming = self.controls.arming(bool(self._queue.halted), found.forecast.digests)
        thread = CampaignThread(
            CampaignRequest(
                found.campaign, session.address, session.rig_file, folder, options, arming, resume
            ),
            session.overlays, session.overlay_drive, self._runner,
        )  # fmt: skip
        thread.began.connect(self._run_began)
        thread.noted.connect(self._noted)
        thread.stage.connect(self._show_stage)
        if not self._runner.begin(thread, Play.CAMPAIGN):
            thread.deleteLater()
            return
        self._thread, self._folder = thread, folder
        self.message.show_text("")
        self._runner.status.set_between(_PLANNED)
        session.block(_BLOCK, "a campaign goes on: see the page Campaign")
        session.set_running(True)
        self.present_run.begin()
        self._refresh()

    def wish(self, *requests: tuple[str, str]) -> None:
        """Ask for ``requests`` as ``dearig campaign-queue`` does: kinds, names of runs or ""."""
        if self._folder is None:
            return
        try:
            ask(self._folder, requests, self._session.operator)
        except InputError as error:
            self._fail(str(error))
            return
        self._show_queue()

    @Slot()
    def reset_layout(self) -> None:
        """Give every part its default size."""
        self.split.setSizes([_LEFT, 860])

    def close_work(self) -> None:
        """End all threads and processes; the runner is at rest."""
        self.present_run.end()
        self.surveyor.close()
        self._opening.close()
        self._worker.close()
        self.plan.close_work()

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802
        """Survey the plan when the page is seen first."""
        super().showEvent(event)
        if self._survey is None and not self.surveyor.waits:
            self._ask_survey(soon=False)

    # plan

    @Slot()
    def _survey_again(self) -> None:
        """Disarm, and survey the runs again: plan, rig or film have changed."""
        self._disarm()
        self._survey = None
        if self.isVisible():
            self._ask_survey(soon=True)
        self._refresh()

    def _request(self) -> SurveyRequest:
        """Return what is to be surveyed now."""
        session = self._session
        return SurveyRequest(
            self.plan.toml, self.plan.folder, session.address, session.rig_file, session.rig_text,
            session.film, self._folder or session.folder, begun=self._folder is not None,
        )  # fmt: skip

    def _ask_survey(self, soon: bool) -> None:
        if not self._session.running:
            self._survey = None
            self.surveyor.ask(self._request(), soon)

    @Slot(object)
    def _unfolded(self, found: PlanSurvey) -> None:
        if self._folder is None and found.request.toml == self.plan.toml and self._survey is None:
            self._show_plan(found)

    @Slot(float)
    def _survey_progressed(self, part: float) -> None:
        if self._survey is None:
            self.summary.show_text(f"Checking the runs … {part:.0%}", "muted")

    @Slot(object)
    def _surveyed(self, found: PlanSurvey) -> None:
        if found.request != self._request():  # what is shown has changed meanwhile
            if self.isVisible() and not self.surveyor.waits:
                self._ask_survey(soon=False)
            return
        self._survey = found
        if found.campaign is not None and found.forecast is not None:
            self._sizes = dict(
                zip((r.name for r in found.campaign.runs), found.forecast.sizes, strict=True)
            )
        if self._folder is None:
            self._show_plan(found)
            if found.forecast is not None:
                self.controls.propose(len(found.forecast.durations), found.forecast.seconds)
        else:
            self._show_queue()
        self._refresh()

    def _show_plan(self, found: PlanSurvey) -> None:
        campaign, forecast = found.campaign, found.forecast
        if campaign is None:
            self.table.show_rows([])
            self.headline.setText("The plan has a fault")
            self.summary.show_text("")
            return
        self.table.show_rows(rows_of_plan(campaign, forecast))
        self.headline.setText(f"{campaign.name}: {runs_text(len(campaign.runs))}")
        self.summary.show_text(plan_text(found), "muted")

    # queue

    @Slot(object)
    def _opened(self, found: OpenedCampaign) -> None:
        self._folder, self._queue, self._rows = found.folder, found.queue, QueueRows()
        self._soon = found.queue
        self.message.show_text(crash_text(found.queue) if found.status == "killed" else "", "warn")
        self.controls.forget_proposal()
        self._sizes = {}
        self.plan.restore(
            found.toml,
            EditedFile("plan", found.toml, found.folder / "plan.toml", found.plan_folder),
        )
        self._show_queue()

    @Slot(object)
    def _run_began(self, live: Live) -> None:
        """Show a run that has begun, here and on the page Run."""
        run = self._queue.running
        opens = self.present_run.isHidden()
        self.present_run.follow(live)
        if opens:
            self.rows.setSizes(_ROWS)
        self.watch_run.emit(live, "a run of the campaign" if run is None else run.name)

    @Slot(object, bool)
    def _noted(self, entries: Sequence[Mapping[str, Any]], older: bool) -> None:
        """Take entries of the journal; the ``older`` ones are of earlier sessions."""
        status = self._runner.status
        if older:
            self._queue = Queue()
        for entry in entries:
            self._queue.take(entry)
            if older:
                continue
            if entry["event"] == "started":
                self.table.show_run(entry["run"])
                stopping = self._thread is not None and self._thread.interrupts.asked()
                status.set_phase(HighVoltage.RAMPING if stopping else HighVoltage.ON)
                continue
            run = self._queue.running
            if entry["event"] in _BETWEEN and (run is None or run.recorded):
                status.set_between(_PAUSED if self._queue.paused else _NEXT)
        if self._queue.runs:
            self._show_queue()

    def _show_queue(self) -> None:
        try:
            if self._folder is not None:
                self._soon = with_requests(self._queue, self._folder)
        except InputError as error:
            self._fail(str(error))
        queue = self._soon
        is_played = self._thread is not None
        self.table.show_rows(self._rows.of(queue, self._sizes, is_played))
        self.headline.setText(counted(queue))
        left = f"{duration_text(queue.time_left)} are left" if queue.waiting else "No run waits"
        if not is_played and queue.running is not None:
            left = f"Run {queue.running.name} was cut off · {left}"
        soon = "ends" if queue.ending else "pauses" if queue.paused else ""
        asked = f" · {soon} after this run" if soon and self._queue.running is not None else ""
        where = "" if self._folder is None else f" · {self._folder}"
        self.summary.show_text(f"{left}{asked}{where}", "muted")
        if not self._session.running:
            self.controls.propose(len(queue.waiting), queue.time_left)
        self._refresh()

    @Slot(str)
    def _show_stage(self, stage: str) -> None:
        self._stage = stage
        self._show_present()

    def _show_present(self) -> None:
        run, stage = self._queue.running, self._stage
        if self._thread is None:
            self.controls.present.show_text("")
        elif run is not None and self._runner.status.state is HighVoltage.UNKNOWN:
            self.controls.present.show_text(f"Output unknown, the run is ending · {run.name}")
        elif run is not None:
            self.controls.present.show_text(f"{run.name} · {stage.partition(', ')[2] or stage}")
        else:
            self.controls.present.show_text(stage[:1].upper() + stage[1:])

    @Slot(object)
    def _ended(self, end: RunEnd) -> None:
        thread, folder = self._thread, self._folder
        if end.play is not Play.CAMPAIGN or thread is None or folder is None:
            return
        self.present_run.end()
        self._thread, self._stage = None, ""
        if not self._queue.runs:  # nothing was begun
            with contextlib.suppress(OSError):
                folder.rmdir()
            self._folder = None
        finished = self._queue.status == "complete"
        role = "good" if finished else "bad" if end.alarming or self._queue.halted else "warn"
        halted = bool(self._queue.halted)  # shown where a person says what was seen
        self.message.show_text("" if halted else f"{end.headline}: {end.sentence}.", role)
        self.controls.forget_proposal()
        self._session.unblock(_BLOCK)
        self._session.set_running(False)
        if self._folder is not None and self._queue.runs:
            self._fix_plan()
            self._show_queue()
        self.controls.show_numbers(None)
        self._show_present()
        last = [run for run in self._queue.listed if run.state == DONE and run.recording]
        if last and self._folder is not None:
            self._session.recorded.emit(self._folder / last[-1].recording)
        self._ask_survey(soon=False)
        self._refresh()

    def _fix_plan(self) -> None:
        """Show the plan of the folder, which a campaign keeps from its begin on."""
        survey = self._survey
        if survey is not None and self._folder is not None:
            toml, path = survey.request.toml, self._folder / "plan.toml"
            self.plan.restore(toml, EditedFile("plan", toml, path, survey.request.folder))

    # buttons

    @Slot(bool)
    def _arm(self, armed: bool) -> None:
        if not (armed and self._arming_block()):
            self._runner.arm(armed, Play.CAMPAIGN)
        self._refresh()

    @Slot()
    def _disarm(self) -> None:
        if self._runner.armed_for(Play.CAMPAIGN):
            self._runner.arm(False, Play.CAMPAIGN)

    @Slot()
    def _batch_changed(self) -> None:
        self._disarm()
        self._refresh()

    @Slot()
    def _play_next(self) -> None:
        names = [row.name for row in self.table.chosen if row.state == WAITING]
        # the last one that is put first is played first
        self.wish(*(("first", name) for name in reversed(names)))

    @Slot()
    def _leave_out(self) -> None:
        names = [row.name for row in self.table.chosen if row.state == WAITING]
        if names and dialogs.ask(
            self, self._session, "Leave out runs",
            f"Leave {runs_text(len(names))} out of the campaign? They cannot be put back.",
            "Leave out", "Cancel",
        ):  # fmt: skip
            self.wish(*(("skip", name) for name in names))

    @Slot()
    def _new(self) -> None:
        """Leave the campaign in its folder, and begin a new one with its plan as a start."""
        self._disarm()
        survey_folder, toml = self.plan.folder, self.plan.toml
        self._folder, self._queue, self._sizes = None, Queue(), {}
        self._rows = QueueRows()
        self._soon = self._queue
        self.table.show_rows([])
        self.headline.setText("No runs yet")
        self.summary.show_text("")
        self.message.show_text("")
        self.controls.forget_proposal()
        self.controls.show_numbers(None)
        self.plan.restore(toml, EditedFile("plan", toml, None, survey_folder))

    @Slot()
    def _ask_open(self) -> None:
        folder = dialogs.choose_folder(
            self, self._session, "Continue a campaign", self._session.folder
        )
        if folder is not None and (self._folder is not None or self.plan.files.confirm_discard()):
            self.open_campaign(folder)

    @Slot()
    def _report(self) -> None:
        if self._folder is not None:
            job = self._worker.submit(write_report, self._folder)
            job.finished.connect(self._report_written)
            job.failed.connect(self._fail)
            self._job = job

    @Slot(object)
    def _report_written(self, path: Path) -> None:
        open_in_browser(path, self.message)

    @Slot(str)
    def _show_recording(self, name: str) -> None:
        if self._folder is not None and not self._session.running:
            self.show_recording.emit(self._folder / name)

    @Slot(str)
    def _fail(self, sentence: str) -> None:
        self.message.show_text(f"{sentence[:1].upper()}{sentence[1:]}.")

    @Slot(str)
    def _operator_changed(self, name: str) -> None:
        session = self._session
        if name != session.operator:
            session.set_notes(name, session.film, session.notes)

    @Slot()
    def _notes_changed(self) -> None:
        session, survey = self._session, self._survey
        if self.controls.operator.text() != session.operator:
            self.controls.operator.setText(session.operator)
        if survey is not None and survey.request.film != session.film:
            self._survey_again()  # the limits hold for one film

    # state

    def _arming_block(self) -> str:
        """Return why the batch cannot be armed, "" where it can, apart from the rig's blocks."""
        begun, said = self._folder is not None, self.controls.seen.text()
        return arming_block(self._session, self._survey, self._soon, begun, said)

    @Slot()
    def _refresh(self) -> None:
        session, runner, controls = self._session, self._runner, self.controls
        running = runner.playing is Play.CAMPAIGN
        arming_block = "" if session.running else self._arming_block()
        armed = runner.armed_for(Play.CAMPAIGN)
        ready = not (session.running or arming_block or session.blocks)
        if armed and not ready:
            runner.arm(False, Play.CAMPAIGN)
            return  # the change of the state comes here again
        controls.arm.setEnabled(ready and armed == runner.armed)
        controls.arm.setChecked(armed)
        controls.start.setEnabled(ready and armed and runner.status.may_start)
        controls.set_editable(not session.running)
        controls.paced.setVisible(is_simulated(session.address))
        controls.show_halt("" if running else self._queue.halted)
        blocks = [b.sentence for key, b in session.blocks.items() if key != _BLOCK]
        if session.running and not running:
            blocks.append("a run goes on: see the page Run")
        elif armed != runner.armed:
            blocks.append("a run is armed: see the page Run")
        words = [arming_block] if arming_block and self._survey is not None else []
        controls.blocked.show_text(
            "\n".join(f"{w[:1].upper()}{w[1:]}." for w in [*words, *blocks]), "warn"
        )
        queue, begun = self._soon, self._folder is not None
        chosen = [row for row in self.table.chosen if row.state == WAITING]
        controls.first.setEnabled(begun and bool(chosen))
        controls.skip.setEnabled(begun and bool(chosen))
        controls.pause.setEnabled(running and not queue.paused and not queue.ending)
        controls.go_on.setEnabled(running and queue.paused)
        controls.end.setEnabled(running and not queue.ending)
        self.plan.set_fixed(begun or running)
        self.new_button.setEnabled(begun and not running)
        self.open_button.setEnabled(not session.running)
        self.report_button.setEnabled(begun and not running)
        self._show_present()

    # layout

    def _connect(self) -> None:
        session, controls = self._session, self.controls
        self.plan.changed.connect(self._survey_again)
        self.table.chosen_changed.connect(self._refresh)
        self.table.opened.connect(self._show_recording)
        controls.changed.connect(self._batch_changed)
        controls.operator_changed.connect(self._operator_changed)
        controls.operator.setText(session.operator)
        controls.arm.clicked.connect(self._arm)
        controls.start.clicked.connect(self.start)
        for step in (controls.arm, controls.start):
            step.dropped.connect(session.message)
        self._runner.status.start_opened.connect(self._refresh)
        self._runner.status.changed.connect(self._show_present)
        controls.pause.clicked.connect(lambda: self.wish(("pause", "")))
        controls.go_on.clicked.connect(lambda: self.wish(("continue", "")))
        controls.end.clicked.connect(lambda: self.wish(("end", "")))
        controls.first.clicked.connect(self._play_next)
        controls.skip.clicked.connect(self._leave_out)
        self._runner.state_changed.connect(self._refresh)
        self._runner.ended.connect(self._ended)
        session.rig_changed.connect(self._survey_again)
        session.notes_changed.connect(self._notes_changed)
        session.running_changed.connect(self._refresh)
        session.blocks_changed.connect(self._refresh)

    def _make_plan(self) -> QWidget:
        self.plan = PlanEditor(self._session)
        inner = QVBoxLayout()
        inner.addWidget(self.plan, 1)
        frame = card(inner)
        frame.setMinimumWidth(280)
        return frame

    def _make_runs(self) -> QWidget:
        self.headline = label("No runs yet", "title")
        self.new_button = button(
            "&New", "Begin a new campaign with this plan; the present one stays"
        )
        self.new_button.clicked.connect(self._new)
        self.open_button = button(
            "&Continue …", "Open the folder of a campaign, to continue it where it stands"
        )
        self.open_button.clicked.connect(self._ask_open)
        self.report_button = button("Open re&port", "Write the report and open it in the browser")
        self.report_button.clicked.connect(self._report)
        self.summary = Message()
        self.message = Message()
        self.table = CampaignTable(self._session)
        self.controls = CampaignControls(self._runner.status)
        self.present_run = PresentRun(self._session, self._runner.status, self.controls)
        self.rows = splitter(Qt.Orientation.Vertical, self.table, self.present_run, growing=0)
        return result_side(
            self.headline, (self.open_button, self.new_button, self.report_button),
            (self.summary, self.message),
            self.rows,
            self.controls,
        )  # fmt: skip
