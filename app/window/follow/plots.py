"""Plots of a target: voltage, displacement and error of its runs, and the error from run to run."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.analysis.tracking import TrackedRun, Tracking
from dearig.window.plots.area import PlotArea
from dearig.window.plots.plot import LegendEntry
from dearig.window.session.state import Session

__all__ = ["ErrorPlot", "FollowPlots"]

_SHADE = 40  # of 255: where the film cannot follow
_SYMBOL = 8  # px
_UM = "\N{MICRO SIGN}m"


class FollowPlots(QWidget):
    """The target, what is expected of the next run, and what chosen runs have measured."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._tracking: Tracking | None = None
        self._runs: tuple[TrackedRun, ...] = ()
        self.area = PlotArea(session, "Target and runs")
        self.plots = [
            self.area.add_plot(row, left=words, weight=weight)
            for row, (words, weight) in enumerate(
                (("Voltage (kV)", 3), ("Displacement (mm)", 6), (f"Error ({_UM})", 4))
            )
        ]
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(self.area)
        session.theme_changed.connect(self._draw)

    def show_tracking(self, tracking: Tracking, runs: Sequence[TrackedRun]) -> None:
        """Draw the target and the next run of ``tracking``, and these ``runs``, over all time."""
        self._tracking, self._runs = tracking, tuple(runs)
        self.area.file_stem = tracking.target.name
        self._draw()
        self.area.auto_range()

    @Slot()
    def _draw(self) -> None:
        for plot in self.plots:
            plot.clear_all()
        tracking, theme = self._tracking, self._session.theme
        if tracking is None:
            return
        voltage, both, error = self.plots
        found, proposed = tracking.inversion, tracking.proposed
        both.add_curve("target", theme.muted).set_points(found.time, found.target * 1e3)
        # the newest run is drawn as a measurement is elsewhere
        colours = (theme.measured, theme.monitor, theme.models[1], theme.field)
        for i, run in enumerate(reversed(self._runs)):
            colour = colours[i % len(colours)]
            voltage.add_curve(run.label, colour, in_key=False).set_points(
                run.time, run.voltage * 1e-3
            )
            both.add_curve(f"measured, {run.label}", colour).set_points(
                run.time, run.measured * 1e3
            )
            missed = np.where(found.reachable, found.reference - run.measured, np.nan)
            error.add_curve(run.label, colour).set_points(run.time, missed * 1e6)
        if proposed is not None:
            voltage.add_curve(f"next: {proposed.label}", theme.command).set_points(
                proposed.time, proposed.voltage * 1e-3
            )
            if proposed.expected is not None:
                both.add_curve("expected, next run", theme.models[0], dashed=True).set_points(
                    proposed.time, proposed.expected * 1e3
                )
                if not self._runs:  # what the model says that the film misses
                    error.add_curve("expected, next run", theme.models[0]).set_points(
                        proposed.time, (found.target - proposed.expected) * 1e6
                    )
        if self._runs:
            noise = self._runs[-1].noise * 1e6
            error.add_levels(theme, "Noise of a reading", -noise, noise)
            error.add_entry(LegendEntry("noise of a reading", theme.muted, dashed=True))
        self._shade()

    def _shade(self) -> None:
        """Shade where the film cannot follow, and say so in the key."""
        tracking, theme = self._tracking, self._session.theme
        if tracking is None or not tracking.inversion.unreachable:
            return
        colour = QColor(theme.bad)
        colour.setAlpha(_SHADE)
        for part in tracking.inversion.unreachable:
            for plot in self.plots[1:]:
                region = pg.LinearRegionItem(
                    (part.start, part.stop), movable=False, brush=colour, pen=pg.mkPen(None)
                )
                region.setToolTip(part.why)
                region.setZValue(-10)
                plot.addItem(region, ignoreBounds=True)
        self.plots[1].add_entry(LegendEntry("cannot be followed", theme.bad, area=True))


class ErrorPlot(QWidget):
    """The error of every run, from iteration to iteration, next to the noise of a reading."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._runs: tuple[TrackedRun, ...] = ()
        self.area = PlotArea(session, "Error from run to run")
        self.plot = self.area.add_plot(
            0, left=f"Error ({_UM} RMS)", bottom="Iteration", group="iteration", log=(False, True)
        )
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(self.area)
        session.theme_changed.connect(self._draw)

    def show_runs(self, runs: Sequence[TrackedRun]) -> None:
        """Draw the errors of ``runs``."""
        self._runs = tuple(runs)
        self._draw()
        self.area.auto_range()

    @Slot()
    def _draw(self) -> None:
        theme = self._session.theme
        self.plot.clear_all()
        known = [run for run in self._runs if math.isfinite(run.rms)]
        if not known:
            return
        at = np.array([float(run.iteration) for run in known])
        rms = np.array([run.rms * 1e6 for run in known])
        self.plot.add_curve("error", theme.measured, symbol="o", size=_SYMBOL).set_points(at, rms)
        noise = np.array([run.noise * 1e6 for run in known])
        self.plot.add_curve("noise", theme.muted, dashed=True, symbol="t", size=_SYMBOL).set_points(
            at, noise
        )
