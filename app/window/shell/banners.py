"""Banner in the bar of the main window: what the operator must know on every page."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QPoint, Qt, Slot
from PySide6.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QPushButton, QSizePolicy, QWidget

from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel, button, label
from dearig.window.session.state import ArmingBlock

__all__ = ["Banners"]

_LIST = 640  # px, width of the list of all banners


class Banners(QWidget):
    """One line with the first banner; a button lists all of them, whole.

    The line has a place of its own in the bar, so that no banner moves the pages and STOP.
    ``show_page`` opens the page with that title. The blocks of the session that name a page have a
    banner each; others are shown by ``show_text`` and stay until ``hide_text``.
    """

    def __init__(self, show_page: Callable[[str], None], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._show_page = show_page
        self._texts: dict[str, tuple[str, str]] = {}
        self._blocks: dict[str, tuple[str, str]] = {}
        self.words = ElidedLabel("warn")
        self.page_button = self._button("")
        self.page_button.clicked.connect(self._go_to_first)
        self.all_button = self._button("All …")
        self.all_button.setToolTip("Show the whole text of every notice")
        self.all_button.clicked.connect(self._show_all)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(SPACE)
        row.addWidget(self.words, 1)
        row.addWidget(self.page_button)
        row.addWidget(self.all_button)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.hide()

    def show_text(self, key: str, text: str, page: str = "") -> None:
        """Show ``text`` as the banner ``key``, with a button to ``page`` where that is given."""
        self._texts[key] = (text, page)
        self._refresh()

    def hide_text(self, key: str) -> None:
        """Hide the banner ``key``, if there is one."""
        if self._texts.pop(key, None) is not None:
            self._refresh()

    def show_blocks(self, blocks: dict[str, ArmingBlock]) -> None:
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
        return [text for text, _ in self._all]

    @property
    def _all(self) -> list[tuple[str, str]]:
        return [*self._blocks.values(), *self._texts.values()]

    def _refresh(self) -> None:
        banners = self._all
        if banners:
            text, page = banners[0]
            self.words.show_text(f"⚠  {text}")
            self.page_button.setText(f"Go to {page}")
            self.page_button.setToolTip(f"Open the page {page}")
            self.page_button.setVisible(bool(page))
            count = len(banners)
            self.all_button.setText(f"All {count} …" if count > 1 else "Whole text …")
        self.setVisible(bool(banners))

    @Slot()
    def _go_to_first(self) -> None:
        if self._all:
            self._show_page(self._all[0][1])

    @Slot()
    def _show_all(self) -> None:
        """Show every banner with its whole text in a list that closes on its own."""
        shown = QFrame(self, Qt.WindowType.Popup)
        shown.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        shown.setProperty("role", "card")
        grid = QGridLayout(shown)
        for row, (text, page) in enumerate(self._all):
            words = label(f"⚠  {text}", "warn")
            words.setWordWrap(True)
            words.setFixedWidth(_LIST)
            grid.addWidget(words, row, 0)
            if page:
                go = self._button(f"Go to {page}")
                go.clicked.connect(shown.close)
                go.clicked.connect(lambda _=False, page=page: self._show_page(page))
                grid.addWidget(go, row, 1)
        shown.adjustSize()
        corner = self.mapToGlobal(QPoint(self.width() - shown.width(), self.height()))
        shown.move(max(corner.x(), 0), corner.y())
        shown.show()

    @staticmethod
    def _button(text: str) -> QPushButton:
        made = button(text, "")
        made.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # no stop key may press it
        return made
