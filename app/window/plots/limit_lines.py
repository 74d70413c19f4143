"""Lines of trip levels and marks in a plot, each with its words.

One item in the pixels of the plot paints all of them: each line and text of pyqtgraph is worked on
in Python several times in every frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import pyqtgraph as pg
from PySide6.QtCore import QPointF, QRectF, Qt, Slot
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QGuiApplication, QPainter, QPen
from PySide6.QtWidgets import QGraphicsObject, QStyleOptionGraphicsItem, QWidget

from dearig.drivers.settings import RigSettings
from dearig.window.kit.theme import Theme
from dearig.window.plots.plot import Plot

__all__ = ["MarkLine", "PlotOverlay", "TripLevel", "trip_levels"]

_EDGE = 4.0  # px from the edge of the plot to a text
_POINTS = 9.0  # pt, size of the texts
_BEHIND = -50.0  # the curves


@dataclass(frozen=True)
class TripLevel:
    """Level ``value`` in SI units in the plot ``plot``; ``words`` name it with its unit."""

    plot: str
    value: float
    words: str


@dataclass(frozen=True)
class MarkLine:
    """Vertical line at ``time`` s in the ``colour`` ``#rrggbb``, with ``words``."""

    time: float
    words: str
    colour: str


def trip_levels(settings: RigSettings) -> tuple[TripLevel, ...]:
    """Return the levels of voltage, current and displacement at which a run is refused or ended.

    The gate refuses plans beyond the voltage limits; the interlocks end a run at the others.
    """
    limits, locks = settings.limits, settings.interlocks
    high, low = limits.voltage_max_kV, limits.voltage_min_kV
    found = [TripLevel("voltage", high * 1e3, f"limit {high:g} kV")]
    if low < 0.0:
        found.append(TripLevel("voltage", low * 1e3, f"limit {low:g} kV"))
    for plot, value, unit in (
        ("current", locks.current_max_mA, "mA"),
        ("current", -locks.current_max_mA, "mA"),
        ("displacement", locks.displacement_max_mm, "mm"),
        ("displacement", locks.displacement_min_mm, "mm"),
    ):
        found.append(TripLevel(plot, value * 1e-3, f"trip {value:g} {unit}"))
    return tuple(found)


class PlotOverlay(QGraphicsObject):
    """Trip levels, marks and a text of one plot, whose values are drawn times ``scale``.

    A level in view is a dashed line with its words. One that is not in view is named at the edge of
    the plot, with an arrow. Everything lies behind the curves.
    """

    def __init__(self, plot: Plot, scale: float, theme: Theme) -> None:
        self._view: pg.ViewBox = plot.vb
        super().__init__(self._view)
        self._scale = scale
        self._theme = theme
        self._levels: tuple[TripLevel, ...] = ()
        self._marks: tuple[MarkLine, ...] = ()
        self._with_words = False
        self._words = ""
        self._font = QFont(QGuiApplication.font())
        self._font.setPointSizeF(_POINTS)
        self._metrics = QFontMetricsF(self._font)
        self.setZValue(_BEHIND)
        self._view.sigRangeChanged.connect(self._changed)
        self._view.sigResized.connect(self._resized)

    @property
    def levels(self) -> tuple[TripLevel, ...]:
        """Levels that are drawn."""
        return self._levels

    @property
    def shown(self) -> list[str]:
        """Words of the levels, with an arrow where the line is not in view."""
        low, high = self._view.viewRange()[1]
        arrows = {True: "\N{UPWARDS ARROW} ", False: "\N{DOWNWARDS ARROW} "}
        found = []
        for level in self._levels:
            at = level.value * self._scale
            found.append(("" if low < at < high else arrows[at >= high]) + level.words)
        return found

    @property
    def texts(self) -> list[str]:
        """Words of the marks, and the text in the middle."""
        marks = [mark.words for mark in self._marks] if self._with_words else []
        return marks + ([self._words] if self._words else [])

    def set_theme(self, theme: Theme) -> None:
        """Use the colours of ``theme``."""
        self._theme = theme
        self.update()

    def show_levels(self, levels: tuple[TripLevel, ...]) -> None:
        """Draw ``levels``."""
        self._levels = levels
        self.update()

    def show_marks(self, marks: tuple[MarkLine, ...], with_words: bool) -> None:
        """Draw ``marks``, with their words or without."""
        self._marks, self._with_words = marks, with_words
        self.update()

    def show_words(self, words: str) -> None:
        """Show ``words`` in the middle of the plot."""
        self._words = words
        self.update()

    @Slot()
    def _changed(self) -> None:
        self.update()

    @Slot()
    def _resized(self) -> None:
        self.prepareGeometryChange()

    def boundingRect(self) -> QRectF:  # noqa: N802
        return QRectF(0.0, 0.0, self._view.width(), self._view.height())

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionGraphicsItem,  # noqa: ARG002
        widget: QWidget | None = None,  # noqa: ARG002
    ) -> None:
        painter.setFont(self._font)
        self._paint_levels(painter)
        self._paint_marks(painter)
        if self._words:
            painter.setPen(QColor(self._theme.muted))
            painter.drawText(self.boundingRect(), Qt.AlignmentFlag.AlignCenter, self._words)

    def _paint_levels(self, painter: QPainter) -> None:
        low, high = self._view.viewRange()[1]
        width, height = self._view.width(), self._view.height()
        ascent, row = self._metrics.ascent(), self._metrics.height()
        end = _EDGE  # x of the next text at the upper edge
        painter.setPen(_dashed(self._theme.limit))
        for level, words in zip(self._levels, self.shown, strict=True):
            at = level.value * self._scale
            if low < at < high:
                y = round((high - at) / (high - low) * height)
                painter.drawLine(QPointF(0.0, y), QPointF(width, y))
                # on the side of the middle
                painter.drawText(QPointF(_EDGE, y + (ascent if y < height / 2 else ascent - row)),
                                 words)  # fmt: skip
                continue
            painter.drawText(QPointF(end, ascent), words)
            end += self._metrics.horizontalAdvance(words) + 3.0 * _EDGE

    def _paint_marks(self, painter: QPainter) -> None:
        first, last = self._view.viewRange()[0]
        width, height = self._view.width(), self._view.height()
        for mark in self._marks:
            if not first <= mark.time <= last:
                continue
            x = round((mark.time - first) / (last - first) * width)
            painter.setPen(_dashed(mark.colour))
            painter.drawLine(QPointF(x, 0.0), QPointF(x, height))
            if self._with_words:
                size = self._metrics.horizontalAdvance(mark.words)
                at = x + _EDGE if x + _EDGE + size < width else x - _EDGE - size
                painter.drawText(QPointF(at, height - self._metrics.descent() - 1.0), mark.words)


def _dashed(colour: str) -> QPen:
    return QPen(QColor(colour), 1.0, Qt.PenStyle.DashLine)
