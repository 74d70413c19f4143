"""Base class of the pages: what the main window calls on a page, and what a page asks of it."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Protocol, Self, TypeVar

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import QWidget

from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile

__all__ = ["Page", "Pages"]


class Page(QWidget):
    """A page of the main window, which connects the signals below when it makes the page.

    ``title`` stands in the list of pages. A page that is not ``at_start``, or not ``needed`` then,
    is made when it is first shown. ``edits`` is what the page edits as a text file ("rig file"):
    unsaved changes of it are restored by ``restore``.
    """

    title: ClassVar[str]
    at_start: ClassVar[bool] = False
    edits: ClassVar[str] = ""

    go_to = Signal(str)  #: title of the page to show
    show_recording = Signal(Path)  #: file to select on the page Recordings
    edit_sequence = Signal(str)  #: TOML for the page Sequence
    play_sequence = Signal(str, object)  #: TOML for the page Run, and its file or None
    play_hold = Signal(object)  #: ``HoldPlan`` for the page Run
    use_model = Signal(Path)  #: model file to overlay on the page Run

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:  # noqa: ARG002
        super().__init__(parent)

    @classmethod
    def make(cls, session: Session, pages: Pages) -> Self:  # noqa: ARG003
        """Return the page; a page that needs others takes them from ``pages``."""
        return cls(session)

    @classmethod
    def needed(cls, session: Session) -> bool:  # noqa: ARG003
        """Return whether the page is made with the window."""
        return cls.at_start

    @Slot()
    def reset_layout(self) -> None:
        """Give every part its default size."""

    def close_work(self) -> None:
        """End the page's threads and processes, and wait for them."""

    def restore(self, text: str, file: EditedFile) -> None:
        """Replace the text that the page ``edits`` by the unsaved one of an earlier window."""
        raise NotImplementedError(f"the page {self.title} edits no {file.what}")


P = TypeVar("P", bound=Page)


class Pages(Protocol):
    """The pages of a main window."""

    def page(self, kind: type[P]) -> P:
        """Return the page of the class ``kind``."""
