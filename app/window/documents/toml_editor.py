"""Editor of a TOML file: its text, its file, and buttons to open and save it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import Signal, Slot
from PySide6.QtGui import QFontDatabase, QTextCursor
from PySide6.QtWidgets import QHBoxLayout, QPlainTextEdit, QTabWidget, QVBoxLayout, QWidget

from dearig.window.documents.file_actions import FileActions
from dearig.window.kit.widgets import button, label
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile

__all__ = ["EditorWords", "TomlEditor"]


@dataclass(frozen=True)
class EditorWords:
    """Words of an editor: ``what`` is edited ("target"), and its ``caption`` with a key.

    ``tip``, ``open_tip`` and ``example_tip`` are tooltips, ``kinds`` the files of the dialog.
    """

    what: str
    caption: str
    tip: str
    open_tip: str
    example_tip: str
    kinds: str


class TomlEditor(QWidget):
    """Text of a file as ``words`` name it, at first the ``example``. ``changed``: its text."""

    changed = Signal()

    def __init__(
        self, session: Session, words: EditorWords, example: str, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.session = session
        self.words = words
        # its lines for a terminal have no place in a window
        lines = example.splitlines(keepends=True)
        example = "".join(line for line in lines if not line.lstrip("# ").startswith("dearig "))
        self._text_of_example = example
        self._file = EditedFile(words.what, example)
        self.files = FileActions(
            self, session, words.what, lambda: (self.toml, self._file), words.kinds
        )
        self.files.chosen.connect(self.open_file)
        self.files.opened.connect(self.restore)
        self.files.saved.connect(self._edited)
        self.edit = QPlainTextEdit(example)
        self.edit.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.edit.setTabChangesFocus(True)
        self.edit.setAccessibleName(words.what.capitalize())
        self.edit.setToolTip(words.tip)
        self.edit.textChanged.connect(self._edited)
        head = QHBoxLayout()
        caption = label(words.caption, "heading")
        caption.setBuddy(self.edit)
        head.addWidget(caption)
        head.addWidget(self.files.name, 1)
        tools = QHBoxLayout()
        self.open_button = button("&Open …", words.open_tip)
        self.open_button.clicked.connect(self.files.ask_open)
        self.save_button = button("Sa&ve as …", f"Write the {words.what} to a file")
        self.save_button.clicked.connect(self.files.ask_save)
        self.example_button = button("&Example", words.example_tip)
        self.example_button.clicked.connect(self._example)
        for made in (self.open_button, self.save_button, self.example_button):
            tools.addWidget(made)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(head)
        column.addWidget(self.edit, 1)
        column.addLayout(tools)
        column.addWidget(self.files.trouble)
        self.files.note()

    @property
    def toml(self) -> str:
        """The text as it is written."""
        return self.edit.toPlainText()

    @property
    def folder(self) -> Path:
        """Folder of the files that the text names."""
        return self._file.folder

    def open_file(self, path: Path) -> None:
        """Read the file ``path``."""
        self.files.open(path)

    def restore(self, toml: str, file: EditedFile) -> None:
        """Replace the text by ``toml`` of ``file``."""
        self._file = file
        self.edit.setPlainText(toml)
        self._edited()

    @Slot(str)
    def take(self, toml: str) -> None:
        """Replace the text by that of a form, as one step that can be undone."""
        cursor = QTextCursor(self.edit.document())
        cursor.select(QTextCursor.SelectionType.Document)
        cursor.insertText(toml)

    def put_form(self, form: QWidget) -> QTabWidget:
        """Show ``form`` and the text on two tabs; return them."""
        tabs = QTabWidget()
        column = self.layout()
        if column is not None:
            column.replaceWidget(self.edit, tabs)
        tabs.addTab(form, "Form")
        tabs.addTab(self.edit, "Text")
        return tabs

    def close_work(self) -> None:
        """Wait for the thread that reads and writes files."""
        self.files.close()

    @Slot()
    def _edited(self) -> None:
        self.files.note()
        self.changed.emit()

    @Slot()
    def _example(self) -> None:
        if self.files.confirm_discard():
            self.restore(self._text_of_example, EditedFile(self.words.what, self._text_of_example))
