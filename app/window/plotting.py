"""Curves, legends and levels as the plots of finished recordings have them."""

from __future__ import annotations

import math
from html import escape

import numpy as np
import pyqtgraph as pg
from PySide6.QtGui import QColor

from dearig.window.theme import Theme, pen, style_plot

__all__ = [
    "DecadeAxis",
    "add_curve",
    "add_legend",
    "add_noise",
    "clear_plot",
    "legend_html",
    "set_legend_title",
    "stacked_plots",
]


_FEW = 2.5  # decades, below which powers of ten alone would be too few marks


class DecadeAxis(pg.AxisItem):
    """A logarithmic axis with words at 1, 2, 5 or at powers of ten, so that none touch."""

    def tickStrings(  # noqa: N802
        self, values: list[float], scale: float, spacing: float
    ) -> list[str]:
        strings: list[str] = super().tickStrings(values, scale, spacing)
        if not self.logMode:
            return strings
        marked = (1, 2, 5) if self.range[1] - self.range[0] < _FEW else (1,)
        leading = (round(10.0 ** (value - math.floor(value + 1e-9))) for value in values)
        return [s if n in marked else "" for s, n in zip(strings, leading, strict=True)]


def stacked_plots(weights: tuple[int, ...]) -> tuple[pg.GraphicsLayoutWidget, list[pg.PlotItem]]:
    """Plots one below the other on one time axis, as high as ``weights`` say."""
    area = pg.GraphicsLayoutWidget()
    plots = [area.addPlot(row=row, col=0) for row in range(len(weights))]
    for plot in plots[1:]:
        plot.setXLink(plots[0])
    for plot in plots[:-1]:
        plot.getAxis("bottom").setStyle(showValues=False)
    for row, weight in enumerate(weights):
        area.ci.layout.setRowStretchFactor(row, weight)
    area.ci.layout.setVerticalSpacing(2)
    return area, plots


def clear_plot(plot: pg.PlotItem, theme: Theme) -> None:
    """Take everything out of ``plot``, and give it the colours of ``theme``."""
    plot.clear()
    style_plot(plot, theme)
    if plot.legend is not None:
        plot.legend.scene().removeItem(plot.legend)
        plot.legend = None


def add_curve(
    plot: pg.PlotItem,
    x: np.ndarray,
    y: np.ndarray,
    colour: str,
    name: str = "",
    dashed: bool = False,
) -> None:
    """A curve of any length, which breaks where ``y`` is NaN; a ``name`` is for the legend."""
    item = pg.PlotDataItem(x, y, pen=pen(colour, dashed), name=name or None, connect="finite")
    plot.addItem(item)
    # only now: while it is put into a view it takes the whole widget for one
    item.setClipToView(True)
    item.setDownsampling(auto=True, method="peak")


def add_legend(plot: pg.PlotItem, theme: Theme) -> None:
    """A legend at the upper left, where runs are at rest, for the curves that come after it."""
    plot.addLegend(
        offset=(8, 4), labelTextColor=QColor(theme.text), verSpacing=-5,
        brush=QColor(theme.surface), pen=pg.mkPen(QColor(theme.line)),
    )  # fmt: skip


def legend_html(*entries: tuple[str, str, str]) -> str:
    """A legend as rich text: (sign, name, colour) of each curve, which no line breaks."""
    whole = str.maketrans({" ": "\N{NO-BREAK SPACE}", "-": "\N{NON-BREAKING HYPHEN}"})
    return " \N{NO-BREAK SPACE} ".join(
        f'<span style="color:{colour}">{escape(f"{sign} {name}".translate(whole))}</span>'
        for sign, name, colour in entries
    )


def set_legend_title(plot: pg.PlotItem, *entries: tuple[str, str, str]) -> None:
    """A legend above the plot, for curves that leave no room."""
    plot.setTitle(legend_html(*entries), size="9pt")


def add_noise(plot: pg.PlotItem, theme: Theme, *levels: float) -> None:
    """Dashed lines at the noise floor."""
    for level in levels:
        line = pg.InfiniteLine(level, angle=0, pen=pen(theme.muted, dashed=True))
        line.setToolTip("the noise floor")
        plot.addItem(line, ignoreBounds=True)
