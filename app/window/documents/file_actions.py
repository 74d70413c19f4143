"""File of an edited text: reading, writing, and the questions before something is lost."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, Signal, Slot
from PySide6.QtWidgets import QWidget

from dearig.config.toml_input import read_text
from dearig.window.documents.dialogs import choose_file, save_as
from dearig.window.documents.questions import confirm_discard, replace_or_tell
from dearig.window.jobs.background import Background
from dearig.window.kit.widgets import Message, label
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile, OverwriteQuestion, Saved

__all__ = ["FileActions"]


class FileActions(QObject):
    """Opens and saves the text that the widget ``parent`` edits, in a thread.

    ``current`` returns the text and its file. Messages of errors are shown by ``trouble``, which
    the widget places, as it does ``name``: the name of the file, marked while it is not saved.
    """

    chosen = Signal(Path)  #: a file to open, from the dialog
    opened = Signal(str, EditedFile)  #: a text that was read, and its file
    saved = Signal(Saved)  #: a text that is in its file now

    def __init__(
        self,
        parent: QWidget,
        session: Session,
        what: str,
        current: Callable[[], tuple[str, EditedFile]],
        kinds: str = "",
    ) -> None:
        """``what`` is edited ("rig file"); ``kinds`` are the files to open, TOML by default."""
        super().__init__(parent)
        self._widget, self._session, self._what, self._current = parent, session, what, current
        self._toml = f"{what.capitalize()}s (*.toml)"
        self._kinds = kinds or self._toml
        self.trouble = Message()
        self.name = label("", "muted")
        self._thread = Background(self)
        self._thread.done.connect(self._done)
        self._thread.failed.connect(self.trouble.show_text)

    def note(self) -> None:
        """Note that the text or its file has changed: show its name, and keep it for a crash."""
        text, file = self._current()
        self._session.recovery.note(file, text)
        self.name.setText(file.name(text))
        self.name.setToolTip(file.tip)

    def confirm_discard(self) -> bool:
        """Return True if the text has no unsaved changes, or the operator gives them up."""
        text, file = self._current()
        return confirm_discard(self._widget, self._session, file, text)

    def open(self, path: Path) -> None:
        """Read the file ``path``."""
        if self.confirm_discard():
            self._thread.start(lambda: (path, read_text(path, self._what)))

    def write(self, path: Path, replace: bool = False) -> None:
        """Write the text to ``path``; an existing file is replaced as a whole.

        Asks where another program has changed the file since it was opened, unless ``replace``.
        """
        text, file = self._current()
        self._thread.start(lambda: file.write(path, text, replace))

    @Slot()
    def save(self) -> None:
        """Write the text to its file, or ask for one."""
        path = self._current()[1].path
        if path is None:
            self.ask_save()
        else:
            self.write(path)

    @Slot()
    def ask_open(self) -> None:
        """Ask for a file, and read it."""
        title = f"Open a {self._what}"
        path = choose_file(self._widget, self._session, title, self._start, self._kinds)
        if path is not None:
            self.chosen.emit(path)

    @Slot()
    def ask_save(self) -> None:
        """Ask for a file, and write the text to it."""
        title = f"Save the {self._what}"
        path = save_as(self._widget, self._session, title, self._start, self._toml, ".toml")
        if path is not None:
            self.write(path)

    @property
    def _start(self) -> Path:
        """Where a dialog begins: the file, the folder that its text names, or the session's."""
        file = self._current()[1]
        return file.path or (file.folder if file.folder != Path() else self._session.folder)

    def close(self) -> None:
        """Wait for the thread."""
        self._thread.close()

    @Slot(object)
    def _done(self, answer: tuple[Path, str] | Saved | OverwriteQuestion) -> None:
        self.trouble.show_text("")
        if isinstance(answer, OverwriteQuestion):
            replace_or_tell(self._widget, self._session, answer, self.write, self.trouble)
        elif isinstance(answer, Saved):
            answer.file.note(answer)
            self.saved.emit(answer)
            self._session.message.emit(f"Saved {answer.path}")
        else:
            path, text = answer
            self.opened.emit(text, EditedFile(self._what, text, path, path.parent))
