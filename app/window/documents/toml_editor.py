"""Editor of a TOML file: its text, its file, and buttons to open and save it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import Signal, Slot
from PySide6.QtGui import QFontDatabase
from PySide6.QtWidgets import QHBoxLayout, QPlainTextEdit, QVBoxLayout, QWidget

from dearig.config.toml_input import read_text
from dearig.window.documents.dialogs import choose_file, save_as
from dearig.window.documents.questions import confirm_discard, replace_or_tell
from dearig.window.jobs.background import Background
from dearig.window.kit.widgets import Message, button, label
from dearig.window.session.state import Session
from dearig.window.session.text_file import OverwriteQuestion, Saved, TextFile

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
        self._file = TextFile(words.what, example)
        self.trouble = Message()
        self.files = Background(self)
        self.files.done.connect(self._file_done)
        self.files.failed.connect(self.trouble.show_text)
        self.edit = QPlainTextEdit(example)
        self.edit.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.edit.setTabChangesFocus(True)
        self.edit.setAccessibleName(words.what.capitalize())
        self.edit.setToolTip(words.tip)
        self.edit.textChanged.connect(self._edited)
        self.file_name = label("", "muted")
        head = QHBoxLayout()
        caption = label(words.caption, "heading")
        caption.setBuddy(self.edit)
        head.addWidget(caption)
        head.addWidget(self.file_name, 1)
        tools = QHBoxLayout()
        self.open_button = button("&Open …", words.open_tip)
        self.open_button.clicked.connect(self._ask_open)
        self.save_button = button("Sa&ve as …", f"Write the {words.what} to a file")
        self.save_button.clicked.connect(self._ask_save)
        self.example_button = button("&Example", words.example_tip)
        self.example_button.clicked.connect(self._example)
        for made in (self.open_button, self.save_button, self.example_button):
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
        """The text as it is written."""
        return self.edit.toPlainText()

    @property
    def folder(self) -> Path:
        """Folder of the files that the text names."""
        return self._file.folder

    def open_file(self, path: Path) -> None:
        """Read the file ``path``."""
        if confirm_discard(self, self.session, self._file, self.toml):
            self.files.start(lambda: (path, read_text(path, self.words.what)))

    def save_file(self, path: Path, replace: bool = False) -> None:
        """Write the text to ``path``; an existing file is replaced as a whole."""
        file, text = self._file, self.toml
        self.files.start(lambda: file.write(path, text, replace))

    def restore(self, toml: str, file: TextFile) -> None:
        """Replace the text by ``toml`` of ``file``."""
        self._file = file
        self.edit.setPlainText(toml)
        self._edited()

    def confirm_discard(self) -> bool:
        """Return True if the text is saved, or the operator gives its changes up."""
        return confirm_discard(self, self.session, self._file, self.toml)

    def close_work(self) -> None:
        """Wait for the thread that reads and writes files."""
        self.files.close()

    @Slot(object)
    def _file_done(self, answer: tuple[Path, str] | Saved | OverwriteQuestion) -> None:
        self.trouble.show_text("")
        if isinstance(answer, OverwriteQuestion):
            replace_or_tell(self, self.session, answer, self.save_file, self.trouble)
        elif isinstance(answer, Saved):
            answer.file.note(answer)
            self._edited()
            self.session.message.emit(f"Saved {answer.path}")
        else:
            path, text = answer
            self.restore(text, TextFile(self.words.what, text, path, path.parent))

    @Slot()
    def _edited(self) -> None:
        self.session.recovery.note(self._file, self.toml)
        self._show_file_name()
        self.changed.emit()

    def _show_file_name(self) -> None:
        self.file_name.setText(self._file.name(self.toml))
        self.file_name.setToolTip(self._file.tip)

    @Slot()
    def _example(self) -> None:
        if self.confirm_discard():
            self.restore(self._text_of_example, TextFile(self.words.what, self._text_of_example))

    @Slot()
    def _ask_open(self) -> None:
        what = self.words.what
        start = self._file.path or self.session.folder
        path = choose_file(self, self.session, f"Open a {what}", start, self.words.kinds)
        if path is not None:
            self.open_file(path)

    @Slot()
    def _ask_save(self) -> None:
        what = self.words.what
        start = self._file.path or self.session.folder
        kinds = f"{what.capitalize()}s (*.toml)"
        path = save_as(self, self.session, f"Save the {what}", start, kinds, ".toml")
        if path is not None:
            self.save_file(path)
