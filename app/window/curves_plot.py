"""Recordings over time, one or several: drive, measurement beside the model, and the residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QWidget

from app.browse import Curves
from app.report.units import SHOWN
from app.window.session import Session
from app.window.theme import pen, style_plot

__all__ = ["CurvesPlot"]


class CurvesPlot(pg.GraphicsLayoutWidget):
    """Three plots on one time axis; the model is dashed where several recordings share a plot."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._shown: tuple[Curves, ...] = ()
        self._with_model = True
        self.setAccessibleName("Curves of the chosen recordings")
        self.plots = [self.addPlot(row=row, col=0) for row in range(3)]
        for plot in self.plots[1:]:
            plot.setXLink(self.plots[0])
        for plot in self.plots[:-1]:
            plot.getAxis("bottom").setStyle(showValues=False)
        # the measurement matters most
        for row, weight in enumerate((2, 4, 3)):
            self.ci.layout.setRowStretchFactor(row, weight)
        self.ci.layout.setVerticalSpacing(2)
        session.theme_changed.connect(self._draw)
        self._draw()

    @property
    def shown(self) -> tuple[Curves, ...]:
        """What is drawn."""
        return self._shown

    def show_curves(self, curves: Sequence[Curves]) -> None:
        """Draw ``curves``, all of one kind, in place of what was there; all of the time is seen."""
        self._shown = tuple(curves)
        self._draw()
        if self._shown:
            first = min(c.drive[0][0] for c in self._shown)
            last = max(c.drive[0][-1] for c in self._shown)
            self.plots[0].setXRange(first, last, padding=0.0)
        for plot in self.plots:
            plot.enableAutoRange(axis="y")

    @Slot(bool)
    def show_model(self, shown: bool) -> None:
        """With the model and the residual, or the measurement alone."""
        self._with_model = shown
        self._draw()

    @Slot()
    def _draw(self) -> None:
        theme = self._session.theme
        self.setBackground(QColor(theme.surface))
        for plot in self.plots:
            plot.clear()
            style_plot(plot, theme)
            if plot.legend is not None:
                plot.legend.scene().removeItem(plot.legend)
                plot.legend = None
        drive, both, residual = self.plots
        shown = SHOWN[self._shown[0].kind if self._shown else "actuator"]
        drive.setLabel("left", shown.drive, units=None)
        drive.setLabel("left", shown.drive_label)
        both.setLabel("left", shown.label)
        residual.setLabel("left", f"Residual ({shown.error_unit})")
        self.plots[-1].setLabel("bottom", "Time (s)")
        residual.setVisible(self._with_model)
        both.getAxis("bottom").setStyle(showValues=not self._with_model)
        if not self._shown:
            return
        both.addLegend(
            offset=(8, 4), labelTextColor=QColor(theme.text), brush=QColor(theme.surface),
            pen=pg.mkPen(QColor(theme.line)), verSpacing=-4,
        )  # fmt: skip
        alone = len(self._shown) == 1
        zero = pg.InfiniteLine(0.0, angle=0, pen=pen(theme.muted, dashed=True))
        residual.addItem(zero, ignoreBounds=True)
        for i, curves in enumerate(self._shown):
            colour = theme.measured if alone else theme.curves[i % len(theme.curves)]
            self._curve(drive, curves.drive, shown.drive_factor, theme.command if alone else colour)
            name = "measured" if alone else curves.name
            self._curve(both, curves.measured, shown.factor, colour, name)
            if not self._with_model or curves.model is None or curves.residual is None:
                continue
            beside = theme.models[0] if alone else colour
            label = "model" if alone else None
            self._curve(both, curves.model, shown.factor, beside, label, dashed=not alone)
            self._curve(residual, curves.residual, shown.error_factor, beside)
            if alone:
                self._events(curves)

    def _curve(
        self,
        plot: pg.PlotItem,
        points: tuple[np.ndarray, np.ndarray],
        factor: float,
        colour: str,
        name: str | None = None,
        dashed: bool = False,
    ) -> None:
        item = pg.PlotDataItem(
            points[0], points[1] * factor, pen=pen(colour, dashed), name=name, connect="finite",
        )  # fmt: skip
        plot.addItem(item)
        # only now: while it is put into a view it takes the whole widget for one
        item.setClipToView(True)
        item.setDownsampling(auto=True, method="peak")

    def _events(self, curves: Curves) -> None:
        theme = self._session.theme
        for event in curves.events:
            if event.level == "info":
                continue
            colour = theme.bad if event.level == "fault" else theme.warn
            line = pg.InfiniteLine(event.time, angle=90, pen=pen(colour, dashed=True))
            line.setToolTip(f"{event.time:.4g} s, {event.level}: {event.message}")
            line.setCursor(Qt.CursorShape.WhatsThisCursor)
            self.plots[1].addItem(line, ignoreBounds=True)
