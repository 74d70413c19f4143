"""Dialog that imports a file of measured data: what it holds, what comes in, and the import."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QTimer, Signal, Slot
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QScrollArea,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.import_preview import ImportTrial, preview_file, try_import, write_import
from dearig.config.imports import raw_scales
from dearig.errors import InputError, noted
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.files import check_output
from dearig.recording.importers import Imported, ImportOptions
from dearig.recording.importers.listing import ColumnGuesses, Content
from dearig.window.imports.choice import (
    ColumnChoice,
    columns_option,
    first_choices,
    kind_of,
    problems,
    with_labels,
)
from dearig.window.imports.memory import ImportMemory, Remembered
from dearig.window.imports.options import ImportFields
from dearig.window.imports.plot import ImportPlot
from dearig.window.imports.table import ImportTable
from dearig.window.jobs.job_controls import JobControls
from dearig.window.jobs.worker import Job, Worker
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel, Message, button, label, name_list
from dearig.window.session.state import Session

__all__ = ["ImportDialog"]

_WAIT_MS = 250  # after a change: a number is typed digit by digit
_SIZE = (1240, 860)  # px, as far as the screen has them


class ImportDialog(QDialog):
    """Imports the file at ``path`` into the session's folder; ``written`` is the recording.

    ``worker`` reads in a process of its own. A column is chosen beforehand only where its name
    leaves no doubt, or where a file of the same layout was imported before. ``place`` says which of
    several files it is: "2 of 3".
    """

    imported = Signal(Path, object)  #: the recording, and what the import said (``Imported``)

    def __init__(
        self,
        session: Session,
        worker: Worker,
        path: Path,
        place: str = "",
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._session, self._worker, self.path = session, worker, path
        self._memory = ImportMemory(session.settings)
        self._writing = False
        self.content: Content | None = None
        self._signature = ""  # of the table, with its names as they are found by themselves
        self._line = 0  # line of the names that was read, 0 if it was found automatically
        self._tried: tuple[ImportOptions, RunMetadata] | None = None
        self.written: Path | None = None
        self._later = QTimer(self, singleShot=True, interval=_WAIT_MS)
        self._later.timeout.connect(self._try)
        self.setWindowTitle(f"Import measured data{place and f' ({place})'}")
        self._build()
        self._connect()
        self._look()

    # layout

    def _build(self) -> None:
        self.file = ElidedLabel()
        self.file.show_text(str(self.path))
        self.table_box = name_list()
        self.table_box.setToolTip("Table of the file: a sheet, a specimen or a group")
        self.table_label = QLabel("&Table")
        self.table_label.setBuddy(self.table_box)
        top = QHBoxLayout()
        top.addWidget(label("File", "heading"))
        top.addWidget(self.file, 1)
        top.addWidget(self.table_label)
        top.addWidget(self.table_box)
        self.remembered = Message()
        self.forget = button("For&get", "Forget these choices, and begin with what is sure")
        memory = QHBoxLayout()
        memory.addWidget(self.remembered, 1)
        memory.addWidget(self.forget)
        self.columns = ImportTable(self._session)
        self.fields = ImportFields(self._session)
        self.to_do = Message()  # what is still to be chosen, or wrong
        self.said = Message()  # what comes in, in words
        side = QWidget()
        inner = QVBoxLayout(side)
        inner.setContentsMargins(0, 0, SPACE, 0)
        inner.addWidget(self.fields)
        inner.addWidget(self.to_do)
        inner.addWidget(self.said)
        inner.addStretch(1)
        scrolled = QScrollArea()
        scrolled.setWidgetResizable(True)
        scrolled.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scrolled.setFrameShape(QScrollArea.Shape.NoFrame)
        scrolled.setWidget(side)
        scrolled.setMinimumWidth(400)
        self.plot = ImportPlot(self._session)
        below = QSplitter(Qt.Orientation.Horizontal)
        below.addWidget(scrolled)
        below.addWidget(self.plot)
        below.setStretchFactor(1, 1)
        below.setSizes([440, 760])
        below.setChildrenCollapsible(False)
        self.split = QSplitter(Qt.Orientation.Vertical)
        self.split.addWidget(self.columns)
        self.split.addWidget(below)
        self.split.setSizes([330, 400])
        self.split.setChildrenCollapsible(False)
        outer = QVBoxLayout(self)
        outer.addLayout(top)
        outer.addLayout(memory)
        outer.addWidget(self.split, 1)
        outer.addLayout(self._bottom())
        available = QGuiApplication.primaryScreen().availableSize()
        self.resize(min(_SIZE[0], available.width() - 60), min(_SIZE[1], available.height() - 60))

    def _bottom(self) -> QHBoxLayout:
        self.out = QLineEdit(_free_name(self._session.folder, self.path.stem))
        self.out.setToolTip("Name of the recording in the folder of recordings")
        caption = QLabel("Recording &name")
        caption.setBuddy(self.out)
        self.start = button("&Import", "Write the recording", primary=True)
        self.start.setDefault(True)
        self.job = JobControls(
            self.start, "Cancel", "Import nothing; during an import, end it (Esc)", self.reject
        )
        row = QHBoxLayout()
        for part, share in ((caption, 0), (self.out, 1), (self.job, 1)):
            row.addWidget(part, share, Qt.AlignmentFlag.AlignTop)
        return row

    def _connect(self) -> None:
        self.columns.changed.connect(self._changed)
        self.fields.changed.connect(self._changed)
        self.fields.film.currentIndexChanged.connect(self._raw_changed)
        self.fields.names_line.editingFinished.connect(self._names_line_changed)
        self.table_box.activated.connect(self._table_chosen)
        self.forget.clicked.connect(self._forget)
        self.out.textEdited.connect(self._show_state)
        self.start.clicked.connect(self.begin)

    # the file

    def _look(self) -> None:
        """Read the file again, with the line of names that is given."""
        self.content = None
        self._line = self.fields.names_line.value()
        self._submit(self._show_content, preview_file, self.path, self._line or None, self._raw())
        self._show_state()

    def _raw(self) -> dict[str, Any]:
        return raw_scales(self._session.rig_file) if self.fields.raw else {}

    @Slot(object)
    def _show_content(self, content: Content) -> None:
        self.content = content
        first = not self._signature
        self.table_box.clear()
        tables = [name for name in content.proposals if name]
        if content.table is None:
            self.table_box.addItem("choose …", None)
        self.table_box.addItem("all columns", "")
        for name in tables:
            self.table_box.addItem(name, name)
        self.table_box.setCurrentIndex(max(self.table_box.findData(content.table), 0))
        for widget in (self.table_box, self.table_label):
            widget.setVisible(bool(tables))
        self.fields.show_stated(content.stated, content.is_text)
        if first:
            self._signature = self._proposal().signature
            kept = self._memory.recall(self._signature)
            if kept is not None and kept.names_line and not self.fields.names_line.value():
                self.fields.names_line.setValue(kept.names_line)
                self._look()
                return
        self._begin_choices()

    def _proposal(self) -> ColumnGuesses:
        """Return the proposal for the table that is chosen; an empty one without."""
        name = self.table_box.currentData()
        known = {} if self.content is None else self.content.proposals
        return known.get("" if name is None else name, ColumnGuesses({}, (), ""))

    def _begin_choices(self) -> None:
        """Fill the boxes: as remembered, or else with what is sure."""
        proposal = self._proposal()
        if not self._line:
            self._signature = proposal.signature
        kept = self._memory.recall(self._signature)
        if kept is not None and (kept.names_line or 0) != self._line:
            kept = None
        choices = first_choices(proposal)
        if kept is not None:
            choices = {
                proposal.numbers[place]: choice
                for place, choice in kept.columns.items()
                if place < len(proposal.numbers)
            }
            self.fields.skip.setChecked(kept.skip_bad_rows)
            self.fields.line("rate_Hz").setText("" if kept.rate_Hz is None else f"{kept.rate_Hz:g}")
            self.fields.kinematics.setCurrentIndex(
                max(self.fields.kinematics.findData(kept.kinematics), 0)
            )
        self._show_memory(kept)
        self._show_columns(choices)

    def _show_memory(self, kept: Remembered | None) -> None:
        text = ""
        if kept is not None:
            try:
                when = datetime.fromisoformat(kept.at).astimezone().strftime(" of %d %B %Y")
            except ValueError:
                when = ""
            text = f"Remembered from the import of {kept.file}{when}: check the boxes below"
        self.remembered.show_text(text, "warn")
        self.forget.setVisible(bool(text))

    def _show_columns(self, choices: dict[int, ColumnChoice]) -> None:
        content, proposal = self.content, self._proposal()
        if content is None:
            return
        inside = set(proposal.numbers)
        columns = [column for column in content.columns if column.number in inside]
        if self.table_box.currentData() is None and not self.table_box.isHidden():
            columns = []
        self.columns.show_columns(columns, choices, proposal.guesses, self.fields.raw)
        self._changed()

    @Slot()
    def _table_chosen(self) -> None:
        self._begin_choices()

    @Slot()
    def _names_line_changed(self) -> None:
        if self.fields.names_line.value() != self._line:
            self._look()

    @Slot()
    def _raw_changed(self) -> None:
        self.columns.set_raw(self.fields.raw)

    @Slot()
    def _forget(self) -> None:
        self._memory.forget(self._signature)
        self.fields.skip.setChecked(False)
        self.fields.line("rate_Hz").clear()
        self.fields.kinematics.setCurrentIndex(0)
        if self._line:
            self.fields.names_line.setValue(0)
            self._look()
        else:
            self._begin_choices()

    # what would come in

    @Slot()
    def _changed(self) -> None:
        if self._writing:
            return
        self._tried = None
        choices, _ = self.columns.choices()
        self.fields.show_kind(kind_of(choices), {choice.quantity for choice in choices.values()})
        self._show_state()
        self._later.start()

    def _problems(self) -> list[str]:
        """Return what must be chosen or mended before anything can be tried."""
        if self.content is None:
            return []
        if self.table_box.currentData() is None and not self.table_box.isHidden():
            return ["The file has several tables: choose one."]
        choices, wrong = self.columns.choices()
        found = wrong + problems(choices, self.columns.columns, self._proposal().guesses)
        numbers, wrong = self.fields.numbers()
        there = {choice.quantity for choice in choices.values()}
        if kind_of(choices) == "film" and not wrong:
            if "displacement" in there and not there & {"stretch", "strain"}:
                found += [] if "gauge_length_mm" in numbers else ["Enter the gauge length."]
            if "force" in there and "nominal_stress" not in there:
                found += [] if "area_mm2" in numbers else ["Enter the cross-section."]
        return found + wrong

    def options(self) -> tuple[ImportOptions, RunMetadata]:
        """Return the options of the import, and film and load. Raises ``InputError``."""
        choices, _ = self.columns.choices()
        numbers, _ = self.fields.numbers()
        film = kind_of(choices) == "film"
        options = ImportOptions(
            columns_option(choices, self.columns.columns),
            gauge_length_mm=numbers.get("gauge_length_mm") if film else None,
            area_mm2=numbers.get("area_mm2") if film else None,
            kinematics=self.fields.kinematics.currentData() or None,
            rate_Hz=numbers.get("rate_Hz"),
            names_line=self.fields.names_line.value() or None,
            skip_bad_rows=self.fields.skip.isChecked(),
            raw=self._raw(),
            table=self.table_box.currentData() or None,
            guess=False,
        )
        return options, self.fields.metadata(numbers)

    @Slot()
    def _try(self) -> None:
        """Read the data as they would come in, in the other process."""
        if self.content is None or self._problems():
            self._show_trial(None)
            return
        try:
            options, metadata = self.options()
        except InputError as error:
            self._show_trial(None, noted(error))
            return
        self.said.show_text("")
        self._submit(
            lambda trial: self._take_trial(trial, options, metadata),
            try_import, self.path, options, metadata,
        )  # fmt: skip

    def _take_trial(
        self, trial: ImportTrial, options: ImportOptions, metadata: RunMetadata
    ) -> None:
        self._tried = options, metadata
        self._show_trial(trial)

    def _show_trial(self, trial: ImportTrial | None, trouble: str = "") -> None:
        self.plot.show_trial(trial)
        if trial is None:
            self.said.show_text(with_labels(trouble, self.path))
        else:
            lines = [f"{trial.samples} samples, {trial.duration:.4g} s of {trial.kind} data", ""]
            lines += [f"• {column}" for column in trial.said.columns]
            lines += [f"• {with_labels(note)}" for note in trial.said.notes]
            lines += [f"Check: {with_labels(doubt)}" for doubt in trial.said.warnings]
            self.said.show_text("\n".join(lines), "warn" if trial.said.warnings else "")
        self._show_state()

    # jobs

    def _submit(
        self, then: Callable[[Any], object], function: Callable[..., Any], *given: Any
    ) -> None:
        """Run ``function`` in the other process in place of what runs there."""
        self._drop()
        job = self._worker.submit(function, *given, whole=True)
        job.finished.connect(lambda found: self._after(job, lambda: then(found)))
        job.failed.connect(
            lambda sentence: self._after(job, lambda: self._failed(job.failure or sentence))
        )
        job.cancelled.connect(lambda: self._after(job, self._stopped))
        self.job.begin(job)

    def _drop(self) -> None:
        """End the present job; nothing of it is shown."""
        job = self.job.job
        self.job.end()
        if job is not None:
            job.cancel()

    def _after(self, job: Job, then: Callable[[], object]) -> None:
        """Do ``then`` if ``job`` is the present one, which has ended."""
        if job is self.job.job:
            self.job.end()
            then()

    def _failed(self, sentence: str) -> None:
        self._writing = False
        self._show_trial(None, sentence)

    def _stopped(self) -> None:
        self._writing = False
        self.said.show_text("Cancelled; nothing was written.", "warn")
        self._show_state()

    # the import

    def out_path(self) -> Path:
        """Return the path of the recording. Raises ``InputError`` if it cannot be written."""
        name = self.out.text().strip()
        if not name or Path(name).name != name:
            raise InputError("Recording name: enter the name of a file, without a folder")
        if Path(name).suffix.lower() not in (".h5", ".hdf5", ".nxs"):
            name = f"{name}.h5"
        return check_output(self._session.folder / name, False, self.path)

    @Slot()
    def begin(self) -> None:
        """Write the recording that is shown."""
        if self._tried is None or not self.start.isEnabled():
            return
        options, metadata = self._tried
        try:
            out = self.out_path()
        except InputError as error:
            self.to_do.show_text(with_labels(error))
            return
        self._submit(
            lambda said: self._take_import(out, said),
            write_import, self.path, out, options, metadata, False,
        )  # fmt: skip
        self._writing = True
        self._show_state()

    def _take_import(self, out: Path, said: Imported) -> None:
        self._writing = False
        self.written = out
        self._keep()
        self.imported.emit(out, said)
        self.accept()

    def _keep(self) -> None:
        """Remember the choices for files of the same layout."""
        options, _ = self._tried or self.options()
        places = {number: place for place, number in enumerate(self._proposal().numbers)}
        choices, _ = self.columns.choices()
        self._memory.keep(
            self._signature,
            Remembered(
                self.path.name,
                {places[number]: choice for number, choice in choices.items()},
                options.names_line,
                options.rate_Hz,
                options.skip_bad_rows,
                options.kinematics or "",
            ),
        )

    def reject(self) -> None:
        """End an import that goes on; otherwise close the dialog."""
        if self._writing and self.job.job is not None:
            self.job.cancel()
            return
        self._later.stop()
        self._drop()
        super().reject()

    @Slot()
    def _show_state(self) -> None:
        """Enable what can be done, and say what is still open."""
        found = self._problems()
        if not found and self.content is not None:
            try:
                self.out_path()
            except InputError as error:
                found = [with_labels(error)]
        self.start.setEnabled(not found and self._tried is not None and not self._writing)
        for widget in (self.columns, self.fields, self.table_box, self.out):
            widget.setEnabled(self.content is not None and not self._writing)
        shown, there = len(self.columns.columns), len(self._proposal().numbers)
        if 0 < shown < there:
            found.append(
                f"The first {shown} of {there} columns are shown, those with a known name before "
                f"others."
            )
        self.to_do.show_text("\n".join(found), "warn")


def _free_name(folder: Path, stem: str) -> str:
    """Return a name for a recording that no file of ``folder`` has."""
    name, number = f"{stem}.h5", 2
    while (folder / name).exists():
        name, number = f"{stem}-{number}.h5", number + 1
    return name
