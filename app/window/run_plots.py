"""Plots of a run: voltage, current, displacement with the models, and residuals."""

from __future__ import annotations

import math

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QRectF, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QWidget

from dearig.drivers.settings import RigSettings
from dearig.window.live import Live
from dearig.window.session import Preview, Session
from dearig.window.theme import pen, style_plot
from dearig.window.trip_lines import TripLines, trip_levels

__all__ = ["PLOTS", "RunPlots"]

_SCALE = {"voltage": 1e-3, "current": 1e3, "displacement": 1e3, "residual": 1e6}  # kV, mA, mm, um
_SIGNALS = {
    "voltage": ("Voltage (kV)", ("monitor", "command")),
    "current": ("Current (mA)", ("current",)),
    "displacement": ("Displacement (mm)", ("displacement", "model 0", "model 1")),
    "residual": ("Residual (µm)", ("residual 0", "residual 1", "rms 0", "rms 1")),
}
#: Name of each plot and what a menu calls it.
PLOTS = {
    "voltage": "Voltage",
    "current": "Current",
    "displacement": "Displacement",
    "residual": "Residual",
}
_SHARES = {"voltage": 4, "current": 4, "displacement": 5, "residual": 4}  # of the height
_NAMES = {
    "command": "commanded",
    "monitor": "monitor",
    "current": "current monitor",
    "displacement": "measured",
}
_UNPREDICTED = ("current", "residual")
_LEGEND_SPACE = 0.35  # of the range of a plot, above its curves
# Smallest range in SI units of the plots that follow what is in view, so that noise does not fill
# them: 50 uA, five times the noise of a current monitor; 5 um
_LEAST = {"current": 5e-5, "residual": 5e-6}
_SHRINK = 0.3  # part of the range below which what is in view makes it smaller
_BAND = 8  # points of the command that become one of the band within which the monitor must stay
_MARKS_MAX = 200  # drawn lines of marks and alarms; each costs time in each frame


class RunPlots(pg.GraphicsLayoutWidget):
    """Draws a plan, or the last ``window`` s of a ``Live`` (the whole run if that is None).

    ``digest`` is that of the waveform whose curves are drawn, "" where that is no plan that may be
    played. ``look_at`` holds another span of the run in view; None follows its newest sample.
    """

    shown_changed = Signal()  #: plots were shown or hidden

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.window: float | None = 10.0
        self.look_at: tuple[float, float] | None = None
        self.digest = ""
        self.trips_in_view = True  #: the range of the current holds its trip levels
        self._duration = 1.0
        self._predicted: set[str] = set()
        self._low: dict[str, float] = {}
        self._high: dict[str, float] = {}
        self._plots: dict[str, pg.PlotItem] = {}
        self._curves: dict[str, pg.PlotCurveItem] = {}
        self._legends: list[pg.LegendItem] = []
        self._marks: dict[str, tuple[float, str, str]] = {}  # time, words, level
        self._mark_lines: list[tuple[pg.PlotItem, pg.InfiniteLine]] = []
        self._settings: RigSettings = session.rig_file
        self._add_plots()
        self.trips = {name: TripLines(p, _SCALE[name]) for name, p in self._plots.items()}
        session.theme_changed.connect(self.restyle)
        session.overlays_changed.connect(self.restyle)
        self.restyle()
        self.show_prediction(None)

    def _add_plots(self) -> None:
        for row, (name, (words, signals)) in enumerate(_SIGNALS.items()):
            plot = self.addPlot(row=row, col=0)
            plot.setLabel("left", words, **{"font-size": "9pt"})
            plot.setMouseEnabled(x=False, y=False)
            plot.disableAutoRange()
            for signal in signals:
                # plain curves: the data are decimated already
                curve = pg.PlotCurveItem(skipFiniteCheck=True, connect="all")
                plot.addItem(curve)
                self._curves[signal] = curve
            self._plots[name] = plot
        self._planned = {name: pg.PlotCurveItem() for name in ("voltage", "displacement")}
        for name, curve in self._planned.items():
            curve.setZValue(-5)
            self._plots[name].addItem(curve)
        self._band = [pg.PlotCurveItem(skipFiniteCheck=True, connect="all") for _ in range(2)]
        for curve in self._band:
            curve.setZValue(-6)
            self._plots["voltage"].addItem(curve)
        self._empty = {name: pg.TextItem(anchor=(0.5, 0.5)) for name in _UNPREDICTED}
        for name, text in self._empty.items():
            text.setParentItem(self._plots[name].getViewBox())
            self._plots[name].getViewBox().sigResized.connect(self._place_texts)
        self._arrange()

    # what is shown

    @property
    def shown(self) -> tuple[str, ...]:
        """Names of the plots that are shown."""
        return tuple(name for name, plot in self._plots.items() if plot.isVisible())

    def show_plot(self, name: str, shown: bool) -> None:
        """Show or hide a plot of ``PLOTS``; the last one stays."""
        if shown == self._plots[name].isVisible() or self.shown == (name,):
            return
        self._plots[name].setVisible(shown)
        self._arrange()
        self._draw_marks()
        self.shown_changed.emit()

    def curve(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return time in s and values in the unit of the plot of a curve that is drawn.

        ``name`` is that of a signal of ``Live.view``, "planned voltage", or "planned displacement".
        """
        planned = {f"planned {key}": curve for key, curve in self._planned.items()}
        x, y = (planned | self._curves)[name].getData()
        return (np.empty(0), np.empty(0)) if x is None else (x, y)

    def band(self, side: str) -> tuple[np.ndarray, np.ndarray]:
        """Return time in s and the "upper" or "lower" bound of the monitor in kV."""
        x, y = self._band[0 if side == "upper" else 1].getData()
        return (np.empty(0), np.empty(0)) if x is None else (x, y)

    def x_range(self) -> tuple[float, float]:
        """Return the time in s that is in view."""
        first, last = self._plots["voltage"].getViewBox().viewRange()[0]
        return first, last

    def y_range(self, name: str) -> tuple[float, float]:
        """Return the range of a plot in its unit."""
        low, high = self._plots[name].getViewBox().viewRange()[1]
        return low, high

    @property
    def marks(self) -> list[str]:
        """Words of the lines of marks and alarms."""
        return [words for _, words, _ in self._marks.values()]

    def _arrange(self) -> None:
        """Number the time axis of the lowest plot only, and share the height."""
        layout, shown = self.ci.layout, self.shown or tuple(self._plots)
        for row, (name, plot) in enumerate(self._plots.items()):
            layout.setRowStretchFactor(row, _SHARES[name] if plot.isVisible() else 0)
            axis = plot.getAxis("bottom")
            axis.setStyle(showValues=name == shown[-1])
            if name == shown[-1]:
                plot.setLabel("bottom", "Time (s)")
            else:
                axis.showLabel(False)

    def restyle(self) -> None:
        """Use the colours of the theme and the names of the models."""
        theme = self._session.theme
        colours = {
            "command": theme.command,
            "monitor": theme.monitor,
            "current": theme.monitor,
            "displacement": theme.measured,
            **{f"{name} {i}": theme.models[i] for name in ("model", "residual") for i in (0, 1)},
            **{f"rms {i}": theme.text for i in (0, 1)},
        }
        for curve in self._planned.values():
            curve.setPen(pen(theme.muted))
        for curve in self._band:
            curve.setPen(pen(theme.limit, dashed=True))
        for signal, curve in self._curves.items():
            # of two curves that coincide, the upper one is dashed and shows the lower one
            dashed = signal in ("command", "model 1") or signal.startswith("rms")
            curve.setPen(pen(colours[signal], dashed))
        for plot in self._plots.values():
            style_plot(plot, theme)
        for text in self._empty.values():
            text.setColor(theme.muted)
        self._show_levels()
        self._name()
        self._draw_marks()

    def _show_levels(self) -> None:
        levels = trip_levels(self._settings)
        for name, lines in self.trips.items():
            lines.show_levels(tuple(v for v in levels if v.plot == name), self._session.theme)

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
            planned = bool(self._predicted)
            for signal in _SIGNALS[name][1]:
                if not planned and (words := self._words(signal)):
                    legend.addItem(self._curves[signal], words)
            if name == "voltage":
                tolerance = self._settings.interlocks.monitor_tolerance_kV
                legend.addItem(self._band[0], f"trip of the monitor, ±{tolerance:g} kV")

    # a plan

    def show_prediction(self, preview: Preview | None) -> None:
        """Draw the plan of ``preview`` in place of everything else; None is one being made."""
        self._predicted.clear()
        self.digest = ""
        self.look_at = None
        nothing = np.empty(0)
        for curve in (*self._curves.values(), *self._planned.values(), *self._band):
            curve.setData(nothing, nothing)
        self._settings = self._session.rig_file
        self._low = {"voltage": 0.0, "displacement": 0.0}
        self._high = {"voltage": 1e3, "displacement": 1e-4}
        for name, least in _LEAST.items():
            self._low[name], self._high[name] = -least, least
        self._duration = 1.0
        self._marks.clear()
        if preview is not None and preview.plan is not None:
            plan = preview.plan
            self._duration = plan.duration
            self.digest = "" if plan.waveform is None else plan.waveform.digest
            for name in ("voltage", "displacement"):
                x, y = preview.curves[name]
                self._include(name, y)
                self._planned[name].setData(x, y * _SCALE[name], connect="finite")
                if np.isfinite(y).any():
                    self._predicted.add(name)
            self._draw_band(*preview.curves["voltage"])
        for text in self._empty.values():
            text.setText("measured during the run" if self._predicted else "")
        self._show_levels()
        self._name()
        self._draw_marks()
        self._scale()
        self._show(0.0, self._duration)

    # a run

    def start(self) -> None:
        """Prepare for a run: remove the prediction, whose drawing would cost frames."""
        for curve in self._planned.values():
            curve.setData(np.empty(0), np.empty(0))
        self._predicted.clear()
        self.digest = ""
        for text in self._empty.values():
            text.setText("")
        self._name()
        self._roll(0.0)

    def draw(self, live: Live, end: float) -> None:
        """Draw the curves up to ``end`` s, or those of the span ``look_at``."""
        if self.look_at is not None:
            begin, end = self.look_at
        else:
            begin = 0.0 if self.window is None else max(0.0, end - self.window)
        grown = False
        for name in self.shown:
            low, high = math.inf, -math.inf
            for signal in _SIGNALS[name][1]:
                x, y = live.view(signal, begin, end)
                known = np.isfinite(y)
                if not known.all():
                    x, y = x[known], y[known]
                self._curves[signal].setData(x, y * _SCALE[name])
                if y.size:
                    low, high = min(low, float(y.min())), max(high, float(y.max()))
                if signal == "command":
                    self._draw_band(x, y)
            if low <= high:
                grown |= self._hold(name, low, high)
        if grown:
            self._scale()
        self._roll(end)

    def add_mark(self, key: str, time: float, words: str, level: str = "info") -> None:
        """Draw a line at ``time`` s with ``words``; another one of the same ``key`` is replaced."""
        if key in self._marks or len(self._marks) < _MARKS_MAX:
            self._marks[key] = (time, words, level)
            self._draw_marks()

    def _draw_marks(self) -> None:
        for plot, line in self._mark_lines:
            plot.removeItem(line)
        self._mark_lines = []
        theme = self._session.theme
        colours = {"fault": theme.bad, "warning": theme.warn}
        shown = self.shown or tuple(self._plots)
        for time, words, level in self._marks.values():
            colour = colours.get(level, theme.text)
            for name in shown:
                line = pg.InfiniteLine(
                    time, angle=90, pen=pen(colour, dashed=True),
                    label=words if name == shown[0] else None,
                    labelOpts={"position": 0.78, "color": colour, "rotateAxis": None,
                               "anchors": [(0, 0.5), (1, 0.5)]},
                )  # fmt: skip
                line.setZValue(-4)
                self._plots[name].addItem(line, ignoreBounds=True)
                self._mark_lines.append((self._plots[name], line))

    def _draw_band(self, x: np.ndarray, y: np.ndarray) -> None:
        """Draw the band about the command that the monitor may not leave, from fewer points."""
        tolerance = self._settings.interlocks.monitor_tolerance_kV * 1e3
        whole = y.size // _BAND * _BAND
        steps = y[:whole].reshape(-1, _BAND)
        time = x[:whole].reshape(-1, _BAND).mean(axis=1)
        for curve, values in (
            (self._band[0], steps.max(axis=1) + tolerance),
            (self._band[1], steps.min(axis=1) - tolerance),
        ):
            curve.setData(time, values * _SCALE["voltage"])

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

    # ranges

    def _include(self, name: str, values: np.ndarray) -> None:
        values = values[np.isfinite(values)]
        if values.size:
            self._hold(name, float(values.min()), float(values.max()))

    def _hold(self, name: str, low: float, high: float) -> bool:
        """Extend the range of a plot to ``low`` and ``high`` in SI units; return if it changed.

        Current and residual have a symmetric range in steps, so that it seldom changes, and it
        shrinks again with what is in view. Voltage and displacement keep the extremes of the run.
        """
        if name in _LEAST:
            size, now = max(-low, high), self._high[name]
            if size <= now and not (size < _SHRINK * now and now > _LEAST[name]):
                return False
            size = max(_next_step(size), _LEAST[name]) if size > 0.0 else _LEAST[name]
            self._low[name], self._high[name] = -size, size
            return size != now
        grown = low < self._low[name] or high > self._high[name]
        if grown:
            room = 0.08 * (high - low)
            self._low[name] = min(self._low[name], low - room if low < self._low[name] else low)
            self._high[name] = max(self._high[name], high + room)
        return grown

    def _scale(self) -> None:
        for name, plot in self._plots.items():
            low, high = self._low[name], self._high[name]
            if name == "current" and self.trips_in_view:
                for level in self.trips[name].levels:
                    low, high = min(low, level.value), max(high, level.value)
            low, high = low * _SCALE[name], high * _SCALE[name]
            size = high - low
            above = _LEGEND_SPACE if name in self._planned else 0.05
            plot.setYRange(low - 0.05 * size, high + above * size, padding=0.0)

    def rescale(self) -> None:
        """Set the ranges again after ``trips_in_view`` was changed."""
        self._scale()

    def _roll(self, end: float) -> None:
        if self.look_at is not None:
            first, last = self.look_at
        elif self.window is None:
            first, last = 0.0, self._duration
        else:
            first, last = max(0.0, end - self.window), max(self.window, end)
        self._show(first, last)

    def _show(self, first: float, last: float) -> None:
        for plot in self._plots.values():
            view: QRectF = plot.getViewBox().viewRect()
            if abs(view.left() - first) > 1e-9 or abs(view.right() - last) > 1e-9:
                plot.setXRange(first, last, padding=0.0)

    def _place_texts(self) -> None:
        for name, text in self._empty.items():
            view = self._plots[name].getViewBox()
            text.setPos(view.width() / 2, view.height() / 2)


def _next_step(size: float) -> float:
    """Return the next of 1, 2, 5, 10, ... above ``size``."""
    decade = 10.0 ** math.floor(math.log10(size))
    return next(step * decade for step in (1.0, 2.0, 5.0, 10.0, 20.0) if step * decade > size)
