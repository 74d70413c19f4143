"""Pages behind tabs that go on in a further line where there is no room for all of them."""

from __future__ import annotations

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import (
    QAbstractButton,
    QButtonGroup,
    QPushButton,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from dearig.window.kit.flow import Flow
from dearig.window.kit.theme import SPACE

__all__ = ["WrappedTabs"]


class WrappedTabs(QWidget):
    """Shows one of several pages; Qt's own row of tabs hides those for which it has no room."""

    current_changed = Signal(int)

    def __init__(self) -> None:
        super().__init__()
        self._group = QButtonGroup(self)
        self._group.idToggled.connect(self._toggled)
        self._bar, self._pages = Flow(), QStackedWidget()
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(SPACE // 2)
        column.addLayout(self._bar)
        column.addWidget(self._pages, 1)

    def add(self, page: QWidget, text: str) -> None:
        """Add a ``page``; the first one is shown."""
        place = self._pages.addWidget(page)
        tab = QPushButton(text)
        tab.setCheckable(True)
        tab.setProperty("role", "switch")
        self._group.addButton(tab, place)
        self._bar.add(tab)
        tab.setChecked(place == 0)

    def tab(self, place: int) -> QAbstractButton:
        """Return the tab of the page at ``place``."""
        return self._group.button(place)

    def show_page(self, place: int) -> None:
        """Show the page at ``place``."""
        self.tab(place).setChecked(True)

    @Slot(int, bool)
    def _toggled(self, place: int, on: bool) -> None:
        if on:
            self._pages.setCurrentIndex(place)
            self.current_changed.emit(place)
