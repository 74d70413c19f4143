"""The page Recordings: the folder, several recordings on one plot, export, recovery, conditions."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import (
    QItemSelection,
    QItemSelectionModel,
    QModelIndex,
    QSortFilterProxyModel,
    Qt,
    QTimer,
    Signal,
    Slot,
)
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QComboBox,
    QFileDialog,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QMenu,
    QSplitter,
    QTableView,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.summary import (
    Curves,
    Difference,
    curves,
    differences,
    export_file,
    recover_file,
)
from dearig.recording.exporters import EXPORTS
from dearig.report.numbers import significant
from dearig.report.tables import Row, Table
from dearig.units import SHOWN
from dearig.window.curves_plot import CurvesPlot
from dearig.window.folder_table import COLUMNS, PATH, SORT, FolderModel, ThumbnailDelegate
from dearig.window.layout_state import remember
from dearig.window.library import shared_library
from dearig.window.report_table import ReportTable, two_columns
from dearig.window.session import Session
from dearig.window.theme import SPACE
from dearig.window.widgets import Message, button, label
from dearig.window.worker import Job

__all__ = ["RecordingsPage"]

_TOGETHER_MAX = 6  # as many as there are colours to tell them apart by
_CHOOSE_MS = 80  # after which a choice is read: arrow keys pass over many
_ANOTHER = "Another model…"


class RecordingsPage(QWidget):
    """A browser of the session's folder.

    ``open_sequence`` carries the sequence of a recording that is to be played again.
    """

    title = "Recordings"
    shortcut = "Ctrl+4"
    open_sequence = Signal(str)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._library = shared_library(session)
        self._reading: list[Job] = []
        self._read: dict[Path, Curves] = {}
        self._wanted: list[Path] = []
        self._round = 0
        self._differing: Job | None = None
        self._waited: list[Path] = []  # to be chosen when they are there
        self._choose = QTimer(self, singleShot=True, interval=_CHOOSE_MS)
        self._choose.timeout.connect(self._show_chosen)

        self.folder_button = button("", "")
        self.folder_button.clicked.connect(self._ask_folder)
        self.filter = QLineEdit(placeholderText="Find by name, sequence, film, operator or notes")
        self.filter.setClearButtonEnabled(True)
        self.filter.setToolTip("Shows only recordings with these words (Ctrl+F)")
        self.model_box = QComboBox()
        self.model_box.setToolTip("The model with which every recording is compared")
        self.model_box.activated.connect(self._model_chosen)
        self.count = label("", "muted")
        find = QAction(self)
        find.setShortcut(QKeySequence(QKeySequence.StandardKey.Find))
        find.triggered.connect(self.filter.setFocus)
        self.addAction(find)
        compare_label = QLabel("&Compare with")
        compare_label.setBuddy(self.model_box)

        top = QHBoxLayout()
        top.addWidget(self.folder_button)
        top.addWidget(self.filter, 1)
        top.addWidget(compare_label)
        top.addWidget(self.model_box)
        top.addWidget(self.count)

        self.files = FolderModel(session)
        self._sorted = _Found(self)
        self._sorted.setSourceModel(self.files)
        self.table = _table(self._sorted, session)
        self.table.selectionModel().selectionChanged.connect(self._selected)
        self.filter.textChanged.connect(self._sorted.find)

        self.plot = CurvesPlot(session)
        self.model_shown = QCheckBox("&Model and residual")
        self.model_shown.setChecked(True)
        self.model_shown.setToolTip("Draw the model beside the measurement, and what it leaves")
        self.model_shown.toggled.connect(self.plot.show_model)
        self.whole = button("&Whole run", "Show all of the time again after zooming")
        self.whole.clicked.connect(self._show_whole)
        self.message = Message()

        self.about, self.events, self.differences = (ReportTable(words=True) for _ in range(3))
        self.sides = QTabWidget()
        self.sides.addTab(self.about, "About")
        self.sides.addTab(self.events, "Events")
        self.sides.addTab(self.differences, "Differences")
        self.sides.setTabToolTip(2, "Conditions in which the chosen recordings differ")

        lower = QSplitter(Qt.Orientation.Horizontal)
        lower.addWidget(self.plot)
        lower.addWidget(self.sides)
        lower.setChildrenCollapsible(False)
        self.columns = lower
        self.splitter = QSplitter(Qt.Orientation.Vertical)
        self.splitter.addWidget(self.table)
        below = QWidget()
        inner = QVBoxLayout(below)
        inner.setContentsMargins(0, 0, 0, 0)
        inner.addLayout(self._tools())
        inner.addWidget(lower, 1)
        self.splitter.addWidget(below)
        self.splitter.setChildrenCollapsible(False)
        self.reset_layout()
        remember(self.splitter, session.settings, "recordings/rows")
        remember(self.columns, session.settings, "recordings/columns")

        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.setSpacing(SPACE)
        outer.addLayout(top)
        outer.addWidget(self.message)
        outer.addWidget(self.splitter, 1)

        self._library.listed.connect(self._listed)
        self._library.looked.connect(self._looked)
        self._library.trouble.connect(self.message.show_text)
        self._library.busy.connect(self._busy)
        session.folder_changed.connect(self._name_folder)
        session.overlays_changed.connect(self._list_models)
        self._name_folder()
        self._list_models()
        self._listed()
        self._show_chosen()

    def _tools(self) -> QHBoxLayout:
        self.export_button = button(
            "&Export as", "Write the chosen recordings as CSV, MAT (MATLAB) or Parquet"
        )
        menu = QMenu(self.export_button)
        for form in EXPORTS:
            action = menu.addAction(form.upper() if form != "parquet" else "Parquet")
            action.triggered.connect(lambda _=False, form=form: self._ask_export(form))
        self.export_button.setMenu(menu)
        self.recover_button = button(
            "&Recover", "Mend a recording whose run was killed, so that any program can read it"
        )
        self.recover_button.clicked.connect(self.recover)
        self.again_button = button(
            "&Play again", "Take the sequence of this recording to the page Sequence"
        )
        self.again_button.clicked.connect(self._play_again)
        tools = QHBoxLayout()
        for made in (self.export_button, self.recover_button, self.again_button):
            tools.addWidget(made)
        tools.addStretch(1)
        tools.addWidget(self.model_shown)
        tools.addWidget(self.whole)
        return tools

    @Slot()
    def reset_layout(self) -> None:
        """Give every part the room that it has at the first start."""
        self.splitter.setSizes([252, 438])
        self.columns.setSizes([760, 420])

    def close_work(self) -> None:
        """End the process in which recordings are read; the window is closing."""
        self._choose.stop()
        self._round += 1
        self._library.close()

    # ------------------------------------------------------------ what is chosen

    def chosen(self) -> list[Path]:
        """The recordings whose rows are selected, in the order of the table."""
        rows = sorted(self.table.selectionModel().selectedRows(), key=QModelIndex.row)
        return [row.data(PATH) for row in rows]

    def choose(self, paths: list[Path]) -> None:
        """Select the rows of ``paths``; those that are not listed yet, as soon as they are."""
        self._waited = [path for path in paths if path not in self._library.files]
        selection = QItemSelection()
        for row in range(self._sorted.rowCount()):
            index = self._sorted.index(row, 0)
            if index.data(PATH) in paths:
                selection.select(index, self._sorted.index(row, len(COLUMNS) - 1))
        flags = QItemSelectionModel.SelectionFlag
        self.table.selectionModel().select(selection, flags.ClearAndSelect | flags.Rows)

    @Slot()
    def _selected(self) -> None:
        self._choose.start()

    @Slot()
    def _show_chosen(self) -> None:
        chosen = self.chosen()
        self.export_button.setEnabled(bool(chosen))
        self.recover_button.setEnabled(any(self._broken(path) for path in chosen))
        self.again_button.setEnabled(False)
        self._round += 1
        for job in self._reading:
            job.cancel()
        self._reading.clear()
        self._read.clear()
        self._wanted = chosen[:_TOGETHER_MAX]
        if len(chosen) > _TOGETHER_MAX:
            self.message.show_text(
                f"{len(chosen)} recordings are chosen; the first {_TOGETHER_MAX} of them are drawn",
                "warn",
            )
        else:
            self.message.show_text("")
        readable = [path for path in self._wanted if not self._trouble(path)]
        for words in filter(None, map(self._trouble, self._wanted)):
            self.message.show_text(words)
        self._wanted = readable
        if not readable:
            self.plot.show_curves(())
            self._show_about()
        for path in readable:
            of = self._round
            job = self._library.submit(
                curves, path, self._library.model, self._session.overlay_drive
            )
            job.finished.connect(lambda found, of=of: self._took(found, of))
            job.failed.connect(self.message.show_text)
            self._reading.append(job)
        if self._differing is not None:
            self._differing.cancel()
            self._differing = None
        self.differences.show_table(Table("", (), ()))
        self.sides.setTabText(2, "Differences")
        if len(readable) > 1:
            of = self._round
            self._differing = self._library.submit(differences, readable)
            self._differing.finished.connect(
                lambda rows, of=of, paths=readable: self._differ(paths, rows, of)
            )

    def _trouble(self, path: Path) -> str:
        summary = self._library.summaries.get(path)
        return "" if summary is None else summary.trouble

    def _broken(self, path: Path) -> bool:
        summary = self._library.summaries.get(path)
        return summary is not None and not summary.complete

    def _took(self, found: Curves, of: int) -> None:
        if of != self._round:
            return
        self._read[found.path] = found
        ready = [self._read[path] for path in self._wanted if path in self._read]
        if len(ready) < len(self._wanted):
            return
        kinds = {c.kind for c in ready}
        if len(kinds) > 1:
            first = ready[0].kind
            ready = [c for c in ready if c.kind == first]
            self.message.show_text(
                "Recordings driven by voltage and by stretch have no axis in common: those like "
                f"{ready[0].name} are drawn",
                "warn",
            )
        self.plot.show_curves(ready)
        self._show_about()
        unfit = next((c.unfit for c in ready if c.unfit), "")
        if unfit:
            self.message.show_text(f"No model is drawn: {unfit}", "warn")
        self.again_button.setEnabled(len(ready) == 1 and bool(ready[0].sequence_toml))

    def _show_about(self) -> None:
        shown = self.plot.shown
        if len(shown) == 1:
            self.about.show_table(two_columns("", shown[0].about))
        else:
            names = tuple((c.name, _rms(c)) for c in shown)
            words = (("", "Choose a recording above; with Ctrl or Shift, several"),)
            self.about.show_table(two_columns("", names or words))
        rows = tuple(
            Row((f"{e.time:.4g}", c.name, e.level, e.message), mark=e.level != "info")
            for c in shown
            for e in c.events
        )
        head = (("Time", "s"), ("Recording", ""), ("Level", ""), ("What happened", ""))
        self.events.show_table(Table("", head, rows))
        self.sides.setTabText(1, f"Events ({len(rows)})" if rows else "Events")

    def _differ(self, paths: list[Path], rows: tuple[Difference, ...], of: int) -> None:
        if of != self._round:
            return
        head = (("Condition", ""), *((path.stem, "") for path in paths))
        cells = tuple(Row((row.what, *row.values)) for row in rows)
        self.differences.show_table(Table("", head, cells))
        self.sides.setTabText(2, f"Differences ({len(rows)})")
        self.sides.setCurrentIndex(2)

    @Slot()
    def _show_whole(self) -> None:
        self.plot.show_curves(self.plot.shown)

    # ------------------------------------------------------------ what can be done with them

    def export(self, path: Path, form: str, out: Path) -> None:
        """Write the recording at ``path`` as ``form`` to ``out``, in the other process."""
        self.message.show_text(f"Writing {out.name}", "muted")
        job = self._library.submit(export_file, path, form, out)
        job.finished.connect(
            lambda written: self.message.show_text(f"{written} was written", "good")
        )
        job.failed.connect(self.message.show_text)

    def _ask_export(self, form: str) -> None:
        chosen = self.chosen()
        if len(chosen) == 1:
            proposed = chosen[0].with_suffix(f".{form}")
            name, _ = QFileDialog.getSaveFileName(
                self, f"Export {chosen[0].name}", str(proposed), f"*.{form}"
            )
            if name:
                self.export(chosen[0], form, Path(name))
            return
        name = QFileDialog.getExistingDirectory(
            self, f"Folder for {len(chosen)} exported recordings", str(self._session.folder)
        )
        for path in chosen if name else ():
            self.export(path, form, Path(name) / f"{path.stem}.{form}")

    @Slot()
    def recover(self) -> None:
        """Mend those of the chosen recordings whose run was killed."""
        for path in filter(self._broken, self.chosen()):
            job = self._library.submit(recover_file, path)
            job.finished.connect(self._recovered)
            job.failed.connect(self.message.show_text)

    @Slot(object)
    def _recovered(self, words: str) -> None:
        self._library.refresh()
        self.message.show_text(words, "good")

    @Slot()
    def _play_again(self) -> None:
        if len(self.plot.shown) == 1:
            self.open_sequence.emit(self.plot.shown[0].sequence_toml)

    # ------------------------------------------------------------ folder and model

    @Slot()
    def _ask_folder(self) -> None:
        name = QFileDialog.getExistingDirectory(
            self, "Folder of recordings", str(self._session.folder)
        )
        if name:
            self._session.set_folder(Path(name))

    @Slot()
    def _name_folder(self) -> None:
        folder = self._session.folder
        self.folder_button.setText(f"Folder: {folder.name or folder}")
        self.folder_button.setToolTip(f"{folder}: choose another folder")

    @Slot()
    def _list_models(self) -> None:
        box, path = self.model_box, self._library.model
        box.clear()
        box.addItem("the thesis's model", None)
        for overlay in self._session.overlays:
            if overlay.path is not None:
                box.addItem(overlay.name, overlay.path)
        if path is not None and box.findData(path) < 0:
            box.addItem(path.stem, path)
        box.addItem(_ANOTHER)
        box.setCurrentIndex(max(box.findData(path), 0))

    @Slot(int)
    def _model_chosen(self, index: int) -> None:
        if self.model_box.itemText(index) == _ANOTHER:
            name, _ = QFileDialog.getOpenFileName(
                self, "Model to compare with", str(self._session.folder), "Models (*.toml)"
            )
            self.compare_with(Path(name) if name else self._library.model)
        else:
            self.compare_with(self.model_box.itemData(index))

    def compare_with(self, model: Path | None) -> None:
        """Set all recordings beside the model file ``model``; None is the thesis's."""
        if model != self._library.model:
            self.files.clear_errors()
            self._library.set_model(model)
            self._show_chosen()
        self._list_models()

    @Slot()
    def _listed(self) -> None:
        self.files.set_files(self._library.files, self._library.summaries)
        if self._waited and all(path in self._library.files for path in self._waited):
            self.choose(self._waited)
        if not self._library.files:
            self.count.setText("no recordings yet")

    @Slot(Path)
    def _looked(self, path: Path) -> None:
        self.files.set_summary(self._library.summaries[path])
        if not self.chosen() and self._sorted.rowCount():
            # something to see: the newest, or whatever stands first
            self.choose([self._sorted.index(0, 0).data(PATH)])
        if path in self.chosen() and path not in [c.path for c in self.plot.shown]:
            self._choose.start()  # it can be read only now, or was changed

    @Slot(int)
    def _busy(self, left: int) -> None:
        count = len(self._library.files)
        words = f"{count} recording{'' if count == 1 else 's'}"
        self.count.setText(f"{words}, {left} to read" if left else words)


def _rms(curves: Curves) -> str:
    if curves.errors is None:
        return curves.unfit
    shown = SHOWN[curves.kind]
    return f"{significant(curves.errors.rms * shown.error_factor)} {shown.error_unit} RMS"


class _Found(QSortFilterProxyModel):
    """The rows in which the words that are looked for occur."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._words: list[str] = []
        self.setSortRole(SORT)

    @Slot(str)
    def find(self, text: str) -> None:
        """Keep the rows with all words of ``text``."""
        self.beginFilterChange()
        self._words = text.casefold().split()
        self.endFilterChange()

    def filterAcceptsRow(self, row: int, parent: QModelIndex) -> bool:  # type: ignore[override]  # noqa: N802
        if not self._words:
            return True
        model = self.sourceModel()
        cells = [str(model.index(row, column, parent).data() or "") for column in range(1, 5)]
        tip = str(model.index(row, 1, parent).data(Qt.ItemDataRole.ToolTipRole) or "")
        text = " ".join([*cells, tip]).casefold()
        return all(word in text for word in self._words)


def _table(model: QSortFilterProxyModel, session: Session) -> QTableView:
    table = QTableView()
    table.setModel(model)
    table.setAccessibleName("Recordings of the folder")
    table.setSortingEnabled(True)
    table.sortByColumn(4, Qt.SortOrder.DescendingOrder)
    table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
    table.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
    table.setAlternatingRowColors(True)
    table.setShowGrid(False)
    table.setTabKeyNavigation(False)
    table.setWordWrap(False)
    table.setItemDelegateForColumn(0, ThumbnailDelegate(session))
    table.verticalHeader().hide()
    table.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
    table.verticalHeader().setDefaultSectionSize(32)
    header = table.horizontalHeader()
    header.setHighlightSections(False)
    for column, width in enumerate((88, 170, 170, 120, 126, 64, 84, 74, 84, 110)):
        table.setColumnWidth(column, width)
    for column in (1, 2):
        header.setSectionResizeMode(column, QHeaderView.ResizeMode.Stretch)
    return table
