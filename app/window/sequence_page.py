"""The page on which a sequence is written: segments, what they would do, what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QTimer, Signal, Slot
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QKeySequence
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QMenu,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QSplitter,
    QTableWidget,
    QTableWidgetItem,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from dearig.config.presets import PRESETS
from dearig.config.sequencefile import SEGMENT_KINDS
from dearig.config.toml_input import read_text
from dearig.drivers.gate import Margin
from dearig.errors import InputError
from dearig.recording.files import check_output, replaced_when_done
from dearig.window.background import Background
from dearig.window.draft import (
    NEW_SEGMENTS,
    Draft,
    Place,
    has_comments,
    place_of,
    relative_csv,
)
from dearig.window.fields import FormField, form_fields, shown_value
from dearig.window.form import Form
from dearig.window.layout_state import remember
from dearig.window.preview_plots import PreviewPlots
from dearig.window.session import Preview, Session
from dearig.window.theme import SPACE
from dearig.window.widgets import Message, button, card, label

__all__ = ["SequencePage"]

_COLUMNS = ("", "Kind", "What it plays", "Lasts (s)")
_LEAST_LEFT = 430
#: Of a plan; until then the last one stays, so that nothing flickers while one types.
_LATE_MS = 300


class SequencePage(QWidget):
    """Shows and changes the sequence of the session."""

    title = "Sequence"
    shortcut = "Ctrl+2"

    show_run = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.draft = Draft(session.sequence_toml)
        self._sent = session.sequence_toml
        self._form: Form | None = None
        self._formed: tuple[int, str] | None = None
        self._warned: tuple[Path, str] | None = None
        self._files = Background(self)
        self._files.done.connect(self._file_done)
        self._files.failed.connect(self._file_failed)
        self._late = QTimer(self, singleShot=True, interval=_LATE_MS)
        self._late.timeout.connect(self._nothing_yet)
        self.setAcceptDrops(True)
        self._build()
        session.sequence_changed.connect(self._sequence_changed)
        session.rig_changed.connect(self._planning)
        session.preview_changed.connect(self._preview_changed)
        session.recent_changed.connect(self._recent_changed)
        self._recent_changed()
        self._fill(0)
        if session.preview is not None:
            self._preview_changed()

    # files

    def open_file(self, path: Path) -> None:
        """Read a sequence (.toml), or add a waveform (.csv) as a segment."""
        if path.suffix.lower() == ".csv":
            self.add_csv(path)
            return
        self._files.start(lambda: (path, read_text(path, "sequence")))

    def save_file(self, path: Path) -> None:
        """Write the sequence; a file of that name is replaced.

        One with comments, which a changed sequence no longer has, only when it is asked again.
        """
        text = self.session.sequence_toml

        def write() -> tuple[Path, None]:
            out = check_output(path, overwrite=True)
            if self._warned != (path, text) and not has_comments(text) and out.is_file():
                there = out.read_text(encoding="utf-8", errors="replace")
                if has_comments(there):
                    self._warned = path, text
                    raise InputError(
                        f"{out.name} has comments (#), which the changed sequence cannot keep, and "
                        f"was left as it is: save once more to replace it, or take another name"
                    )
            with replaced_when_done(out) as partial:
                partial.write_text(text, encoding="utf-8")
            return out, None

        self._files.start(write)

    def add_csv(self, path: Path) -> None:
        """Add a measured or computed waveform (time_s, voltage_kV) as a segment."""
        session = self.session
        if session.sequence_path is None and 'kind = "csv"' not in session.sequence_toml:
            session.sequence_folder = path.parent  # it lies nowhere yet: now beside its waveform
        file = relative_csv(path, session.sequence_folder)
        self._do(lambda: self.draft.add("csv", self._next_row(), file=file), self._next_row())

    def preset(self, name: str) -> None:
        """Take one of the sequences that are known by name."""
        self._take(PRESETS[name], Path(), None)

    def reset_layout(self) -> None:
        """Give every part the room that it has at the first start."""
        self.split.setSizes([400, 600])

    def close_work(self) -> None:
        """Wait for the thread."""
        self._files.close()

    @Slot(object)
    def _file_done(self, answer: tuple[Path, str | None]) -> None:
        path, text = answer
        self._warned = None
        if text is None:
            self.session.sequence_path = path
            self.session.message.emit(f"saved {path}")
            self.trouble.show_text("")
        elif not self._take(text, path.parent, path):
            return
        self.session.used(path)
        self._name_file()

    @Slot(str)
    def _file_failed(self, sentence: str) -> None:
        self.trouble.show_text(sentence)

    def _take(self, toml: str, folder: Path, path: Path | None) -> bool:
        """Put another sequence in place of this one; False, with a word, where it is none."""
        try:
            self.draft.replace(toml)
        except InputError as error:
            self.trouble.show_text(str(error))
            return False
        self.trouble.show_text("")
        self._sent = toml
        self.session.set_sequence(toml, folder, path)
        self._fill(0)
        self._name_file()
        return True

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:  # noqa: N802
        if any(_usable(url.toLocalFile()) for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:  # noqa: N802
        for url in event.mimeData().urls():
            if _usable(url.toLocalFile()):
                self.open_file(Path(url.toLocalFile()))
        event.acceptProposedAction()

    # changes

    def choose(self, row: int) -> None:
        """Choose the segment in ``row``."""
        self.table.setCurrentCell(row, 1)

    def add(self, kind: str) -> None:
        """Add a segment after the one that is chosen."""
        if kind == "csv":
            name, _ = QFileDialog.getOpenFileName(
                self, "A waveform with time_s and voltage_kV", str(self.session.sequence_folder),
                "Waveforms (*.csv)",
            )  # fmt: skip
            if name:
                self.add_csv(Path(name))
            return
        row = self._next_row()
        self._do(lambda: self.draft.add(kind, row), row)

    @Slot()
    def duplicate(self) -> None:
        """The chosen segment once more."""
        row = self.table.currentRow()
        if row >= 0:
            self._do(lambda: self.draft.duplicate(row), row + 1)

    @Slot()
    def remove(self) -> None:
        """Take the chosen segment away."""
        row = self.table.currentRow()
        if row >= 0:
            self._do(lambda: self.draft.remove(row), max(row - 1, 0))

    def shift(self, by: int) -> None:
        """Move the chosen segment up (-1) or down (1)."""
        row = self.table.currentRow()
        if row >= 0 and 0 <= row + by < len(self.draft.segments):
            self._do(lambda: self.draft.move(row, row + by), row + by)

    @Slot()
    def undo(self) -> None:
        """Take the last change back."""
        self._do(self.draft.undo, self.table.currentRow())

    @Slot()
    def redo(self) -> None:
        """Make it again."""
        self._do(self.draft.redo, self.table.currentRow())

    def _do(self, change: Callable[[], None], row: int) -> None:
        change()
        self._fill(row)
        self._send()

    def _next_row(self) -> int:
        return self.table.currentRow() + 1 if self.draft.segments else 0

    def _send(self) -> None:
        session = self.session
        self._sent = self.draft.toml
        self.undo_button.setEnabled(self.draft.can_undo)
        self.redo_button.setEnabled(self.draft.can_redo)
        session.set_sequence(self._sent, session.sequence_folder, session.sequence_path)

    @Slot(str, object)
    def _typed(self, key: str, value: Any) -> None:
        row = self.table.currentRow()
        if row >= 0:
            self.draft.set_value(row, key, value)
            self._fill_row(row)
            self._send()

    def _head_typed(self, key: str, text: str) -> None:
        try:
            value: Any = float(text) if key != "name" and text.strip() else text
        except ValueError:
            value = text  # refused in words by the file's own check
        self.draft.set_head(key, None if key != "name" and not text.strip() else value)
        self._send()

    # what is shown

    @Slot()
    def _sequence_changed(self) -> None:
        if self.session.sequence_toml != self._sent:  # it came from another page
            self._take(
                self.session.sequence_toml, self.session.sequence_folder, self.session.sequence_path
            )
        self._planning()

    @Slot()
    def _planning(self) -> None:
        self.state.show_text("planning …", "muted")
        self._late.start()

    @Slot()
    def _nothing_yet(self) -> None:
        self.plots.show_preview(None)

    @Slot()
    def _preview_changed(self) -> None:
        preview = self.session.preview
        if preview is None or preview.toml != self.session.sequence_toml:
            return
        self._late.stop()
        self.plots.show_preview(preview)
        self._show_faults(preview)
        self._show_lengths(preview)
        self._show_margins(preview)
        self._shade()

    def _show_faults(self, preview: Preview) -> None:
        place = Place()
        if preview.playable and preview.plan is not None:
            seconds = float(preview.plan.time[-1])
            self.state.show_text(
                f"✓ Passes the gate: {seconds:.2f} s, {preview.plan.voltage.size:,} samples", "good"
            )
        elif preview.plan is not None:
            reasons = "\n".join(f"✗ {reason}" for reason in preview.plan.reasons)
            self.state.show_text(f"Refused, by the limits of the rig file:\n{reasons}", "bad")
        else:
            self.state.show_text(f"✗ {preview.sentence}", "bad")
            place = place_of(preview.sentence)
        for row in range(self.table.rowCount()):
            item = self.table.item(row, 0)
            if item is not None:
                item.setText(f"✗ {row + 1}" if row == place.row else str(row + 1))
        if self._form is not None:
            here = place.row == self.table.currentRow() and place.key is not None
            words = preview.sentence.rpartition(": ")[2] if here else ""
            self._form.show_faults({str(place.key): _after_key(preview.sentence)} if words else {})
        for key, field in self.heads.items():
            wrong = place.row is None and place.key == key
            if bool(field.property("wrong")) != wrong:
                field.setProperty("wrong", wrong)
                field.style().unpolish(field)
                field.style().polish(field)

    def _show_lengths(self, preview: Preview) -> None:
        if preview.loaded is None:
            wrong = place_of(preview.sentence).row
            item = None if wrong is None else self.table.item(wrong, 3)
            if item is not None:
                item.setText("")
            return
        segments = iter(preview.loaded.sequence.segments)
        for row, table in enumerate(self.draft.segments):
            repeats = table.get("repeats", 1)
            total = sum(next(segments).duration for _ in range(repeats))
            item = self.table.item(row, 3)
            if item is not None:
                item.setText(f"{total:.3g}")

    def _show_margins(self, preview: Preview) -> None:
        waveform = None if preview.plan is None else preview.plan.waveform
        margins: tuple[Margin, ...] = () if waveform is None else waveform.margins
        for row, (words, bar) in enumerate(self.margins):
            there = row < len(margins)
            words.setVisible(there)
            bar.setVisible(there)
            if there:
                margin = margins[row]
                words.setText(
                    f"{margin.quantity}: {margin.reached:.4g} of {margin.allowed:.4g} {margin.unit}"
                )
                share = margin.reached / margin.allowed if margin.allowed > 0.0 else 0.0
                bar.setValue(round(100 * min(max(share, 0.0), 1.0)))

    @Slot()
    def _chosen(self) -> None:
        row = self.table.currentRow()
        self._show_form(row)
        self._shade()
        there = row >= 0
        for made in self._of_row:
            made.setEnabled(there)

    def _shade(self) -> None:
        preview, row = self.session.preview, self.table.currentRow()
        if preview is None or preview.loaded is None or row < 0 or not preview.segments:
            self.plots.choose(None)
            return
        before = sum(int(t.get("repeats", 1)) for t in self.draft.segments[:row])
        many = int(self.draft.segments[row].get("repeats", 1))
        played = preview.segments[1:-1][before : before + many]
        self.plots.choose((played[0][1], played[-1][2]) if played else None)

    def _show_form(self, row: int) -> None:
        segments = self.draft.segments
        if not 0 <= row < len(segments) or segments[row].get("kind") not in SEGMENT_KINDS:
            self._put_form(None, None)
            return
        table = segments[row]
        kind = str(table["kind"])
        if self._formed == (row, kind) and self._form is not None:
            self._form.show_values(table)
            return
        form = Form(self._fields(kind), table, explain=True)
        form.changed.connect(self._typed)
        self._put_form(form, (row, kind))

    def _fields(self, kind: str) -> list[FormField]:
        fields = list(form_fields(SEGMENT_KINDS[kind], ("kind",)))
        return [*fields[1:], fields[0]]  # how often it is repeated comes last

    def _put_form(self, form: Form | None, formed: tuple[int, str] | None) -> None:
        self._form, self._formed = form, formed
        self.form_area.setWidget(form if form is not None else label("", "muted"))

    def _fill(self, row: int) -> None:
        """Show the draft as it stands, with ``row`` chosen."""
        self._formed = None
        self.table.blockSignals(True)
        self.table.setRowCount(len(self.draft.segments))
        for i in range(len(self.draft.segments)):
            self._fill_row(i)
        self.table.blockSignals(False)
        row = min(row, len(self.draft.segments) - 1)
        self.table.setCurrentCell(row, 1)
        self._chosen()
        data = self.draft.data
        for key, field in self.heads.items():
            text = shown_value(data.get(key))
            if field.text() != text:
                field.setText(text)
        self.undo_button.setEnabled(self.draft.can_undo)
        self.redo_button.setEnabled(self.draft.can_redo)

    def _fill_row(self, row: int) -> None:
        table = self.draft.segments[row]
        kind = str(table.get("kind", "?"))
        words = ", ".join(
            f"{field.label} {shown_value(table[field.key])} {field.unit}".rstrip()
            for field in (self._fields(kind) if kind in SEGMENT_KINDS else ())
            if field.key in table and not (field.key == "repeats" and table[field.key] == 1)
        )
        kept = self.table.item(row, 3)
        for column, text in enumerate(
            (str(row + 1), kind.replace("_", " "), words, kept.text() if kept else "")
        ):
            item = QTableWidgetItem(text)
            item.setFlags(Qt.ItemFlag.ItemIsSelectable | Qt.ItemFlag.ItemIsEnabled)
            item.setToolTip(words)
            if column == 3:
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self.table.setItem(row, column, item)

    def _name_file(self) -> None:
        path = self.session.sequence_path
        self.file_name.setText(path.name if path is not None else "not in a file")
        self.file_name.setToolTip("" if path is None else str(path))

    @Slot()
    def _recent_changed(self) -> None:
        self.recent.clear()
        for path in self.session.recent:
            action = self.recent.addAction(str(path))
            action.triggered.connect(lambda _=False, path=path: self.open_file(path))
        self.recent_button.setEnabled(bool(self.session.recent))

    # how it is laid out

    def _build(self) -> None:
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.setSpacing(SPACE)
        outer.addWidget(self._tool_bar())
        self.trouble = Message()
        outer.addWidget(self.trouble)
        self.split = QSplitter(Qt.Orientation.Horizontal)
        self.split.setChildrenCollapsible(False)
        self.split.addWidget(self._left())
        self.split.addWidget(self._right())
        self.reset_layout()
        remember(self.split, self.session.settings, "sequence/columns")
        outer.addWidget(self.split, 1)

    def _tool_bar(self) -> QWidget:
        row = QHBoxLayout()
        row.setContentsMargins(0, 0, 0, 0)
        presets = QMenu(self)
        for name in PRESETS:
            action = presets.addAction(name)
            action.triggered.connect(lambda _=False, name=name: self.preset(name))
        self.presets = _menu_button("&Presets", "The thesis's own sequences, and a richer one")
        self.presets.setMenu(presets)
        row.addWidget(self.presets)
        self.recent = QMenu(self)
        self.recent_button = _menu_button("&Recent", "Files used lately")
        self.recent_button.setMenu(self.recent)
        for words, tip, key, done in (
            ("&Open …", "Read a sequence file (.toml); it may be dropped here too", "Ctrl+O",
             self._ask_open),
            ("&Save", "Write the sequence to its file", "Ctrl+S", self._save),
            ("Save &as …", "Write the sequence to another file", "Ctrl+Shift+S", self._ask_save),
            ("Import &CSV …", "Add a waveform (time_s, voltage_kV) as a segment", "Ctrl+I",
             lambda: self.add("csv")),
        ):  # fmt: skip
            made = button(words, f"{tip} ({key})")
            made.setShortcut(QKeySequence(key))
            made.clicked.connect(done)
            row.addWidget(made)
            if words.startswith("&Open"):
                row.addWidget(self.recent_button)
        self.undo_button = button("↶ &Undo", "Take the last change back (Ctrl+Z)")
        self.undo_button.setShortcut(QKeySequence("Ctrl+Z"))
        self.undo_button.clicked.connect(self.undo)
        self.redo_button = button("↷ Re&do", "Make it again (Ctrl+Shift+Z)")
        self.redo_button.setShortcut(QKeySequence("Ctrl+Shift+Z"))
        self.redo_button.clicked.connect(self.redo)
        row.addWidget(self.undo_button)
        row.addWidget(self.redo_button)
        row.addStretch(1)
        self.file_name = label("not in a file", "muted")
        row.addWidget(self.file_name)
        play = button("Go and r&un it", "To the Run page", primary=True)
        play.clicked.connect(self.show_run)
        row.addWidget(play)
        bar = QWidget()
        bar.setLayout(row)
        return bar

    def _left(self) -> QWidget:
        column = QVBoxLayout()
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(SPACE)
        head = QHBoxLayout()
        self.heads: dict[str, QLineEdit] = {}
        for key, words, tip, share in (
            ("name", "&Name", "What the recording will be called", 4),
            ("lead_in_s", "lead-in (s)", "Quiet, at 0 V, before; 2 s where it is left out", 1),
            ("tail_s", "tail (s)", "Quiet, at 0 V, after; 1 s where it is left out", 1),
        ):
            field = QLineEdit()
            field.setToolTip(tip)
            if key != "name":
                field.setPlaceholderText("2" if key == "lead_in_s" else "1")
            field.textEdited.connect(lambda text, key=key: self._head_typed(key, text))
            caption = label(words, tip=tip)
            caption.setBuddy(field)
            head.addWidget(caption)
            head.addWidget(field, share)
            self.heads[key] = field
        column.addLayout(head)
        column.addWidget(self._segment_table(), 3)
        column.addLayout(self._row_buttons())
        self.form_area = QScrollArea()
        self.form_area.setWidgetResizable(True)
        self.form_area.setFrameShape(QScrollArea.Shape.NoFrame)
        column.addWidget(self.form_area, 3)
        holder = QWidget()
        holder.setLayout(column)
        holder.setMinimumWidth(_LEAST_LEFT)
        return holder

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
        self.table.itemSelectionChanged.connect(self._chosen)
        return self.table

    def _row_buttons(self) -> QHBoxLayout:
        row = QHBoxLayout()
        kinds = QMenu(self)
        for kind in NEW_SEGMENTS:
            action = kinds.addAction(kind.replace("_", " "))
            action.triggered.connect(lambda _=False, kind=kind: self.add(kind))
        self.add_button = _menu_button("+ A&dd", "A new segment after the chosen one")
        self.add_button.setMenu(kinds)
        row.addWidget(self.add_button)
        self._of_row: list[QPushButton] = []
        for words, tip, key, done in (
            ("Duplicate", "The chosen segment once more", "Ctrl+D", self.duplicate),
            ("Remove", "Take the chosen segment away", "Ctrl+Del", self.remove),
            ("▲", "Move the chosen segment up", "Alt+Up", lambda: self.shift(-1)),
            ("▼", "Move the chosen segment down", "Alt+Down", lambda: self.shift(1)),
        ):
            made = button(words, f"{tip} ({key})")
            made.setShortcut(QKeySequence(key))
            made.clicked.connect(done)
            row.addWidget(made)
            self._of_row.append(made)
        row.addStretch(1)
        return row

    def _right(self) -> QWidget:
        column = QVBoxLayout()
        column.setContentsMargins(0, 0, 0, 0)
        self.plots = PreviewPlots(self.session)
        column.addWidget(self.plots, 1)
        below = QVBoxLayout()
        below.setSpacing(4)
        self.state = Message()
        below.addWidget(self.state)
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * SPACE)
        self.margins: list[tuple[QLabel, QProgressBar]] = []
        for i in range(6):
            words, bar = label(""), QProgressBar()
            bar.setTextVisible(False)
            bar.setFixedHeight(6)
            bar.setToolTip("How much of the limit is used")
            grid.addWidget(words, 2 * (i // 2), i % 2)
            grid.addWidget(bar, 2 * (i // 2) + 1, i % 2)
            words.hide()
            bar.hide()
            self.margins.append((words, bar))
        below.addLayout(grid)
        column.addWidget(card(below))
        holder = QWidget()
        holder.setLayout(column)
        return holder

    @Slot()
    def _ask_open(self) -> None:
        name, _ = QFileDialog.getOpenFileName(
            self, "Sequence", str(self.session.sequence_folder), "Sequences (*.toml);;CSV (*.csv)"
        )
        if name:
            self.open_file(Path(name))

    @Slot()
    def _save(self) -> None:
        if self.session.sequence_path is None:
            self._ask_save()
        else:
            self.save_file(self.session.sequence_path)

    @Slot()
    def _ask_save(self) -> None:
        name, _ = QFileDialog.getSaveFileName(
            self, "Save the sequence", str(self.session.sequence_folder), "Sequences (*.toml)"
        )
        if name:
            path = Path(name)
            self.save_file(path if path.suffix else path.with_suffix(".toml"))


def _menu_button(words: str, tip: str) -> QToolButton:
    made = QToolButton()
    made.setText(words)
    made.setToolTip(tip)
    made.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
    made.setMinimumHeight(28)
    return made


def _usable(name: str) -> bool:
    return Path(name).suffix.lower() in (".toml", ".csv")


def _after_key(sentence: str) -> str:
    """The part of a sentence that follows the name of the key: the field stands beside it."""
    found = sentence.split(" is not allowed: ", 1)
    return found[1] if len(found) == 2 else sentence.rpartition(": ")[2]
