"""Plots of the channels that the rig file declares, one below the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QObject, Slot

from dearig.window.plots.area import PlotArea
from dearig.window.plots.curve import PlotCurve
from dearig.window.plots.limit_lines import PlotOverlay, TripLevel
from dearig.window.plots.plot import Plot
from dearig.window.run.live import Live
from dearig.window.session.state import Session

__all__ = ["ChannelPlots"]

_HEIGHT = 90  # pixels of one plot: enough for an axis with three numbers
_WEIGHT = 2  # share of the height of a plot


class ChannelPlots(QObject):
    """One plot for each declared channel in ``area``, from ``row`` on, below its other plots."""

    def __init__(self, session: Session, area: PlotArea, row: int) -> None:
        super().__init__(area)
        self._session = session
        self._area = area
        self._row = row
        self._shown: tuple[tuple[str, str], ...] = ()
        self.plots: list[Plot] = []
        self.curves: list[PlotCurve] = []
        self.overlays: list[PlotOverlay] = []
        self._levels: list[tuple[TripLevel, ...]] = []
        session.theme_changed.connect(self._restyle)

    def show_channels(
        self,
        channels: Sequence[tuple[str, str]],
        limits: Sequence[tuple[float | None, float | None]] = (),
    ) -> None:
        """Show empty plots for ``channels``, each a label and a unit.

        ``limits`` are the lowest and the highest value that each channel may have, None without.
        """
        levels = [_levels(unit, *pair) for (_, unit), pair in zip(channels, limits, strict=False)]
        levels += [()] * (len(channels) - len(levels))
        if (tuple(channels), levels) != (self._shown, self._levels):
            self._levels = levels
            self._shown = tuple(channels)
            for plot in self.plots:
                self._area.remove_plot(plot)
            self.plots, self.curves, self.overlays = [], [], []
            for row, (label, unit) in enumerate(channels, self._row):
                plot = self._area.add_plot(
                    row, left=f"{label} ({unit})", weight=_WEIGHT, least=_HEIGHT
                )
                self.plots.append(plot)
                self.curves.append(plot.add_curve(label))
                self.overlays.append(PlotOverlay(plot, 1.0, self._session.theme))
            self._restyle()
        for curve in self.curves:
            curve.set_points(np.empty(0), np.empty(0))

    def show_values(self, place: int, time: np.ndarray, values: np.ndarray) -> None:
        """Draw ``values`` (n,) over ``time`` (n,) s in the plot at ``place``."""
        self.curves[place].set_points(time, values)

    def draw(self, live: Live, names: Sequence[str], first: float, last: float) -> None:
        """Draw the channels ``names`` of a run from ``first`` to ``last`` s."""
        for place, name in enumerate(names):
            self.curves[place].set_points(*live.view(f"channel {name}", first, last), thinned=True)

    @Slot()
    def _restyle(self) -> None:
        theme = self._session.theme
        for plot, curve in zip(self.plots, self.curves, strict=True):
            curve.set_colour(theme.measured)
            plot.renew_key()
        for overlay, levels in zip(self.overlays, self._levels, strict=True):
            overlay.set_theme(theme)
            overlay.show_levels(levels)


def _levels(unit: str, low: float | None, high: float | None) -> tuple[TripLevel, ...]:
    """Return the trip levels of a channel."""
    return tuple(
        TripLevel("", value, f"trip {value:g} {unit}") for value in (low, high) if value is not None
    )
