"""Lines of the limits and trip levels of the rig file in a plot, each with its value."""

from __future__ import annotations

from dataclasses import dataclass

import pyqtgraph as pg

from dearig.drivers.settings import RigSettings
from dearig.window.theme import Theme, pen

__all__ = ["TripLevel", "TripLines", "trip_levels"]

_EDGE = 4  # px from the edge of the plot to the text of a line that is not in view


@dataclass(frozen=True)
class TripLevel:
    """Level ``value`` in SI units in the plot ``plot``; ``words`` name it with its unit."""

    plot: str
    value: float
    words: str


def trip_levels(settings: RigSettings) -> tuple[TripLevel, ...]:
    """Return the levels of voltage, current and displacement at which a run is refused or ended.

    The gate refuses plans beyond the voltage limits; the interlocks end a run at the others.
    """
    limits, locks = settings.limits, settings.interlocks
    found = [
        TripLevel("voltage", limits.voltage_max_kV * 1e3, f"limit {limits.voltage_max_kV:g} kV")
    ]
    if limits.voltage_min_kV < 0.0:
        low = limits.voltage_min_kV
        found.append(TripLevel("voltage", low * 1e3, f"limit {low:g} kV"))
    for plot, value, scale, unit in (
        ("current", locks.current_max_mA, 1e-3, "mA"),
        ("current", -locks.current_max_mA, 1e-3, "mA"),
        ("displacement", locks.displacement_max_mm, 1e-3, "mm"),
        ("displacement", locks.displacement_min_mm, 1e-3, "mm"),
    ):
        found.append(TripLevel(plot, value * scale, f"trip {value:g} {unit}"))
    return tuple(found)


class TripLines:
    """The levels of one plot whose values are drawn times ``scale``.

    A level in view is a dashed line with its words. One that is not in view is named at the edge of
    the plot, with an arrow.
    """

    def __init__(self, plot: pg.PlotItem, scale: float) -> None:
        self._plot = plot
        self._scale = scale
        self._levels: tuple[TripLevel, ...] = ()
        self._lines: list[pg.InfiniteLine] = []
        self._edges = [pg.TextItem(anchor=(0, 0)), pg.TextItem(anchor=(0, 1))]  # top, bottom
        view = plot.getViewBox()
        for edge in self._edges:
            edge.setParentItem(view)
            edge.setZValue(5)
        view.sigYRangeChanged.connect(self._arrange)
        view.sigResized.connect(self._arrange)

    @property
    def levels(self) -> tuple[TripLevel, ...]:
        """Levels that are drawn."""
        return self._levels

    @property
    def shown(self) -> list[str]:
        """Words of the lines in view, then those at the edges."""
        lines = [v.words for v, line in zip(self._levels, self._lines, strict=True)
                 if line.isVisible()]  # fmt: skip
        return lines + [edge.toPlainText() for edge in self._edges if edge.toPlainText()]

    def show_levels(self, levels: tuple[TripLevel, ...], theme: Theme) -> None:
        """Draw ``levels`` in the colours of ``theme``."""
        for line in self._lines:
            self._plot.removeItem(line)
        self._levels, self._lines = levels, []
        for level in levels:
            above = level.value < 0.0  # the words stand on the inner side of the line
            line = pg.InfiniteLine(
                level.value * self._scale, angle=0, pen=pen(theme.limit, dashed=True),
                label=level.words,
                labelOpts={
                    "position": 0.01, "color": theme.limit, "movable": False,
                    "anchors": [(0, 1), (0, 1)] if above else [(0, 0), (0, 0)],
                },
            )  # fmt: skip
            line.setZValue(-8)
            self._plot.addItem(line, ignoreBounds=True)
            self._lines.append(line)
        for edge in self._edges:
            edge.setColor(theme.limit)
        self._arrange()

    def _arrange(self) -> None:
        """Show the lines in view, and name the others at the edges."""
        view = self._plot.getViewBox()
        low, high = view.viewRange()[1]
        above, below = [], []
        for level, line in zip(self._levels, self._lines, strict=True):
            at = level.value * self._scale
            line.setVisible(low < at < high)
            if at >= high:
                above.append(f"\N{UPWARDS ARROW} {level.words}")
            elif at <= low:
                below.append(f"\N{DOWNWARDS ARROW} {level.words}")
        for edge, words, y in (
            (self._edges[0], above, 0.0), (self._edges[1], below, view.height())
        ):  # fmt: skip
            edge.setText("  ".join(words))
            edge.setPos(_EDGE, y)
