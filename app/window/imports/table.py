"""Table of the first rows of a file, with boxes above its columns: quantity, unit, scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHeaderView,
    QLineEdit,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from dearig.recording.importers.listing import ColumnPreview, Guessed
from dearig.recording.importers.quantities.labels import DIMENSIONS
from dearig.window.imports.choice import ColumnChoice, quantity_label, unit_label, units_of
from dearig.window.kit.number_text import NumberTextError, read_number
from dearig.window.kit.widgets import plain_tip, set_wrong
from dearig.window.session.state import Session

__all__ = ["Boxes", "ImportTable"]

#: Columns that are shown: those with a guess, and the first others.
COLUMNS_MAX = 40
_HEADS = 5  # rows above the values: boxes, and the range
_WIDTH = 168  # px of a column: its boxes have room for their texts
_OPEN = "choose …"


@dataclass(frozen=True)
class Boxes:
    """Widgets above a column."""

    quantity: QComboBox
    unit: QComboBox
    scale: QLineEdit
    offset: QLineEdit


class ImportTable(QTableWidget):
    """Columns of a file, each with boxes for its choice; ``changed`` is after each change."""

    changed = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._shown: tuple[ColumnPreview, ...] = ()
        self._boxes: dict[int, Boxes] = {}  # by the number of the column
        self._raw = False
        self.setAccessibleName("Columns of the file")
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setWordWrap(False)
        self.setTabKeyNavigation(False)
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.verticalHeader().setHighlightSections(False)
        self.horizontalHeader().setHighlightSections(False)
        self.horizontalHeader().setDefaultSectionSize(_WIDTH)

    @property
    def columns(self) -> tuple[ColumnPreview, ...]:
        """Columns that are shown."""
        return self._shown

    def show_columns(
        self,
        columns: Sequence[ColumnPreview],
        choices: Mapping[int, ColumnChoice],
        guesses: Mapping[int, Guessed],
        raw: bool,
    ) -> None:
        """Show ``columns`` with ``choices``, both by number; ``raw``: a rig file has scales.

        What is a guess only stands in the box that is still open.
        """
        likely = [c for c in columns if c.number in choices or c.number in guesses]
        others = [c for c in columns if c not in likely]
        some = [*likely, *others][:COLUMNS_MAX]
        self._shown = tuple(c for c in columns if c in some)
        self._raw = raw
        rows = max((len(c.values) for c in self._shown), default=0)
        self.clear()
        self._boxes = {}
        self.setRowCount(_HEADS + rows)
        self.setColumnCount(len(self._shown))
        heads = ("Quantity", "Unit", "Scale", "Offset", "Range")
        self.setVerticalHeaderLabels([*heads, *(str(n) for n in range(1, rows + 1))])
        for place, column in enumerate(self._shown):
            self._show_column(place, column, choices, guesses)
        for row in range(_HEADS + rows):
            self.setRowHeight(row, 30 if row < _HEADS - 1 else 22)

    def _show_column(
        self,
        place: int,
        column: ColumnPreview,
        choices: Mapping[int, ColumnChoice],
        guesses: Mapping[int, Guessed],
    ) -> None:
        head = QTableWidgetItem(column.name)
        head.setToolTip(plain_tip(f"{column.name}: column {column.number}, {column.count} values"))
        self.setHorizontalHeaderItem(place, head)
        span = "" if column.low is None else f"{column.low:.6g} to {column.high:.6g}"
        for row, text in enumerate((span, *(f"{v:.9g}" for v in column.values)), _HEADS - 1):
            item = QTableWidgetItem(text)
            item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self.setItem(row, place, item)
        choice = choices.get(column.number, ColumnChoice())
        boxes = Boxes(QComboBox(), QComboBox(), QLineEdit(), QLineEdit())
        self._boxes[column.number] = boxes
        guess = guesses.get(column.number)
        doubtful = guess is not None and guess.doubt == "column" and not choice.quantity
        likely = f"{quantity_label(guess.quantity)}?" if guess and doubtful else "not used"
        boxes.quantity.addItem(likely, "")
        for name in DIMENSIONS:
            boxes.quantity.addItem(quantity_label(name), name)
        boxes.quantity.setCurrentIndex(boxes.quantity.findData(choice.quantity))
        boxes.quantity.setEnabled(column.count > 0)
        boxes.quantity.currentIndexChanged.connect(lambda: self._quantity_changed(place))
        boxes.unit.currentIndexChanged.connect(self._changed)
        for line, typed, empty in (
            (boxes.scale, choice.scale, "1"), (boxes.offset, choice.offset, "0")
        ):  # fmt: skip
            line.setText("" if typed is None else f"{typed:.10g}")
            line.setPlaceholderText(empty)
            line.setToolTip("Value = cell * scale + offset, in the unit that is chosen above")
            line.textEdited.connect(self._changed)
        for row, (words, widget) in enumerate(
            (("Quantity", boxes.quantity), ("Unit", boxes.unit), ("Scale", boxes.scale),
             ("Offset", boxes.offset))
        ):  # fmt: skip
            widget.setAccessibleName(f"{words} of {column.name}")
            self.setCellWidget(row, place, widget)
        self._fill_units(boxes, choice.unit)
        self._mark(place)

    def _fill_units(self, boxes: Boxes, unit: str) -> None:
        quantity = boxes.quantity.currentData()
        boxes.unit.blockSignals(True)
        boxes.unit.clear()
        boxes.unit.addItem(_OPEN if quantity else "", "")
        for symbol in units_of(quantity, self._raw) if quantity else ():
            boxes.unit.addItem(unit_label(symbol), symbol)
        boxes.unit.setCurrentIndex(max(boxes.unit.findData(unit), 0))
        boxes.unit.blockSignals(False)
        for widget in (boxes.unit, boxes.scale, boxes.offset):
            widget.setEnabled(bool(quantity))

    def set_raw(self, raw: bool) -> None:
        """Offer volts at the card as a unit, or not; a rig file scales them."""
        if raw != self._raw:
            self._raw = raw
            for boxes in self._boxes.values():
                self._fill_units(boxes, boxes.unit.currentData() or "")

    def _quantity_changed(self, place: int) -> None:
        """Offer the units of another quantity; the unit of the name is chosen if it is one."""
        column = self._shown[place]
        self._fill_units(self._boxes[column.number], column.unit)
        self._mark(place)
        self.changed.emit()

    @Slot()
    def _changed(self) -> None:
        self.changed.emit()

    def _mark(self, place: int) -> None:
        """Show the numbers of a column that is not used in grey."""
        used = bool(self._boxes[self._shown[place].number].quantity.currentData())
        colour = self._session.theme.text if used else self._session.theme.muted
        for row in range(_HEADS - 1, self.rowCount()):
            if (item := self.item(row, place)) is not None:
                item.setForeground(QColor(colour))

    def boxes(self, number: int) -> Boxes:
        """Return the widgets above the column ``number``."""
        return self._boxes[number]

    def choices(self) -> tuple[dict[int, ColumnChoice], list[str]]:
        """Return the choices by number, and sentences on numbers that cannot be read."""
        found, wrong = {}, []
        for column in self._shown:
            boxes = self._boxes[column.number]
            quantity = boxes.quantity.currentData()
            numbers: list[float | None] = []
            for words, line in (("scale", boxes.scale), ("offset", boxes.offset)):
                value, fault = _read(line.text())
                if value == 0.0 and words == "scale":
                    fault = "0 leaves nothing"
                set_wrong(line, bool(fault))
                numbers.append(value)
                if fault and quantity:
                    wrong.append(f"The {words} of {column.name!r}: {fault}.")
            if quantity:
                found[column.number] = ColumnChoice(
                    quantity, boxes.unit.currentData() or "", *numbers
                )
        return found, wrong


def _read(text: str) -> tuple[float | None, str]:
    """Return the number that is typed, None without one, and what is wrong with the text."""
    if not text.strip():
        return None, ""
    try:
        return read_number(text), ""
    except NumberTextError as error:
        return None, str(error)
