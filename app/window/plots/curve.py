"""Curve of a plot: it keeps all of its points, and draws what the width of the plot can show."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor

from dearig.analysis.decimate import decimate_on_grid
from dearig.window.kit.theme import pen

__all__ = ["PlotCurve", "PointSource", "cut_lines"]

#: Returns all points (x, y) of a curve, where the curve itself holds only what is visible.
PointSource = Callable[[], tuple[np.ndarray, np.ndarray]]

_POINTS_PER_PIXEL = 2  # the lowest and the highest sample of a column of pixels
_MARGIN = 1  # points beyond each edge of the view, so that the line reaches the edge


class PlotCurve(pg.PlotCurveItem):
    """Line through points, with symbols if ``symbol`` is given; it breaks where y is NaN.

    ``x`` and ``y`` are in the units of the axes. Where there are more points than the plot has
    pixels, each column of pixels gets its lowest and its highest point in the order of x: rising
    and falling slopes look alike, no spike is lost, and each drawn point is one of the data. The
    columns keep their places in x, so that the curve does not flicker while it is moved.
    """

    def __init__(
        self,
        name: str,
        symbol: str = "",
        line: bool = True,
        size: int = 5,
        in_key: bool = True,
    ) -> None:
        super().__init__(skipFiniteCheck=False, connect="finite")
        self.title = name  #: without one, it is neither in the key nor in the data
        self.in_key = in_key
        self.colour = ""
        self.dashed = False
        self.line = line
        self.symbol = symbol
        self.supply: PointSource | None = None
        self.scatter = pg.ScatterPlotItem(pen=None, symbol=symbol, size=size) if symbol else None
        self._log = (False, False)
        self._x = self._y = np.empty(0)
        self._increasing = True
        self._thinned = False
        self._drawn: tuple[float, float, float] | None = None  # view for which points were chosen

    # appearance

    def set_colour(self, colour: str, dashed: bool = False) -> None:
        """Use a colour ``#rrggbb``; a dashed line is drawn over one that may coincide with it."""
        self.colour, self.dashed = colour, dashed
        self.setPen(pen(colour, dashed) if self.line else None)
        if self.scatter is not None:
            self.scatter.setBrush(QColor(colour))

    def set_log(self, x: bool, y: bool) -> None:
        """Draw the logarithms of x, of y, or of both; points that are not positive are left out."""
        if (x, y) != self._log:
            self._log = (x, y)
            self._draw(force=True)

    # data

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """All points, x and y (n,) each."""
        return (self._x, self._y) if self.supply is None else self.supply()

    @property
    def increasing(self) -> bool:
        """True if x does not decrease, so that there is one value for each x."""
        return self._increasing

    def set_points(self, x: np.ndarray, y: np.ndarray, thinned: bool = False) -> None:
        """Use the points ``x`` and ``y`` (n,); ``thinned`` ones are all drawn as they are.

        ``thinned`` is for a curve that is decimated elsewhere, many times a second: x increases.
        """
        self._x = np.asarray(x, dtype=np.float64)
        self._y = np.asarray(y, dtype=np.float64)
        self._thinned = thinned
        self._increasing = thinned or not (np.diff(self._x) < 0.0).any()
        self._draw(force=True)

    def value_at(self, x: float) -> float:
        """Return y of the point nearest to ``x``; NaN beyond the ends, or where x turns back."""
        if not self._increasing or not self._x.size or not self._x[0] <= x <= self._x[-1]:
            return math.nan
        after = int(np.searchsorted(self._x, x))
        if after and x - self._x[after - 1] < self._x[after] - x:
            after -= 1
        return float(self._y[after])

    # drawing

    def viewRangeChanged(self) -> None:  # noqa: N802
        """Choose the points again for another range or width of the plot."""
        self._draw(force=False)

    def cut_at_edges(self, cut: bool) -> None:
        """Cut the drawn lines at the edges of the plot, for a drawing without clipping, or not."""
        if not cut:
            self._draw(force=True)
            return
        view = self.getViewBox()
        limits = view.viewRange()
        x, y = self.getData()
        if x is None or not x.size:
            return
        if self.scatter is not None:
            inside = (x >= limits[0][0]) & (x <= limits[0][1])
            inside &= (y >= limits[1][0]) & (y <= limits[1][1])
            self.scatter.setData(x[inside], y[inside])
        self.setData(*cut_lines(x, y, limits[0], limits[1]), connect="finite")

    def boundingRect(self) -> QRectF:  # noqa: N802
        """Return the visible rectangle for a curve of a run, which changes in every frame.

        Nothing is drawn beyond it, and it needs no look at the points.
        """
        view = self.getViewBox()
        live = self._thinned and isinstance(view, pg.ViewBox)
        rectangle: QRectF = view.viewRect() if live else super().boundingRect()
        return rectangle

    def dataBounds(  # noqa: N802
        self,
        ax: int,
        frac: float = 1.0,  # noqa: ARG002
        orthoRange: tuple[float, float] | None = None,
    ) -> tuple[float | None, float | None]:
        """Return the range of all points along axis ``ax``, of those in ``orthoRange`` if given."""
        x, y = self._mapped(self._x, self._y)
        along, across = (x, y) if ax == 0 else (y, x)
        if orthoRange is not None:
            along = along[(across >= orthoRange[0]) & (across <= orthoRange[1])]
        along = along[np.isfinite(along)]
        return (float(along.min()), float(along.max())) if along.size else (None, None)

    def _mapped(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if not any(self._log):
            return x, y
        good = np.ones(x.size, dtype=bool)
        for values, log in zip((x, y), self._log, strict=True):
            if log:
                good &= values > 0.0
        x, y = x[good], y[good]
        return np.log10(x) if self._log[0] else x, np.log10(y) if self._log[1] else y

    def _draw(self, force: bool) -> None:
        if self._thinned and not force:
            return
        if self._thinned or not self._increasing:
            if force:
                self._set_drawn(*self._mapped(self._x, self._y))
            return
        view = self.getViewBox()
        width = view.width() if isinstance(view, pg.ViewBox) else 0.0  # not in a plot yet
        if width < 1.0:
            first, last, step = -math.inf, math.inf, 0.0
        else:
            first, last = view.viewRange()[0]
            step = _grid((last - first) / width)
        if not force and self._drawn == (first, last, step):
            return
        self._drawn = (first, last, step)
        x, y = self._mapped(self._x, self._y)
        if math.isfinite(first):
            begin = max(int(np.searchsorted(x, first)) - _MARGIN, 0)
            end = int(np.searchsorted(x, last, side="right")) + _MARGIN
            x, y = x[begin:end], y[begin:end]
        if step and x.size > _POINTS_PER_PIXEL * width:
            x, y = decimate_on_grid(x, y, step)
        self._set_drawn(x, y)

    def _set_drawn(self, x: np.ndarray, y: np.ndarray) -> None:
        finite = bool(np.isfinite(y).all())
        self.setData(x, y, connect="all" if finite else "finite", skipFiniteCheck=finite)
        if self.scatter is not None:
            known = np.isfinite(y)
            self.scatter.setData(x[known], y[known])


def cut_lines(
    x: np.ndarray, y: np.ndarray, x_limits: Sequence[float], y_limits: Sequence[float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts of the polyline (``x``, ``y``) (n,) in a rectangle, with NaN between them.

    Each segment is cut as by Liang and Barsky (ACM Trans. Graph. 3, 1984).
    """
    first, last = np.zeros(max(x.size - 1, 0)), np.ones(max(x.size - 1, 0))
    kept = np.isfinite(x[1:]) & np.isfinite(y[1:]) & np.isfinite(x[:-1]) & np.isfinite(y[:-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        for values, (low, high) in ((x, x_limits), (y, y_limits)):
            start, step = values[:-1], np.diff(values)
            level = step == 0.0
            kept &= ~level | ((start >= low) & (start <= high))
            enter, leave = (low - start) / step, (high - start) / step
            near, far = np.minimum(enter, leave), np.maximum(enter, leave)
            first = np.where(level, first, np.fmax(first, near))
            last = np.where(level, last, np.fmin(last, far))
    rows = np.flatnonzero(kept & (first <= last))
    if not rows.size:
        return np.empty(0), np.empty(0)
    joined = np.zeros(rows.size, dtype=bool)  # goes on where the segment before it ends
    joined[1:] = (np.diff(rows) == 1) & (last[rows[:-1]] == 1.0) & (first[rows[1:]] == 0.0)
    ends = np.cumsum(np.where(joined, 1, 3)) - 1
    cut = []
    for values in (x, y):
        step = np.diff(values)[rows]
        out = np.full(int(ends[-1]) + 1, np.nan)
        out[ends] = values[:-1][rows] + last[rows] * step
        out[ends[~joined] - 1] = (values[:-1][rows] + first[rows] * step)[~joined]
        cut.append(out)
    return cut[0], cut[1]


def _grid(pixel: float) -> float:
    """Return the width of a column: the power of two at or below that of a pixel.

    Widths that are powers of two, at places that are multiples of them, stay where they are while
    the curve is moved and change rarely while it is zoomed.
    """
    return 2.0 ** math.floor(math.log2(pixel)) if pixel > 0.0 else 0.0
