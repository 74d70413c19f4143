"""A form: one line for each field, and below it what was read or what is wrong."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from PySide6.QtCore import Signal, Slot
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QComboBox, QGridLayout, QLabel, QLineEdit, QWidget

from dearig.window.kit.fields import FormField, as_labelled, read_back, read_typed, shown_value
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, label, set_wrong

__all__ = ["Form"]

_ABOUT = 100  # px, least width of a description
_CAPTION = 28  # letters; a longer one is wrapped, so that the form fits a small screen


class Form(QWidget):
    """Edits ``fields``; ``changed`` carries key and value after each key press.

    Below a list, and below a number that is typed, stands what was read from the text. A text that
    is not a number is carried as it is, and its fault is shown in place of those found later.
    """

    changed = Signal(str, object)

    def __init__(
        self,
        fields: Iterable[FormField],
        values: Mapping[str, Any],
        *,
        explain: bool,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._fields = {field.key: field for field in fields}
        self._about: list[QLabel] = []  # hidden where the form is narrow
        self._widgets: dict[str, QLineEdit | QComboBox] = {}
        self._below: dict[str, Message] = {}
        self._faults: dict[str, str] = {}  # found by the check of the file
        self._misread: dict[str, str] = {}  # found where the text was read
        self._edited: set[str] = set()
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(SPACE)
        grid.setVerticalSpacing(4)
        for i, (key, field) in enumerate(self._fields.items()):
            row = 2 * i
            widget = self._widget(field, values.get(key))
            caption = label(field.label, tip=field.tip)
            caption.setBuddy(widget)
            caption.setWordWrap(len(field.label) > _CAPTION)
            grid.addWidget(caption, row, 0)
            grid.addWidget(widget, row, 1)
            grid.addWidget(label(field.unit, "muted"), row, 2)
            if explain:
                about = label(as_labelled(field.description), "muted", field.tip)
                about.setWordWrap(True)
                about.setMinimumWidth(1)  # not that of its longest word
                self._about.append(about)
                grid.addWidget(about, row, 3)
            below = Message()
            grid.addWidget(below, row + 1, 1, 1, 3)
            self._below[key] = below
            self._widgets[key] = widget
            self._show_below(key)
        self._grid = grid
        grid.setColumnStretch(1, 4)
        grid.setColumnStretch(3, 4 if explain else 0)
        grid.setRowStretch(2 * len(self._fields), 1)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Leave out the descriptions, which are in the tips too, where there is no room."""
        super().resizeEvent(event)
        others = sum(
            max(self._item_width(row, column) for row in range(0, 2 * len(self._fields), 2))
            for column in range(3)
        )
        room = self.width() - others - 3 * SPACE >= _ABOUT
        for about in self._about:
            about.setVisible(room)

    def _item_width(self, row: int, column: int) -> int:
        item = self._grid.itemAtPosition(row, column)
        return 0 if item is None else item.sizeHint().width()

    def show_faults(self, faults: Mapping[str, str]) -> None:
        """Show each fault below its field, and clear the others."""
        self._faults = dict(faults)
        for key in self._fields:
            self._show_below(key)

    def show_values(self, values: Mapping[str, Any]) -> None:
        """Show other values; a field whose text already means its value keeps its text."""
        for key, widget in self._widgets.items():
            field, value = self._fields[key], values.get(key)
            if isinstance(widget, QComboBox):
                widget.setCurrentText(shown_value(field.default if value is None else value))
            elif read_typed(field, widget.text()).value != value:
                widget.setText(shown_value(value))
                self._edited.discard(key)
                self._misread.pop(key, None)
                self._show_below(key)

    def field(self, key: str) -> QLineEdit | QComboBox:
        """Return the widget of ``key``."""
        return self._widgets[key]

    def has(self, key: str) -> bool:
        """Return True if the form has a field for ``key``."""
        return key in self._fields

    def fault(self, key: str) -> str:
        """Return the fault that is shown below ``key``; "" where there is none."""
        return self._misread.get(key) or self._faults.get(key, "")

    def note(self, key: str) -> str:
        """Return what is shown below ``key``: its fault, or what was read from its text."""
        return self._below[key].text()

    def _show_below(self, key: str) -> None:
        widget, fault = self._widgets[key], self.fault(key)
        set_wrong(widget, bool(fault))
        if fault or isinstance(widget, QComboBox):
            self._below[key].show_text(fault)
            return
        field = self._fields[key]
        shown = key in self._edited or field.kind == "numbers"
        text = read_back(field, read_typed(field, widget.text()).value) if shown else ""
        self._below[key].show_text(text, "muted")

    def _widget(self, field: FormField, value: Any) -> QLineEdit | QComboBox:
        if field.kind == "choice":
            choice = QComboBox()
            choice.addItems([shown_value(c) for c in field.choices])
            choice.setCurrentText(shown_value(field.default if value is None else value))
            choice.setToolTip(field.tip)
            choice.textActivated.connect(lambda text: self._typed(field, text))
            return choice
        line = QLineEdit(shown_value(value))
        line.setToolTip(field.tip)
        line.setAccessibleName(f"{field.label} {field.unit}".rstrip())
        empty = "empty" if field.default is None else shown_value(field.default)
        line.setPlaceholderText(empty)
        line.textEdited.connect(lambda text: self._typed(field, text))
        return line

    @Slot()
    def _typed(self, field: FormField, text: str) -> None:
        typed = read_typed(field, text)
        self._edited.add(field.key)
        self._misread[field.key] = typed.fault
        self._faults.pop(field.key, None)  # it was about the text before
        self._show_below(field.key)
        self.changed.emit(field.key, typed.value)
