"""Plots of a run in progress: voltage, displacement with the models, and residuals."""

from __future__ import annotations

import math

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QWidget

from dearig.window.live import Live
from dearig.window.session import Preview, Session
from dearig.window.theme import pen, style_plot

__all__ = ["RunPlots"]

_SCALE = {"voltage": 1e-3, "displacement": 1e3, "residual": 1e6}  # kV, mm, um
_PLOTS = {
    "voltage": ("Voltage (kV)", ("monitor", "command")),
    "displacement": ("Displacement (mm)", ("displacement", "model 0", "model 1")),
    "residual": ("Residual (µm)", ("residual 0", "residual 1", "rms 0", "rms 1")),
}
_NAMES = {"command": "commanded", "monitor": "monitor", "displacement": "measured"}
_LEGEND_SPACE = 0.35  # of the range of a plot, above its curves
_RESIDUAL_LEAST = 5e-6  # m, smallest range of the residual, so that noise does not fill the plot


class RunPlots(pg.GraphicsLayoutWidget):
    """Draws the last ``window`` s of a ``Live``, or the whole run if that is None."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.window: float | None = 10.0
        self._duration = 1.0
        self._predicted: set[str] = set()
        self._low: dict[str, float] = {}
        self._high: dict[str, float] = {}
        self._plots: dict[str, pg.PlotItem] = {}
        self._curves: dict[str, pg.PlotCurveItem] = {}
        self._legends: list[pg.LegendItem] = []
        for row, (name, (words, signals)) in enumerate(_PLOTS.items()):
            plot = self.addPlot(row=row, col=0)
            plot.setLabel("left", words)
            plot.setMouseEnabled(x=False, y=False)
            plot.disableAutoRange()
            for signal in signals:
                # plain curves: the data are decimated already
                curve = pg.PlotCurveItem(skipFiniteCheck=True, connect="all")
                plot.addItem(curve)
                self._curves[signal] = curve
            if row < len(_PLOTS) - 1:
                plot.getAxis("bottom").setStyle(showValues=False)
            self._plots[name] = plot
        self._planned = {name: pg.PlotCurveItem() for name in ("voltage", "displacement")}
        for name, curve in self._planned.items():
            curve.setZValue(-5)
            self._plots[name].addItem(curve)
        self._plots["residual"].setLabel("bottom", "Time (s)")
        layout = self.ci.layout
        for row, share in enumerate((3, 4, 3)):
            layout.setRowStretchFactor(row, share)
        session.theme_changed.connect(self.restyle)
        session.overlays_changed.connect(self.restyle)
        self.restyle()
        self.show_prediction(None)

    def restyle(self) -> None:
        """Use the colours of the theme and the names of the models."""
        theme = self._session.theme
        colours = {
            "command": theme.command,
            "monitor": theme.monitor,
            "displacement": theme.measured,
            **{f"{name} {i}": theme.models[i] for name in ("model", "residual") for i in (0, 1)},
            **{f"rms {i}": theme.text for i in (0, 1)},
        }
        for curve in self._planned.values():
            curve.setPen(pen(theme.muted))
        for signal, curve in self._curves.items():
            # of two curves that coincide, the upper one is dashed and shows the lower one
            dashed = signal in ("command", "model 1") or signal.startswith("rms")
            curve.setPen(pen(colours[signal], dashed))
        for plot in self._plots.values():
            style_plot(plot, theme)
        self._name()

    def _name(self) -> None:
        """Make the legends."""
        theme = self._session.theme
        ground = QColor(theme.surface)
        ground.setAlpha(200)  # curves under the legend stay visible
        for legend in self._legends:
            legend.scene().removeItem(legend)
        self._legends = []
        for name, plot in self._plots.items():
            legend = pg.LegendItem(
                offset=(-6, 2), colCount=4, labelTextColor=theme.text, verSpacing=-4, brush=ground
            )
            legend.setParentItem(plot.getViewBox())
            self._legends.append(legend)
            if name in self._predicted:
                legend.addItem(self._planned[name], "planned" if name == "voltage" else "predicted")
            for signal in _PLOTS[name][1]:
                if words := self._words(signal):
                    legend.addItem(self._curves[signal], words)

    def show_prediction(self, preview: Preview | None) -> None:
        """Show the prediction of ``preview``, and clear the curves of the last run."""
        self._predicted.clear()
        nothing = np.empty(0)
        for curve in (*self._curves.values(), *self._planned.values()):
            curve.setData(nothing, nothing)
        self._low = {"voltage": 0.0, "displacement": 0.0, "residual": -_RESIDUAL_LEAST}
        self._high = {"voltage": 1e3, "displacement": 1e-4, "residual": _RESIDUAL_LEAST}
        self._duration = 1.0
        if preview is not None and preview.plan is not None:
            self._duration = preview.plan.duration
            for name in ("voltage", "displacement"):
                x, y = preview.curves[name]
                self._include(name, y)
                self._planned[name].setData(x, y * _SCALE[name], connect="finite")
                if np.isfinite(y).any():
                    self._predicted.add(name)
        self._name()
        self._scale()
        self._show(0.0, self._duration)

    def start(self) -> None:
        """Prepare for a run: remove the prediction, whose drawing would cost frames."""
        for curve in self._planned.values():
            curve.setData(np.empty(0), np.empty(0))
        self._predicted.clear()
        self._name()
        self._roll(0.0)

    def draw(self, live: Live, end: float) -> None:
        """Draw the curves up to ``end`` s."""
        begin = 0.0 if self.window is None else max(0.0, end - self.window)
        grown = False
        for name, (_, signals) in _PLOTS.items():
            for signal in signals:
                x, y = live.view(signal, begin, end)
                known = np.isfinite(y)
                if not known.all():
                    x, y = x[known], y[known]
                self._curves[signal].setData(x, y * _SCALE[name])
                grown |= self._include(name, y)
        if grown:
            self._scale()
        self._roll(end)

    def _words(self, signal: str) -> str:
        if signal in _NAMES:
            return _NAMES[signal]
        kind, number = signal.split()
        overlays = self._session.overlays
        if int(number) >= len(overlays):
            return ""
        name = overlays[int(number)].name
        if kind == "rms":
            return "RMS, last 1 s" if number == "0" else ""
        return name if kind == "model" else f"residual of {name}"

    def _include(self, name: str, values: np.ndarray) -> bool:
        """Extend the range of a plot to ``values``; return True if it grew."""
        values = values[np.isfinite(values)]
        if not values.size:
            return False
        low, high = float(values.min()), float(values.max())
        grown = low < self._low[name] or high > self._high[name]
        if name == "residual":
            size = max(-low, high)
            if grown:  # in steps and symmetric, so that it seldom changes
                self._high[name] = size = _next_step(size)
                self._low[name] = -size
        elif grown:
            room = 0.08 * (high - low)
            self._low[name] = min(self._low[name], low - room if low < self._low[name] else low)
            self._high[name] = max(self._high[name], high + room)
        return grown

    def _scale(self) -> None:
        for name, plot in self._plots.items():
            low, high = self._low[name] * _SCALE[name], self._high[name] * _SCALE[name]
            size = high - low
            above = _LEGEND_SPACE if name in self._planned else 0.03
            plot.setYRange(low - 0.03 * size, high + above * size, padding=0.0)

    def _roll(self, end: float) -> None:
        if self.window is None:
            first, last = 0.0, self._duration
        else:
            first, last = max(0.0, end - self.window), max(self.window, end)
        self._show(first, last)

    def _show(self, first: float, last: float) -> None:
        for plot in self._plots.values():
            view: QRectF = plot.getViewBox().viewRect()
            if abs(view.left() - first) > 1e-9 or abs(view.right() - last) > 1e-9:
                plot.setXRange(first, last, padding=0.0)


def _next_step(size: float) -> float:
    """Return the next of 1, 2, 5, 10, ... above ``size``."""
    decade = 10.0 ** math.floor(math.log10(size))
    return next(step * decade for step in (1.0, 2.0, 5.0, 10.0, 20.0) if step * decade > size)
