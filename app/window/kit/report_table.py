"""Widget for a table of a report, with the rows of the terminal and the HTML page."""

from __future__ import annotations

import re

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QFont, QGuiApplication, QKeyEvent, QKeySequence, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QSizePolicy,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from dearig.report.text.tables import Row, Table
from dearig.window.kit.widgets import plain_tip

__all__ = ["ReportTable", "two_columns"]

_NUMBER = re.compile(
    r"[(<]?[-\N{MINUS SIGN}\N{EN DASH}\N{INFINITY}+]?\d|[-\N{EN DASH}\N{INFINITY}]$"
)
_NARROW = ("Recording", "Level")  # columns that hold a word, next to columns of sentences


def two_columns(title: str, rows: tuple[tuple[str, str], ...]) -> Table:
    """Make a table of (name, value) rows."""
    return Table(title, (("", ""), ("", "")), tuple(Row(row) for row in rows))


class ReportTable(QTableWidget):
    """Shows a ``Table``; Ctrl+C copies the selected cells.

    With ``whole`` it is as high as its rows, and its parent scrolls. With ``words`` its cells are
    sentences wrapped to its width, otherwise numbers.
    """

    def __init__(
        self, parent: QWidget | None = None, *, whole: bool = False, words: bool = False
    ) -> None:
        super().__init__(parent)
        self._shown = Table("", (), ())
        self._whole, self._words = whole, words
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ContiguousSelection)
        self.setAlternatingRowColors(True)
        self.setShowGrid(False)
        self.setWordWrap(True)
        self.setTabKeyNavigation(False)  # Tab moves to the next widget
        self.verticalHeader().hide()
        self.horizontalHeader().setHighlightSections(False)
        self.setToolTip("Ctrl+C copies the selection")
        if whole:
            self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
            self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
            self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_table(self, table: Table) -> None:
        """Show ``table`` without its title, which the caller shows."""
        self.clear()
        self.setRowCount(len(table.rows))
        self.setColumnCount(len(table.head))
        heads = [" ".join(part for part in head if part) for head in table.head]
        self.setHorizontalHeaderLabels(heads)
        self.horizontalHeader().setVisible(any(heads))
        bold = QFont(self.font())
        bold.setBold(True)
        for i, row in enumerate(table.rows):
            for k, text in enumerate(row.cells):
                item = QTableWidgetItem(text)
                right = k > 0 and not self._words and _NUMBER.match(text) is not None
                side = Qt.AlignmentFlag.AlignRight if right else Qt.AlignmentFlag.AlignLeft
                item.setTextAlignment(side | Qt.AlignmentFlag.AlignVCenter)
                item.setToolTip(plain_tip(row.detail or text))
                if row.mark:
                    item.setFont(bold)
                self.setItem(i, k, item)
        self._shown = table
        self._mute()
        header = self.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        if self._words:
            for column, head in enumerate(heads):
                if column and head not in _NARROW:
                    header.setSectionResizeMode(column, QHeaderView.ResizeMode.Stretch)
        self._fit()

    def changeEvent(self, event: QEvent) -> None:  # noqa: N802
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._mute()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        super().resizeEvent(event)
        self._fit()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        if not event.matches(QKeySequence.StandardKey.Copy):
            super().keyPressEvent(event)
            return
        lines = [
            "\t".join(
                "" if (item := self.item(row, column)) is None else item.text()
                for column in range(chosen.leftColumn(), chosen.rightColumn() + 1)
            )
            for chosen in self.selectedRanges()
            for row in range(chosen.topRow(), chosen.bottomRow() + 1)
        ]
        QGuiApplication.clipboard().setText("\n".join(lines))

    def _mute(self) -> None:
        """Draw muted rows in the muted colour of the present theme."""
        for i, row in enumerate(self._shown.rows):
            for k in range(len(row.cells)) if row.muted else ():
                item = self.item(i, k)
                if item is not None:
                    item.setForeground(self.palette().placeholderText())

    def _fit(self) -> None:
        self.resizeRowsToContents()
        if not self._whole:
            return
        header, edges = self.horizontalHeader(), 2 * self.frameWidth()
        # isHidden and not isVisible: the table itself is not shown yet
        height = edges + (0 if header.isHidden() else header.sizeHint().height())
        height += sum(self.rowHeight(row) for row in range(self.rowCount()))
        self.setFixedHeight(height)
        self.setMaximumWidth(header.length() + edges)
