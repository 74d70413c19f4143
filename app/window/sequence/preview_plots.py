"""Plots of a planned sequence: voltage, predicted displacement, true field, and limits."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QWidget

from dearig.window.kit.theme import pen
from dearig.window.plots.area import PlotArea
from dearig.window.plots.curve import PlotCurve
from dearig.window.plots.plot import Plot
from dearig.window.session.state import Preview, Session

__all__ = ["PreviewPlots"]

_PLOTS = {
    "voltage": ("Voltage (kV)", 1e-3),
    "displacement": ("Displacement (mm)", 1e3),
    "field": ("True field (MV/m)", 1e-6),
}
_MARKED = {"voltage": "voltage", "slew": "voltage", "true field": "field"}


class PreviewPlots(PlotArea):
    """Shows a ``Preview``."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, "Planned sequence", parent=parent)
        self._preview: Preview | None = None
        self._chosen: tuple[float, float] | None = None
        self._marks: list[tuple[Plot, pg.GraphicsObject]] = []
        self._plots = {
            name: self.add_plot(row, left=words)
            for row, (name, (words, _)) in enumerate(_PLOTS.items())
        }
        self._curves: dict[str, PlotCurve] = {
            name: self._plots[name].add_curve(words)
            for name, words in (
                ("voltage", "planned"), ("displacement", "predicted"), ("field", "predicted"),
            )
        }  # fmt: skip
        session.theme_changed.connect(self._recolour)
        self._recolour()

    @property
    def marks(self) -> int:
        """Number of time spans that are marked as refused."""
        return sum(isinstance(item, _Refused) for _, item in self._marks)

    @property
    def drawn(self) -> tuple[str, ...]:
        """Names of the plots with a curve."""
        found = {name: curve.points[1] for name, curve in self._curves.items()}
        return tuple(n for n, y in found.items() if np.isfinite(y).any())

    def show_preview(self, preview: Preview | None) -> None:
        """Draw ``preview``; None is one that is still being made.

        Without a prediction nothing is drawn: an old curve belongs to another sequence.
        """
        self._preview = preview
        planned = preview is not None and (preview.plan is not None or preview.is_outline)
        curves = {} if preview is None else preview.curves
        for name, curve in self._curves.items():
            x, y = curves.get(name, (np.empty(0), np.empty(0)))
            curve.set_points(x, y * _PLOTS[name][1])
            text = ""
            if preview is not None and not planned:
                text = "no prediction: the sequence cannot be played"
            elif planned and not y.size:
                text = "the prediction follows"
            elif y.size and not np.isfinite(y).any():
                text = "no prediction: a limit is already exceeded"
            elif not np.isfinite(y).all():
                text = "prediction up to where a limit is exceeded or the model fails"
            self._plots[name].set_note(text)
        self._mark()
        if preview is None or not planned:
            return
        self.file_stem = (
            "planned sequence" if preview.loaded is None else preview.loaded.sequence.name
        )
        self.auto_range()

    def choose(self, span: tuple[float, float] | None) -> None:
        """Shade the time span (s) of the chosen segment."""
        if span != self._chosen:
            self._chosen = span
            self._mark()

    @Slot()
    def _recolour(self) -> None:
        theme = self._session.theme
        for name, colour in (
            ("voltage", theme.command), ("displacement", theme.models[0]), ("field", theme.field)
        ):  # fmt: skip
            self._curves[name].set_colour(colour)
            self._plots[name].renew_key()
        self._mark()

    def _mark(self) -> None:
        """Draw limits, the chosen segment, and the time spans beyond limits."""
        theme = self._session.theme
        for plot, item in self._marks:
            plot.removeItem(item)
        self._marks = []
        limits = self._session.rig_file.gate_limits()
        lines = [("voltage", limits.voltage_max), ("field", limits.field)]
        if limits.voltage_min < 0.0:
            lines.append(("voltage", limits.voltage_min))
        for name, value in lines:
            line = pg.InfiniteLine(
                value * _PLOTS[name][1], angle=0, pen=pen(theme.limit, dashed=True), label="limit",
                labelOpts={"position": 0.04, "color": theme.limit, "anchors": [(0, 0), (0, 0)]},
            )  # fmt: skip
            self._put(self._plots[name], line)
        if self._chosen is not None:
            shade = QColor(theme.accent)
            shade.setAlpha(36)
            for plot in self._plots.values():
                self._put(plot, pg.LinearRegionItem(
                    self._chosen, movable=False, brush=shade, pen=pg.mkPen(None)))  # fmt: skip
        for breach in () if self._preview is None else self._preview.breaches:
            colour = QColor(theme.bad)
            colour.setAlpha(90)
            region = _Refused(
                (breach.first, breach.last), movable=False, brush=colour,
                pen=pen(theme.bad),
            )  # fmt: skip
            region.setToolTip(f"{breach.quantity} beyond its limit")
            self._put(self._plots[_MARKED[breach.quantity]], region)

    def _put(self, plot: Plot, item: pg.GraphicsObject) -> None:
        item.setZValue(-10)
        plot.addItem(item, ignoreBounds=isinstance(item, pg.LinearRegionItem))
        self._marks.append((plot, item))


class _Refused(pg.LinearRegionItem):
    """Time span in which a limit is exceeded."""
