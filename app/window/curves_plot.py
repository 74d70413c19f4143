"""Plot of one or several recordings over time: drive, measurement and model, residual."""

from __future__ import annotations

from collections.abc import Sequence

import pyqtgraph as pg
from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.analysis.summary import Curves
from dearig.units import SHOWN
from dearig.window.channel_plots import ChannelPlots
from dearig.window.plotting import add_curve, clear_plot, legend_html, stacked_plots
from dearig.window.session import Session
from dearig.window.theme import pen
from dearig.window.widgets import label, plain_tip

__all__ = ["CurvesPlot"]


class CurvesPlot(QWidget):
    """Three plots on one time axis, and below them the declared channels of a single recording.

    The model is dashed where several recordings share a plot.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._shown: tuple[Curves, ...] = ()
        self._with_model = True
        # the measurement gets the most space
        self._area, self.plots = stacked_plots((3, 5, 4))
        self._area.setAccessibleName("Curves of the selected recordings")
        # above the plots and wrapped: the names of six recordings would cover half of a plot
        self.key = label("")
        self.key.setTextFormat(Qt.TextFormat.RichText)  # legend_html escapes the names
        self.key.setWordWrap(True)
        self.key.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(2)
        outer.addWidget(self.key)
        outer.addWidget(self._area, 1)
        self.channels = ChannelPlots(session)
        outer.addWidget(self.channels)
        session.theme_changed.connect(self._draw)
        self._draw()

    @property
    def shown(self) -> tuple[Curves, ...]:
        """Recordings that are drawn."""
        return self._shown

    def show_curves(self, curves: Sequence[Curves]) -> None:
        """Draw ``curves``, all of one kind, over their whole time."""
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
        """Show or hide the model and the residual."""
        self._with_model = shown
        self._draw()

    @Slot()
    def _draw(self) -> None:
        theme = self._session.theme
        self._area.setBackground(QColor(theme.surface))
        for plot in self.plots:
            clear_plot(plot, theme)
        drive, both, residual = self.plots
        shown = SHOWN[self._shown[0].kind if self._shown else "actuator"]
        drive.setLabel("left", shown.drive_label)
        both.setLabel("left", shown.label)
        residual.setLabel("left", f"Residual ({shown.error_unit})")
        self.plots[-1].setLabel("bottom", "Time (s)")
        residual.setVisible(self._with_model)
        both.getAxis("bottom").setStyle(showValues=not self._with_model)
        self.key.setVisible(bool(self._shown))
        declared = self._shown[0].declared if len(self._shown) == 1 else ()
        self.channels.show_channels([(name, unit) for name, unit, _ in declared], self.plots[0])
        for place, (_, _, values) in enumerate(declared):
            self.channels.show_values(place, *values)
        if not self._shown:
            return
        named: list[tuple[str, str, str]] = []
        alone = len(self._shown) == 1
        zero = pg.InfiniteLine(0.0, angle=0, pen=pen(theme.muted, dashed=True))
        residual.addItem(zero, ignoreBounds=True)
        for i, curves in enumerate(self._shown):
            colour = theme.measured if alone else theme.curves[i % len(theme.curves)]
            driven = theme.command if alone else colour
            add_curve(drive, curves.drive[0], curves.drive[1] * shown.drive_factor, driven)
            named.append(("—", "measured" if alone else curves.name, colour))
            add_curve(both, curves.measured[0], curves.measured[1] * shown.factor, colour)
            if not self._with_model or curves.model is None or curves.residual is None:
                continue
            beside = theme.models[0] if alone else colour
            time, model = curves.model
            if alone:
                named.append(("—", "model", beside))
            elif i == len(self._shown) - 1:
                named.append(("- -", "model of each recording", theme.muted))
            add_curve(both, time, model * shown.factor, beside, dashed=not alone)
            time, left = curves.residual
            add_curve(residual, time, left * shown.error_factor, beside)
        self.key.setText(legend_html(*named))
        if alone:
            self._events(self._shown[0])

    def _events(self, curves: Curves) -> None:
        theme = self._session.theme
        for event in curves.events:
            if event.level == "info":
                continue
            colour = theme.bad if event.level == "fault" else theme.warn
            line = pg.InfiniteLine(event.time, angle=90, pen=pen(colour, dashed=True))
            line.setToolTip(plain_tip(f"{event.time:.4g} s, {event.level}: {event.message}"))
            line.setCursor(Qt.CursorShape.WhatsThisCursor)
            self.plots[1].addItem(line, ignoreBounds=True)
