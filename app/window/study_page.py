"""Page Study: fit a model, or find the effects it lacks, and use the result."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

from PySide6.QtCore import Qt, QUrl, Signal, Slot
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import (
    QButtonGroup,
    QComboBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QProgressBar,
    QRadioButton,
    QSpinBox,
    QSplitter,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.compatibility import BRANCHES_MAX
from dearig.analysis.outcomes import Comparison, DiagnoseOutcome, IdentifyOutcome
from dearig.analysis.study import Study, Task, study
from dearig.errors import InputError
from dearig.recording.files import check_output, replaced_when_done
from dearig.report import diagnosis, sentences, tables
from dearig.report.page import write_report
from dearig.report.tables import Table
from dearig.units import readable
from dearig.window.before_after_plot import BeforeAfterPlot
from dearig.window.layout_state import remember
from dearig.window.library import shared_library
from dearig.window.report_page import ReportPage
from dearig.window.residual_plots import ResidualPlots
from dearig.window.session import Session
from dearig.window.theme import SPACE
from dearig.window.training_table import TrainingTable
from dearig.window.widgets import Message, button, card, label
from dearig.window.worker import Job, Worker

__all__ = ["StudyPage"]

_SPRINGS = ("gent", "neo-hookean", "arruda-boyce")
_DRIVES = (("commanded voltage", "command"), ("monitored voltage", "monitor"))
_LEFT = 330  # px, default width of the left column


class StudyPage(QWidget):
    """Fits models to the recordings of the session's folder, in a process of its own.

    ``open_sequence`` carries the proposed experiment, to be armed and run; ``show_model`` a model
    file to use as overlay; ``study_finished`` a ``Study`` as soon as it is shown.
    """

    title = "Study"
    shortcut = "Ctrl+5"
    open_sequence = Signal(str)
    show_model = Signal(Path)
    study_finished = Signal(object)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._library = shared_library(session)
        self._worker = Worker(self)
        self._job: Job | None = None
        self._shown: Study | None = None

        self.split = QSplitter(Qt.Orientation.Horizontal)
        self.split.addWidget(self._make_inputs())
        self.split.addWidget(self._make_results())
        self.split.setStretchFactor(1, 1)
        self.split.setChildrenCollapsible(False)
        self.reset_layout()
        remember(self.split, session.settings, "study/columns")
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.addWidget(self.split)

        self._kind_changed()
        self._enable()

    # layout

    def _make_inputs(self) -> QWidget:
        self.recordings = TrainingTable(self._library)
        self.recordings.changed.connect(self._enable)
        hint = label("Select recordings for training, and others for validation.", "muted")
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
        self.branches = QSpinBox(minimum=1, maximum=BRANCHES_MAX, value=3)
        self.branches.setToolTip("Number of Maxwell relaxation branches")
        self.spring = QComboBox()
        self.spring.addItems(_SPRINGS)
        self.spring.setToolTip("Strain energy function of the springs")
        self.drive = QComboBox()
        for text, channel in _DRIVES:
            self.drive.addItem(text, channel)
        self.drive.setToolTip("Voltage that drives the model")
        form = QFormLayout()
        form.addRow("&Branches", self.branches)
        form.addRow("S&prings", self.spring)
        form.addRow("D&rive", self.drive)

        self.start = button("&Start", "Start the fit or the diagnosis, in the background", True)
        self.start.clicked.connect(self.begin)
        self.cancel = button(
            "&Cancel", "End early and keep the results so far; a second click ends at once"
        )
        self.cancel.clicked.connect(self._cancel)
        self.bar = QProgressBar()
        self.bar.setRange(0, 1000)
        self.bar.setTextVisible(False)
        self.bar.setFixedHeight(10)
        self.stage = label(" ", "muted")
        self.stage.setWordWrap(True)
        buttons = QHBoxLayout()
        buttons.addWidget(self.start, 2)
        buttons.addWidget(self.cancel, 1)

        inner = QVBoxLayout()
        inner.addWidget(label("Recordings", "heading"))
        inner.addWidget(self.recordings, 1)
        inner.addWidget(hint)
        inner.addWidget(self.diagnose)
        inner.addWidget(self.identify)
        inner.addLayout(form)
        inner.addLayout(buttons)
        inner.addWidget(self.bar)
        inner.addWidget(self.stage)
        frame = card(inner)
        frame.setMinimumWidth(280)
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
            "Go to the proposed e&xperiment",
            "Show its sequence on the Run page, to arm and start it there",
            True,
        )
        self.run_button.clicked.connect(self._run)
        top = QHBoxLayout()
        top.addWidget(self.headline, 1)
        tools = QHBoxLayout()
        for made in (self.overlay_button, self.save_button, self.report_button, self.run_button):
            tools.addWidget(made)
        tools.addStretch(1)

        self.verdict = ReportPage()
        self.curves = BeforeAfterPlot(self._session)
        self.residual = ResidualPlots(self._session)
        self.ranking = ReportPage()
        self.experiment = ReportPage()
        self.tabs = QTabWidget()
        for widget, name, tip in (
            (self.verdict, "Result", "Result, and the errors before and after"),
            (self.curves, "Curves", "Measurement and models over time"),
            (self.residual, "Residual", "Residual over time, frequency and other quantities"),
            (self.ranking, "Ranking", "Every effect that was tried, by round"),
            (self.experiment, "Experiment", "Experiment that separates rival explanations"),
        ):
            self.tabs.setTabToolTip(self.tabs.addTab(widget, name), tip)
        self.verdict.show_pieces(_INTRODUCTION)
        for index in range(1, self.tabs.count()):
            self.tabs.setTabEnabled(index, False)  # until there is a result
        side = QWidget()
        outer = QVBoxLayout(side)
        outer.setContentsMargins(SPACE, 0, 0, 0)
        outer.addLayout(top)
        outer.addWidget(self.message)
        outer.addWidget(self.tabs, 1)
        outer.addLayout(tools)
        return side

    # job

    def task(self) -> Task:
        """Return the task of the form."""
        return Task(
            diagnose=self.diagnose.isChecked(),
            train=self.recordings.train,
            validation=self.recordings.validation,
            branches=self.branches.value(),
            spring=self.spring.currentText(),
            drive=self.drive.currentData(),
            limits=self._session.rig_file,
        )

    @Slot()
    def _kind_changed(self) -> None:
        self.spring.setEnabled(self.identify.isChecked())

    @Slot()
    def begin(self) -> None:
        """Start the job on the checked recordings."""
        if self._job is not None:
            return
        self.message.show_text("")
        task = self.task()
        self._job = self._worker.submit(
            study, task, self._session.folder, write_report, whole=task.diagnose
        )
        self._job.progressed.connect(self._progressed)
        self._job.finished.connect(self._finished)
        self._job.failed.connect(self._failed)
        self._job.cancelled.connect(self._cancelled)
        self.bar.setValue(0)
        self.stage.setText("Starting")
        self._enable()

    @Slot()
    def _cancel(self) -> None:
        if self._job is not None:
            self.stage.setText("Ending; click Cancel again to end at once")
            self._job.cancel()

    @Slot(str, float, float)
    def _progressed(self, stage: str, fraction: float, left: float) -> None:
        if self._job is None or self._job.asked_to_stop:
            return
        self.bar.setValue(round(1000 * fraction))
        of = "" if self._job.whole else " of this step"
        about = "" if math.isnan(left) else f", about {_roughly(left)}{of} left"
        self.stage.setText(f"{stage}{about}")

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
        self._job = None
        self.bar.setValue(0)
        self.stage.setText(" ")
        self._enable()

    def _enable(self) -> None:
        busy = self._job is not None
        self.start.setEnabled(not busy and bool(self.recordings.train))
        self.cancel.setEnabled(busy)
        found = self._shown
        for made in (self.overlay_button, self.save_button, self.report_button):
            made.setEnabled(found is not None)
        self.overlay_button.setEnabled(found is not None and found.outcome.kind == "actuator")
        self.run_button.setEnabled(self.proposed() is not None)

    @Slot()
    def reset_layout(self) -> None:
        """Give every part its default size."""
        self.split.setSizes([_LEFT, 860])

    def close_work(self) -> None:
        """End the job and its process."""
        self._worker.close()
        self._job = None
        self._library.close()

    # result

    def proposed(self) -> str | None:
        """Return the sequence (TOML) of the proposed experiment; None without one."""
        outcome = None if self._shown is None else self._shown.outcome
        if isinstance(outcome, DiagnoseOutcome) and outcome.experiment is not None:
            return outcome.experiment.sequence
        return None

    def show_study(self, found: Study) -> None:
        """Show a result."""
        self._shown = found
        outcome = found.outcome
        self.residual.show_residuals(found.residuals)
        diagnosed = isinstance(outcome, DiagnoseOutcome)
        for page in (self.ranking, self.experiment):
            self.tabs.setTabVisible(self.tabs.indexOf(page), diagnosed)
        for index in range(self.tabs.count()):
            self.tabs.setTabEnabled(index, True)
        if isinstance(outcome, DiagnoseOutcome):
            self._show_diagnosis(outcome)
        else:
            self._show_fit(outcome)
        self.tabs.setCurrentWidget(self.verdict)
        self._enable()
        self.study_finished.emit(found)

    def _show_diagnosis(self, outcome: DiagnoseOutcome) -> None:
        finding = outcome.finding
        self.headline.setText(diagnosis.headline(outcome))
        pieces: list[str | Table] = list(diagnosis.summary(outcome))
        for heading, before, after in (
            ("Validation recordings", outcome.before.validation, outcome.after.validation),
            ("Training recordings", outcome.before.train, outcome.after.train),
        ):
            if before and after:
                pieces.append(diagnosis.before_after_table(heading, before, after, outcome.kind))
        pieces.append(diagnosis.step_table(outcome))
        if finding.steps:
            pieces.append(diagnosis.effect_table(outcome))
        self.verdict.show_pieces(pieces, diagnosis.warnings(outcome))
        rounds: list[str | Table] = [*diagnosis.rankings(outcome)]
        dropped = diagnosis.dropped_effects(outcome)
        self.ranking.show_pieces(
            [*(rounds or ["No round of candidates is complete."]), *([dropped] if dropped else [])]
        )
        proposal: list[str | Table] = [readable(f"{outcome.experiment_words}.")]
        considered = diagnosis.experiment_table(outcome)
        if considered is not None:
            proposal.append(considered)
        self.experiment.show_pieces(proposal)
        both = bool(finding.steps)
        self.curves.show_pairs(
            (
                *_pairs(outcome.before.validation, outcome.after.validation if both else ()),
                *_pairs(outcome.before.train, outcome.after.train if both else ()),
            )
        )

    def _show_fit(self, outcome: IdentifyOutcome) -> None:
        self.headline.setText(outcome.title)
        pieces: list[str | Table] = [
            *sentences.identify_summary(outcome),
            tables.parameter_table(outcome.fit),
            tables.error_table("Training", outcome.train),
        ]
        if outcome.validation:
            pieces += [
                tables.error_table(title, members)
                for title, members in tables.by_thesis_table(outcome.validation, "Validation")
            ]
        self.verdict.show_pieces(pieces, sentences.warnings_of(outcome))
        self.curves.show_pairs((*_pairs(outcome.validation, ()), *_pairs(outcome.train, ())))

    @Slot()
    def _use(self) -> None:
        if self._shown is not None:
            self.show_model.emit(self._shown.model)
            self.message.show_text("This model is an overlay model of the next run.", "good")

    @Slot()
    def _ask_save(self) -> None:
        if self._shown is None:
            return
        proposed = self._session.folder / f"{self._shown.model.parent.name}.toml"
        name, _ = QFileDialog.getSaveFileName(
            self, "Save the model", str(proposed), "Models (*.toml)"
        )
        if name:
            self.save(Path(name))

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
        if self._shown is None:
            return
        report = self._shown.report
        if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(report))):
            self.message.show_text(f"No browser was found to open the report {report}", "warn")

    @Slot()
    def _run(self) -> None:
        proposed = self.proposed()
        if proposed is not None:
            self.open_sequence.emit(proposed)


#: Text of the page before the first result.
_INTRODUCTION = (
    "Select recordings for training at the left. Validation recordings show at the end how well "
    "the model predicts data that it was not fitted to.",
    "A diagnosis fits the thesis model, analyses the residual, and tries every known effect. It "
    "names the effects that the data support, and the explanations that the data cannot separate. "
    "For these it proposes an experiment that separates them.",
    "Work runs in the background: you can record, or browse recordings, at the same time.",
)


def _roughly(left: float) -> str:
    """Return a rough duration; ``left`` in s."""
    return f"{max(round(left), 1)} s" if left < 100.0 else f"{round(left / 60.0)} min"


def _pairs(
    before: tuple[Comparison, ...], after: tuple[Comparison, ...]
) -> tuple[tuple[Comparison, Comparison | None], ...]:
    last = {c.name: c for c in after}
    return tuple((c, last.get(c.name)) for c in before)
