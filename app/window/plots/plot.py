"""One plot of a plot area: axes with units, curves, and a key above the curves."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from html import escape

import pyqtgraph as pg
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QGuiApplication, QPainter
from PySide6.QtWidgets import (
    QGraphicsGridLayout,
    QGraphicsItem,
    QGraphicsSceneResizeEvent,
    QSizePolicy,
    QStyleOptionGraphicsItem,
    QWidget,
)

from dearig.window.kit.theme import Theme, pen
from dearig.window.plots.curve import PlotCurve

__all__ = ["AxisText", "LegendEntry", "Plot"]

_SAMPLE = 18.0  # px, length of a line in the key
_GAP = 5.0  # px between the line and its name
_BETWEEN = 16.0  # px between two entries
_KEY_POINTS = 9.0  # pt, size of the text of keys and labels
_LEAST_POINTS = 7.0  # pt, of a label next to a low plot
_CUT = "\N{HORIZONTAL ELLIPSIS}"
_DAY = 86_400.0  # s
_LEFT = 64  # px, width of the left axis
_OPAQUE = 255  # of the alpha of a colour
_FEW_DECADES = 2.5  # below this, powers of ten alone are too few labels
_LABEL = re.compile(r"(?P<name>.*?)\s*\((?P<unit>[^()]*)\)$")


@dataclass(frozen=True)
class AxisText:
    """Label of an axis: ``name`` of the quantity and its ``unit``, which may be empty."""

    name: str
    unit: str

    @classmethod
    def of(cls, label: str) -> AxisText:
        """Return the parts of a label such as "Voltage (kV)"."""
        found = _LABEL.match(label)
        return cls(found["name"], found["unit"]) if found else cls(label, "")

    def __str__(self) -> str:
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def number(self, value: float, pixel: float) -> str:
        """Return ``value`` with its unit, to a tenth of ``pixel``, its size on the screen."""
        if not math.isfinite(value):
            return "\N{EM DASH}"
        if not 1e-9 < pixel < 1e9 or not 1e-6 <= abs(value or 1.0) < 1e7:
            text = f"{value:.4g}"
        else:
            decimals = min(max(math.ceil(-math.log10(pixel)) + 1, 0), 9)
            text = f"{round(value, decimals) + 0.0:.{decimals}f}"  # + 0.0: no negative zero
        text = text.replace("-", "\N{MINUS SIGN}")
        return f"{text} {self.unit}" if self.unit else text


@dataclass(frozen=True)
class LegendEntry:
    """One entry of a key: a line, a symbol or a coloured area, and its name."""

    name: str
    colour: str
    dashed: bool = False
    symbol: str = ""
    line: bool = True
    area: bool = False

    @property
    def has_sample(self) -> bool:
        """True if something is drawn before the name."""
        return self.line or self.area or bool(self.symbol)


class Plot(pg.GraphicsWidget):
    """Plot of a ``PlotArea``, which makes it.

    The key stands above the curves and hides none. While ``auto_y`` is True, the y axis covers what
    is visible; it is False after the operator has chosen a range of y. With ``own_range`` the owner
    of the plot sets the range, with ``show_y``.
    """

    def __init__(
        self,
        left: str,
        bottom: str,
        log: tuple[bool, bool] = (False, False),
        own_range: bool = False,
        dates: bool = False,
    ) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.log = log
        self.dates = dates  #: the horizontal axis is Unix time in s, shown as local time
        self.axis_texts: dict[str, AxisText] = {}
        self._labels: dict[str, tuple[str, float]] = {}  # that are shown, with their points
        self.items: list[QGraphicsItem] = []  #: what was added, in this order
        self.drawn: list[PlotCurve] = []
        self.auto_y = True
        self._own_range = own_range
        self.same_y: tuple[Plot, ...] = (self,)  #: plots with this vertical axis
        self._entries: list[LegendEntry] = []
        self._note = ""
        self.vb = view = pg.ViewBox(enableMenu=False)
        view.setMouseEnabled(x=False, y=False)  # the area handles the mouse
        view.disableAutoRange()
        view.setAutoVisible(y=True)
        view.enableAutoRange(axis="y", enable=not own_range)
        self._axes = {
            "bottom": pg.DateAxisItem("bottom") if dates else _axis("bottom", log[0]),
            "left": _axis("left", log[1]),
        }
        self.key = _Key(self)
        self._arrange()
        for axis, logarithmic in zip(self._axes.values(), log, strict=True):
            if axis.autoSIPrefix:  # switching it off twice would scale the axis again
                axis.enableAutoSIPrefix(False)  # the labels have fixed units: kV, mm
            axis.linkToView(view)
            axis.setLogMode(logarithmic)
        self.set_axis("left", left)
        self.set_axis("bottom", bottom)
        # a row of the key changes the height of the view, and not that of the plot
        self.vb.sigResized.connect(lambda *_: self._show_label("left"))

    def _arrange(self) -> None:
        """Put the key above the view, and the axes at its left and below it."""
        self.rows = QGraphicsGridLayout(self)
        self.rows.setContentsMargins(1, 1, 1, 1)
        self.rows.setSpacing(0)
        self.rows.addItem(self.key, 0, 1)
        self.rows.setRowFixedHeight(0, 0.0)  # the key is empty
        self.rows.addItem(self.vb, 1, 1)
        self.rows.addItem(self._axes["bottom"], 2, 1)
        self.rows.addItem(self._axes["left"], 1, 0)
        self.rows.setRowStretchFactor(1, 1)
        self.rows.setColumnStretchFactor(1, 1)
        for axis in self._axes.values():
            # so that a negative place in depth puts it behind the curves
            axis.setFlag(QGraphicsItem.GraphicsItemFlag.ItemNegativeZStacksBehindParent)

    # axes

    def axis(self, side: str) -> pg.AxisItem:
        """Return the axis ``left`` or ``bottom``."""
        return self._axes[side]

    def set_axis(self, side: str, label: str) -> None:
        """Label the axis ``left`` or ``bottom``; the unit stands in brackets at the end."""
        self.axis_texts[side] = AxisText.of(label)
        self._show_label(side)

    def _show_label(self, side: str) -> None:
        """Show the label of an axis.

        Next to a plot that is too low for it, it has two lines, then smaller letters, and at last
        fewer of them: it must not run into the label of the next plot.
        """
        text = self.axis_texts[side]
        words, points, room = escape(str(text)), _KEY_POINTS, self.vb.height()
        if side == "left" and text.unit and self.key.width_of(str(text)) > room > 0.0:
            room += self.key.size().height()  # half of it on each side
            name, share = text.name, room / max(self.key.width_of(text.name), 1.0)
            points = max(_LEAST_POINTS, _KEY_POINTS * min(1.0, share))
            while len(name) > 1 and self.key.width_of(name) * points / _KEY_POINTS > room:
                name = f"{name.removesuffix(_CUT)[:-1]}{_CUT}"
            words = f"{escape(name)}<br>{escape(f'({text.unit})')}"
        if (words, points) != self._labels.get(side):
            self._labels[side] = (words, points)
            # the styles that are given replace all others
            axis = self._axes[side]
            colour = axis.textPen().color().name()
            axis.setLabel(words, **{"font-size": f"{points:g}pt", "color": colour})
            # pyqtgraph centres a label only when the axis changes its size
            axis.resizeEvent()

    def set_auto_y(self, auto: bool) -> None:
        """Let the y axis cover what is visible, or keep its range."""
        self.auto_y = auto
        self.vb.enableAutoRange(axis="y", enable=auto and not self._own_range)

    def show_y(self, low: float, high: float) -> None:
        """Show ``low`` to ``high`` on the y axis, unless the operator has chosen a range."""
        if self.auto_y:
            self.vb.setYRange(low, high, padding=0.0)

    def pixel(self) -> tuple[float, float]:
        """Return the size of a pixel in the units of the axes, at the middle of a linear axis."""
        (left, right), (low, high) = self.vb.viewRange()
        return (
            (right - left) / max(self.vb.width(), 1.0), (high - low) / max(self.vb.height(), 1.0)
        )  # fmt: skip

    def text_of(self, side: str, value: float) -> str:
        """Return ``value`` of the axis ``bottom`` or ``left`` with its unit, rounded."""
        if self.dates and side == "bottom":
            try:
                return f"{datetime.fromtimestamp(value, UTC).astimezone():%Y-%m-%d %H:%M}"
            except (ValueError, OverflowError, OSError):
                return "\N{EM DASH}"  # beyond the years that this system knows
        along = 0 if side == "bottom" else 1
        size = math.inf if self.log[along] else self.pixel()[along]
        return self.axis_texts[side].number(value, size)

    def share_y(self, plots: tuple[Plot, ...]) -> None:
        """Cover what is visible in all ``plots``, so that their curves can be compared."""
        self.same_y = plots
        shared = _SharedBounds(tuple(plot for plot in plots if plot is not self))
        shared.of_tools = True
        self.addItem(shared)

    def difference(self, side: str, value: float) -> str:
        """Return the difference ``value`` of two places on an axis, with its unit."""
        if self.dates and side == "bottom":
            return f"{value / _DAY:.4g} days".replace("-", "\N{MINUS SIGN}")
        return self.text_of(side, value)

    # contents

    def addItem(self, item: QGraphicsItem, ignoreBounds: bool = False) -> None:  # noqa: N802
        """Add an item in the units of the axes; one with ``ignoreBounds`` does not affect them."""
        self.items.append(item)
        self.vb.addItem(item, ignoreBounds)

    def removeItem(self, item: QGraphicsItem) -> None:  # noqa: N802
        """Remove an item that was added."""
        self.items.remove(item)
        self.vb.removeItem(item)

    def add_curve(
        self,
        name: str = "",
        colour: str = "#808080",
        dashed: bool = False,
        symbol: str = "",
        line: bool = True,
        size: int = 5,
        in_key: bool = True,
    ) -> PlotCurve:
        """Add an empty curve; one without a ``name`` is neither in the key nor in the data."""
        curve = PlotCurve(name, symbol, line, size, in_key)
        curve.set_colour(colour, dashed)
        curve.set_log(*self.log)
        self.addItem(curve)
        if curve.scatter is not None:
            self.addItem(curve.scatter)
        self.drawn.append(curve)
        self.renew_key()
        return curve

    def add_entry(self, entry: LegendEntry) -> None:
        """Add an entry to the key for something that is not a curve."""
        self._entries.append(entry)
        self.renew_key()

    def set_note(self, text: str) -> None:
        """Show ``text`` after the entries of the key, or nothing."""
        self._note = text
        self.renew_key()

    def add_levels(self, theme: Theme, tip: str, *levels: float) -> None:
        """Add horizontal dashed lines that do not affect the range."""
        for level in levels:
            line = pg.InfiniteLine(level, angle=0, pen=pen(theme.muted, dashed=True))
            line.setToolTip(tip)
            self.addItem(line, ignoreBounds=True)

    def clear_all(self) -> None:
        """Remove all curves, lines and entries of the key."""
        kept = [item for item in self.items if getattr(item, "of_tools", False)]
        self.drawn.clear()
        self._entries.clear()
        self._note = ""
        for item in [item for item in self.items if item not in kept]:
            self.removeItem(item)
        self.renew_key()

    def curves_in_key(self) -> list[PlotCurve]:
        """Return the curves that are in the key."""
        return [curve for curve in self.drawn if curve.title and curve.in_key]

    def entries(self) -> list[LegendEntry]:
        """Return the entries of the key."""
        curves = [
            LegendEntry(c.title, c.colour, c.dashed, c.symbol, c.line) for c in self.curves_in_key()
        ]
        note = [LegendEntry(self._note, "#808080", line=False)] if self._note else []
        return curves + self._entries + note

    def renew_key(self, values: tuple[str, ...] = ()) -> None:
        """Draw the key again; ``values`` follow the names of the curves, in the order of these."""
        self.key.show_entries(self.entries(), values)

    def restyle(self, theme: Theme) -> None:
        """Use the colours of ``theme`` for the axes and the key.

        The left axis has a fixed width, so that the plot does not move while its labels change.
        """
        for axis in self._axes.values():
            axis.setPen(pg.mkPen(QColor(theme.muted)))
            axis.setTextPen(pg.mkPen(QColor(theme.text)))
            # few opaque lines behind the curves: drawing pyqtgraph's own grid takes longer than
            # drawing the curves
            axis.setGrid(_OPAQUE)
            axis.setTickPen(pg.mkPen(QColor(theme.raised)))
            axis.setStyle(maxTickLevel=0, tickAlpha=_OPAQUE)
            axis.setZValue(-1000)
        self._axes["left"].setWidth(_LEFT)
        self.key.set_colour(theme.text)

    def resizeEvent(self, event: QGraphicsSceneResizeEvent) -> None:  # noqa: N802
        super().resizeEvent(event)
        self.key.arrange()
        self._show_label("left")


class _SharedBounds(pg.GraphicsObject):
    """Draws nothing; its vertical bounds are those of the curves in other plots."""

    def __init__(self, plots: tuple[Plot, ...]) -> None:
        super().__init__()
        self._plots = plots

    def dataBounds(  # noqa: N802
        self,
        ax: int,
        frac: float = 1.0,
        orthoRange: tuple[float, float] | None = None,
    ) -> tuple[float | None, float | None]:
        found = [
            curve.dataBounds(ax, frac, orthoRange)
            for plot in self._plots if ax == 1 and plot.isVisible() for curve in plot.drawn
        ]  # fmt: skip
        low = min((b[0] for b in found if b[0] is not None), default=None)
        return low, max((b[1] for b in found if b[1] is not None), default=None)

    def boundingRect(self) -> QRectF:  # noqa: N802
        return QRectF()

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionGraphicsItem,
        widget: QWidget | None = None,
    ) -> None:
        """Draw nothing."""


def _axis(side: str, logarithmic: bool) -> pg.AxisItem:
    return DecadeAxis(side) if logarithmic else _Axis(side)


class _Axis(pg.AxisItem):
    """Axis that lays out its label when the words change, not with each pen and each range."""

    _words: str | None = None

    def _updateLabel(self) -> None:  # noqa: N802
        words = self.labelString()
        if words != self._words:
            self._words = words
            super()._updateLabel()
        else:
            self.picture = None  # another pen or scale: the ticks are drawn again
            self.update()


class DecadeAxis(_Axis):
    """Logarithmic axis with labels at 1, 2, 5 or at powers of ten, so that none overlap."""

    def tickStrings(  # noqa: N802
        self, values: list[float], scale: float, spacing: float
    ) -> list[str]:
        strings: list[str] = super().tickStrings(values, scale, spacing)
        if not self.logMode:
            return strings
        marked = (1, 2, 5) if self.range[1] - self.range[0] < _FEW_DECADES else (1,)
        leading = (round(10.0 ** (value - math.floor(value + 1e-9))) for value in values)
        return [s if n in marked else "" for s, n in zip(strings, leading, strict=True)]


class _Key(pg.GraphicsWidget):
    """Entries from the left, in as many rows as they need; no row where there is no entry."""

    def __init__(self, plot: Plot) -> None:
        super().__init__()
        self._plot = plot
        self._entries: list[LegendEntry] = []
        self._values: tuple[str, ...] = ()
        self._places: list[tuple[LegendEntry, str, QPointF]] = []
        self._colour = "#808080"
        font = QGuiApplication.font()
        font.setPointSizeF(_KEY_POINTS)
        self._font = font
        self._metrics = QFontMetricsF(font)
        self._rows = -1

    def set_colour(self, colour: str) -> None:
        self._colour = colour
        self.update()

    def show_entries(self, entries: list[LegendEntry], values: tuple[str, ...]) -> None:
        if (entries, values) == (self._entries, self._values) and self._rows >= 0:
            return
        self._entries, self._values = entries, values
        self.arrange()

    def width_of(self, text: str) -> float:
        """Return the width of ``text`` in px."""
        return self._metrics.horizontalAdvance(text)

    @property
    def texts(self) -> list[str]:
        """Texts that are shown."""
        return [text for _, text, _ in self._places]

    def arrange(self) -> None:
        """Break the entries into rows, and take the height that they need."""
        width = max(self._plot.vb.width(), 60.0)
        height = self._row_height()
        self._places, x, row = [], 0.0, 0
        values = (*self._values, *[""] * (len(self._entries) - len(self._values)))
        for entry, value in zip(self._entries, values, strict=True):
            text = f"{entry.name}  {value}" if value else entry.name
            sample = _SAMPLE + _GAP if entry.has_sample else 0.0
            text = self._metrics.elidedText(text, Qt.TextElideMode.ElideMiddle, width - sample)
            size = sample + self._metrics.horizontalAdvance(text)
            if x and x + size > width:
                x, row = 0.0, row + 1
            self._places.append((entry, text, QPointF(x, row * height)))
            x += size + _BETWEEN
        rows = row + 1 if self._places else 0
        if rows != self._rows:
            self._rows = rows
            self.setMinimumHeight(rows * height)
            self.setMaximumHeight(rows * height)
            self._plot.rows.setRowFixedHeight(0, rows * height)
        self.setToolTip("\n".join(escape(e.name) for e in self._entries))
        self.update()

    def boundingRect(self) -> QRectF:  # noqa: N802
        return QRectF(0.0, 0.0, self._plot.vb.width(), max(self._rows, 0) * self._row_height())

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionGraphicsItem,  # noqa: ARG002
        widget: QWidget | None = None,  # noqa: ARG002
    ) -> None:
        painter.setFont(self._font)
        height = self._row_height()
        for entry, text, place in self._places:
            middle = place.y() + height / 2.0
            colour = QColor(entry.colour)
            if entry.area:
                painter.fillRect(QRectF(place.x(), middle - 4.0, _SAMPLE, 8.0), colour)
            elif entry.line:
                painter.setPen(pg.mkPen(pen(entry.colour, entry.dashed), width=2))
                painter.drawLine(
                    QPointF(place.x(), middle), QPointF(place.x() + _SAMPLE, middle)
                )  # fmt: skip
            if entry.symbol:
                painter.setPen(Qt.PenStyle.NoPen)
                painter.setBrush(colour)
                square = QRectF(place.x() + _SAMPLE / 2.0 - 3.0, middle - 3.0, 6.0, 6.0)
                draw = painter.drawRect if entry.symbol == "s" else painter.drawEllipse
                draw(square)
            painter.setPen(QColor(self._colour))
            base = place.y() + (height + self._metrics.ascent() - self._metrics.descent()) / 2.0
            sample = _SAMPLE + _GAP if entry.has_sample else 0.0
            painter.drawText(QPointF(place.x() + sample, base), text)

    def _row_height(self) -> float:
        return math.ceil(self._metrics.height()) + 1.0
