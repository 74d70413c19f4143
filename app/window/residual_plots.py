"""Plots of a residual: over time, over frequency, against quantities, and the missing stress."""

from __future__ import annotations

import math

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QSignalBlocker, Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QComboBox, QGridLayout, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from dearig.analysis.study import Residual
from dearig.model.diagnosis.results import Dependence, MissingStress
from dearig.units import SHOWN, readable
from dearig.window.plotting import DecadeAxis, add_curve, add_noise, clear_plot, set_legend_title
from dearig.window.session import Session
from dearig.window.theme import SPACE, pen
from dearig.window.widgets import label

__all__ = ["ResidualPlots"]

_POINTS = 2000  # of a scatter plot; more points cover each other


class ResidualPlots(QWidget):
    """Four plots of one recording's residual, before and after a diagnosis."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._residuals: tuple[Residual, ...] = ()
        self.record = QComboBox()
        self.record.setToolTip("Recording whose residual is shown")
        self.quantity = QComboBox()
        self.quantity.setToolTip("Quantity on the horizontal axis of the lower plots")
        self.stand = QComboBox()
        self.stand.addItems(["before", "after"])
        self.stand.setToolTip("Thesis model (before), or model with the effects found (after)")
        self.time, self.dependence, self.missing = (pg.PlotWidget() for _ in range(3))
        self.density = pg.PlotWidget(axisItems={"left": DecadeAxis("left")})
        for plot, name in (
            (self.time, "Residual over time"),
            (self.density, "Residual over frequency"),
            (self.dependence, "Residual against a quantity"),
            (self.missing, "Missing stress"),
        ):
            plot.setAccessibleName(name)
            plot.setMinimumHeight(130)
        self.remarks = label("", "muted")
        self.remarks.setWordWrap(True)

        row = QHBoxLayout()
        for text, box in (
            ("Recor&ding", self.record), ("A&gainst", self.quantity), ("Mode&l", self.stand),
        ):  # fmt: skip
            of = QLabel(text)
            of.setBuddy(box)
            row.addWidget(of)
            row.addWidget(box)
        row.addStretch(1)
        grid = QGridLayout()
        grid.setSpacing(SPACE)
        for i, plot in enumerate((self.time, self.density, self.dependence, self.missing)):
            grid.addWidget(plot, i // 2, i % 2)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.addLayout(row)
        outer.addLayout(grid, 1)
        outer.addWidget(self.remarks)

        self.record.currentIndexChanged.connect(self._another_record)
        self.quantity.currentIndexChanged.connect(self._draw)
        self.stand.currentIndexChanged.connect(self._draw)
        session.theme_changed.connect(self._draw)

    def show_residuals(self, residuals: tuple[Residual, ...]) -> None:
        """Show these residuals, starting with the first."""
        self._residuals = residuals
        with QSignalBlocker(self.record):
            self.record.clear()
            self.record.addItems([r.name for r in residuals])
        self._another_record()

    @Slot()
    def _another_record(self) -> None:
        found = self._found()
        names = [d.quantity for d in found.dependences[0]] if found and found.dependences else []
        before = self.quantity.currentText()
        with QSignalBlocker(self.quantity):
            self.quantity.clear()
            self.quantity.addItems(names)
            self.quantity.setCurrentIndex(max(names.index(before) if before in names else 0, 0))
        self.quantity.setEnabled(bool(names))
        self.stand.setEnabled(found is not None and len(found.over_time) > 1)
        self._draw()

    def _found(self) -> Residual | None:
        index = self.record.currentIndex()
        return self._residuals[index] if 0 <= index < len(self._residuals) else None

    @Slot()
    def _draw(self) -> None:
        theme = self._session.theme
        for widget in (self.time, self.density, self.dependence, self.missing):
            widget.setBackground(QColor(theme.surface))
            clear_plot(widget.getPlotItem(), theme)
        found = self._found()
        self.dependence.setVisible(found is None or bool(found.dependences))
        self.missing.setVisible(found is None or bool(found.missing))
        if found is None:
            self.remarks.setText("")
            return
        self.remarks.setText(readable(". ".join(w[:1].upper() + w[1:] for w in found.words)))
        self._over_time(found)
        self._over_frequency(found)
        last = min(self.stand.currentIndex(), len(found.over_time) - 1)
        if found.dependences:
            self._against(found.dependences[last], found.kind)
        if found.missing:
            self._stress(found.missing[min(last, len(found.missing) - 1)], found.kind)

    def _colours(self) -> tuple[tuple[str, str], ...]:
        theme = self._session.theme
        return (("before", theme.models[0]), ("after", theme.models[1]))

    def _key(self, stands: int) -> tuple[tuple[str, str, str], ...]:
        """Return the legend for ``stands`` models."""
        names = self._colours()[:stands]
        if stands == 1:
            names = (("residual", names[0][1]),)
        return tuple(("\N{EM DASH}", name, colour) for name, colour in names)

    def _over_time(self, found: Residual) -> None:
        plot, theme, shown = self.time.getPlotItem(), self._session.theme, SHOWN[found.kind]
        plot.setLabel("left", f"Residual ({shown.error_unit})")
        plot.setLabel("bottom", "Time (s)")
        stands = self._colours()[: len(found.over_time)]
        set_legend_title(plot, *self._key(len(found.over_time)))
        for (_, colour), trace in zip(stands, found.over_time, strict=True):
            add_curve(plot, trace.x, trace.y * shown.error_factor, colour)
        if found.noise is not None:
            level = found.noise * shown.error_factor
            add_noise(plot, theme, -level, level)
        plot.autoRange(padding=0.02)

    def _over_frequency(self, found: Residual) -> None:
        plot, theme, shown = self.density.getPlotItem(), self._session.theme, SHOWN[found.kind]
        plot.setLogMode(x=True, y=True)
        plot.setLabel("left", f"Density ({shown.error_unit}/\N{SQUARE ROOT}Hz)")
        plot.setLabel("bottom", "Frequency (Hz)")
        set_legend_title(plot, *self._key(len(found.density)), ("- -", "noise floor", theme.muted))
        for (_, colour), trace in zip(self._colours(), found.density, strict=False):
            good = (trace.x > 0.0) & (trace.y > 0.0)
            add_curve(plot, trace.x[good], trace.y[good] * shown.error_factor, colour)
        if found.floor:
            add_noise(plot, theme, math.log10(found.floor * shown.error_factor))
        plot.autoRange(padding=0.02)

    def _against(self, dependences: tuple[Dependence, ...], kind: str) -> None:
        plot, theme, shown = self.dependence.getPlotItem(), self._session.theme, SHOWN[kind]
        chosen = [d for d in dependences if d.quantity == self.quantity.currentText()]
        plot.setLabel("left", f"Residual ({shown.error_unit})")
        if not chosen:
            return
        found, scale = chosen[0], shown.error_factor
        unit = found.unit.replace("^2", "\N{SUPERSCRIPT TWO}")
        plot.setLabel("bottom", f"{found.quantity} ({unit})" if unit else found.quantity)
        set_legend_title(
            plot, ("\N{BLACK CIRCLE}", "loading", theme.command),
            ("\N{BLACK SQUARE}", "unloading", theme.monitor),
            ("\N{FULL BLOCK}", "95 % band of noise", theme.muted),
        )  # fmt: skip
        chance = 2.0 * found.error * scale
        band = QColor(theme.muted)
        band.setAlpha(60)
        edges = [pg.PlotCurveItem(found.at, sign * chance, pen=None) for sign in (-1.0, 1.0)]
        plot.addItem(pg.FillBetweenItem(*edges, brush=band), ignoreBounds=True)
        for values, colour, symbol in (
            (found.loading, theme.command, "o"), (found.unloading, theme.monitor, "s"),
        ):  # fmt: skip
            good = np.isfinite(values)
            plot.addItem(
                pg.PlotDataItem(
                    found.at[good], values[good] * scale, pen=pen(colour), symbol=symbol,
                    symbolSize=5, symbolPen=None, symbolBrush=QColor(colour),
                )
            )  # fmt: skip
        plot.autoRange(padding=0.04)

    def _stress(self, missing: MissingStress, kind: str) -> None:
        plot, theme = self.missing.getPlotItem(), self._session.theme
        quantity = self.quantity.currentText()
        values, text = missing.stretch, "stretch"
        if kind == "actuator" and "oltage" in quantity:
            values, text = (missing.voltage * 1e-3) ** 2, "voltage squared (kV\N{SUPERSCRIPT TWO})"
        elif "rate" in quantity:
            values, text = missing.rate, "stretch rate (1/s)"
        elif "time" in quantity:
            values, text = missing.time, "time (s)"
        plot.setLabel("left", "Missing stress (Pa)")
        plot.setLabel("bottom", text)
        set_legend_title(
            plot, ("\N{BLACK CIRCLE}", "loading", theme.command),
            ("\N{BLACK SQUARE}", "unloading", theme.monitor),
        )  # fmt: skip
        rising = missing.rate >= 0.0
        for which, colour, symbol in (
            (rising, theme.command, "o"), (~rising, theme.monitor, "s"),
        ):  # fmt: skip
            rows = np.flatnonzero(which)
            rows = rows[:: max(1, rows.size // (_POINTS // 2))]
            plot.addItem(
                pg.ScatterPlotItem(
                    values[rows], missing.stress[rows], size=3, pen=None, symbol=symbol,
                    brush=QColor(colour),
                )
            )  # fmt: skip
        plot.autoRange(padding=0.04)
