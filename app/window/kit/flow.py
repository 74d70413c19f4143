"""Row of widgets that goes on in a further line where there is no room for all of them."""

from __future__ import annotations

from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtWidgets import QHBoxLayout, QLayout, QLayoutItem, QSizePolicy, QWidget

from dearig.window.kit.theme import SPACE

__all__ = ["Flow"]


class Flow(QLayout):
    """Places widgets from the left to the right, in as many lines as they need.

    What is left of a line goes to its widgets with a ``share``.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._items: list[QLayoutItem] = []
        self._shares: list[int] = []
        self._heights: dict[int, int] = {}  # by width; a page that is shown asks a hundred times
        self.setContentsMargins(0, 0, 0, 0)
        self.setSpacing(SPACE // 2)

    def add(self, *widgets: QWidget, share: int = 0) -> None:
        """Add ``widgets``, which stay in one line; the last of them grows by ``share``."""
        made = widgets[0]
        if len(widgets) > 1:
            made = QWidget()
            row = QHBoxLayout(made)
            row.setContentsMargins(0, 0, 0, 0)
            row.setSpacing(SPACE // 2)
            for place, widget in enumerate(widgets):
                row.addWidget(widget, int(place == len(widgets) - 1))
            made.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self._shares.append(share)
        self.addWidget(made)

    def addItem(self, item: QLayoutItem) -> None:  # noqa: N802
        self._items.append(item)
        self.invalidate()

    def count(self) -> int:
        return len(self._items)

    def itemAt(self, index: int) -> QLayoutItem | None:  # noqa: N802
        return self._items[index] if 0 <= index < len(self._items) else None

    def takeAt(self, index: int) -> QLayoutItem | None:  # noqa: N802
        if not 0 <= index < len(self._items):
            return None
        del self._shares[index]
        self.invalidate()
        return self._items.pop(index)

    def expandingDirections(self) -> Qt.Orientation:  # noqa: N802
        return Qt.Orientation.Horizontal

    def hasHeightForWidth(self) -> bool:  # noqa: N802
        return True

    def invalidate(self) -> None:
        self._heights.clear()
        super().invalidate()

    def heightForWidth(self, width: int) -> int:  # noqa: N802
        if width not in self._heights:
            lines = self._lines(width)
            between = self.spacing() * max(len(lines) - 1, 0)
            self._heights[width] = sum(map(self._height, lines)) + between
        return self._heights[width]

    def sizeHint(self) -> QSize:  # noqa: N802
        shown = self._shown()
        widths = [item.sizeHint().width() for item, _ in shown]
        return QSize(sum(widths) + self.spacing() * max(len(widths) - 1, 0), self._height(shown))

    def minimumSize(self) -> QSize:  # noqa: N802
        shown = self._shown()
        return QSize(
            max((item.minimumSize().width() for item, _ in shown), default=0), self._height(shown)
        )

    def setGeometry(self, area: QRect) -> None:  # noqa: N802
        super().setGeometry(area)
        top = area.top()
        for line in self._lines(area.width()):
            height, left = self._height(line), area.left()
            free = area.width() - self._width(line)
            shares = sum(share for _, share in line)
            for item, share in line:
                width = min(_wanted(item), area.width())
                width += free * share // shares if shares and free > 0 else 0
                item.setGeometry(QRect(QPoint(left, top), QSize(width, height)))
                left += width + self.spacing()
            top += height + self.spacing()

    def _shown(self) -> list[tuple[QLayoutItem, int]]:
        return [
            (item, share)
            for item, share in zip(self._items, self._shares, strict=True)
            if not item.isEmpty()
        ]

    def _lines(self, width: int) -> list[list[tuple[QLayoutItem, int]]]:
        lines: list[list[tuple[QLayoutItem, int]]] = []
        used = 0
        for pair in self._shown():
            wanted = _wanted(pair[0])
            if lines and used + self.spacing() + wanted <= width:
                lines[-1].append(pair)
                used += self.spacing() + wanted
            else:
                lines.append([pair])
                used = wanted
        return lines

    def _width(self, line: list[tuple[QLayoutItem, int]]) -> int:
        return sum(_wanted(item) for item, _ in line) + self.spacing() * (len(line) - 1)

    def _height(self, line: list[tuple[QLayoutItem, int]]) -> int:
        return max((item.sizeHint().height() for item, _ in line), default=0)


def _wanted(item: QLayoutItem) -> int:
    """Width in px that ``item`` asks for; the hint of a widget that takes what is left may be 0."""
    return max(item.sizeHint().width(), item.minimumSize().width())
