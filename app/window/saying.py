"""A line of a page that says in words what was done, or what is wrong and what to do."""

from __future__ import annotations

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import QHBoxLayout, QLabel, QToolButton, QWidget

from app.window.session import Session

__all__ = ["Saying"]

_SIGNS = {"good": "\N{CHECK MARK}", "warn": "!", "bad": "\N{MULTIPLICATION X}", "muted": ""}


class Saying(QWidget):
    """Hidden while there is nothing to say; a sign and a colour tell the kinds apart."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.label = QLabel()
        self.label.setWordWrap(True)
        self.label.setTextInteractionFlags(
            Qt.TextInteractionFlag.TextSelectableByMouse
            | Qt.TextInteractionFlag.TextSelectableByKeyboard
        )
        close = QToolButton()
        close.setText("\N{MULTIPLICATION SIGN}")
        close.setAutoRaise(True)
        close.setToolTip("Hide this line")
        close.setAccessibleName("Hide this line")
        close.clicked.connect(self.nothing)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.label, 1)
        row.addWidget(close, 0, Qt.AlignmentFlag.AlignTop)
        session.theme_changed.connect(self._restyle)
        self.hide()

    @property
    def text(self) -> str:
        """What it says, without its sign; "" while hidden."""
        return str(self.property("words") or "")

    @Slot(str)
    def wrong(self, words: str) -> None:
        """An error, and what to do."""
        self._say(words, "bad")

    @Slot(str)
    def warn(self, words: str) -> None:
        """Something to look at."""
        self._say(words, "warn")

    @Slot(str)
    def good(self, words: str) -> None:
        """What was done."""
        self._say(words, "good")

    @Slot(str)
    def note(self, words: str) -> None:
        """Something to know."""
        self._say(words, "muted")

    @Slot()
    def nothing(self) -> None:
        """Say nothing."""
        self.setProperty("words", "")
        self.hide()

    def _say(self, words: str, role: str) -> None:
        self.setProperty("words", words)
        sign = _SIGNS[role]
        self.label.setText(f"{sign}  {words}" if sign else words)
        self.label.setProperty("role", role)
        self._restyle()
        self.show()

    @Slot()
    def _restyle(self) -> None:
        self.label.style().unpolish(self.label)
        self.label.style().polish(self.label)
