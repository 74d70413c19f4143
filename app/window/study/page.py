"""Page Study: fit a model, or find the effects it lacks, and use the result."""

from __future__ import annotations

import shutil
from pathlib import Path

from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QButtonGroup,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QMenu,
    QRadioButton,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.readings.compatibility import BRANCHES_MAX
from dearig.analysis.study import Study, StudyRequest
from dearig.errors import InputError
from dearig.model.springs import SPRINGS
from dearig.recording.files import check_output, replaced_when_done
from dearig.report.study_file import StudyEntry, make_study, open_study, studies_in
from dearig.report.study_view import StudyView, view_of
from dearig.window.documents.dialogs import save_as
from dearig.window.jobs.background import Background
from dearig.window.jobs.job_controls import JobControls, splitter
from dearig.window.jobs.worker import Worker
from dearig.window.kit.browser import open_in_browser
from dearig.window.kit.flow import Flow
from dearig.window.kit.number_box import WholeBox
from dearig.window.kit.report_page import ReportPage
from dearig.window.kit.theme import SPACE
from dearig.window.kit.turns import Turns
from dearig.window.kit.widgets import Message, button, card, label, menu_button, plain_tip, set_role
from dearig.window.recordings.library import shared_library
from dearig.window.session.layout_state import remember
from dearig.window.session.page import Page
from dearig.window.session.state import Session
from dearig.window.study.before_after_plot import BeforeAfterPlot
from dearig.window.study.known_parameters import KnownParameters
from dearig.window.study.residual_plots import ResidualPlots
from dearig.window.study.training_table import TrainingPanel, TrainingTable
from dearig.window.study.trends_panel import TrendsPanel

__all__ = ["StudyPage"]

_SPRINGS = ("gent", *(kind for kind in SPRINGS if kind != "gent"))
_DRIVES = (("commanded voltage", "command"), ("monitored voltage", "monitor"))
_ENDED_EARLY = (
    ("Cut the end that may show a fault", "cut"),
    ("Leave these recordings out", "leave-out"),
    ("Use them as they are", "keep"),
)
_LEFT = 400  # px, default width of the left column
_LISTED_MAX = 30  # studies in the menu; a longer one does not fit on a screen


class StudyPage(Page):
    """Fits models to the recordings of the session's folder, in a process of its own."""

    title = "Study"

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, parent)
        self._session = session
        self._library = shared_library(session)
        self._worker = Worker(self)
        self._shown: StudyView | None = None
        self._turns = Turns(lambda: session.busy, self)
        self._listing = Background(self)
        self._listing.done.connect(self._list_studies)
        self._listing.failed.connect(self._show_trouble)
        self._opening = Background(self)
        self._opening.done.connect(self._reopened)
        self._opening.failed.connect(self._show_trouble)

        self.split = splitter(
            Qt.Orientation.Horizontal, self._make_inputs(), self._make_results(), growing=1
        )
        self.reset_layout()
        remember(self.split, session.settings, "study/columns")
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.addWidget(self.split)

        session.folder_changed.connect(self.find_studies)
        self._kind_changed()
        self._enable()
        self.find_studies()

    # layout

    def _make_inputs(self) -> QWidget:
        self.recordings = TrainingTable(self._library)
        self.recordings.changed.connect(self._enable)
        self.recordings.changed.connect(self._warn)
        hint = label("Choose recordings for training, and others for validation.", "muted")
        hint.setWordWrap(True)

        self.diagnose = QRadioButton("&Diagnose: find missing effects")
        self.diagnose.setToolTip("Fit the thesis model, then try every known effect")
        self.identify = QRadioButton("&Identify: fit springs and branches")
        self.identify.setToolTip("Fit springs and relaxation branches, without further effects")
        self.diagnose.setChecked(True)
        both = QButtonGroup(self)
        both.addButton(self.diagnose)
        both.addButton(self.identify)
        self.diagnose.toggled.connect(self._kind_changed)
        self.branches = WholeBox(1, BRANCHES_MAX, 3)
        self.branches.setToolTip("Number of Maxwell relaxation branches")
        self.spring = QComboBox()
        self.spring.addItems(_SPRINGS)
        self.spring.setToolTip("Strain energy function of the springs")
        self.drive = QComboBox()
        for text, channel in _DRIVES:
            self.drive.addItem(text, channel)
        self.drive.setToolTip("Voltage that drives the model")
        self.warning = Message()
        self.ended_early = QComboBox()
        for text, choice in _ENDED_EARLY:
            self.ended_early.addItem(text, choice)
        self.ended_early.setToolTip("What is done with the recordings whose runs ended early")
        self.ended_early.setAccessibleName("Recordings whose runs ended early")
        self.ended_early.hide()
        form = QFormLayout()
        form.addRow("&Branches", self.branches)
        form.addRow("S&prings", self.spring)
        form.addRow("D&rive", self.drive)
        self.known = KnownParameters(self._session)

        self.start = button("&Start", "Start the fit or the diagnosis, in the background", True)
        self.start.clicked.connect(self.begin)
        self.job = JobControls(
            self.start,
            "&Cancel",
            "End early and keep the results so far; a second click ends at once",
        )

        inner = QVBoxLayout()
        inner.addWidget(label("Recordings", "heading"))
        self.choice = TrainingPanel(self.recordings)
        inner.addWidget(self.choice, 1)
        inner.addWidget(hint)
        inner.addWidget(self.warning)
        inner.addWidget(self.ended_early)
        inner.addWidget(self.diagnose)
        inner.addWidget(self.identify)
        inner.addLayout(form)
        inner.addWidget(self.known)
        inner.addWidget(self.job)
        frame = card(inner)
        frame.setMinimumWidth(frame.minimumSizeHint().width())
        return frame

    def _make_results(self) -> QWidget:
        self.message = Message()
        self.headline = label("No results yet", "title")
        self.headline.setWordWrap(True)
        self.overlay_button = button(
            "&Use as overlay", "Simulate this model in step with the next run"
        )
        self.overlay_button.clicked.connect(self._use)
        self.save_button = button("Save &model …", "Save a copy of the model file")
        self.save_button.clicked.connect(self._ask_save)
        self.report_button = button("&Open report", "Open the full report in the browser")
        self.report_button.clicked.connect(self._open_report)
        self.run_button = button(
            "Go to the e&xperiment",
            "Show its sequence on the Run page, to arm and start it there",
            True,
        )
        self.run_button.clicked.connect(self._run)
        self.about = label("", "muted")
        self.about.setWordWrap(True)
        self.about.hide()
        self.studies = QMenu(self)
        self.reopen_button = menu_button(
            "&Reopen", "Show an earlier study of this folder again", self.studies
        )
        top = QHBoxLayout()
        top.addWidget(self.headline, 1)
        top.addWidget(self.reopen_button, 0, Qt.AlignmentFlag.AlignTop)
        tools = Flow()
        for made in (self.overlay_button, self.save_button, self.report_button, self.run_button):
            tools.add(made)

        self.verdict = ReportPage()
        self.curves = BeforeAfterPlot(self._session)
        self.residual = ResidualPlots(self._session)
        self.ranking = ReportPage()
        self.experiment = ReportPage()
        self.trends = TrendsPanel(self._session)
        self.tabs = QTabWidget()
        for widget, name, tip in (
            (self.verdict, "Result", "Result, and the errors before and after"),
            (self.curves, "Curves", "Measurement and models over time"),
            (self.residual, "Residual", "Residual over time, frequency and other quantities"),
            (self.ranking, "Ranking", "Every effect that was tried, by round"),
            (self.experiment, "Experiment", "Experiment that separates rival explanations"),
            (self.trends, "Trends", "What the recordings of a study say together"),
        ):
            self.tabs.setTabToolTip(self.tabs.addTab(widget, name), tip)
        self.verdict.show_pieces(_INTRODUCTION)
        for widget in (self.curves, self.residual, self.ranking, self.experiment):
            self.tabs.setTabEnabled(self.tabs.indexOf(widget), False)  # until there is a result
        side = QWidget()
        outer = QVBoxLayout(side)
        outer.setContentsMargins(SPACE, 0, 0, 0)
        outer.addLayout(top)
        outer.addWidget(self.about)
        outer.addWidget(self.message)
        outer.addWidget(self.tabs, 1)
        outer.addLayout(tools)
        return side

    # job

    def task(self) -> StudyRequest:
        """Return the task of the form. Raises ``InputError`` for a faulty parameter file."""
        return StudyRequest(
            diagnose=self.diagnose.isChecked(),
            train=self.recordings.train,
            validation=self.recordings.validation,
            branches=self.branches.value(),
            spring=self.spring.currentText(),
            drive=self.drive.currentData(),
            limits=self._session.rig_file,
            ended_early=self.ended_early.currentData(),
            parameters=self.known.stated(),
        )

    @Slot()
    def _kind_changed(self) -> None:
        self.spring.setEnabled(self.identify.isChecked())

    @Slot()
    def begin(self) -> None:
        """Start the job on the checked recordings."""
        if self.job.job is not None:
            return
        self.message.show_text("")
        try:
            task = self.task()
        except InputError as error:
            self.message.show_text(str(error))
            return
        self._label_previous()
        job = self._worker.submit(make_study, task, self._session.folder, whole=task.diagnose)
        job.finished.connect(self._finished)
        job.failed.connect(self._failed)
        job.cancelled.connect(self._cancelled)
        self.job.begin(job)
        self._enable()

    @Slot(object)
    def _finished(self, found: Study) -> None:
        self._job_ended()
        self.show_study(found)

    @Slot(str)
    def _failed(self, sentence: str) -> None:
        self._job_ended()
        self.message.show_text(sentence)

    @Slot()
    def _cancelled(self) -> None:
        self._job_ended()
        self.message.show_text("Cancelled; nothing was saved.", "warn")

    def _job_ended(self) -> None:
        self.job.end()
        self._enable()

    def _enable(self) -> None:
        self.start.setEnabled(self.job.job is None and bool(self.recordings.train))
        found = self._shown
        for made in (self.overlay_button, self.save_button, self.report_button):
            made.setEnabled(found is not None)
        self.overlay_button.setEnabled(found is not None and found.kind == "actuator")
        self.run_button.setEnabled(self.proposed() is not None)

    @Slot()
    def _warn(self) -> None:
        """Warn of checked recordings whose runs ended early, and offer what to do with them."""
        said = self.recordings.early_ends()
        self.warning.show_text("\n".join(said), "warn")
        self.ended_early.setVisible(bool(said))

    @Slot()
    def reset_layout(self) -> None:
        """Give every part its default size."""
        self.split.setSizes([_LEFT, 860])

    def close_work(self) -> None:
        """End the job and its process."""
        self._worker.close()
        self._listing.close()
        self._opening.close()
        self.trends.close_work()
        self.job.end()
        self._library.close()

    # result

    def proposed(self) -> str | None:
        """Return the sequence (TOML) of the proposed experiment; None without one."""
        return (self._shown.sequence or None) if self._shown is not None else None

    def show_study(self, found: Study) -> None:
        """Show a result that has just been made."""
        self.show_view(view_of(found))
        self._session.study_finished.emit(found)
        self.find_studies()

    def show_view(self, shown: StudyView) -> None:
        """Show a result, new or reopened; while the rig is busy, one piece after another."""
        self._shown = shown
        self._turns.clear()
        self._turns.add(
            (
                *self.verdict.steps(shown.result, shown.warnings),
                lambda: self.residual.show_residuals(shown.residuals),
                lambda: self.curves.show_pairs(shown.pairs),
                *self.ranking.steps(shown.ranking),
                *self.experiment.steps(shown.experiment),
            )
        )
        for page in (self.ranking, self.experiment):
            self.tabs.setTabVisible(self.tabs.indexOf(page), shown.diagnosed)
        for index in range(self.tabs.count()):
            self.tabs.setTabEnabled(index, True)
        self.headline.setText(shown.headline)
        set_role(self.headline, "title")
        self.about.setText(f"{shown.label}; validated on {dict(shown.about)['validated on']}")
        set_role(self.about, "muted")
        self.about.show()
        self.tabs.setCurrentWidget(self.verdict)
        self._enable()

    def _label_previous(self) -> None:
        """Label the result on the page as the previous one; a new study begins."""
        if self._shown is None:
            return
        self.headline.setText(f"Previous result: {self._shown.headline}")
        set_role(self.headline, "muted")
        self.about.setText(f"This is {self._shown.label}. A new study was started after it.")
        set_role(self.about, "warn")

    # earlier studies

    @Slot()
    def find_studies(self) -> None:
        """List the studies of the folder again."""
        folder = self._session.folder
        self._listing.start(lambda: studies_in(folder))

    @Slot(object)
    def _list_studies(self, found: tuple[StudyEntry, ...]) -> None:
        self.studies.clear()
        for folder, headline, name in found[:_LISTED_MAX]:
            # & would mark a key
            action = QAction(f"{name}: {headline}".replace("&", "&&"), self.studies)
            action.setToolTip(plain_tip(str(folder)))
            action.triggered.connect(lambda _=False, folder=folder: self.reopen(folder))
            self.studies.addAction(action)
        self.reopen_button.setEnabled(bool(found))

    def reopen(self, folder: Path) -> None:
        """Show the study in ``folder`` again, with its plots and its report."""
        self.message.show_text("")
        self._opening.start(lambda: open_study(folder))

    @Slot(object)
    def _reopened(self, shown: StudyView) -> None:
        self.show_view(shown)
        if self.job.job is not None:
            self._label_previous()

    @Slot(str)
    def _show_trouble(self, sentence: str) -> None:
        self.message.show_text(sentence)

    @Slot()
    def _use(self) -> None:
        if self._shown is not None:
            self.use_model.emit(self._shown.model)
            self.go_to.emit("Run")
            self.message.show_text(
                "The next run shows this model as an overlay. Remove it on the page Run.", "good"
            )

    @Slot()
    def _ask_save(self) -> None:
        if self._shown is None:
            return
        proposed = self._session.folder / f"{self._shown.model.parent.name}.toml"
        path = save_as(self, self._session, "Save the model", proposed, "Models (*.toml)", ".toml")
        if path is not None:
            self.save(path)

    def save(self, path: Path) -> None:
        """Copy the model file to ``path``; an existing file is replaced."""
        if self._shown is None:
            return
        try:
            out = check_output(path, overwrite=True)
            with replaced_when_done(out, overwrite=True) as partial:
                shutil.copyfile(self._shown.model, partial)
        except InputError as error:
            self.message.show_text(str(error))
        else:
            self.message.show_text(f"Saved {path}", "good")

    @Slot()
    def _open_report(self) -> None:
        if self._shown is not None:
            open_in_browser(self._shown.report, self.message)

    @Slot()
    def _run(self) -> None:
        proposed = self.proposed()
        if proposed is not None:
            self.play_sequence.emit(proposed, None)


#: Text of the page before the first result.
_INTRODUCTION = (
    "Select recordings for training at the left. Validation recordings show at the end how well "
    "the model predicts data that it was not fitted to.",
    "A diagnosis fits the thesis model, analyses the residual, and tries every known effect. It "
    "names the effects that the data support, and the explanations that the data cannot separate. "
    "For these it proposes an experiment that separates them.",
    "Work runs in the background: you can record, or browse recordings, at the same time.",
)
