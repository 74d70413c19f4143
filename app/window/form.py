"""A form: one line for each field, with what is wrong said beside it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import QComboBox, QGridLayout, QLineEdit, QWidget

from dearig.window.fields import FormField, shown_value, typed_value
from dearig.window.theme import SPACE
from dearig.window.widgets import Message, label, set_wrong

__all__ = ["Form"]


class Form(QWidget):
    """Edits ``fields``; ``changed`` carries key and value after each key press."""

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
        self._widgets: dict[str, QLineEdit | QComboBox] = {}
        self._faults: dict[str, Message] = {}
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(SPACE)
        grid.setVerticalSpacing(4)
        for i, (key, field) in enumerate(self._fields.items()):
            row = 2 * i
            widget = self._widget(field, values.get(key))
            caption = label(field.label, tip=field.tip)
            caption.setBuddy(widget)
            grid.addWidget(caption, row, 0)
            grid.addWidget(widget, row, 1)
            grid.addWidget(label(field.unit, "muted"), row, 2)
            if explain:
                about = label(field.description, "muted", field.tip)
                about.setWordWrap(True)
                grid.addWidget(about, row, 3)
            fault = Message()
            grid.addWidget(fault, row + 1, 1, 1, 3)
            self._faults[key] = fault
            self._widgets[key] = widget
        grid.setColumnStretch(1, 4)
        grid.setColumnStretch(3, 4 if explain else 0)
        grid.setRowStretch(2 * len(self._fields), 1)

    def show_faults(self, faults: Mapping[str, str]) -> None:
        """Show each fault beside its field, and clear the others."""
        for key, sentence in self._faults.items():
            words = faults.get(key, "")
            sentence.show_text(words)
            set_wrong(self._widgets[key], bool(words))

    def show_values(self, values: Mapping[str, Any]) -> None:
        """Show other values; a field whose text already means its value keeps its text."""
        for key, widget in self._widgets.items():
            field, value = self._fields[key], values.get(key)
            if isinstance(widget, QComboBox):
                widget.setCurrentText(shown_value(field.default if value is None else value))
            elif typed_value(field, widget.text()) != value:
                widget.setText(shown_value(value))

    def field(self, key: str) -> QLineEdit | QComboBox:
        """Return the widget of ``key``."""
        return self._widgets[key]

    def fault(self, key: str) -> str:
        """Return the fault that is shown beside ``key``."""
        return self._faults[key].text()

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
        self.changed.emit(field.key, typed_value(field, text))
