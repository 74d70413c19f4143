"""Plots of a run: voltage, current, displacement with the models, and residuals."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.drivers.settings import RigSettings
from dearig.window.plots.area import PlotArea
from dearig.window.plots.curve import PlotCurve
from dearig.window.plots.limit_lines import MarkLine, PlotOverlay, trip_levels
from dearig.window.plots.plot import Plot
from dearig.window.run.live import Live
from dearig.window.session.state import Preview, Session

__all__ = ["PLOTS", "RunPlots"]

_SCALE = {"voltage": 1e-3, "current": 1e3, "displacement": 1e3, "residual": 1e6}  # kV, mA, mm, um
_SIGNALS = {
    "voltage": ("Voltage (kV)", ("monitor", "command")),
    "current": ("Current (mA)", ("current", "drawn 0", "drawn 1")),
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
_SHARES = {"voltage": 4, "current": 4, "displacement": 6, "residual": 4}  # of the height
_NAMES = {
    "command": "commanded",
    "monitor": "monitor",
    "current": "current monitor",
    "displacement": "measured",
}
_SECOND = "second residual"
_UNPREDICTED = ("current", "residual")
# Smallest range in SI units of the plots that follow what is in view, so that noise does not fill
# them: 50 uA, five times the noise of a current monitor; 5 um
_LEAST = {"current": 5e-5, "residual": 5e-6}
_SHRINK = 0.3  # part of the range below which what is in view makes it smaller
_BAND = 8  # points of the command that become one of the band within which the monitor must stay
_MARKS_MAX = 200  # lines of marks and alarms; each takes time in each frame
_ROOM = 0.05  # of a range, above and below its curves


class RunPlots(QWidget):
    """Draws a plan, or the last ``span_s`` s of a ``Live`` (the whole run if that is None).

    ``digest`` is that of the waveform whose curves are drawn, "" where that is not a plan that may
    be played. When the operator looks at another time, ``following`` is False for so long.
    """

    shown_changed = Signal()  #: plots were shown or hidden
    view_changed = Signal()  #: the operator has changed a range

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.span_s: float | None = 10.0
        self.digest = ""
        self.trips_in_view = True  #: the range of the current holds its trip levels
        self._duration = 1.0
        self._planned_shown = self._run_shown = False
        self._live: Live | None = None
        self._low: dict[str, float] = {}
        self._high: dict[str, float] = {}
        self._marks: dict[str, tuple[float, str, str]] = {}  # time, words, level
        self._settings: RigSettings = session.rig_file
        self.area = PlotArea(session, "run", live=True)
        self.area.canvas.setAccessibleName("Curves of the run")
        self._plots: dict[str, Plot] = {
            name: self.area.add_plot(row, left=label, weight=_SHARES[name], own_range=True)
            for row, (name, (label, _)) in enumerate(_SIGNALS.items())
        }
        # the residual of a second model has a plot of its own, which has the range of the first:
        # in one plot it would hide the first
        words, share = _SIGNALS["residual"][0], _SHARES["residual"]
        self._second = self.area.add_plot(len(_SIGNALS), left=words, weight=share, own_range=True)
        for plot in (self._plots["residual"], self._second):
            plot.same_y = (self._plots["residual"], self._second)
        self.rows = len(_SIGNALS) + 1  #: rows of the area that are taken
        self._planned = {n: self._plots[n].add_curve() for n in ("voltage", "displacement")}
        self._band = [self._plots["voltage"].add_curve() for _ in range(2)]
        self._curves: dict[str, PlotCurve] = {
            signal: self._plot_of(name, signal).add_curve()
            for name, (_, signals) in _SIGNALS.items()
            for signal in signals
        }
        self.overlays = {
            name: PlotOverlay(plot, _SCALE[name], session.theme)
            for name, plot in self._plots.items()
        }
        self.overlays[_SECOND] = PlotOverlay(self._second, _SCALE["residual"], session.theme)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.area)
        self.area.view_changed.connect(self._view_changed)
        session.theme_changed.connect(self.restyle)
        session.overlays_changed.connect(self.restyle)
        self.restyle()
        self.show_prediction(None)

    # what is shown

    @property
    def shown(self) -> tuple[str, ...]:
        """Names of the plots that are shown."""
        return tuple(name for name, plot in self._plots.items() if plot.isVisible())

    @property
    def following(self) -> bool:
        """True while the plots show the newest samples of a run."""
        return self.area.following

    def show_plot(self, name: str, shown: bool) -> None:
        """Show or hide a plot of ``PLOTS``; the last one stays."""
        if shown == self._plots[name].isVisible() or self.shown == (name,):
            return
        self.area.show_plot(self._plots[name], shown)
        self._show_second()
        self._draw_marks()
        self.shown_changed.emit()

    def _show_second(self) -> None:
        """Show the plot of the second residual, if there is one."""
        shown = len(self._session.overlays) > 1 and self._plots["residual"].isVisible()
        self.area.show_plot(self._second, shown)

    def _plot_of(self, name: str, signal: str) -> Plot:
        """Return the plot of ``signal``, which belongs to ``name``."""
        second = name == "residual" and signal.endswith(" 1")
        return self._second if second else self._plots[name]

    def curve(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return time in s and values in the unit of the plot of a curve that is drawn.

        ``name`` is that of a signal of ``Live.view``, "planned voltage", or "planned displacement".
        """
        planned = {f"planned {key}": curve for key, curve in self._planned.items()}
        return _drawn(({**planned, **self._curves})[name])

    def band(self, side: str) -> tuple[np.ndarray, np.ndarray]:
        """Return time in s and the "upper" or "lower" bound of the monitor in kV."""
        return _drawn(self._band[0 if side == "upper" else 1])

    def x_range(self) -> tuple[float, float]:
        """Return the time in s that is in view."""
        return self.area.span()

    def y_range(self, name: str) -> tuple[float, float]:
        """Return the range of a plot, or of the "second residual", in its unit."""
        plot = self._second if name == _SECOND else self._plots[name]
        low, high = plot.vb.viewRange()[1]
        return low, high

    @property
    def marks(self) -> list[str]:
        """Words of the lines of marks and alarms."""
        return [words for _, words, _ in self._marks.values()]

    @Slot()
    def restyle(self) -> None:
        """Use the colours of the theme and the names of the models."""
        theme = self._session.theme
        colours = {
            "command": theme.command,
            "monitor": theme.monitor,
            "current": theme.monitor,
            "displacement": theme.measured,
            **{
                f"{name} {i}": theme.models[i]
                for name in ("model", "drawn", "residual")
                for i in (0, 1)
            },
            **{f"rms {i}": theme.text for i in (0, 1)},
        }
        for curve in self._planned.values():
            curve.set_colour(theme.muted)
        for curve in self._band:
            curve.set_colour(theme.limit)  # dashes along a curve take longer than the curve
        for signal, curve in self._curves.items():
            # of two curves that coincide, the upper one is dashed and shows the lower one
            dashed = signal in ("command", "model 1", "drawn 1") or signal.startswith("rms")
            curve.set_colour(colours[signal], dashed)
        for overlay in self.overlays.values():
            overlay.set_theme(theme)
        self._show_second()
        self._show_levels()
        self._name()
        self._draw_marks()

    def _show_levels(self) -> None:
        levels = trip_levels(self._settings)
        for name, overlay in self.overlays.items():
            overlay.show_levels(tuple(level for level in levels if level.plot == name))

    def _name(self) -> None:
        """Name the curves that are drawn; those without a name are not in the keys."""
        planned = self._planned_shown
        for name, curve in self._planned.items():
            text = "planned" if name == "voltage" else "predicted"
            curve.title = text if planned else ""
            curve.setVisible(planned)  # hidden ones cost nothing in a frame
        for signal, curve in self._curves.items():
            curve.title = self._words(signal) if self._run_shown else ""
            curve.setVisible(self._run_shown and self._exists(signal))
        tolerance = self._settings.interlocks.monitor_tolerance_kV
        self._band[0].title = f"trip of the monitor, ±{tolerance:g} kV"
        for plot in (*self._plots.values(), self._second):
            plot.renew_key()

    # a plan

    def show_prediction(self, preview: Preview | None) -> None:
        """Draw the plan of ``preview`` in place of everything else; None is one being made."""
        self.digest = ""
        self._live = None
        nothing = np.empty(0)
        for curve in (*self._curves.values(), *self._planned.values(), *self._band):
            curve.supply = None
            curve.set_points(nothing, nothing)
        self._settings = self._session.rig_file
        self._low = {"voltage": 0.0, "displacement": 0.0}
        self._high = {"voltage": 1e3, "displacement": 1e-4}
        for name, least in _LEAST.items():
            self._low[name], self._high[name] = -least, least
        self._duration = 1.0
        self._marks.clear()
        planned = preview is not None and (preview.plan is not None or preview.is_outline)
        if preview is not None and planned:
            self._duration = preview.duration
            self.digest = preview.digest
            for name in ("voltage", "displacement"):
                x, y = preview.curves[name]
                self._include(name, y)
                self._planned[name].set_points(x, y * _SCALE[name])
            self._draw_band(*preview.curves["voltage"])
        self._planned_shown, self._run_shown = planned, False
        for name in _UNPREDICTED:
            self.overlays[name].show_words("measured during the run" if planned else "")
        self._show_levels()
        self._name()
        self._draw_marks()
        for plot in (*self._plots.values(), self._second):
            plot.set_auto_y(auto=True)
        self.area.set_live(live=False)  # a plan has all of its time at once
        self.area.show_span(0.0, self._duration)
        self._scale()

    # a run

    def start(self) -> None:
        """Prepare for a run: remove the prediction, whose drawing would cost frames."""
        for curve in self._planned.values():
            curve.set_points(np.empty(0), np.empty(0))
        self._planned_shown, self._run_shown = False, True
        self.digest = ""
        for name in _UNPREDICTED:
            self.overlays[name].show_words("")
        self._name()
        self.area.set_live(live=True)
        self.area.roll(*self._span(0.0))

    def step_of(self, shown: float) -> int:
        """Return the pixel that a run which is shown up to ``shown`` s has come to.

        It is 0 once the time axis moves: then ``flow`` shows what comes.
        """
        if self._moves(shown):
            return 0
        first, last = self._span(shown)
        return int((shown - first) / (last - first) * self.width())

    def last_drawn(self, end: float, shown: float) -> float:
        """Return the s up to which curves are drawn of a run that has come to ``end`` s."""
        return end if self._moves(shown) else shown

    def flow(self, shown: float) -> None:
        """Move the time axis to ``shown`` s, below curves that are drawn already."""
        span = self._span(shown)
        if self._moves(shown) and self.area.following and self.area.span() != span:
            self.area.roll(*span)
            self.area.data_changed()

    def _moves(self, shown: float) -> bool:
        return self.span_s is not None and shown > self.span_s

    def draw(self, live: Live, end: float, shown: float | None = None) -> None:
        """Draw the curves of a run that has come to ``end`` s.

        The time axis ends at ``shown`` s, by default there too, unless the operator looks at
        another time.
        """
        if live is not self._live:
            self._live = live
            self._supply(live)
        shown = end if shown is None else shown
        following = self.area.following
        begin, until = self._span(shown) if following else self.area.span()
        last = self.last_drawn(end, shown) if following else until
        changed = False
        for name in self.shown:
            low, high = math.inf, -math.inf
            for signal in _SIGNALS[name][1]:
                if not self._exists(signal):
                    continue
                x, y = live.view(signal, begin, last)
                self._curves[signal].set_points(x, y * _SCALE[name], thinned=True)
                known = y[np.isfinite(y)]
                if known.size:
                    low, high = min(low, float(known.min())), max(high, float(known.max()))
                if signal == "command":
                    self._draw_band(x, y)
            if low <= high:
                changed |= self._hold(name, low, high)
        if changed:
            self._scale()
        self.area.roll(begin, until)
        self.area.data_changed()

    def _supply(self, live: Live) -> None:
        """Let the files of the data hold the whole run, not only what is drawn."""

        def whole(signal: str, scale: float) -> tuple[np.ndarray, np.ndarray]:
            now = live.now()
            x, y = live.view(signal, 0.0, 0.0 if now is None else now.samples / now.rate)
            return x, y * scale

        for name, (_, signals) in _SIGNALS.items():
            for signal in signals:
                scale = _SCALE[name]
                self._curves[signal].supply = lambda s=signal, k=scale: whole(s, k)

    def add_mark(self, key: str, time: float, words: str, level: str = "info") -> None:
        """Draw a line at ``time`` s with ``words``; another one of the same ``key`` is replaced."""
        if key in self._marks or len(self._marks) < _MARKS_MAX:
            self._marks[key] = (time, words, level)
            self._draw_marks()

    def _draw_marks(self) -> None:
        theme = self._session.theme
        colours = {"fault": theme.bad, "warning": theme.warn}
        marks = tuple(
            MarkLine(time, words, colours.get(level, theme.text))
            for time, words, level in self._marks.values()
        )
        first = (self.shown or tuple(self._plots))[0]
        for name, overlay in self.overlays.items():
            overlay.show_marks(marks, with_words=name == first)

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
            curve.set_points(time, values * _SCALE["voltage"], thinned=True)

    def _words(self, signal: str) -> str:
        if signal in _NAMES:
            return _NAMES[signal]
        kind, number = signal.split()
        overlays = self._session.overlays
        if int(number) >= len(overlays):
            return ""
        name = overlays[int(number)].name
        if kind == "rms":
            return "RMS, last 1 s"
        return name if kind in ("model", "drawn") else f"residual of {name}"

    def _exists(self, signal: str) -> bool:
        """Return False for the curves of a model that is not chosen."""
        number = signal.rpartition(" ")[2]
        return not number.isdigit() or int(number) < len(self._session.overlays)

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

    @Slot()
    def _scale(self) -> None:
        """Set the ranges of the plots whose range the operator has not chosen."""
        for name, first in self._plots.items():
            low, high = self._low[name], self._high[name]
            if name == "current" and self.trips_in_view:
                for level in self.overlays[name].levels:
                    low, high = min(low, level.value), max(high, level.value)
            room = _ROOM * (high - low)
            scale = _SCALE[name]
            for plot in first.same_y:
                plot.show_y((low - room) * scale, (high + room) * scale)

    def rescale(self) -> None:
        """Set the ranges again after ``trips_in_view`` was changed."""
        self._scale()

    @Slot()
    def _view_changed(self) -> None:
        self._scale()
        self.view_changed.emit()

    def _span(self, end: float) -> tuple[float, float]:
        """Return the first and the last s that are in view of a run that has come to ``end`` s."""
        if self.span_s is None:
            return 0.0, self._duration
        return max(0.0, end - self.span_s), max(self.span_s, end)


def _drawn(curve: PlotCurve) -> tuple[np.ndarray, np.ndarray]:
    x, y = curve.getData()
    return (np.empty(0), np.empty(0)) if x is None else (x, y)


def _next_step(size: float) -> float:
    """Return the next of 1, 2, 5, 10, ... above ``size``."""
    decade = 10.0 ** math.floor(math.log10(size))
    return next(step * decade for step in (1.0, 2.0, 5.0, 10.0, 20.0) if step * decade > size)
