"""Form of a campaign's plan: its fields, and the keys of the sequence that are varied."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w
from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHBoxLayout,
    QHeaderView,
    QScrollArea,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from dearig.config.campaignfile import PLAN_TABLE
from dearig.config.presets import PRESETS
from dearig.config.toml_edit import with_key
from dearig.config.toml_input import read_text
from dearig.errors import InputError
from dearig.units import name_and_unit
from dearig.window.kit.fields import form_fields
from dearig.window.kit.form import Form
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, button, label

__all__ = ["PlanForm", "key_text", "read_values", "values_text"]

_TABLES = ("grid", "run", "warm_up", "after", "keep", "notify")  # of the plan, not fields
_VALUES = 1  # column
_ROWS = 4  # that are seen at least


def key_text(path: str) -> str:
    """Return the path of a sequence's key as words: segment 1: amplitudes (kV)."""
    *place, key = path.split(".")
    name, unit = name_and_unit(key)
    words = f"{name} ({unit})" if unit else name
    if len(place) == 2 and place[0] == "segment" and place[1].isdigit():
        return f"segment {int(place[1]) + 1}: {words}"
    return words if not place else f"{' '.join(place)}: {words}"


def values_text(values: Any) -> str:
    """Return the values that a key takes as they are typed: 6, 7, or [6, 6], [7, 7]."""
    return ", ".join(map(_inline, values)) if isinstance(values, list) else _inline(values)


def _inline(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_inline, value))}]"
    return tomli_w.dumps({"v": value}).partition("= ")[2].strip()


def read_values(text: str) -> list[Any]:
    """Return the values in a typed ``text``. Raises ``InputError`` for what is not a list."""
    try:
        tables = tomllib.loads(f"v = [{text}]")
    except tomllib.TOMLDecodeError:
        tables = {}
    if list(tables) != ["v"]:
        raise InputError(
            f"{text!r} is not a list of values: write numbers with commas between them, as 6, 7, "
            f"and lists in brackets, as [6, 6], [7, 7]"
        )
    values = tables["v"]
    if not values:
        raise InputError("a key that is varied needs a value at least")
    return list(values)


class PlanForm(QScrollArea):
    """Edits a plan as a form. ``changed`` carries the whole text after each change."""

    changed = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._toml, self._folder = "", Path()
        self._shows = False  # values are put into the table, not typed
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.form = Form(form_fields(PLAN_TABLE, _TABLES), {}, explain=False)
        self.form.changed.connect(self._field_changed)
        self.grid = QTableWidget(0, 2)
        self.grid.setHorizontalHeaderLabels(("Varied key", "Its values"))
        self.grid.setAccessibleName("Keys of the sequence that are varied, and their values")
        self.grid.setToolTip(
            "Every combination of the values is played. Numbers with commas between them: 6, 7. "
            "For a key that is a list: [6, 6], [7, 7]"
        )
        self.grid.verticalHeader().hide()
        self.grid.setTabKeyNavigation(False)
        self.grid.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        header = self.grid.horizontalHeader()
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(_VALUES, QHeaderView.ResizeMode.Stretch)
        self.grid.setMinimumHeight((_ROWS + 1) * self.grid.verticalHeader().defaultSectionSize())
        self.grid.itemChanged.connect(self._values_changed)
        self.keys = QComboBox()
        self.keys.setToolTip("Key of the sequence")
        self.keys.setAccessibleName("Key of the sequence to vary")
        self.add_button = button("Var&y", "Vary this key, at first with its present value")
        self.add_button.clicked.connect(self._add)
        self.remove_button = button("Remo&ve", "Vary the selected keys no more")
        self.remove_button.clicked.connect(self._remove)
        self.trouble = Message()
        inner = QWidget()
        column = QVBoxLayout(inner)
        column.setContentsMargins(0, SPACE // 2, SPACE // 2, 0)
        column.addWidget(self.form)
        column.addWidget(label("Varied", "heading"))
        column.addWidget(self.grid, 1)
        row = QHBoxLayout()
        column.addWidget(self.keys)
        row.addWidget(self.add_button)
        row.addWidget(self.remove_button)
        column.addLayout(row)
        column.addWidget(self.trouble)
        self.setWidget(inner)

    def show_plan(self, toml: str, folder: Path) -> None:
        """Show the plan ``toml``, whose sequence files are in ``folder``."""
        self._toml, self._folder = toml, folder
        try:
            plan = tomllib.loads(toml)
        except tomllib.TOMLDecodeError as error:
            self._enable(False)
            self.trouble.show_text(f"The text is not TOML, correct it there: {error}")
            return
        self._enable(True)
        self.trouble.show_text("")
        self.form.show_values(plan)
        self._show_grid(plan)

    def _enable(self, enabled: bool) -> None:
        for part in (self.form, self.grid, self.keys, self.add_button, self.remove_button):
            part.setEnabled(enabled)

    def _show_grid(self, plan: Mapping[str, Any]) -> None:
        grid = plan.get("grid", {})
        varied = grid if isinstance(grid, dict) else {}
        self._shows = True
        self.grid.setRowCount(len(varied))
        for row, (path, values) in enumerate(varied.items()):
            for place, text in enumerate((key_text(path), values_text(values))):
                item = self.grid.item(row, place)
                if item is None:
                    item = QTableWidgetItem()
                    self.grid.setItem(row, place, item)
                if place != _VALUES:
                    item.setFlags(Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable)
                    item.setData(Qt.ItemDataRole.UserRole, path)
                # what is typed stays as it is where it means the same
                if place != _VALUES or _means(item.text()) != values:
                    item.setText(text)
        self._shows = False
        known = self._keys_of(plan)
        chosen = self.keys.currentData()
        self.keys.clear()
        for path, value in known.items():
            if path not in varied:
                self.keys.addItem(key_text(path), (path, value))
        if chosen is not None:
            self.keys.setCurrentIndex(max(self.keys.findText(key_text(chosen[0])), 0))
        self.add_button.setEnabled(self.keys.count() > 0)
        self.remove_button.setEnabled(bool(varied))

    def _keys_of(self, plan: Mapping[str, Any]) -> dict[str, Any]:
        """Return the keys of the plan's sequence by their paths, with their values."""
        name = str(plan.get("sequence", ""))
        try:
            text = PRESETS[name] if name in PRESETS else read_text(self._folder / name, "sequence")
            sequence = tomllib.loads(text)
        except (InputError, tomllib.TOMLDecodeError):
            return {}  # the check of the plan says what is wrong with it
        found = {
            key: value for key, value in sequence.items() if not isinstance(value, list | dict)
        }
        segments = sequence.get("segment", [])
        for number, segment in enumerate(segments if isinstance(segments, list) else ()):
            for key, value in segment.items():
                if key != "kind":
                    found[f"segment.{number}.{key}"] = value
        found.pop("name", None)
        return found

    # changes

    @Slot(str, object)
    def _field_changed(self, key: str, value: object) -> None:
        self._change("", key, value)

    @Slot(QTableWidgetItem)
    def _values_changed(self, item: QTableWidgetItem) -> None:
        if self._shows or item.column() != _VALUES:
            return
        try:
            values = read_values(item.text())
        except InputError as error:
            self.trouble.show_text(f"{error}. The values before stay in the plan.")
            return
        self._change("grid", self._path(item.row()), values)

    @Slot()
    def _add(self) -> None:
        chosen = self.keys.currentData()
        if chosen is not None:
            path, value = chosen
            self._change("grid", path, [value])

    @Slot()
    def _remove(self) -> None:
        rows = {index.row() for index in self.grid.selectedIndexes()}
        toml = self._toml
        for path in [self._path(row) for row in rows]:
            toml = with_key(toml, "grid", path, None)
        if toml != self._toml:
            self.changed.emit(toml)

    def _path(self, row: int) -> str:
        item = self.grid.item(row, 0)
        return "" if item is None else str(item.data(Qt.ItemDataRole.UserRole))

    def _change(self, table: str, key: str, value: object) -> None:
        self.trouble.show_text("")
        self.changed.emit(with_key(self._toml, table, key, value))


def _means(text: str) -> list[Any] | None:
    try:
        return read_values(text)
    except InputError:
        return None
