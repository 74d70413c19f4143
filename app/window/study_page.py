"""The page Study: fit a model, or find what it lacks, and what to do with what was found."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

from PySide6.QtCore import Qt, QUrl, Signal, Slot
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import (
    QAbstractItemView,
    QButtonGroup,
    QComboBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QProgressBar,
    QRadioButton,
    QScrollArea,
    QSpinBox,
    QSplitter,
    QTableWidget,
    QTableWidgetItem,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.compatibility import BRANCHES_MAX
from dearig.analysis.outcomes import Comparison, DiagnoseOutcome, IdentifyOutcome
from dearig.analysis.study import Study, Task, study
from dearig.recording.files import in_words
from dearig.report import diagnosis, sentences, tables
from dearig.report.numbers import seconds
from dearig.report.page import write_report
from dearig.report.tables import Table
from dearig.units import readable
from dearig.window.before_after_plot import BeforeAfterPlot
from dearig.window.layout_state import remember
from dearig.window.library import shared_library
from dearig.window.report_table import ReportTable
from dearig.window.residual_plots import ResidualPlots
from dearig.window.session import Session
from dearig.window.theme import SPACE
from dearig.window.widgets import Message, button, card, label
from dearig.window.worker import Job, Worker

__all__ = ["StudyPage"]

_NAME, _FIT, _CHECK = range(3)
_SPRINGS = ("gent", "neo-hookean", "arruda-boyce")
_DRIVES = (("the commanded voltage", "command"), ("the monitored voltage", "monitor"))
_LEFT = 330  # px


class StudyPage(QWidget):
    """Works on the recordings of the session's folder, in a process of its own.

    ``open_sequence`` carries the proposed experiment, to be armed and run; ``show_model`` a model
    file that is to run beside the next measurement.
    """

    title = "Study"
    shortcut = "Ctrl+5"
    open_sequence = Signal(str)
    show_model = Signal(Path)
    #: what was found, as soon as it is shown
    found = Signal(object)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._library = shared_library(session)
        self._worker = Worker(self)
        self._job: Job | None = None
        self._shown: Study | None = None

        self.split = QSplitter(Qt.Orientation.Horizontal)
        self.split.addWidget(self._asking())
        self.split.addWidget(self._answering())
        self.split.setStretchFactor(1, 1)
        self.split.setChildrenCollapsible(False)
        self.reset_layout()
        remember(self.split, session.settings, "study/columns")
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.addWidget(self.split)

        self._library.listed.connect(self._list)
        self._library.looked.connect(self._looked)
        self._list()
        self._kind_changed()
        self._enable()

    # ------------------------------------------------------------ what is asked

    def _asking(self) -> QWidget:
        self.recordings = QTableWidget(0, 3)
        self.recordings.setAccessibleName("Recordings to fit, and to check")
        heads = (
            ("Recording", "Recordings of the folder, the newest first"),
            ("Fit", "The model is fitted to these"),
            ("Check", "Read once, at the end: no fit and no choice sees them"),
        )
        for column, (name, tip) in enumerate(heads):
            head = QTableWidgetItem(name)
            head.setToolTip(tip)
            self.recordings.setHorizontalHeaderItem(column, head)
        header = self.recordings.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(_NAME, QHeaderView.ResizeMode.Stretch)
        header.setHighlightSections(False)
        self.recordings.verticalHeader().hide()
        self.recordings.verticalHeader().setDefaultSectionSize(26)
        self.recordings.setShowGrid(False)
        # ticks are what counts, and a chosen row would look like one
        self.recordings.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.recordings.setAlternatingRowColors(True)
        self.recordings.setTabKeyNavigation(False)
        self.recordings.itemChanged.connect(self._ticked)
        hint = label(
            "Tick what is to be fitted, and what is left untouched to check the result on.", "muted"
        )
        hint.setWordWrap(True)

        self.diagnose = QRadioButton("&Find what the model lacks")
        self.diagnose.setToolTip("Diagnosis: fits the thesis's model, then tries every effect")
        self.identify = QRadioButton("F&it the model as it is")
        self.identify.setToolTip("Identification: springs and relaxation branches only")
        self.diagnose.setChecked(True)
        both = QButtonGroup(self)
        both.addButton(self.diagnose)
        both.addButton(self.identify)
        self.diagnose.toggled.connect(self._kind_changed)
        self.branches = QSpinBox(minimum=1, maximum=BRANCHES_MAX, value=3)
        self.branches.setToolTip("Maxwell relaxation branches of the model")
        self.spring = QComboBox()
        self.spring.addItems(_SPRINGS)
        self.spring.setToolTip("Strain energy of the springs")
        self.drive = QComboBox()
        for text, channel in _DRIVES:
            self.drive.addItem(text, channel)
        self.drive.setToolTip("What the model is driven by")
        form = QFormLayout()
        form.addRow("&Branches", self.branches)
        form.addRow("S&prings", self.spring)
        form.addRow("D&riven by", self.drive)

        self.start = button("&Start", "Work on the ticked recordings, in the background", True)
        self.start.clicked.connect(self.begin)
        self.cancel = button(
            "&Cancel", "End it and keep what was found; a second time, end it at once"
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

    def _answering(self) -> QWidget:
        self.message = Message()
        self.headline = label("Nothing studied yet", "title")
        self.headline.setWordWrap(True)
        self.overlay_button = button(
            "&Use as overlay", "Let this model run beside the next measurement"
        )
        self.overlay_button.clicked.connect(self._use)
        self.save_button = button("Save &model…", "Keep the model file under a name of your own")
        self.save_button.clicked.connect(self._ask_save)
        self.report_button = button("&Open report", "Open the full report, in the browser")
        self.report_button.clicked.connect(self._open_report)
        self.run_button = button(
            "R&un the proposed experiment",
            "Fill it in on the page Run, where it is armed and started like any other",
            True,
        )
        self.run_button.clicked.connect(self._run)
        top = QHBoxLayout()
        top.addWidget(self.headline, 1)
        tools = QHBoxLayout()
        for made in (self.overlay_button, self.save_button, self.report_button, self.run_button):
            tools.addWidget(made)
        tools.addStretch(1)

        self.verdict = _Page()
        self.curves = BeforeAfterPlot(self._session)
        self.residual = ResidualPlots(self._session)
        self.ranking = _Page()
        self.experiment = _Page()
        self.tabs = QTabWidget()
        for widget, name, tip in (
            (self.verdict, "Verdict", "What was found, and the errors before and after"),
            (self.curves, "Curves", "Measurement beside the models"),
            (self.residual, "Residual", "What is left, over time, frequency and other quantities"),
            (self.ranking, "Ranking", "Every effect that was tried, round by round"),
            (self.experiment, "Experiment", "What would tell rival explanations apart"),
        ):
            self.tabs.setTabToolTip(self.tabs.addTab(widget, name), tip)
        self.verdict.show_pieces(_FIRST_WORDS)
        for index in range(1, self.tabs.count()):
            self.tabs.setTabEnabled(index, False)  # until there is something in them
        side = QWidget()
        outer = QVBoxLayout(side)
        outer.setContentsMargins(SPACE, 0, 0, 0)
        outer.addLayout(top)
        outer.addWidget(self.message)
        outer.addWidget(self.tabs, 1)
        outer.addLayout(tools)
        return side

    # ------------------------------------------------------------ recordings

    @Slot()
    def _list(self) -> None:
        """The recordings of the folder, with the ticks that they had."""
        before = {path: self._ticks(row) for row, path in enumerate(self._paths())}
        files = self._library.files
        paths = sorted(files, key=lambda path: (-files[path][0], path.name))
        self.recordings.blockSignals(True)
        self.recordings.setRowCount(len(paths))
        for row, path in enumerate(paths):
            item = QTableWidgetItem(path.stem)
            item.setData(Qt.ItemDataRole.UserRole, path)
            item.setFlags(Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable)
            self.recordings.setItem(row, _NAME, item)
            for column, ticked in zip(
                (_FIT, _CHECK), before.get(path, (False, False)), strict=True
            ):
                box = QTableWidgetItem()
                box.setFlags(
                    Qt.ItemFlag.ItemIsEnabled
                    | Qt.ItemFlag.ItemIsUserCheckable
                    | Qt.ItemFlag.ItemIsSelectable
                )
                box.setCheckState(_state(ticked))
                self.recordings.setItem(row, column, box)
            self._describe(row, path)
        self.recordings.blockSignals(False)
        self._enable()

    @Slot(Path)
    def _looked(self, path: Path) -> None:
        paths = self._paths()
        if path in paths:
            self._describe(paths.index(path), path)

    def _describe(self, row: int, path: Path) -> None:
        summary = self._library.summaries.get(path)
        if summary is None:
            return
        item = self._item(row, _NAME)
        told = f"{summary.title}, {seconds(summary.duration)}"
        film = f", {summary.film}" if summary.film else ""
        item.setToolTip(summary.trouble or f"{path}\n{told}{film}")
        if summary.trouble:
            self.recordings.blockSignals(True)
            for column in (_FIT, _CHECK):
                box = self._item(row, column)
                box.setFlags(Qt.ItemFlag.NoItemFlags)
                box.setCheckState(Qt.CheckState.Unchecked)
                box.setToolTip(summary.trouble)
            item.setFlags(Qt.ItemFlag.NoItemFlags)
            self.recordings.blockSignals(False)

    def _paths(self) -> list[Path]:
        items = (self._item(row, _NAME) for row in range(self.recordings.rowCount()))
        return [item.data(Qt.ItemDataRole.UserRole) for item in items]

    def _item(self, row: int, column: int) -> QTableWidgetItem:
        found = self.recordings.item(row, column)
        if found is None:
            raise LookupError(f"no cell at row {row}, column {column}")
        return found

    def _ticks(self, row: int) -> tuple[bool, bool]:
        fit, check = (self._item(row, c).checkState() for c in (_FIT, _CHECK))
        return fit == Qt.CheckState.Checked, check == Qt.CheckState.Checked

    def tick(self, train: list[Path], validation: list[Path]) -> None:
        """Choose what is fitted and what is checked."""
        for row, path in enumerate(self._paths()):
            self._item(row, _FIT).setCheckState(_state(path in train))
            self._item(row, _CHECK).setCheckState(_state(path in validation))

    @Slot(QTableWidgetItem)
    def _ticked(self, item: QTableWidgetItem) -> None:
        if item.column() in (_FIT, _CHECK) and item.checkState() == Qt.CheckState.Checked:
            # an error on fitted data proves nothing: one or the other
            other = self._item(item.row(), _CHECK + _FIT - item.column())
            other.setCheckState(Qt.CheckState.Unchecked)
        self._enable()

    def task(self) -> Task:
        """What is asked for."""
        ticks = [(path, *self._ticks(row)) for row, path in enumerate(self._paths())]
        return Task(
            diagnose=self.diagnose.isChecked(),
            train=tuple(path for path, fit, _ in ticks if fit),
            validation=tuple(path for path, _, check in ticks if check),
            branches=self.branches.value(),
            spring=self.spring.currentText(),
            drive=self.drive.currentData(),
            limits=self._session.rig_file,
        )

    @Slot()
    def _kind_changed(self) -> None:
        self.spring.setEnabled(self.identify.isChecked())

    # ------------------------------------------------------------ the work

    @Slot()
    def begin(self) -> None:
        """Start the work on what is ticked."""
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
        self.stage.setText("starting")
        self._enable()

    @Slot()
    def _cancel(self) -> None:
        if self._job is not None:
            self.stage.setText("ending; press Cancel again to end at once")
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
        self._over()
        self.show_study(found)

    @Slot(str)
    def _failed(self, sentence: str) -> None:
        self._over()
        self.message.show_text(sentence)

    @Slot()
    def _cancelled(self) -> None:
        self._over()
        self.message.show_text("Cancelled: nothing was kept.", "warn")

    def _over(self) -> None:
        self._job = None
        self.bar.setValue(0)
        self.stage.setText(" ")
        self._enable()

    def _enable(self) -> None:
        busy = self._job is not None
        self.start.setEnabled(not busy and bool(self.task().train))
        self.cancel.setEnabled(busy)
        found = self._shown
        for made in (self.overlay_button, self.save_button, self.report_button):
            made.setEnabled(found is not None)
        self.overlay_button.setEnabled(found is not None and found.outcome.kind == "actuator")
        self.run_button.setEnabled(self.proposed() is not None)

    @Slot()
    def reset_layout(self) -> None:
        """Give every part the room that it has at the first start."""
        self.split.setSizes([_LEFT, 860])

    def close_work(self) -> None:
        """End whatever is under way, and its process; the window is closing."""
        self._worker.close()
        self._job = None
        self._library.close()

    # ------------------------------------------------------------ what was found

    def proposed(self) -> str | None:
        """The TOML of the proposed experiment; None without one."""
        outcome = None if self._shown is None else self._shown.outcome
        if isinstance(outcome, DiagnoseOutcome) and outcome.experiment is not None:
            return outcome.experiment.sequence
        return None

    def show_study(self, found: Study) -> None:
        """Show what was found."""
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
        self.found.emit(found)

    def _show_diagnosis(self, outcome: DiagnoseOutcome) -> None:
        finding = outcome.finding
        early = (
            ", in a search that was ended early" if finding.interrupted and finding.rounds else ""
        )
        self.headline.setText(f"{diagnosis.headline(finding)}{early}")
        pieces: list[str | Table] = list(diagnosis.summary(outcome))
        for heading, before, after in (
            ("Untouched recordings", outcome.before.validation, outcome.after.validation),
            ("Training recordings", outcome.before.train, outcome.after.train),
        ):
            if before and after:
                pieces.append(diagnosis.before_after_table(heading, before, after, outcome.kind))
        pieces.append(diagnosis.step_table(outcome))
        if finding.steps:
            pieces.append(diagnosis.effect_table(outcome))
        self.verdict.show_pieces(pieces, diagnosis.warnings(outcome))
        rounds: list[str | Table] = [diagnosis.ranking_table(found) for found in finding.rounds]
        dropped = diagnosis.dropped_effects(outcome)
        self.ranking.show_pieces(
            [*(rounds or ["No round of candidates was finished."]), *([dropped] if dropped else [])]
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
                for title, members in tables.by_thesis_table(outcome.validation, "Untouched")
            ]
        self.verdict.show_pieces(pieces, sentences.warnings_of(outcome))
        self.curves.show_pairs((*_pairs(outcome.validation, ()), *_pairs(outcome.train, ())))

    @Slot()
    def _use(self) -> None:
        if self._shown is not None:
            self.show_model.emit(self._shown.model)
            self.message.show_text("This model runs beside the next measurement.", "good")

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
        """Copy the model file to ``path``; the window has asked whether that may be replaced."""
        if self._shown is None:
            return
        try:
            shutil.copyfile(self._shown.model, path)
        except OSError as error:
            self.message.show_text(f"{path} cannot be written: {in_words(error)}")
        else:
            self.message.show_text(f"The model was saved as {path}.", "good")

    @Slot()
    def _open_report(self) -> None:
        if self._shown is None:
            return
        report = self._shown.report
        if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(report))):
            self.message.show_text(f"No program here opens pages; the report is {report}", "warn")

    @Slot()
    def _run(self) -> None:
        proposed = self.proposed()
        if proposed is not None:
            self.open_sequence.emit(proposed)


#: What the page says before anything was studied.
_FIRST_WORDS = (
    "Tick at the left what is to be fitted. Recordings that you leave untouched show at the end "
    "how well the model predicts what it never saw.",
    "A diagnosis fits the thesis's model, looks at what is left, tries every known effect, and "
    "says which ones the data ask for, and which other explanations they leave open. For those it "
    "proposes the experiment that tells them apart.",
    "Everything runs in the background: record, or look at other recordings meanwhile.",
)


def _roughly(left: float) -> str:
    """A duration in s as far as it can be foreseen."""
    return f"{max(round(left), 1)} s" if left < 100.0 else f"{round(left / 60.0)} min"


def _state(ticked: bool) -> Qt.CheckState:
    return Qt.CheckState.Checked if ticked else Qt.CheckState.Unchecked


def _pairs(
    before: tuple[Comparison, ...], after: tuple[Comparison, ...]
) -> tuple[tuple[Comparison, Comparison | None], ...]:
    last = {c.name: c for c in after}
    return tuple((c, last.get(c.name)) for c in before)


class _Page(QScrollArea):
    """Sentences and tables one below the other."""

    def __init__(self) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.show_pieces(())

    def show_pieces(
        self, pieces: list[str | Table] | tuple[str, ...], warnings: tuple[str, ...] = ()
    ) -> None:
        """Show these in place of what was shown."""
        inner = QWidget()
        column = QVBoxLayout(inner)
        column.setSpacing(SPACE)
        widest = 0
        for piece in pieces:
            if isinstance(piece, str):
                column.addWidget(_words(piece, ""))
                continue
            column.addWidget(label(piece.title, "heading"))
            if piece.rows:
                table = ReportTable(whole=True)
                table.show_table(piece)
                column.addWidget(table)
                widest = max(widest, table.maximumWidth())
            if piece.note:
                column.addWidget(_words(piece.note, "muted"))
        for warning in warnings:
            column.addWidget(_words(f"! {warning}", "warn"))
        column.addStretch(1)
        # where a table does not fit, the page scrolls, not the table
        inner.setMinimumWidth(widest)
        self.setWidget(inner)


def _words(text: str, role: str) -> QLabel:
    made = label(text, role)
    made.setWordWrap(True)
    made.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return made
