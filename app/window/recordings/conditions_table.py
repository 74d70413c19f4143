"""Table of the conditions in which recordings differ: a row for each recording."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication, QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from dearig.analysis.summary import Difference
from dearig.window.kit.widgets import plain_tip

__all__ = ["ConditionsTable"]

#: px; a column is as wide as its content within these, and the rest is in the tip of a cell.
_WIDTH_MIN, _WIDTH_MAX = 70, 260


class ConditionsTable(QTableWidget):
    """Recordings as rows, whose names stay in view; conditions as columns, grouped.

    A head has the group in its first line, once for the columns of a group. Ctrl+C copies the
    selected cells with their heads.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Conditions that differ between the selected recordings")
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ContiguousSelection)
        self.setAlternatingRowColors(True)
        self.setTabKeyNavigation(False)
        self.setWordWrap(False)
        self.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        header = self.horizontalHeader()
        header.setHighlightSections(False)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        header.setMaximumSectionSize(_WIDTH_MAX)
        header.setMinimumSectionSize(_WIDTH_MIN)
        self.verticalHeader().setHighlightSections(False)
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.verticalHeader().setDefaultSectionSize(26)
        self.setToolTip("Ctrl+C copies the selection")

    def show_differences(self, names: Sequence[str], rows: Sequence[Difference]) -> None:
        """Show the differences of the recordings ``names``."""
        self.clear()
        self.setRowCount(len(names) if rows else 0)
        self.setColumnCount(len(rows))
        group = ""
        for place, difference in enumerate(rows):
            head = QTableWidgetItem(f"{difference.group if difference.group != group else ''}\n"
                                    f"{difference.what}")  # fmt: skip
            head.setToolTip(plain_tip(f"{difference.group}: {difference.what}"))
            self.setHorizontalHeaderItem(place, head)
            group = difference.group
            for row, value in enumerate(difference.values):
                item = QTableWidgetItem(value)
                side = Qt.AlignmentFlag.AlignRight if _number(value) else Qt.AlignmentFlag.AlignLeft
                item.setTextAlignment(side | Qt.AlignmentFlag.AlignVCenter)
                item.setToolTip(plain_tip(f"{difference.what}: {value}"))
                self.setItem(row, place, item)
        if rows:
            for row, name in enumerate(names):
                title = QTableWidgetItem(name)
                title.setToolTip(plain_tip(name))
                self.setVerticalHeaderItem(row, title)
        self.resizeColumnsToContents()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        if not event.matches(QKeySequence.StandardKey.Copy):
            super().keyPressEvent(event)
            return
        lines = []
        for chosen in self.selectedRanges():
            places = range(chosen.leftColumn(), chosen.rightColumn() + 1)
            heads = [_text(self.horizontalHeaderItem(place)).split("\n")[-1] for place in places]
            lines.append("\t".join(["", *heads]))
            for row in range(chosen.topRow(), chosen.bottomRow() + 1):
                cells = [_text(self.item(row, place)) for place in places]
                lines.append("\t".join([_text(self.verticalHeaderItem(row)), *cells]))
        QGuiApplication.clipboard().setText("\n".join(lines))


def _text(item: QTableWidgetItem | None) -> str:
    return "" if item is None else item.text()


def _number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
