"""Page Follow: make the film follow a displacement and learn from run to run, or hold one.

The page proposes voltages and plays none. Each goes to the page Run as a sequence, where it is
planned, armed and started as any other; when its recording is there, the page learns from it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QFormLayout,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.track_target import WITHIN
from dearig.analysis.tracking import TrackedRun
from dearig.config.toml_input import read_text
from dearig.errors import InputError
from dearig.recording.result_folder import numbered_folder
from dearig.report.pages.track import (
    limits_table,
    runs_table,
    track_headline,
)
from dearig.report.text.tables import Table
from dearig.window.follow.hold_panel import HoldPanel
from dearig.window.follow.jobs import (
    FollowRequest,
    PlayedRun,
    TrackingState,
    begin_following,
    learn_from,
    write_report,
)
from dearig.window.follow.model_choice import ModelChoice
from dearig.window.follow.plots import ErrorPlot, FollowPlots
from dearig.window.follow.target import TargetEditor
from dearig.window.jobs.job_controls import JobControls, result_side, splitter
from dearig.window.jobs.worker import Job, Worker
from dearig.window.kit.browser import open_in_browser
from dearig.window.kit.number_box import NumberBox
from dearig.window.kit.report_page import ReportPage
from dearig.window.kit.report_table import ReportTable
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, button, card, label
from dearig.window.run.page import RunPage
from dearig.window.session.layout_state import remember
from dearig.window.session.page import Page, Pages
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile

__all__ = ["FollowPage"]

_LEFT = 400  # px, default width of the left column
_COLUMNS = [520, 340]  # px, of the words and of the error from run to run
_WITHIN_MAX = 1000.0  # um


class FollowPage(Page):
    """Proposes the runs of a target one after another, and learns from their recordings.

    ``waits`` is True while the run of a shown sequence is awaited.
    """

    title = "Follow"
    edits = "target"
    waits = Signal(bool)

    def __init__(
        self, session: Session, parent: QWidget | None = None, worker: Worker | None = None
    ) -> None:
        super().__init__(session, parent)
        self._session = session
        self._worker = worker or Worker(self)
        self._job: Job | None = None
        self._followed: TrackingState | None = None
        self._folder: Path | None = None  # of the sequences that were shown
        self._awaited = ""  # TOML of the sequence that was shown on the page Run
        self._recorded_meanwhile: Path | None = None  # while a job went on

        self.split = splitter(
            Qt.Orientation.Horizontal, self._make_inputs(), self._make_results(), growing=1
        )
        self.hold = HoldPanel(session, self._worker)
        self.hold.use_model.connect(self.use_model)
        self.hold.play_hold.connect(self.play_hold)
        self.hold.waits.connect(self.waits)
        self.modes = QTabWidget()
        self.modes.setDocumentMode(True)
        self.modes.addTab(self._padded(self.split), "Follow a path")
        self.modes.addTab(self.hold, "Hold a displacement")
        self.reset_layout()
        remember(self.split, session.settings, "follow/columns")
        remember(self.rows, session.settings, "follow/rows")
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE // 2, SPACE, SPACE)
        outer.addWidget(self.modes)

        self.target.changed.connect(self._refresh)
        self.model.changed.connect(self._refresh)
        self.within.valueChanged.connect(self._refresh)
        self.nearest.toggled.connect(self._refresh)
        session.rig_changed.connect(self._refresh)
        session.running_changed.connect(self._refresh)
        session.recorded.connect(self._recorded)
        self._refresh()

    @classmethod
    def make(cls, session: Session, pages: Pages) -> Self:
        """Return the page; it observes the runs of the page Run."""
        page, run = cls(session), pages.page(RunPage)
        run.started.connect(page.hold.watch)
        run.runner.ended.connect(page.hold.run_ended)
        page.waits.connect(run.follow_button.setVisible)
        return page

    def restore(self, text: str, file: EditedFile) -> None:
        """Replace the target by the unsaved one of an earlier window."""
        self.target.restore(text, file)

    # what the page offers

    @property
    def followed(self) -> TrackingState | None:
        """The target that is followed, and its runs."""
        return self._followed

    def request(self) -> FollowRequest:
        """Return what the inputs ask for."""
        session = self._session
        return FollowRequest(
            self.target.toml, self.target.folder, self.model.path, session.address,
            session.rig_file, self.within.value() * 1e-6,
        )  # fmt: skip

    @Slot()
    def compute(self) -> None:
        """Compute the voltage of the first run; earlier runs are no longer shown."""
        if self._job is None:
            job = self._worker.submit(begin_following, self.request(), self._session.film)
            self._submit(job, self._begun)

    @Slot()
    def show_on_run(self) -> None:
        """Write the proposed sequence and show it on the page Run, to arm and start it there."""
        followed = self._followed
        proposed = None if followed is None else followed.tracking.proposed
        if followed is None or proposed is None:
            return
        try:
            if self._folder is None:
                self._folder = numbered_folder(self._session.folder, "follow")
            loaded = proposed.write(self._folder)
        except InputError as error:
            self.message.show_text(str(error))
            return
        self._await(loaded.toml)
        self._play(self._folder / f"{proposed.stem}.toml")

    @Slot()
    def play_best(self) -> None:
        """Show the sequence of the run with the smallest error on the page Run."""
        followed, best = self._followed, self._best()
        if followed is None or best is None or self._folder is None:
            return
        self._await("")  # nothing is learned from it
        self._play(self._folder / f"{best.stem}.toml")

    @Slot()
    def open_report(self) -> None:
        """Write the report of the runs and open it in the browser."""
        if self._followed is not None and self._folder is not None and self._job is None:
            job = self._worker.submit(write_report, self._followed, self._folder / "report.html")
            self._submit(job, self._report_written)

    @Slot()
    def reset_layout(self) -> None:
        """Give every part its default size."""
        self.split.setSizes([_LEFT, 860])
        self.rows.setSizes([420, 230])
        self.hold.reset_layout()

    def close_work(self) -> None:
        """End the job and its process, and wait for the threads."""
        self._worker.close()
        self._job = None
        self.hold.close_work()
        self.target.close_work()
        self.model.close_work()

    # jobs

    def _submit(self, job: Job, done: Callable[[Any], None]) -> None:
        self._job = job
        self.message.show_text("")
        job.finished.connect(done)
        job.finished.connect(self._job_ended)
        job.failed.connect(self._failed)
        job.cancelled.connect(self._cancelled)
        self.job.begin(job)
        self._refresh()

    @Slot()
    def _job_ended(self) -> None:
        self._job = None
        self.job.end()
        path, self._recorded_meanwhile = self._recorded_meanwhile, None
        if path is not None:
            self._recorded(path)
        self._refresh()

    @Slot(object)
    def _begun(self, followed: TrackingState) -> None:
        self._folder = None
        self._await("")
        self._show(followed)

    @Slot(object)
    def _learned(self, followed: TrackingState | None) -> None:
        if followed is None:  # another sequence was played
            return
        self._await("")
        self._show(followed)
        self.tabs.setCurrentWidget(self.runs)

    @Slot(object)
    def _report_written(self, path: Path) -> None:
        open_in_browser(path, self.message)

    @Slot(str)
    def _failed(self, sentence: str) -> None:
        self._job_ended()
        self.message.show_text(f"{sentence[:1].upper()}{sentence[1:]}.")

    @Slot()
    def _cancelled(self) -> None:
        self._job_ended()
        self.message.show_text("Cancelled; nothing has changed.", "warn")

    # runs

    @Slot(Path)
    def _recorded(self, path: Path) -> None:
        if self._followed is None or not self._awaited:
            return
        if self._job is not None:
            self._recorded_meanwhile = path
            return
        if self._changed():
            self.message.show_text(
                "Nothing is learned from the last run: target, model or rig were changed after the "
                "voltage was computed. Compute it again.",
                "warn",
            )
            return
        job = self._worker.submit(
            learn_from, self._followed, PlayedRun(path, self._awaited), self._session.film
        )
        self._submit(job, self._learned)

    def _await(self, sequence: str) -> None:
        self._awaited = sequence
        self.waits.emit(bool(sequence))

    def _play(self, path: Path) -> None:
        model = None if self._followed is None else self._followed.request.model
        if model is not None:
            self.use_model.emit(model)
        try:
            toml = read_text(path, "sequence")
        except InputError as error:
            self.message.show_text(str(error))
            return
        self.play_sequence.emit(toml, path)

    def _best(self) -> TrackedRun | None:
        if self._followed is None:
            return None
        return self._followed.tracking.outcome("").best

    def _changed(self) -> bool:
        """Return whether the inputs are others than those of the voltage that is shown."""
        return self._followed is not None and self._followed.request != self.request()

    # display

    def _show(self, followed: TrackingState) -> None:
        self._followed = followed
        tracking = followed.tracking
        outcome = tracking.outcome(followed.request.address)
        self.headline.setText(track_headline(outcome))
        notes = () if not tracking.runs else tracking.runs[-1].notes
        self.next_run.show_pieces(
            self._next_texts(followed),
            tuple(f"{said}." for said in (*tracking.warnings, *notes)),
        )
        self.runs.show_table(runs_table(outcome))
        self.errors.show_runs(tracking.runs)
        if tracking.runs and self.errors.isHidden():
            self.errors.show()
            self.columns.setSizes(_COLUMNS)
        self.errors.setVisible(bool(tracking.runs))
        self._draw()
        self._refresh()

    def _next_texts(self, followed: TrackingState) -> list[str | Table]:
        proposed, missed = followed.tracking.proposed, followed.tracking.inversion.unreachable
        pieces: list[str | Table] = []
        if proposed is not None:
            peak = float(proposed.voltage.max()) * 1e-3
            pieces.append(
                f"Next run: {proposed.label}, up to {peak:.2f} kV, {proposed.time[-1]:.1f} s."
            )
        if followed.reasons:
            pieces.append(f"The limits of the rig file refuse it: {'; '.join(followed.reasons)}.")
        else:
            pieces.append(
                "It is within all limits. Every run is armed alone: click Show on Run, look at "
                "its plan there, then Arm and Start."
            )
        pieces += [f"Not reachable: {part.sentence}." for part in missed]
        if followed.margins:
            pieces.append(limits_table(followed.margins))
        return pieces

    @Slot()
    def _draw(self) -> None:
        """Draw the selected runs; without a selection the first, the best and the newest."""
        if self._followed is None:
            return
        runs = self._followed.tracking.runs
        rows = {index.row() for index in self.runs.selectedIndexes()}
        if not rows and runs:
            best = self._best()
            rows = {0, len(runs) - 1, *(i for i, run in enumerate(runs) if run is best)}
        self.plots.show_tracking(
            self._followed.tracking, [run for i, run in enumerate(runs) if i in rows]
        )

    @Slot()
    def _refresh(self) -> None:
        followed, free = self._followed, self._job is None and not self._session.running
        changed = self._changed()
        playable = followed is not None and not followed.reasons and not changed
        if followed is not None and self._job is None:
            self.state.show_text(*self._state(followed, changed))
        reachable = followed is not None and (
            self.nearest.isChecked() or followed.tracking.outcome("").feasible
        )
        self.compute_button.setEnabled(free)
        self.run_button.setEnabled(free and playable and reachable)
        self.again_button.setEnabled(free and self._best() is not None)
        self.report_button.setEnabled(
            self._job is None and followed is not None and bool(followed.tracking.runs)
        )

    def _state(self, followed: TrackingState, changed: bool) -> tuple[str, str]:
        """Return what keeps the next run from being shown on the page Run, and its role."""
        if changed:
            return "Target, model or rig have changed: compute the voltage again.", "warn"
        if followed.reasons:
            return f"Refused by the limits of the rig file: {'; '.join(followed.reasons)}.", "bad"
        if not followed.tracking.outcome("").feasible and not self.nearest.isChecked():
            return (
                "The film cannot follow the whole target: see Next run. Change the target, or "
                "follow the nearest one that is feasible.",
                "bad",
            )
        settled = followed.tracking.settled
        return (f"{settled[:1].upper()}{settled[1:]}." if settled else ""), "good"

    # layout

    @staticmethod
    def _padded(inner: QWidget) -> QWidget:
        """Return ``inner`` with the distance of the other mode to the tabs above."""
        outer = QWidget()
        column = QVBoxLayout(outer)
        column.setContentsMargins(0, SPACE, 0, 0)
        column.addWidget(inner)
        return outer

    def _make_inputs(self) -> QWidget:
        session = self._session
        self.target = TargetEditor(session)
        self.model = ModelChoice(session)
        self.within = NumberBox(0.1, _WITHIN_MAX, WITHIN * 1e6, decimals=1, unit=" \N{MICRO SIGN}m")
        self.within.setToolTip("Distance from the target that is accepted")
        self.nearest = QCheckBox("Follow the &nearest feasible target")
        self.nearest.setToolTip(
            "Where the film cannot follow the target, do what it can; no error is counted there"
        )
        form = QFormLayout()
        form.addRow("&Model", self.model)
        form.addRow("&Within", self.within)
        self.compute_button = button(
            "&Compute the voltage", "Compute the voltage of the first run; nothing is played", True
        )
        self.compute_button.clicked.connect(self.compute)
        self.job = JobControls(self.compute_button, "Cance&l")
        inner = QVBoxLayout()
        inner.addWidget(self.target, 1)
        inner.addLayout(form)
        inner.addWidget(self.nearest)
        inner.addWidget(self.job)
        frame = card(inner)
        frame.setMinimumWidth(270)
        return frame

    def _make_results(self) -> QWidget:
        session = self._session
        self.headline = label("No voltage yet", "title")
        self.run_button = button(
            "Show on R&un", "Show the next run on the page Run, to arm and start it there", True
        )
        self.run_button.clicked.connect(self.show_on_run)
        self.again_button = button(
            "Play the &best again",
            "Show the voltage with the smallest error on the page Run; nothing is learned from it",
        )
        self.again_button.clicked.connect(self.play_best)
        self.report_button = button("Open re&port", "Write the report and open it in the browser")
        self.report_button.clicked.connect(self.open_report)
        self.state = Message()
        self.message = Message()
        self.plots = FollowPlots(session)
        self.next_run = ReportPage()
        self.next_run.show_pieces(_INTRODUCTION)
        self.runs = ReportTable()
        self.runs.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.runs.itemSelectionChanged.connect(self._draw)
        self.runs.setToolTip("Select runs to draw them; Ctrl+C copies")
        self.tabs = QTabWidget()
        self.tabs.addTab(self.next_run, "Next run")
        self.tabs.addTab(self.runs, "Runs")
        self.errors = ErrorPlot(session)
        self.errors.hide()  # until there is a run
        self.columns = splitter(Qt.Orientation.Horizontal, self.tabs, self.errors)
        self.rows = splitter(Qt.Orientation.Vertical, self.plots, self.columns, growing=0)
        return result_side(
            self.headline, (self.report_button, self.again_button, self.run_button),
            (self.state, self.message), self.rows,
        )  # fmt: skip


#: Text of the page before the first voltage.
_INTRODUCTION = (
    "Compose the displacement that the film should follow at the left, or open a file. Choose the "
    "model that computes the voltage, best one that a diagnosis has found.",
    "Compute the voltage shows what the model expects, the margins to all limits, and what the "
    "film cannot follow, before anything is played.",
    "Show on Run shows the next run on the page Run. Every run is armed on its own, and STOP ends "
    "it as any other. After it this page shows its error and the voltage that was learned from it.",
)
