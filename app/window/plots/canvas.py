"""Drawing surface of a plot area: what the mouse does on the plots."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, Qt, Signal
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QRubberBand, QSizePolicy, QWidget

from dearig.window.plots.plot import Plot

__all__ = ["GAP", "Canvas", "Drag"]

GAP = 2  #: px between two plots, and around them

_NEAR = 5.0  # px from a cursor within which it is taken
_ZOOM_LEAST = 5  # px; a shorter drag is a click, and does not zoom
_WHEEL_STEP = 120.0  # eighths of a degree of one step of a wheel
_WHEEL_FACTOR = 1.25  # of the range, for one step


class Drag(Enum):
    """What a drag with the left button does."""

    PAN = "pan"
    BOX = "box zoom"
    TIME = "zoom of the horizontal axis"


@dataclass
class _Dragged:
    plot: Plot
    start: QPointF  # in the widget
    last: QPointF
    kind: Drag
    cursor: int | None = None
    moved: bool = False


class Canvas(pg.GraphicsLayoutWidget):
    """Shows the plots; says what the operator does with the mouse.

    The wheel zooms the horizontal axis about the pointer, over the left axis or with Ctrl the
    vertical one. A double click shows everything.
    """

    pointed = Signal(object, QPointF)  #: plot or None, place in the units of its axes
    begun = Signal(str)  #: before a change of ranges, by "drag" or "wheel"
    panned = Signal(object, QPointF)  #: plot, shift in the units of its axes
    zoomed = Signal(object, object, object)  #: plot, range of x or None, range of y or None
    cursor_moved = Signal(object, int, float)  #: plot, cursor 0 or 1, x
    double_clicked = Signal()
    clicked = Signal(object, QPointF)  #: plot, place in the widget, of a click that moved nothing

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.drag = Drag.PAN
        self.area_plots: list[Plot] = []
        self.cursors_of: dict[Plot, tuple[float, float] | None] = {}
        self._dragged: _Dragged | None = None
        self._band = QRubberBand(QRubberBand.Shape.Rectangle, self.viewport())
        self.ci.layout.setVerticalSpacing(GAP)
        self.ci.layout.setContentsMargins(GAP, GAP, 6, GAP)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.setMouseTracking(True)
        # as high as there is room for: the height that a scene asks for made a page scroll
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)

    # places

    def plot_at(self, place: QPointF, with_axes: bool = False) -> Plot | None:
        """Return the plot whose curves, or axes too, are at ``place`` of the widget."""
        scene = self.mapToScene(place.toPoint())
        for plot in self.area_plots:
            area = plot if with_axes else plot.vb
            if plot.isVisible() and area.sceneBoundingRect().contains(scene):
                return plot
        return None

    def value_at(self, plot: Plot, place: QPointF) -> QPointF:
        """Return the place in the units of the axes of ``plot``."""
        return plot.vb.mapSceneToView(self.mapToScene(place.toPoint()))  # type: ignore[no-any-return]

    def place_of(self, plot: Plot, x: float, y: float) -> QPoint:
        """Return the place in the widget of (``x``, ``y``) in the units of the axes of ``plot``."""
        return self.mapFromScene(plot.vb.mapViewToScene(QPointF(x, y)))  # type: ignore[no-any-return]

    def _cursor_at(self, plot: Plot, place: QPointF) -> int | None:
        pair = self.cursors_of.get(plot)
        if pair is None:
            return None
        middle = plot.vb.viewRect().center().y()
        away = [abs(self.place_of(plot, x, middle).x() - place.x()) for x in pair]
        nearest = 0 if away[0] < away[1] else 1
        return nearest if away[nearest] <= _NEAR else None

    # mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        plot = self.plot_at(event.position())
        buttons = (Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton)
        if plot is None or event.button() not in buttons:
            event.accept()  # pyqtgraph's own zoom with the right button is not used
            return
        place = event.position()
        kind = self.drag if event.button() is Qt.MouseButton.LeftButton else Drag.PAN
        cursor = self._cursor_at(plot, place) if event.button() is buttons[0] else None
        self._dragged = _Dragged(plot, place, place, kind, cursor)
        event.accept()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        place, dragged = event.position(), self._dragged
        if dragged is None:
            plot = self.plot_at(place)
            near = plot is not None and self._cursor_at(plot, place) is not None
            shape = Qt.CursorShape.SplitHCursor if near else Qt.CursorShape.ArrowCursor
            if plot is not None and not near and self.drag is not Drag.PAN:
                shape = Qt.CursorShape.CrossCursor
            self.viewport().setCursor(shape)
            self.pointed.emit(plot, QPointF() if plot is None else self.value_at(plot, place))
            super().mouseMoveEvent(event)  # tips of the items
            return
        event.accept()
        self._drag_to(dragged, place)

    def _drag_to(self, dragged: _Dragged, place: QPointF) -> None:
        plot = dragged.plot
        if dragged.cursor is not None:
            self.cursor_moved.emit(plot, dragged.cursor, self.value_at(plot, place).x())
            return
        if dragged.kind is Drag.PAN:
            if not dragged.moved:
                self.begun.emit("drag")
            shift = self.value_at(plot, dragged.last) - self.value_at(plot, place)
            self.panned.emit(plot, shift)
        else:
            self._band.setGeometry(self._box(dragged, place))
            self._band.show()
        dragged.moved, dragged.last = True, place

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        dragged, self._dragged = self._dragged, None
        event.accept()
        self._band.hide()
        if dragged is not None and not dragged.moved and dragged.cursor is None:
            self.clicked.emit(dragged.plot, event.position())
        if dragged is None or dragged.cursor is not None or dragged.kind is Drag.PAN:
            return
        box = self._box(dragged, event.position())
        if box.width() < _ZOOM_LEAST or box.height() < _ZOOM_LEAST:
            return
        first = self.value_at(dragged.plot, QPointF(box.topLeft()))
        last = self.value_at(dragged.plot, QPointF(box.bottomRight()))
        self.begun.emit("drag")
        y = (last.y(), first.y()) if dragged.kind is Drag.BOX else None
        self.zoomed.emit(dragged.plot, (first.x(), last.x()), y)

    def _box(self, dragged: _Dragged, place: QPointF) -> QRect:
        """Return the rectangle of a zoom, inside the plot."""
        box = QRect(dragged.start.toPoint(), place.toPoint()).normalized()
        inside = self.mapFromScene(dragged.plot.vb.sceneBoundingRect()).boundingRect()
        if dragged.kind is Drag.TIME:
            box.setTop(inside.top())
            box.setBottom(inside.bottom())
        return box.intersected(inside)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        event.accept()
        self._dragged = None
        if event.button() is Qt.MouseButton.LeftButton and self.plot_at(event.position()):
            self.double_clicked.emit()

    def wheelEvent(self, event: QWheelEvent) -> None:  # noqa: N802
        plot = self.plot_at(event.position(), with_axes=True)
        turned = event.angleDelta().y() or event.angleDelta().x()
        if plot is None or not turned:
            event.ignore()
            return
        event.accept()
        factor = _WHEEL_FACTOR ** (-turned / _WHEEL_STEP)
        place = self.value_at(plot, event.position())
        x, y = plot.vb.viewRange()
        self.begun.emit("wheel")
        over_left = event.position().x() < self.mapFromScene(
            plot.vb.sceneBoundingRect().topLeft()
        ).x()  # fmt: skip
        if over_left or event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self.zoomed.emit(plot, None, _about(y, place.y(), factor))
        else:
            self.zoomed.emit(plot, _about(x, place.x(), factor), None)

    def leaveEvent(self, event: QEvent) -> None:  # noqa: N802
        super().leaveEvent(event)
        self.pointed.emit(None, QPointF())


def _about(limits: list[float], middle: float, factor: float) -> tuple[float, float]:
    """Return ``limits`` made ``factor`` times as far apart, with ``middle`` in its place."""
    low, high = limits
    return middle - (middle - low) * factor, middle + (high - middle) * factor
