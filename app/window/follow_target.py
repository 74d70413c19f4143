"""Editor of the target that the film shall follow: its text, and its file."""

from __future__ import annotations

from pathlib import Path

import tomli_w
from PySide6.QtCore import Signal, Slot
from PySide6.QtGui import QFontDatabase
from PySide6.QtWidgets import QHBoxLayout, QPlainTextEdit, QVBoxLayout, QWidget

from dearig.config.targetfile import EXAMPLE
from dearig.config.toml_input import read_text
from dearig.window.background import Background
from dearig.window.dialogs import choose_file, save_as
from dearig.window.document import Asked, Saved, TextFile
from dearig.window.questions import ask_replace, may_drop
from dearig.window.session import Session
from dearig.window.widgets import Message, button, label

__all__ = ["TargetEditor"]

_TABLES = (".csv", ".txt", ".dat")


class TargetEditor(QWidget):
    """Text of a target file, from a file, a table or written in place. ``changed``: its text."""

    changed = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._file = TextFile("target", EXAMPLE)
        self.trouble = Message()
        self._files = Background(self)
        self._files.done.connect(self._file_done)
        self._files.failed.connect(self.trouble.show_text)
        self.edit = QPlainTextEdit(EXAMPLE)
        self.edit.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.edit.setTabChangesFocus(True)
        self.edit.setAccessibleName("Target")
        self.edit.setToolTip(
            "Displacement from the loaded rest state: the segments of a sequence, in mm"
        )
        self.edit.textChanged.connect(self._edited)
        self.file_name = label("", "muted")
        head = QHBoxLayout()
        caption = label("&Target", "heading")
        caption.setBuddy(self.edit)
        head.addWidget(caption)
        head.addWidget(self.file_name, 1)
        tools = QHBoxLayout()
        for words, tip, done in (
            ("&Open …", "Read a target, or a table (CSV) of time and displacement", self._ask_open),
            ("Sa&ve as …", "Write the target to a file", self._ask_save),
            ("&Example", "Replace the target by one that the rig of the thesis can follow",
             self._example),
        ):  # fmt: skip
            made = button(words, tip)
            made.clicked.connect(done)
            tools.addWidget(made)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(head)
        column.addWidget(self.edit, 1)
        column.addLayout(tools)
        column.addWidget(self.trouble)
        self._show_file_name()

    @property
    def toml(self) -> str:
        """The target as it is written."""
        return self.edit.toPlainText()

    @property
    def folder(self) -> Path:
        """Folder of the tables that the target names."""
        return self._file.folder

    def open_file(self, path: Path) -> None:
        """Read a target (.toml), or make one of a table (.csv)."""
        if not may_drop(self, self._session, self._file, self.toml):
            return
        if path.suffix.lower() in _TABLES:
            segment = {"kind": "csv", "file": path.name}
            text = tomli_w.dumps({"name": path.stem, "segment": [segment]})
            self.restore(text, TextFile("target", text, None, path.parent))
        else:
            self._files.start(lambda: (path, read_text(path, "target")))

    def save_file(self, path: Path, replace: bool = False) -> None:
        """Write the target to ``path``; an existing file is replaced as a whole."""
        file, text = self._file, self.toml
        self._files.start(lambda: file.write(path, text, replace))

    def restore(self, toml: str, file: TextFile) -> None:
        """Replace the target by ``toml`` of ``file``."""
        self._file = file
        self.edit.setPlainText(toml)
        self._edited()

    def close_work(self) -> None:
        """Wait for the thread that reads and writes files."""
        self._files.close()

    @Slot(object)
    def _file_done(self, answer: tuple[Path, str] | Saved | Asked) -> None:
        self.trouble.show_text("")
        if isinstance(answer, Asked):
            if ask_replace(self, self._session, answer):
                self.save_file(answer.path, replace=True)
        elif isinstance(answer, Saved):
            answer.file.note(answer)
            self._edited()
            self._session.message.emit(f"Saved {answer.path}")
        else:
            path, text = answer
            self.restore(text, TextFile("target", text, path, path.parent))

    @Slot()
    def _edited(self) -> None:
        self._session.recovery.note(self._file, self.toml)
        self._show_file_name()
        self.changed.emit()

    def _show_file_name(self) -> None:
        self.file_name.setText(self._file.name(self.toml))
        self.file_name.setToolTip(self._file.tip)

    @Slot()
    def _example(self) -> None:
        if may_drop(self, self._session, self._file, self.toml):
            self.restore(EXAMPLE, TextFile("target", EXAMPLE))

    @Slot()
    def _ask_open(self) -> None:
        path = choose_file(
            self, self._session, "Open a target", self._file.path or self._session.folder,
            "Targets (*.toml);;Tables (*.csv *.txt *.dat)",
        )  # fmt: skip
        if path is not None:
            self.open_file(path)

    @Slot()
    def _ask_save(self) -> None:
        start = self._file.path or self._session.folder
        path = save_as(self, self._session, "Save the target", start, "Targets (*.toml)", ".toml")
        if path is not None:
            self.save_file(path)
