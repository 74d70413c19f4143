"""Banners under the bar of the main window: what the operator must know on every page."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QSizePolicy, QVBoxLayout, QWidget

from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import button, label
from dearig.window.session.state import Block

__all__ = ["Banners"]

_SHOWN_MAX = 3  # the pages keep their place; further banners are counted


class Banners(QWidget):
    """A row for each banner, the newest last. ``show_page`` opens the page with that title.

    The blocks of the session that name a page have a banner each; others are shown by ``show_text``
    and stay until ``hide_text``.
    """

    def __init__(self, show_page: Callable[[str], None], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._show_page = show_page
        self._texts: dict[str, tuple[str, str]] = {}
        self._blocks: dict[str, tuple[str, str]] = {}
        self._rows = QVBoxLayout(self)
        self._rows.setContentsMargins(SPACE, 0, SPACE, 0)
        self._rows.setSpacing(SPACE // 2)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)
        self.hide()

    def show_text(self, key: str, text: str, page: str = "") -> None:
        """Show ``text`` as the banner ``key``, with a button to ``page`` where that is given."""
        self._texts[key] = (text, page)
        self._refresh()

    def hide_text(self, key: str) -> None:
        """Hide the banner ``key``, if there is one."""
        if self._texts.pop(key, None) is not None:
            self._refresh()

    def show_blocks(self, blocks: dict[str, Block]) -> None:
        """Show what blocks arming, where it has a page."""
        self._blocks = {
            f"block {key}": (f"The rig cannot be armed: {block.sentence}", block.page)
            for key, block in blocks.items()
            if block.page
        }
        self._refresh()

    @property
    def texts(self) -> list[str]:
        """Texts of all banners, in their order."""
        return [text for text, _ in (*self._blocks.values(), *self._texts.values())]

    def _refresh(self) -> None:
        while self._rows.count():
            item = self._rows.takeAt(0)
            widget = None if item is None else item.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        banners = [*self._blocks.values(), *self._texts.values()]
        for text, page in banners[:_SHOWN_MAX]:
            self._rows.addWidget(self._row(text, page))
        more = len(banners) - _SHOWN_MAX
        if more > 0:
            self._rows.addWidget(label(f"and {more} more", "muted"))
        self.setVisible(bool(banners))

    def _row(self, text: str, page: str) -> QFrame:
        frame = QFrame()
        frame.setProperty("role", "banner")
        row = QHBoxLayout(frame)
        row.setContentsMargins(SPACE, SPACE // 2, SPACE, SPACE // 2)
        words = QLabel(f"⚠  {text}")
        words.setTextFormat(Qt.TextFormat.PlainText)
        words.setWordWrap(True)
        row.addWidget(words, 1)
        if page:
            to_page = button(f"Go to {page}", f"Open the page {page}")
            to_page.clicked.connect(lambda _=False: self._show_page(page))
            row.addWidget(to_page)
        return frame
