"""Marks and notes during a run: the key M, a button, and a field for the note."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QWidget

from dearig.acquisition.marks import RunMarks
from dearig.recording.reading.marks import NOTE_BYTES
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import button

__all__ = ["MarkBar"]

_UTF8_MAX = 4  # bytes of one character
_NO_RUN = "Marks and notes can be set while a run goes on (M)"
_READY = "Note (N): Enter sets a mark with it"


class MarkBar(QWidget):
    """Button that sets a mark in the run, and the field for its note.

    The key M sets a mark wherever the focus is, except in a field for text. Then the field waits
    for the note of that mark; Enter keeps it. Without a mark that waits, Enter sets a new mark with
    the note. ``left``: the focus should leave the field. ``said`` carries a sentence for the status
    bar.
    """

    left = Signal()
    said = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._marks: RunMarks | None = None
        self._waiting: int | None = None  # mark whose note is typed
        self.action = QAction("Set a mark", self)
        self.action.setShortcut(QKeySequence(Qt.Key.Key_M))
        self.action.setAutoRepeat(False)
        self.action.triggered.connect(self.mark)
        self.note_action = QAction("Write a note", self)
        self.note_action.setShortcut(QKeySequence(Qt.Key.Key_N))
        self.note_action.triggered.connect(self._go_to_note)
        self.addActions([self.action, self.note_action])
        self.button = button("Mark (M)", "Set a mark at the present sample of the run (M)")
        self.button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # no stop key may press it
        self.button.clicked.connect(self.mark)
        self.note = QLineEdit()
        self.note.setAccessibleName("Note of the mark")
        self.note.setMaxLength(NOTE_BYTES // _UTF8_MAX)
        self.note.textEdited.connect(self._typed)
        self.note.returnPressed.connect(self._entered)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(SPACE)
        row.addWidget(self.button)
        row.addWidget(self.note, 1)
        self.follow(None)

    @property
    def marks(self) -> RunMarks | None:
        """Marks of the run in progress; None without one."""
        return self._marks

    def follow(self, marks: RunMarks | None) -> None:
        """Set marks in the run of ``marks``; None once it has ended."""
        typed = self.note.text().strip()
        if marks is None and self._marks is not None and typed and self._waiting is None:
            self.said.emit(f"The run ended before the note {typed!r} was entered: it is not kept")
        self._marks, self._waiting = marks, None
        self.note.clear()
        if self.note.hasFocus():
            self.left.emit()  # before it is disabled: the focus would go to any button
        for part in (self.button, self.note, self.action, self.note_action):
            part.setEnabled(marks is not None)
        self.note.setPlaceholderText(_NO_RUN if marks is None else _READY)
        self.note.setToolTip(self.note.placeholderText())

    @Slot()
    def mark(self) -> None:
        """Set a mark now; the field waits for its note."""
        number = None if self._marks is None else self._marks.mark()
        if number is None:
            self.said.emit("No mark was set: no run is in progress")
            return
        self._finish_note()  # of the mark before
        self._waiting = number
        self.note.setPlaceholderText(f"Note on mark {number}: Enter keeps it, Esc stops the run")
        self.said.emit(f"Mark {number} is set")
        self._go_to_note()

    @Slot()
    def _go_to_note(self) -> None:
        if self.isVisible():
            self.note.setFocus(Qt.FocusReason.ShortcutFocusReason)

    @Slot(str)
    def _typed(self, text: str) -> None:
        """Tell the run what is typed: it is kept if the run ends first."""
        if self._marks is not None and self._waiting is not None:
            self._marks.draft(self._waiting, text)

    @Slot()
    def _entered(self) -> None:
        if self._marks is not None and self._waiting is None and self.note.text().strip():
            number = self._marks.mark(self.note.text())
            if number is None:
                return  # the run is ending: ``follow`` says what becomes of the text
            self.said.emit(f"Mark {number} is set")
            self.note.clear()
        self._finish_note()
        self.note.setPlaceholderText(_READY)
        self.left.emit()

    def _finish_note(self) -> None:
        """Give the mark that waits its note."""
        if self._marks is not None and self._waiting is not None:
            self._marks.note(self._waiting, self.note.text())
            self._waiting = None
            self.note.clear()
