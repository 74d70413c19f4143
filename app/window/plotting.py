"""Curves, legends and axes of the plots of finished recordings."""

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


_FEW = 2.5  # decades; below this, powers of ten alone are too few labels


class DecadeAxis(pg.AxisItem):
    """Logarithmic axis with labels at 1, 2, 5 or at powers of ten, so that none overlap."""

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
    """Make plots one below the other on one time axis, with heights in the ratio ``weights``."""
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
    """Clear ``plot``, and give it the colours of ``theme``."""
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
    """Add a curve of any length, which breaks where ``y`` is NaN; ``name`` is for the legend."""
    item = pg.PlotDataItem(x, y, pen=pen(colour, dashed), name=name or None, connect="finite")
    plot.addItem(item)
    # only now: before it is in a view, pyqtgraph clips it to the whole widget
    item.setClipToView(True)
    item.setDownsampling(auto=True, method="peak")


def add_legend(plot: pg.PlotItem, theme: Theme) -> None:
    """Add a legend at the upper left, where runs are at rest, for the curves added later."""
    plot.addLegend(
        offset=(8, 4), labelTextColor=QColor(theme.text), verSpacing=-5,
        brush=QColor(theme.surface), pen=pg.mkPen(QColor(theme.line)),
    )  # fmt: skip


def legend_html(*entries: tuple[str, str, str]) -> str:
    """Return a legend as rich text from (sign, name, colour); entries do not wrap."""
    whole = str.maketrans({" ": "\N{NO-BREAK SPACE}", "-": "\N{NON-BREAKING HYPHEN}"})
    return " \N{NO-BREAK SPACE} ".join(
        f'<span style="color:{colour}">{escape(f"{sign} {name}".translate(whole))}</span>'
        for sign, name, colour in entries
    )


def set_legend_title(plot: pg.PlotItem, *entries: tuple[str, str, str]) -> None:
    """Put a legend above the plot, where the curves leave no room inside."""
    plot.setTitle(legend_html(*entries), size="9pt")


def add_noise(plot: pg.PlotItem, theme: Theme, *levels: float) -> None:
    """Add dashed lines at the noise floor."""
    for level in levels:
        line = pg.InfiniteLine(level, angle=0, pen=pen(theme.muted, dashed=True))
        line.setToolTip("Noise floor")
        plot.addItem(line, ignoreBounds=True)
