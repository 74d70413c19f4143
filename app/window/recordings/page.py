"""Page Recordings: browse a folder, plot and compare recordings, export and recover them."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Slot
from PySide6.QtGui import QAction, QDragEnterEvent, QDropEvent, QKeySequence
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QMenu,
    QSplitter,
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
from dearig.report.text.tables import Row, Table
from dearig.window.documents.dialogs import choose_file, choose_folder, save_as
from dearig.window.imports.queue import Imports
from dearig.window.jobs.worker import Job
from dearig.window.kit.flow import Flow
from dearig.window.kit.report_table import ReportTable, two_columns
from dearig.window.kit.theme import SPACE
from dearig.window.kit.turns import Turns
from dearig.window.kit.widgets import ElidedLabel, Message, button, menu_button, plain_tip
from dearig.window.recordings.conditions_table import ConditionsTable
from dearig.window.recordings.curves_plot import CurvesPlot, rms_text
from dearig.window.recordings.folder_model import FolderModel
from dearig.window.recordings.library import shared_library
from dearig.window.recordings.recording_analysis import RecordingAnalysis
from dearig.window.recordings.table import RecordingsTable
from dearig.window.recordings.tags_field import TagsField
from dearig.window.recordings.trend_plot import TrendPlot
from dearig.window.session.layout_state import remember
from dearig.window.session.page import Page
from dearig.window.session.state import Session

__all__ = ["RecordingsPage"]

_TOGETHER_MAX = 6  # recordings in one plot: the theme has six colours for curves
_CHOOSE_MS = 80  # wait after a selection: arrow keys pass over many rows
_COUNT = 230  # px, of the number of recordings
_OPEN_MODEL = "Open a model file …"


class RecordingsPage(Page):
    """Browser of the session's folder; a recording's sequence can be edited or run again."""

    title = "Recordings"

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, parent)
        self._session = session
        self._library = shared_library(session)
        self.imports = Imports(session, self)
        self.setAcceptDrops(True)
        self._reading: list[Job] = []
        self._read: dict[Path, Curves] = {}
        self._wanted: list[Path] = []
        self._turns = Turns(lambda: session.busy, self)
        self._round = 0
        self._differing: Job | None = None
        self._to_choose: list[Path] = []  # files to choose as soon as they are listed
        self._choose = QTimer(self, singleShot=True, interval=_CHOOSE_MS)
        self._choose.timeout.connect(self._show_chosen)

        self._shown: tuple[object, ...] = ()  # what was asked for last
        self.folder_message = Message()  # of the folder; the other one is of what is selected
        self.message = Message()
        self._build()
        self._connect()
        self._name_folder()
        self._list_models()
        self._listed()
        self._show_chosen()

    def _build(self) -> None:
        self.files = FolderModel(self._session)
        self.table = RecordingsTable(self.files, self._session)
        self.plot = CurvesPlot(self._session)
        self.analysis = RecordingAnalysis(self._session, self._library, self)
        self.trend = TrendPlot(self._session)
        self.details, self.events = (ReportTable(words=True) for _ in range(2))
        self.differences = ConditionsTable()
        self.side_tabs = QTabWidget()
        self.side_tabs.addTab(self.details, "Details")
        self.side_tabs.addTab(self.events, "Events")
        self.side_tabs.addTab(self.differences, "Differences")
        self.side_tabs.setTabToolTip(2, "Conditions that differ between the selected recordings")

        self.columns = QSplitter(Qt.Orientation.Horizontal)
        self.columns.addWidget(self.plot)
        self.columns.addWidget(self.side_tabs)
        self.columns.setChildrenCollapsible(False)
        self.views = QTabWidget()
        self.views.addTab(self.columns, "Curves")
        self.views.addTab(self.analysis.loop, "Loop")
        self.views.addTab(self.analysis.spectrum, "Spectrum")
        self.views.addTab(self.trend, "Trend")
        for place, tip in enumerate(
            (
                "Selected recordings over time",
                "Displacement of the selected recordings against voltage, or its square",
                "Spectra of displacement and residual of the first selected recording",
                "A number of all listed recordings over the time of their runs",
            )
        ):
            self.views.setTabToolTip(place, tip)
        self.views.currentChanged.connect(self._view_changed)
        below = QWidget()
        inner = QVBoxLayout(below)
        inner.setContentsMargins(0, 0, 0, 0)
        inner.addLayout(self._tools())
        inner.addWidget(self.views, 1)
        self.splitter = QSplitter(Qt.Orientation.Vertical)
        self.splitter.addWidget(self.table)
        self.splitter.addWidget(below)
        self.splitter.setChildrenCollapsible(False)
        self._default_sizes()
        remember(self.splitter, self._session.settings, "recordings/rows")
        remember(self.columns, self._session.settings, "recordings/columns")

        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.setSpacing(SPACE)
        outer.addLayout(self._top_row())
        outer.addWidget(self.folder_message)
        outer.addWidget(self.message)
        outer.addWidget(self.splitter, 1)

    def _connect(self) -> None:
        self.table.chosen_changed.connect(lambda: self._choose.start())
        self.table.verticalScrollBar().valueChanged.connect(self._prefer_visible)
        self.filter.textChanged.connect(self._find)
        self.files.arranged.connect(self._rows_changed)
        self.trend.picked.connect(lambda path: self.choose([path]))
        self.imports.said.connect(self.message.show_text)
        self.imports.written.connect(self._imported)
        self.analysis.trouble.connect(self.message.show_text)
        self._library.listed.connect(self._listed)
        self._library.summarised.connect(self._summarised)
        self._library.trouble.connect(self.folder_message.show_text)
        self._library.busy.connect(self._busy)
        self._session.folder_changed.connect(self._name_folder)
        self._session.overlays_changed.connect(self._list_models)

    def _top_row(self) -> Flow:
        self.folder_button = button("", "")
        self.folder_button.clicked.connect(self._ask_folder)
        self.import_button = button(
            "&Import …",
            "Import measured data of other programs (Ctrl+I); files can be dropped on this page",
        )
        self.import_button.setShortcut(QKeySequence("Ctrl+I"))
        self.import_button.clicked.connect(self.imports.ask)
        self.filter = QLineEdit(placeholderText="Search in all columns")
        self.filter.setClearButtonEnabled(True)
        self.filter.setToolTip(
            "Show only recordings with all of these words in any column, also in one that is not "
            "shown, and in their notes (Ctrl+F)"
        )
        find = QAction(self)
        find.setShortcut(QKeySequence(QKeySequence.StandardKey.Find))
        find.triggered.connect(self.filter.setFocus)
        self.addAction(find)
        self.model_box = QComboBox()
        self.model_box.setToolTip("Model that every recording is compared with")
        self.model_box.activated.connect(self._model_chosen)
        compare_label = QLabel("&Compare with")
        compare_label.setBuddy(self.model_box)
        # of a width that its text does not change: else the row breaks, and the page is laid out
        self.count = ElidedLabel("muted")
        self.count.setMinimumWidth(_COUNT)
        self.subfolders = QCheckBox("Su&bfolders")
        self.subfolders.setChecked(self._library.deep)
        self.subfolders.setToolTip("List the recordings in subfolders too")
        self.subfolders.toggled.connect(self._library.set_deep)
        columns = menu_button("Columns", "Choose the columns of the table", self.table.columns_menu)
        row = Flow()
        row.add(self.folder_button)
        row.add(self.import_button)
        row.add(self.subfolders)
        row.add(self.filter, share=1)
        row.add(self.count, share=1)
        row.add(columns)
        row.add(compare_label, self.model_box)
        return row

    def _tools(self) -> QHBoxLayout:
        self.export_button = button(
            "&Export as", "Write the selected recordings as CSV, MAT (MATLAB) or Parquet"
        )
        menu = QMenu(self.export_button)
        for form in EXPORTS:
            action = menu.addAction(EXPORTS[form].title)
            action.triggered.connect(lambda _=False, form=form: self._ask_export(form))
        self.export_button.setMenu(menu)
        self.recover_button = button(
            "&Recover", "Repair a recording whose run was killed, so that any program can read it"
        )
        self.recover_button.clicked.connect(self.recover)
        self.sequence_button = button(
            "Open its &sequence", "Open the sequence of this recording on the Sequence page"
        )
        self.sequence_button.clicked.connect(self._open_its_sequence)
        tools = QHBoxLayout()
        for made in (self.export_button, self.recover_button, self.sequence_button):
            tools.addWidget(made)
        self.tags = TagsField(self._library)
        self.tags.trouble.connect(self.message.show_text)
        tag_key = QAction(self)
        tag_key.setShortcut(QKeySequence("Ctrl+T"))
        tag_key.triggered.connect(self.tags.setFocus)
        self.addAction(tag_key)
        tags_label = QLabel("Ta&gs")
        tags_label.setBuddy(self.tags)
        tools.addWidget(tags_label)
        tools.addWidget(self.tags, 1)
        self.model_shown = QCheckBox("&Model and residual")
        self.model_shown.setChecked(True)
        self.model_shown.setToolTip("Plot the model and its residual")
        self.model_shown.toggled.connect(self.plot.show_model)
        self.whole = button("&Whole run", "Show the whole time axis again after zooming")
        self.whole.clicked.connect(self._show_whole)
        self.current_shown = QCheckBox("C&urrent")
        self.current_shown.setToolTip("Plot the monitored current")
        self.current_shown.toggled.connect(self.plot.show_current)
        tools.addWidget(self.current_shown)
        tools.addWidget(self.model_shown)
        tools.addWidget(self.whole)
        return tools

    @Slot()
    def reset_layout(self) -> None:
        """Give every part its default size, and show the columns of the first start."""
        self._default_sizes()
        self.table.reset_columns()

    def _default_sizes(self) -> None:
        self.splitter.setSizes([252, 438])
        self.columns.setSizes([760, 420])

    def close_work(self) -> None:
        """End the process that reads recordings."""
        self._choose.stop()
        self._round += 1
        self.imports.close()
        self._library.close()

    # selection

    def chosen(self) -> list[Path]:
        """Return the selected recordings, in the order of the table."""
        return self.table.chosen

    def choose(self, paths: list[Path]) -> None:
        """Select the rows of ``paths``; files that are not listed yet are selected later."""
        self._to_choose = [path for path in paths if path not in self._library.files]
        self.table.choose(paths)
        if self.table.chosen:
            self.table.scrollTo(self.table.currentIndex())

    @Slot()
    def _show_chosen(self) -> None:
        chosen = self.chosen()
        self.tags.show_recordings(chosen)
        if self.views.currentWidget() is self.trend:
            self.trend.show_chosen(chosen)
        asked = (*chosen, self._library.model, *map(self._changed_at, chosen))
        if asked == self._shown:
            return  # the rows have only moved
        self._shown = asked
        self.export_button.setEnabled(bool(chosen))
        self.recover_button.setEnabled(any(self._incomplete(path) for path in chosen))
        self.sequence_button.setEnabled(False)
        self._round += 1
        for job in self._reading:
            job.cancel()
        self._reading.clear()
        self._read.clear()
        self._wanted = chosen[:_TOGETHER_MAX]
        self.message.show_text("")
        readable = [path for path in self._wanted if not self._trouble(path)]
        for words in filter(None, map(self._trouble, self._wanted)):
            self.message.show_text(words)
        self._wanted = readable
        self.analysis.forget()
        self._analyse()
        if not readable:
            self.plot.show_curves(())
            self._turns.clear()
            self._show_details()
            self._show_events()
        for path in readable:
            of = self._round
            job = self._library.submit(
                curves, path, self._library.model, self._session.overlay_drive
            )
            job.finished.connect(lambda found, of=of: self._take_curves(found, of))
            job.failed.connect(lambda words, of=of, path=path: self._not_read(path, words, of))
            self._reading.append(job)
        self._show_count()
        if self._differing is not None:
            self._differing.cancel()
            self._differing = None
        self.differences.show_differences((), ())
        self.side_tabs.setTabText(2, "Differences")
        if len(readable) < 2:
            if self.side_tabs.currentWidget() is self.differences:
                self.side_tabs.setCurrentWidget(self.details)
        else:
            of = self._round
            self._differing = self._library.submit(differences, readable)
            self._differing.finished.connect(
                lambda rows, of=of, paths=readable: self._show_differences(paths, rows, of)
            )

    def _analyse(self) -> None:
        """Show loops or spectra of the selected recordings, if their view is on the screen."""
        if self.views.currentWidget() is self.analysis.loop:
            self.analysis.show_loops(self._wanted)
        elif self.views.currentWidget() is self.analysis.spectrum:
            self.analysis.show_spectra(self._wanted)

    def _trouble(self, path: Path) -> str:
        summary = self._library.summaries.get(path)
        return "" if summary is None else summary.trouble

    def _incomplete(self, path: Path) -> bool:
        summary = self._library.summaries.get(path)
        return summary is not None and not summary.complete and not summary.trouble

    def _take_curves(self, found: Curves, of: int) -> None:
        if of != self._round:
            return
        self._read[found.path] = found
        self._show_read()

    def _not_read(self, path: Path, words: str, of: int) -> None:
        if of == self._round:
            self.message.show_text(words)
            self._wanted.remove(path)
            self._show_read()

    def _show_read(self) -> None:
        ready = [self._read[path] for path in self._wanted if path in self._read]
        if len(ready) < len(self._wanted):
            return
        self._show_count()
        if not ready:
            return
        kinds = {c.kind for c in ready}
        if len(kinds) > 1:
            first = ready[0].kind
            ready = [c for c in ready if c.kind == first]
            self.message.show_text(
                "Recordings driven by voltage and by stretch cannot share a plot: only those like "
                f"{ready[0].name} are plotted",
                "warn",
            )
        self.plot.show_curves(ready)
        self._turns.clear()
        self._turns.add((self._show_details, self._show_events))
        unfit = next((c.unfit for c in ready if c.unfit), "")
        if unfit:
            self.message.show_text(f"No model is plotted: {unfit}", "warn")
        self.sequence_button.setEnabled(len(ready) == 1 and bool(ready[0].sequence_toml))

    def _show_details(self) -> None:
        shown = self.plot.shown
        if len(shown) == 1:
            self.details.show_table(two_columns("", shown[0].about))
        else:
            names = tuple((c.name, rms_text(c)) for c in shown)
            words = (("", "Select a recording above; several with Ctrl or Shift"),)
            self.details.show_table(two_columns("", names or words))

    def _show_events(self) -> None:
        shown = self.plot.shown
        rows = tuple(
            Row((f"{e.time:.4g}", c.name, e.level, e.message), mark=e.level != "info")
            for c in shown
            for e in c.events
        )
        head = (("Time", "s"), ("Recording", ""), ("Level", ""), ("Event", ""))
        self.events.show_table(Table("", head, rows))
        self.side_tabs.setTabText(1, f"Events ({len(rows)})" if rows else "Events")

    def _show_differences(self, paths: list[Path], rows: tuple[Difference, ...], of: int) -> None:
        if of != self._round:
            return
        names = [s.name if (s := self._library.summaries.get(p)) else p.stem for p in paths]
        self.differences.show_differences(names, rows)
        self.side_tabs.setTabText(2, f"Differences ({len(rows)})")
        self.side_tabs.setCurrentIndex(2)

    @Slot()
    def _show_whole(self) -> None:
        self.plot.show_curves(self.plot.shown)

    # commands

    def export(self, path: Path, form: str, out: Path) -> None:
        """Write the recording ``path`` as ``form`` to ``out``, in the other process."""
        self.message.show_text(f"Writing {out.name} …", "muted")
        job = self._library.submit(export_file, path, form, out)
        job.finished.connect(lambda written: self.message.show_text(f"Wrote {written}", "good"))
        job.failed.connect(self.message.show_text)

    def _ask_export(self, form: str) -> None:
        chosen = self.chosen()
        if len(chosen) == 1:
            proposed = chosen[0].with_suffix(f".{form}")
            out = save_as(
                self, self._session, f"Export {chosen[0].name}", proposed, f"*.{form}", f".{form}"
            )
            if out is not None:
                self.export(chosen[0], form, out)
            return
        title = f"Folder for {len(chosen)} exported recordings"
        folder = choose_folder(self, self._session, title, self._session.folder)
        if folder is not None:
            for path in chosen:
                self.export(path, form, folder / f"{path.stem}.{form}")

    @Slot()
    def recover(self) -> None:
        """Repair the selected recordings that are incomplete."""
        for path in filter(self._incomplete, self.chosen()):
            job = self._library.submit(recover_file, path)
            job.finished.connect(self._recovered)
            job.failed.connect(self.message.show_text)

    @Slot(object)
    def _recovered(self, words: str) -> None:
        self._library.refresh()
        self.message.show_text(words, "good")

    @Slot()
    def _open_its_sequence(self) -> None:
        if len(self.plot.shown) == 1:
            self.edit_sequence.emit(self.plot.shown[0].sequence_toml)

    # import

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:  # noqa: N802
        if _files(event):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:  # noqa: N802
        event.acceptProposedAction()
        files = _files(event)
        # the program that the files come from waits for the end of this call
        QTimer.singleShot(0, lambda: self.imports.import_files(files))

    @Slot(list)
    def _imported(self, paths: list[Path]) -> None:
        self._library.refresh()
        self.choose(paths)

    # folder and model

    @Slot()
    def _ask_folder(self) -> None:
        folder = choose_folder(self, self._session, "Folder of recordings", self._session.folder)
        if folder is not None:
            self._session.set_folder(folder)

    @Slot()
    def _name_folder(self) -> None:
        folder = self._session.folder
        self.folder_button.setText(f"Folder: {folder.name or folder}")
        self.folder_button.setToolTip(plain_tip(f"{folder}; click to choose another folder"))

    @Slot()
    def _list_models(self) -> None:
        box, path = self.model_box, self._library.model
        box.clear()
        box.addItem("thesis model", None)
        for overlay in self._session.overlays:
            if overlay.path is not None:
                box.addItem(overlay.name, overlay.path)
        if path is not None and box.findData(path) < 0:
            box.addItem(path.stem, path)
        box.addItem(_OPEN_MODEL)
        box.setCurrentIndex(max(box.findData(path), 0))

    @Slot(int)
    def _model_chosen(self, index: int) -> None:
        if self.model_box.itemText(index) == _OPEN_MODEL:
            model = choose_file(
                self, self._session, "Model to compare with", self._session.folder,
                "Models (*.toml)",
            )  # fmt: skip
            self.compare_with(model or self._library.model)
        else:
            self.compare_with(self.model_box.itemData(index))

    def compare_with(self, model: Path | None) -> None:
        """Compare all recordings with the model file ``model``; None is the thesis model."""
        if model != self._library.model:
            self._library.set_model(model)
            self._show_chosen()
        self._list_models()

    @Slot()
    def _listed(self) -> None:
        self.files.set_files(self._library.files, self._library.summaries)
        if self._to_choose and all(path in self._library.files for path in self._to_choose):
            self.choose(self._to_choose)
        self._choose_first()
        self._show_count()
        self._show_trend()
        self._prefer_visible()
        if not self._library.files:
            self._choose.start()  # nothing of the previous folder stays

    @Slot(Path)
    def _summarised(self, path: Path) -> None:
        self.files.set_summary(self._library.summaries[path])
        self._choose_first()
        if path in self.chosen() and path not in [c.path for c in self.plot.shown]:
            self._shown = ()
            self._choose.start()  # it could not be read before, or has changed

    def _choose_first(self) -> None:
        """Select the first row, the newest recording unless sorted otherwise, if none is."""
        if not self.chosen() and self.files.rowCount() and not self._to_choose:
            path = self.files.path_at(0)
            if path in self._library.summaries:
                self.choose([path])

    def _changed_at(self, path: Path) -> object:
        return self._library.files.get(path)

    @Slot(str)
    def _find(self, text: str) -> None:
        self.files.find(text)
        self._show_count()

    @Slot()
    def _rows_changed(self) -> None:
        self._show_count()
        self._show_trend()
        self._prefer_visible()

    @Slot()
    def _prefer_visible(self) -> None:
        self._library.prefer([*self.chosen(), *self.table.visible_paths()])

    @Slot(int)
    def _busy(self, left: int) -> None:
        self._show_count()
        if not left:
            self._show_trend()

    def _show_count(self) -> None:
        shown, total = self.files.rowCount(), len(self._library.files)
        text = "no recordings yet"
        if total:
            text = f"{total} recording{'' if total == 1 else 's'}"
            if self.filter.text().strip():
                text = f"{shown} of {text}"
            if self._library.left:
                text += f", {self._library.left} to read"
            selected = len(self.chosen())
            if selected > _TOGETHER_MAX:
                text += f", {selected} selected ({_TOGETHER_MAX} are plotted)"
            text += ", reading curves …" * any(p not in self._read for p in self._wanted)
        self.count.show_text(text)

    @Slot(int)
    def _view_changed(self, _: int) -> None:
        self._analyse()
        curves = self.views.currentWidget() is self.columns
        for tool in (self.model_shown, self.current_shown, self.whole):
            tool.setVisible(curves)
        self._show_trend()

    def _show_trend(self) -> None:
        if self.views.currentWidget() is self.trend:
            self.trend.show_summaries(self.files.shown, self.chosen())


def _files(event: QDropEvent) -> list[Path]:
    return [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
