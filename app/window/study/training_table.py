"""Table of recordings with a check box each for training and for validation."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QSignalBlocker, Qt, Signal, Slot
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from dearig.analysis.summary import RecordingSummary
from dearig.recording.reading.early_end import early_end
from dearig.report.text.numbers import seconds
from dearig.window.kit.widgets import plain_tip
from dearig.window.recordings.library import Library

__all__ = ["TrainingTable"]

_NAME, _TRAIN, _VALIDATE = range(3)
_HEADS = (
    ("Recording", "Recordings of the folder, newest first"),
    ("Train", "The model is fitted to these recordings"),
    ("Validate", "Compared once, at the end; no fit and no selection uses them"),
)


class TrainingTable(QTableWidget):
    """Lists the recordings of a library; ``changed``: other check marks, or other recordings."""

    changed = Signal()

    def __init__(self, library: Library, parent: QWidget | None = None) -> None:
        super().__init__(0, len(_HEADS), parent)
        self._library = library
        self._row: dict[Path, int] = {}
        self.setAccessibleName("Recordings for training and validation")
        for column, (name, tip) in enumerate(_HEADS):
            head = QTableWidgetItem(name)
            head.setToolTip(tip)
            self.setHorizontalHeaderItem(column, head)
        header = self.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(_NAME, QHeaderView.ResizeMode.Stretch)
        header.setHighlightSections(False)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(26)
        self.setShowGrid(False)
        # only the check marks matter; a selected row would look checked
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.setAlternatingRowColors(True)
        self.setTabKeyNavigation(False)
        self.itemChanged.connect(self._item_changed)
        library.listed.connect(self.refresh)
        library.summarised.connect(self._summarised)
        self.refresh()

    @property
    def train(self) -> tuple[Path, ...]:
        """Recordings checked for training."""
        return self._checked(_TRAIN)

    @property
    def validation(self) -> tuple[Path, ...]:
        """Recordings checked for validation."""
        return self._checked(_VALIDATE)

    def check(self, train: list[Path], validation: list[Path]) -> None:
        """Check the recordings for training and for validation."""
        for row, path in enumerate(self._paths()):
            self._item(row, _TRAIN).setCheckState(_state(path in train))
            self._item(row, _VALIDATE).setCheckState(_state(path in validation))

    def early_ends(self) -> list[str]:
        """Return a sentence on each checked recording whose run ended early."""
        said = []
        for path in (*self.train, *self.validation):
            summary = self._library.summaries.get(path)
            end = None if summary is None else early_end(summary)
            if end is not None:
                said.append(f"{path.stem} {end.sentence}.")
        return said

    @Slot()
    def refresh(self) -> None:
        """List the recordings of the library; their check marks stay."""
        train, validation = set(self.train), set(self.validation)
        files = self._library.files
        paths = sorted(files, key=lambda path: (-files[path][0], path.name))
        with QSignalBlocker(self):
            self.setRowCount(len(paths))
            self._row = {path: row for row, path in enumerate(paths)}
            for row, path in enumerate(paths):
                self._fill_row(row, path, path in train, path in validation)
        self.changed.emit()

    def _fill_row(self, row: int, path: Path, train: bool, validate: bool) -> None:
        summary = self._library.summaries.get(path)
        # with its subfolder, once it is known
        item = QTableWidgetItem(path.stem if summary is None else summary.name or path.stem)
        item.setData(Qt.ItemDataRole.UserRole, path)
        item.setFlags(Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable)
        self.setItem(row, _NAME, item)
        for column, checked in ((_TRAIN, train), (_VALIDATE, validate)):
            box = QTableWidgetItem()
            box.setFlags(
                Qt.ItemFlag.ItemIsEnabled
                | Qt.ItemFlag.ItemIsUserCheckable
                | Qt.ItemFlag.ItemIsSelectable
            )
            box.setCheckState(_state(checked))
            self.setItem(row, column, box)
        self._describe(row, self._library.summaries.get(path))

    @Slot(Path)
    def _summarised(self, path: Path) -> None:
        row = self._row.get(path)
        if row is not None:
            self._describe(row, self._library.summaries.get(path))
            self.changed.emit()  # how the run of a checked recording ended is known now

    def _describe(self, row: int, summary: RecordingSummary | None) -> None:
        if summary is None:
            return
        item = self._item(row, _NAME)
        item.setText(summary.name or summary.path.stem)
        film = f", {summary.film}" if summary.film else ""
        about = f"{summary.path}\n{summary.title}, {seconds(summary.duration)}{film}"
        end = None if summary.trouble else early_end(summary)
        if end is not None:
            about = f"{about}\nThe run {end.sentence}"
        # signals may be blocked by the caller already: a blocker leaves them as they were
        with QSignalBlocker(self):
            item.setText(summary.path.stem if end is None else f"{summary.path.stem} ({end.mark})")
            item.setToolTip(plain_tip(summary.trouble or about))
            if not summary.trouble:
                return
            item.setFlags(Qt.ItemFlag.NoItemFlags)
            for column in (_TRAIN, _VALIDATE):
                box = self._item(row, column)
                box.setFlags(Qt.ItemFlag.NoItemFlags)
                box.setCheckState(Qt.CheckState.Unchecked)
                box.setToolTip(plain_tip(summary.trouble))

    @Slot(QTableWidgetItem)
    def _item_changed(self, item: QTableWidgetItem) -> None:
        if item.column() not in (_TRAIN, _VALIDATE):
            return  # a name or its tip
        if item.checkState() == Qt.CheckState.Checked:
            # an error on training data is no validation: a recording is one or the other
            other = self._item(item.row(), _VALIDATE + _TRAIN - item.column())
            other.setCheckState(Qt.CheckState.Unchecked)
        self.changed.emit()

    def _checked(self, column: int) -> tuple[Path, ...]:
        return tuple(
            path
            for row, path in enumerate(self._paths())
            if self._item(row, column).checkState() == Qt.CheckState.Checked
        )

    def _paths(self) -> list[Path]:
        items = (self._item(row, _NAME) for row in range(self.rowCount()))
        return [item.data(Qt.ItemDataRole.UserRole) for item in items]

    def _item(self, row: int, column: int) -> QTableWidgetItem:
        found = self.item(row, column)
        if found is None:
            raise LookupError(f"no cell at row {row}, column {column}")
        return found


def _state(checked: bool) -> Qt.CheckState:
    return Qt.CheckState.Checked if checked else Qt.CheckState.Unchecked
