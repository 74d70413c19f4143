"""Recordings for training and for validation: searched, and chosen one or several at a time."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QSignalBlocker, Qt, Signal, Slot
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLineEdit,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.summary import RecordingSummary
from dearig.recording.content.timestamps import local_time
from dearig.recording.reading.early_end import early_end
from dearig.report.text.numbers import seconds
from dearig.window.kit.widgets import ElidedLabel, button, plain_tip
from dearig.window.recordings.library import Library

__all__ = ["TrainingPanel", "TrainingTable"]

_NAME, _START, _TRAIN, _VALIDATE = range(4)
_HEADS = (
    ("Recording", "Recordings of the folder with their subfolders, newest first"),
    ("Start", "Local time of the start of the measurement"),
    ("Train", "The model is fitted to these recordings"),
    ("Validate", "Compared once, at the end; no fit and no selection uses them"),
)
_READING = "reading …"
_MINUTES = len("2026-11-28 01:23")  # of a time, which goes on with seconds and an offset


class TrainingPanel(QWidget):
    """Search, table, and buttons for the selected recordings."""

    def __init__(self, table: TrainingTable, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._table = table
        self.search = QLineEdit(placeholderText="Search")
        self.search.setClearButtonEnabled(True)
        self.search.setToolTip(
            "Show only recordings with all of these words in their name, folder, sequence, film, "
            "tags or start, as 2026-11-28"
        )
        self.search.setAccessibleName("Search the recordings")
        self.search.textChanged.connect(table.search)
        self.search.textChanged.connect(self._refresh)
        self.count = ElidedLabel("muted", hugging=True)
        top = QHBoxLayout()
        top.addWidget(self.search, 1)
        top.addWidget(self.count)
        self.train_button = button("As &training", "Fit the model to the selected recordings")
        self.validate_button = button(
            "As &validation", "Compare the model with the selected recordings, at the end"
        )
        self.neither_button = button("&Neither", "Use the selected recordings for nothing")
        row = QHBoxLayout()
        for made, uses in (
            (self.train_button, (True, False)),
            (self.validate_button, (False, True)),
            (self.neither_button, (False, False)),
        ):
            made.clicked.connect(lambda _=False, uses=uses: table.use_chosen(*uses))
            row.addWidget(made)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(top)
        column.addWidget(table, 1)
        column.addLayout(row)
        table.itemSelectionChanged.connect(self._refresh)
        table.changed.connect(self._refresh)
        self._refresh()

    @Slot()
    def _refresh(self) -> None:
        table = self._table
        shown, count, chosen = table.shown, table.rowCount(), len(table.chosen)
        self.count.show_text(f"{shown} of {count}" if shown < count else f"{count}")
        for made in (self.train_button, self.validate_button, self.neither_button):
            made.setEnabled(chosen > 0)


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
        header.setResizeContentsPrecision(0)  # of the rows in view
        header.setSectionResizeMode(_NAME, QHeaderView.ResizeMode.Stretch)
        # names differ at their ends, where their numbers are
        self.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.setWordWrap(False)
        header.setHighlightSections(False)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(26)
        self.setShowGrid(False)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self._words: tuple[str, ...] = ()
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
        """Check the recordings for training and for validation; one in both is for validation."""
        for_validation = set(validation)
        for_training = set(train) - for_validation
        with QSignalBlocker(self):  # one signal for all of them: each is answered by all rows
            for row, path in enumerate(self._paths()):
                self._item(row, _TRAIN).setCheckState(_state(path in for_training))
                self._item(row, _VALIDATE).setCheckState(_state(path in for_validation))
        self.changed.emit()
        self.viewport().update()

    @property
    def chosen(self) -> tuple[Path, ...]:
        """Recordings whose rows are selected."""
        rows = {index.row() for index in self.selectedIndexes()}
        return tuple(path for row, path in enumerate(self._paths()) if row in rows)

    @property
    def shown(self) -> int:
        """Number of recordings that the search shows."""
        return sum(not self.isRowHidden(row) for row in range(self.rowCount()))

    def use_chosen(self, train: bool, validate: bool) -> None:
        """Check the selected recordings for training, for validation, or for neither."""
        chosen = set(self.chosen)
        with QSignalBlocker(self):
            for row, path in enumerate(self._paths()):
                if path not in chosen or not self._item(row, _TRAIN).flags():
                    continue
                self._item(row, _TRAIN).setCheckState(_state(train))
                self._item(row, _VALIDATE).setCheckState(_state(validate))
        self.changed.emit()
        self.viewport().update()

    @Slot(str)
    def search(self, text: str) -> None:
        """Show the recordings with all words of ``text`` in name, folder, sequence, film or start.

        Hidden ones keep their check marks, and are not selected.
        """
        self._words = tuple(text.casefold().split())
        self.clearSelection()
        for row in range(self.rowCount()):
            self._hide_or_show(row)

    def _hide_or_show(self, row: int) -> None:
        path = self._item(row, _NAME).data(Qt.ItemDataRole.UserRole)
        summary = self._library.summaries.get(path)
        texts = [self._item(row, _NAME).text(), self._item(row, _START).text()]
        if summary is not None:
            texts += [summary.title, *summary.texts.values(), *summary.tags]
        text = " ".join(texts).casefold()
        self.setRowHidden(row, not all(word in text for word in self._words))

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
        start = QTableWidgetItem("" if summary is not None else _READING)
        start.setFlags(item.flags())
        self.setItem(row, _START, start)
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
        self._hide_or_show(row)

    @Slot(Path)
    def _summarised(self, path: Path) -> None:
        row = self._row.get(path)
        if row is not None:
            checked = self._is_checked(row)
            self._describe(row, self._library.summaries.get(path))
            self._hide_or_show(row)
            if checked:
                self.changed.emit()  # how its run ended is known now

    def _describe(self, row: int, summary: RecordingSummary | None) -> None:
        if summary is None:
            return
        item, name = self._item(row, _NAME), summary.name or summary.path.stem
        start = local_time(summary.started)[:_MINUTES] if summary.started else ""
        if summary.start_is_import:
            start += " (import)"
        film = f", {summary.film}" if summary.film else ""
        about = f"{summary.path}\n{summary.title}, {seconds(summary.duration)}{film}"
        end = None if summary.trouble else early_end(summary)
        if end is not None:
            about = f"{about}\nThe run {end.sentence}"
        # signals may be blocked by the caller already: a blocker leaves them as they were
        with QSignalBlocker(self):
            item.setText(name if end is None else f"{name} ({end.mark})")
            self._item(row, _START).setText(start)
            item.setToolTip(plain_tip(summary.trouble or about))
            if not summary.trouble:
                return
            for cell in (item, self._item(row, _START)):
                cell.setFlags(Qt.ItemFlag.NoItemFlags)
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
            # an error on training data is not validation: a recording is one or the other
            other = self._item(item.row(), _VALIDATE + _TRAIN - item.column())
            other.setCheckState(Qt.CheckState.Unchecked)
        self.changed.emit()

    def _checked(self, column: int) -> tuple[Path, ...]:
        return tuple(
            path
            for row, path in enumerate(self._paths())
            if self._item(row, column).checkState() == Qt.CheckState.Checked
        )

    def _is_checked(self, row: int) -> bool:
        checked = Qt.CheckState.Checked
        return any(self._item(row, c).checkState() == checked for c in (_TRAIN, _VALIDATE))

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
