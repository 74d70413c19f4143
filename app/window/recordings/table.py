"""View of the table of recordings: chosen columns, sorting and selection, kept between starts."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from PySide6.QtCore import (
    QItemSelection,
    QItemSelectionModel,
    QModelIndex,
    QPersistentModelIndex,
    QPoint,
    QSignalBlocker,
    Qt,
    Signal,
    Slot,
)
from PySide6.QtGui import QAction, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QMenu,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
    QWidget,
)

from dearig.window.recordings.folder_model import (
    COLUMNS,
    ENDED,
    FolderModel,
    ThumbnailDelegate,
    shown_columns,
)
from dearig.window.session.layout_state import GROUP
from dearig.window.session.settings import kept_text, kept_texts
from dearig.window.session.state import Session

__all__ = ["RecordingsTable"]

_SHOWN, _WIDTHS, _SORTING = (
    f"{GROUP}/recordings/{name}" for name in ("shown columns", "widths", "sorting")
)
_START = "Start"
_ROW = 32  # px, height of a row
_ROWS_LEAST = 4  # of which the header and a scroll bar take one
#: Least width of a column: its sorting sign, and room to take hold of its edge.
_WIDTH_MIN, _WIDTH_MAX = 40, 1200


class _SentenceDelegate(QStyledItemDelegate):
    """Cuts sentences at their end: the middle of "ended early: ... by hand" is what happened."""

    def initStyleOption(  # noqa: N802
        self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        super().initStyleOption(option, index)
        option.textElideMode = Qt.TextElideMode.ElideRight


class RecordingsTable(QTableView):
    """Shows a ``FolderModel``; ``chosen_changed``: other recordings are selected.

    The selection is of recordings, not of rows: it stays with them when rows move, and recordings
    that a search hides are not selected.
    """

    chosen_changed = Signal()

    def __init__(self, files: FolderModel, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._files = files
        self._settings = session.settings
        self._chosen: tuple[Path, ...] = ()
        self._fitted = True  # the widths follow that of the table
        self.setModel(files)
        self.setAccessibleName("Recordings of the folder")
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setAlternatingRowColors(True)
        self.setShowGrid(False)
        self.setTabKeyNavigation(False)
        self.setWordWrap(False)
        # names differ at their ends, where their numbers are
        self.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setItemDelegateForColumn(0, ThumbnailDelegate(session))
        self.setItemDelegateForColumn(ENDED, _SentenceDelegate(self))
        self.verticalHeader().hide()
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.verticalHeader().setDefaultSectionSize(_ROW)
        self.setMinimumHeight(_ROWS_LEAST * _ROW)
        header = self.horizontalHeader()
        header.setHighlightSections(False)
        # a header asks of each column whether all rows are selected: 0.2 s for 2000 recordings
        header.setSelectionModel(QItemSelectionModel(files, header))
        header.setMinimumSectionSize(_WIDTH_MIN)
        header.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        header.customContextMenuRequested.connect(self._ask_columns)
        self.columns_menu = QMenu("Columns", self)
        self._column_actions: list[QAction] = []
        for column in COLUMNS:
            action = self.columns_menu.addAction(column.name)
            action.setCheckable(True)
            action.setToolTip(column.tip)
            action.toggled.connect(self._columns_chosen)
            self._column_actions.append(action)
        self._restore()
        header.sectionResized.connect(self._keep_widths)
        header.sortIndicatorChanged.connect(self._sort)
        files.arranged.connect(self._reselect)
        self.selectionModel().selectionChanged.connect(self._selected)

    @property
    def chosen(self) -> list[Path]:
        """The selected recordings, in the order of the table."""
        # by ranges of rows: Qt's list of selected rows asks the model for each cell of each row
        rows = {
            row
            for part in self.selectionModel().selection().toList()
            for row in range(part.top(), part.bottom() + 1)
        }
        return [self._files.path_at(row) for row in sorted(rows)]

    def choose(self, paths: Iterable[Path]) -> None:
        """Select the rows of ``paths``."""
        selection = QItemSelection()
        first: QModelIndex | None = None
        for path in paths:
            row = self._files.row_of(path)
            if row is not None:
                index = self._files.index(row, 1)
                first = index if first is None else first
                selection.select(
                    self._files.index(row, 0), self._files.index(row, len(COLUMNS) - 1)
                )
        flags = QItemSelectionModel.SelectionFlag
        model = self.selectionModel()
        if first is not None:
            model.setCurrentIndex(first, flags.NoUpdate)  # arrow keys go on from there
        model.select(selection, flags.ClearAndSelect | flags.Rows)

    def visible_paths(self) -> list[Path]:
        """Return the recordings whose rows are on the screen."""
        top, bottom = self.rowAt(0), self.rowAt(self.viewport().height() - 1)
        last = self._files.rowCount() - 1
        if last < 0 or top < 0:
            return []
        return [
            self._files.path_at(row) for row in range(top, (last if bottom < 0 else bottom) + 1)
        ]

    @Slot()
    def reset_columns(self) -> None:
        """Show the columns of the first start, in their widths, the newest recording first."""
        for key in (_SHOWN, _WIDTHS, _SORTING):
            self._settings.remove(key)
        self._restore()

    @Slot()
    def _selected(self) -> None:
        self._chosen = tuple(self.chosen)
        self.chosen_changed.emit()

    @Slot()
    def _reselect(self) -> None:
        """Select again what was selected before the rows were arranged again."""
        before = self._chosen
        with QSignalBlocker(self):
            self.choose(before)
        if tuple(self.chosen) != before:
            self._selected()

    # columns

    def _restore(self) -> None:
        shown = shown_columns(kept_texts(self._settings, _SHOWN, len(COLUMNS)))
        widths = dict(
            text.rpartition("=")[::2] for text in kept_texts(self._settings, _WIDTHS, len(COLUMNS))
        )
        header = self.horizontalHeader()
        with QSignalBlocker(header):
            for place, column in enumerate(COLUMNS):
                with QSignalBlocker(self._column_actions[place]):
                    self._column_actions[place].setChecked(shown[place])
                header.setSectionHidden(place, not shown[place])
                kept = widths.get(column.name, "")
                width = int(kept) if kept.isascii() and kept.isdigit() else column.width
                header.resizeSection(place, min(max(width, _WIDTH_MIN), _WIDTH_MAX))
        self._fitted = not widths
        self._fit()
        name, _, order = kept_text(self._settings, _SORTING).rpartition(" ")
        names = [column.name for column in COLUMNS]
        chosen, up = (name, order == "up") if name in names else (_START, False)
        direction = Qt.SortOrder.AscendingOrder if up else Qt.SortOrder.DescendingOrder
        with QSignalBlocker(header):  # shown, not chosen
            header.setSortIndicatorShown(True)
            header.setSortIndicator(names.index(chosen), direction)
        header.setSectionsClickable(True)
        self._files.sort(names.index(chosen), direction)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        """Share out the width that is left among the columns of text, until a width is chosen."""
        header = self.horizontalHeader()
        shown = [place for place in range(len(COLUMNS)) if not header.isSectionHidden(place)]
        left = self.viewport().width() - sum(COLUMNS[place].width for place in shown)
        texts = [place for place in shown if COLUMNS[place].wide]
        total = sum(COLUMNS[place].width for place in texts)
        if not self._fitted or left < 0 or not total:
            return
        with QSignalBlocker(header):
            for place in texts:
                width = COLUMNS[place].width
                header.resizeSection(place, width + left * width // total)
        self.updateGeometries()
        self.viewport().update()

    @Slot(QPoint)
    def _ask_columns(self, at: QPoint) -> None:
        self.columns_menu.popup(self.horizontalHeader().mapToGlobal(at))

    @Slot()
    def _columns_chosen(self) -> None:
        names = [a.text() for a in self._column_actions if a.isChecked()]
        if not names:  # a table without columns has no header to choose them in
            names = ["Recording"]
            with QSignalBlocker(self._column_actions[1]):
                self._column_actions[1].setChecked(True)
        for place, action in enumerate(self._column_actions):
            self.setColumnHidden(place, not action.isChecked())
        self._fit()
        self._settings.setValue(_SHOWN, names)

    @Slot()
    def _keep_widths(self) -> None:
        self._fitted = False
        header = self.horizontalHeader()
        self._settings.setValue(
            _WIDTHS,
            [
                f"{column.name}={header.sectionSize(place)}"
                for place, column in enumerate(COLUMNS)
                if not header.isSectionHidden(place)
            ],
        )

    @Slot(int, Qt.SortOrder)
    def _sort(self, column: int, order: Qt.SortOrder) -> None:
        self._files.sort(column, order)
        direction = "down" if order == Qt.SortOrder.DescendingOrder else "up"
        self._settings.setValue(_SORTING, f"{COLUMNS[column].name} {direction}")
