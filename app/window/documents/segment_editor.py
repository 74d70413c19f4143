"""Editor of a sequence or a target: its name and rests, its segments, and the fields of one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from PySide6.QtCore import QSignalBlocker, Qt, Signal, Slot
from PySide6.QtGui import QColor, QKeySequence
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLineEdit,
    QMenu,
    QPushButton,
    QScrollArea,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from dearig.config.sequencefile import HEAD_FIELDS, SequenceFault
from dearig.units import in_digits
from dearig.window.documents.draft import Draft
from dearig.window.documents.segment_forms import SegmentForms, sequence_forms
from dearig.window.kit.fields import (
    Typed,
    as_labelled,
    form_field,
    read_back,
    read_typed,
    shown_value,
)
from dearig.window.kit.form import Form
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, button, label, menu_button, plain_tip, set_wrong
from dearig.window.session.text_file import EditedFile

__all__ = ["SequenceEditor"]

_COLUMNS = ("", "Kind", "Settings", "Duration (s)")
_DURATION = 3  # column
_FOREGROUND = Qt.ItemDataRole.ForegroundRole
_LEAST_WIDTH = 325  # px
_HEADS = {key: form_field(key, info) for key, info in HEAD_FIELDS.items()}


class SequenceEditor(QWidget):
    """Shows and changes a ``Draft``.

    ``edited``: the draft has changed; ``row_chosen``: another segment is chosen; ``file_wanted``: a
    segment that reads a CSV file is to be added.
    """

    edited = Signal()
    row_chosen = Signal()
    file_wanted = Signal()

    def __init__(
        self,
        toml: str,
        file: EditedFile | None = None,
        parent: QWidget | None = None,
        *,
        forms: SegmentForms | None = None,
        explain: bool = True,
    ) -> None:
        super().__init__(parent)
        self._forms = forms or sequence_forms()
        self._explain = explain  # next to the fields, not only in their tooltips
        self.draft = Draft(toml, file)
        self.form: Form | None = None
        self._form_of: tuple[int, str] | None = None  # row and kind
        self._faults: tuple[SequenceFault, ...] = ()
        self._fault_colour = "red"
        self._misread: dict[str, str] = {}  # what is wrong with the text of a head's field
        self._head_faults: dict[str, str] = {}
        self._edited_heads: list[str] = []
        self.head_note = Message()
        self.row_fault = Message()
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(SPACE)
        column.addLayout(self._head_row())
        column.addWidget(self.head_note)
        column.addWidget(self._segment_table(), 3)
        column.addLayout(self._row_buttons())
        column.addWidget(self.row_fault)
        self._form_area = QScrollArea()
        self._form_area.setWidgetResizable(True)
        self._form_area.setFrameShape(QScrollArea.Shape.NoFrame)
        column.addWidget(self._form_area, 3)
        self.setMinimumWidth(_LEAST_WIDTH)

    # changes

    def replace(self, toml: str, file: EditedFile) -> None:
        """Replace the draft by that of another file. Raises ``InputError`` if it is not TOML."""
        self.draft.replace(toml, file)
        self.fill(0)

    def choose(self, row: int) -> None:
        """Choose the segment in ``row``."""
        self.table.setCurrentCell(row, 1)

    def add(self, kind: str, **given: Any) -> None:
        """Add a segment of ``kind`` after the chosen one, with ``given`` in place of defaults."""
        row = self.table.currentRow() + 1 if self.draft.segments else 0
        keys = {**self._forms.examples[kind], **given}
        self._change(lambda: self.draft.add(row, kind, keys), row)

    @Slot()
    def duplicate(self) -> None:
        """Add a copy of the chosen segment after it."""
        row = self.table.currentRow()
        if row >= 0:
            self._change(lambda: self.draft.duplicate(row), row + 1)

    @Slot()
    def remove(self) -> None:
        """Remove the chosen segment."""
        row = self.table.currentRow()
        if row >= 0:
            self._change(lambda: self.draft.remove(row), max(row - 1, 0))

    def shift(self, by: int) -> None:
        """Move the chosen segment up (-1) or down (1)."""
        row = self.table.currentRow()
        if row >= 0 and 0 <= row + by < len(self.draft.segments):
            self._change(lambda: self.draft.move(row, row + by), row + by)

    @Slot()
    def undo(self) -> None:
        """Undo the last change."""
        self._change(self.draft.undo, self.table.currentRow())

    @Slot()
    def redo(self) -> None:
        """Redo the change that was undone last."""
        self._change(self.draft.redo, self.table.currentRow())

    def set_value(self, key: str, value: Any) -> None:
        """Set ``key`` of the chosen segment; None leaves it out."""
        row = self.table.currentRow()
        if row >= 0:
            self.draft.set_value(row, key, value)
            self._fill_row(row)
            self.edited.emit()

    def _change(self, change: Callable[[], None], row: int) -> None:
        change()
        self.fill(row)
        self.edited.emit()

    def _head_typed(self, key: str, text: str) -> None:
        typed = Typed(text) if key == "name" else read_typed(_HEADS[key], text)
        self._misread[key] = typed.fault
        if key != "name" and key not in self._edited_heads:
            self._edited_heads.append(key)
        self._faults = tuple(f for f in self._faults if (f.row, f.key) != (None, key))
        self._show_head(key)
        self.draft.set_head(key, typed.value)
        self.edited.emit()

    # display

    def fill(self, row: int) -> None:
        """Show the draft, with the segment in ``row`` chosen."""
        self._form_of = None
        with QSignalBlocker(self.table):
            self.table.setRowCount(len(self.draft.segments))
            for i in range(len(self.draft.segments)):
                self._fill_row(i)
        self.table.setCurrentCell(min(row, len(self.draft.segments) - 1), 1)
        self._row_changed()
        for key, field in self.heads.items():
            value = self.draft.data.get(key)
            read = field.text() if key == "name" else read_typed(_HEADS[key], field.text()).value
            if read != value:
                field.setText(shown_value(value))
                field.setCursorPosition(0)  # its beginning is seen
                self._misread.pop(key, None)
                if key in self._edited_heads:
                    self._edited_heads.remove(key)

    def show_faults(self, faults: Iterable[SequenceFault]) -> None:
        """Mark every row and field that has a fault, each with its own words."""
        self._faults = tuple(replace(f, words=as_labelled(f.words)) for f in faults)
        by_row: dict[int, list[str]] = {}
        for fault in self._faults:
            if fault.row is not None:
                named = f"{as_labelled(fault.key)}: {fault.words}" if fault.key else fault.words
                by_row.setdefault(fault.row, []).append(named)
        for row in range(self.table.rowCount()):
            item = self.table.item(row, 0)
            if item is not None:
                words = by_row.get(row, [])
                item.setText(f"✗ {row + 1}" if words else str(row + 1))
                item.setData(_FOREGROUND, QColor(self._fault_colour) if words else None)
                item.setToolTip(plain_tip("\n".join(words)))
        self._show_faults_of_row()
        for key in self.heads:
            self._show_head(key)

    def set_fault_colour(self, colour: str) -> None:
        """Mark rows with faults in another colour."""
        self._fault_colour = colour
        self.show_faults(self._faults)

    def _show_faults_of_row(self) -> None:
        """Show the faults of the chosen row: above its form, and below its fields."""
        here = [f for f in self._faults if f.row is not None and f.row == self.table.currentRow()]
        keys = {f.key: f.words for f in reversed(here) if f.key}
        shown = {} if self.form is None else {k: w for k, w in keys.items() if self.form.has(k)}
        above = [f.words for f in here if not f.key or f.key not in shown]
        self.row_fault.show_text("\n".join(above))
        if self.form is not None:
            self.form.show_faults(shown)

    def _show_head(self, key: str) -> None:
        """Show below the head what is wrong with its fields, or was read from them."""
        found = next((f.words for f in self._faults if f.row is None and f.key == key), "")
        self._head_faults[key] = self._misread.get(key) or found
        set_wrong(self.heads[key], bool(self._head_faults[key]))
        bad = [f"{_HEADS[k].label}: {words}" for k, words in self._head_faults.items() if words]
        values = {k: read_typed(_HEADS[k], self.heads[k].text()).value for k in self._edited_heads}
        read = [
            f"{_HEADS[k].label} {words}"
            for k, value in values.items()
            if (words := read_back(_HEADS[k], value))
        ]
        self.head_note.show_text("\n".join(bad or read), "bad" if bad else "muted")

    def show_durations(self, durations: Iterable[float]) -> None:
        """Show the durations in s of all segments as they are played, repeats one by one."""
        played = iter(durations)
        for row in range(len(self.draft.segments)):
            total = sum(next(played) for _ in range(self._repeats(row)))
            self._set_duration(row, in_digits(f"{total:.3g}"))

    def clear_duration(self, row: int | None) -> None:
        """Show no duration for the segment in ``row``, which cannot be played."""
        if row is not None:
            self._set_duration(row, "")

    def chosen_segments(self) -> slice:
        """Return the place of the chosen row among the segments as they are played."""
        row = self.table.currentRow()
        if row < 0:
            return slice(0, 0)
        before = sum(self._repeats(i) for i in range(row))
        return slice(before, before + self._repeats(row))

    def _repeats(self, row: int) -> int:
        return int(self.draft.segments[row].get("repeats", 1))

    def _set_duration(self, row: int, text: str) -> None:
        item = self.table.item(row, _DURATION)
        if item is not None:
            item.setText(text)

    @Slot()
    def _row_changed(self) -> None:
        row = self.table.currentRow()
        self._show_form(row)
        self._show_faults_of_row()
        for made in self._needs_row:
            made.setEnabled(row >= 0)
        self.row_chosen.emit()

    def _show_form(self, row: int) -> None:
        segments = self.draft.segments
        if not 0 <= row < len(segments) or segments[row].get("kind") not in self._forms.fields:
            self._put_form(None, None)
            return
        table = segments[row]
        kind = str(table["kind"])
        if self._form_of == (row, kind) and self.form is not None:
            self.form.show_values(table)
            return
        form = Form(self._forms.fields[kind], table, explain=self._explain)
        form.changed.connect(self.set_value)
        self._put_form(form, (row, kind))

    def _put_form(self, form: Form | None, of: tuple[int, str] | None) -> None:
        self.form, self._form_of = form, of
        self._form_area.setWidget(form if form is not None else label("", "muted"))

    def _fill_row(self, row: int) -> None:
        table = self.draft.segments[row]
        kind = str(table.get("kind", "?"))
        settings = ", ".join(
            f"{field.label} {shown_value(table[field.key])} {field.unit}".rstrip()
            for field in self._forms.fields.get(kind, ())
            if field.key in table and not (field.key == "repeats" and table[field.key] == 1)
        )
        kept = self.table.item(row, _DURATION)
        for column, text in enumerate(
            (str(row + 1), kind.replace("_", " "), settings, kept.text() if kept else "")
        ):
            item = QTableWidgetItem(text)
            item.setFlags(Qt.ItemFlag.ItemIsSelectable | Qt.ItemFlag.ItemIsEnabled)
            item.setToolTip(plain_tip(settings))
            if column == _DURATION:
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self.table.setItem(row, column, item)

    # layout

    def _head_row(self) -> QHBoxLayout:
        row = QHBoxLayout()
        self.heads: dict[str, QLineEdit] = {}
        what, rest = self._forms.what, self._forms.rest
        for key, words, tip, default, share in (
            ("name", "&Name", f"Name of the {what} and of its recordings", "", 4),
            ("lead_in_s", "&Lead-in (s)", f"Rest at {rest} before the first segment", "2", 1),
            ("tail_s", "&Tail (s)", f"Rest at {rest} after the last segment", "1", 1),
        ):
            field = QLineEdit()
            field.setPlaceholderText(default)
            tip = f"{tip}; {default} s if empty" if default else tip
            field.setToolTip(tip)
            field.textEdited.connect(lambda text, key=key: self._head_typed(key, text))
            caption = label(words, tip=tip)
            caption.setBuddy(field)
            row.addWidget(caption)
            row.addWidget(field, share)
            self.heads[key] = field
        return row

    def _segment_table(self) -> QTableWidget:
        self.table = QTableWidget(0, len(_COLUMNS))
        self.table.setHorizontalHeaderLabels(_COLUMNS)
        self.table.verticalHeader().hide()
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.table.setTabKeyNavigation(False)
        self.table.setShowGrid(False)
        self.table.setAccessibleName("Segments")
        header = self.table.horizontalHeader()
        for column, mode in enumerate(
            (QHeaderView.ResizeMode.ResizeToContents, QHeaderView.ResizeMode.ResizeToContents,
             QHeaderView.ResizeMode.Stretch, QHeaderView.ResizeMode.ResizeToContents)
        ):  # fmt: skip
            header.setSectionResizeMode(column, mode)
        self.table.itemSelectionChanged.connect(self._row_changed)
        return self.table

    def _row_buttons(self) -> QHBoxLayout:
        row = QHBoxLayout()
        kinds = QMenu(self)
        kinds.setToolTipsVisible(True)
        for kind, tip in self._forms.tips.items():
            action = kinds.addAction(kind.replace("_", " "))
            action.setToolTip(tip)
            action.triggered.connect(lambda _=False, kind=kind: self._add_from_menu(kind))
        self.add_button = menu_button("+ A&dd", "Add a segment after the chosen one", kinds)
        row.addWidget(self.add_button)
        self._needs_row: list[QPushButton] = []
        for words, tip, key, done in (
            ("Duplicate", "Duplicate the chosen segment", "Ctrl+D", self.duplicate),
            ("Remove", "Remove the chosen segment", "Ctrl+Del", self.remove),
            ("▲", "Move the chosen segment up", "Alt+Up", lambda: self.shift(-1)),
            ("▼", "Move the chosen segment down", "Alt+Down", lambda: self.shift(1)),
        ):
            made = button(words, f"{tip} ({key})")
            made.setAccessibleName(tip)
            made.setShortcut(QKeySequence(key))
            made.clicked.connect(done)
            row.addWidget(made)
            self._needs_row.append(made)
        row.addStretch(1)
        return row

    def _add_from_menu(self, kind: str) -> None:
        if kind == "csv":
            self.file_wanted.emit()
        else:
            self.add(kind)
