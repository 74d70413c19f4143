"""Plots of the channels that the rig file declares, one below the other."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QWidget

from dearig.window.live import Live
from dearig.window.session import Session
from dearig.window.theme import pen, style_plot
from dearig.window.trip_lines import PlotOverlay, TripLevel

__all__ = ["ChannelPlots"]

_HEIGHT = 90  # pixels of one plot: enough for an axis with three numbers


class ChannelPlots(pg.GraphicsLayoutWidget):
    """One plot for each declared channel; the widget is hidden where there is none."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._shown: tuple[tuple[str, str], ...] = ()
        self.plots: list[pg.PlotItem] = []
        self.curves: list[pg.PlotCurveItem] = []
        self.overlays: list[PlotOverlay] = []
        self._levels: list[tuple[TripLevel, ...]] = []
        self.setAccessibleName("Curves of the declared channels")
        self.setVisible(False)
        session.theme_changed.connect(self._restyle)

    def show_channels(
        self,
        channels: Sequence[tuple[str, str]],
        beside: pg.PlotItem | None = None,
        limits: Sequence[tuple[float | None, float | None]] = (),
    ) -> None:
        """Show empty plots for ``channels``, each a label and a unit; ``beside`` sets the time.

        ``limits`` are the lowest and the highest value that each channel may have, None without.
        """
        levels = [_levels(unit, *pair) for (_, unit), pair in zip(channels, limits, strict=False)]
        levels += [()] * (len(channels) - len(levels))
        if (tuple(channels), levels) != (self._shown, self._levels):
            self._levels = levels
            self._shown = tuple(channels)
            self.clear()
            self.plots, self.curves, self.overlays = [], [], []
            for row, (label, unit) in enumerate(channels):
                plot = self.addPlot(row=row, col=0)
                plot.setLabel("left", escape(f"{label} ({unit})"))  # it is HTML
                plot.getAxis("bottom").setStyle(showValues=False)
                curve = pg.PlotCurveItem(skipFiniteCheck=True, connect="all")
                plot.addItem(curve)
                self.plots.append(plot)
                self.curves.append(curve)
                self.overlays.append(PlotOverlay(plot, 1.0, self._session.theme))
            self.setFixedHeight(_HEIGHT * max(1, len(channels)))
            self.setVisible(bool(channels))
            self._restyle()
        for plot, curve in zip(self.plots, self.curves, strict=True):
            curve.setData(np.empty(0), np.empty(0))
            if beside is not None:
                plot.setXLink(beside)

    def show_values(self, place: int, time: np.ndarray, values: np.ndarray) -> None:
        """Draw ``values`` (n,) over ``time`` (n,) s in the plot at ``place``."""
        self.curves[place].setData(time, values)

    def draw(self, live: Live, names: Sequence[str], span: float | None, end: float) -> None:
        """Draw the channels ``names`` of a run up to ``end`` s: ``span`` s of it, None for all."""
        begin = 0.0 if span is None else max(0.0, end - span)
        for place, name in enumerate(names):
            self.show_values(place, *live.view(f"channel {name}", begin, end))

    @Slot()
    def _restyle(self) -> None:
        theme = self._session.theme
        self.setBackground(QColor(theme.surface))
        for plot, curve in zip(self.plots, self.curves, strict=True):
            style_plot(plot, theme)
            curve.setPen(pen(theme.measured))
        for overlay, levels in zip(self.overlays, self._levels, strict=True):
            overlay.set_theme(theme)
            overlay.show_levels(levels)


def _levels(unit: str, low: float | None, high: float | None) -> tuple[TripLevel, ...]:
    """Return the trip levels of a channel."""
    return tuple(
        TripLevel("", value, f"trip {value:g} {unit}") for value in (low, high) if value is not None
    )
