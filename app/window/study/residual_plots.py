"""Plots of a residual: over time, over frequency, against quantities, and the missing stress."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QSignalBlocker, Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from dearig.analysis.study import Residual
from dearig.model.residual import Dependence, MissingStress
from dearig.units import SHOWN, readable
from dearig.window.kit.flow import Flow
from dearig.window.kit.theme import SPACE
from dearig.window.kit.turns import Turns
from dearig.window.kit.widgets import label, name_list
from dearig.window.plots.area import PlotArea
from dearig.window.plots.plot import LegendEntry
from dearig.window.session.state import Session

__all__ = ["ResidualPlots"]

_POINTS = 2000  # of a scatter plot; more points cover each other
_LEAST = 66  # px, height of the plot over time of one model; the others are twice as high


class ResidualPlots(QWidget):
    """Four plots of one recording's residual, before and after a diagnosis."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._residuals: tuple[Residual, ...] = ()
        self._turns = Turns(lambda: session.busy, self)
        self.record = name_list()
        self.record.setToolTip("Recording whose residual is shown")
        self.quantity = name_list()
        self.quantity.setToolTip("Quantity on the horizontal axis of the lower plots")
        self.stand = name_list()
        self.stand.addItems(["before", "after"])
        self.stand.setToolTip("Thesis model (before), or model with the effects found (after)")
        self.area = area = PlotArea(session, "Residual")
        # each model has a plot over time: one residual would hide the other
        self.time = tuple(area.add_plot(row, left="Residual (µm)", least=_LEAST) for row in (0, 1))
        area.share_y(*self.time)
        self.density = area.add_plot(
            0, 1, left="Density (µm/√Hz)", bottom="Frequency (Hz)", group="frequency", rows=2,
            least=_LEAST, log=(True, True),
        )  # fmt: skip
        self.dependence = area.add_plot(
            2, left="Residual (µm)", bottom="Quantity", group="quantity", weight=2,
            least=2 * _LEAST,
        )  # fmt: skip
        self.missing = area.add_plot(
            2, 1, left="Missing stress (Pa)", bottom="Quantity", group="missing stress", weight=2,
            least=2 * _LEAST,
        )  # fmt: skip
        self.remarks = label("", "muted")
        self.remarks.setWordWrap(True)

        row = Flow()
        for text, box in (
            ("Recor&ding", self.record), ("A&gainst", self.quantity), ("Mode&l", self.stand),
        ):  # fmt: skip
            of = QLabel(text)
            of.setBuddy(box)
            row.add(of, box)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.addLayout(row)
        outer.addWidget(area, 1)
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
        """Draw what is chosen; while the rig is busy, one plot after another."""
        self._turns.clear()
        for plot in (*self.time, self.density, self.dependence, self.missing):
            plot.clear_all()
        found = self._found()
        self.area.show_plot(self.dependence, found is None or bool(found.dependences))
        self.area.show_plot(self.missing, found is None or bool(found.missing))
        if found is None:
            self.remarks.setText("")
            return
        self.remarks.setText(readable(". ".join(w[:1].upper() + w[1:] for w in found.words)))
        self.area.file_stem = f"{found.name} residual"
        pieces: list[Callable[[], object]] = [
            partial(self._over_time, found),
            partial(self._over_frequency, found),
        ]
        last = min(self.stand.currentIndex(), len(found.over_time) - 1)
        if found.dependences:
            pieces.append(partial(self._against, found.dependences[last], found.kind))
        if found.missing:
            shown = found.missing[min(last, len(found.missing) - 1)]
            pieces.append(partial(self._stress, shown, found.kind))
        self._turns.add([*pieces, self.area.auto_range])

    def _models(self, count: int) -> list[tuple[str, str]]:
        """Return names and colours of ``count`` models."""
        colours = self._session.theme.models
        if count == 1:
            return [("residual", colours[0])]
        return list(zip(("before", "after"), colours, strict=True))[:count]

    def _over_time(self, found: Residual) -> None:
        theme, shown = self._session.theme, SHOWN[found.kind]
        models = self._models(len(found.over_time))
        for place, plot in enumerate(self.time):
            self.area.show_plot(plot, place < len(models))
            if place >= len(models):
                continue
            name, colour = models[place]
            trace = found.over_time[place]
            plot.set_axis("left", f"Residual ({shown.error_unit})")
            plot.add_curve(name, colour).set_points(trace.x, trace.y * shown.error_factor)
            if found.noise is not None:
                level = found.noise * shown.error_factor
                plot.add_levels(theme, "Noise floor", -level, level)
                plot.add_entry(LegendEntry("noise floor", theme.muted, dashed=True))

    def _over_frequency(self, found: Residual) -> None:
        plot, theme, shown = self.density, self._session.theme, SHOWN[found.kind]
        plot.set_axis("left", f"Density ({shown.error_unit}/\N{SQUARE ROOT}Hz)")
        for (name, colour), trace in zip(
            self._models(len(found.density)), found.density, strict=True
        ):  # fmt: skip
            plot.add_curve(name, colour).set_points(trace.x, trace.y * shown.error_factor)
        if found.floor:
            plot.add_levels(theme, "Noise floor", math.log10(found.floor * shown.error_factor))
            plot.add_entry(LegendEntry("noise floor", theme.muted, dashed=True))

    def _against(self, dependences: tuple[Dependence, ...], kind: str) -> None:
        plot, theme, shown = self.dependence, self._session.theme, SHOWN[kind]
        chosen = [d for d in dependences if d.quantity == self.quantity.currentText()]
        plot.set_axis("left", f"Residual ({shown.error_unit})")
        if not chosen:
            return
        found, scale = chosen[0], shown.error_factor
        unit = found.unit.replace("^2", "\N{SUPERSCRIPT TWO}")
        plot.set_axis("bottom", f"{found.quantity} ({unit})" if unit else found.quantity)
        chance = 2.0 * found.error * scale
        band = QColor(theme.muted)
        band.setAlpha(60)
        edges = [pg.PlotCurveItem(found.at, sign * chance, pen=None) for sign in (-1.0, 1.0)]
        plot.addItem(pg.FillBetweenItem(*edges, brush=band), ignoreBounds=True)
        for name, values, colour, symbol in (
            ("loading", found.loading, theme.command, "o"),
            ("unloading", found.unloading, theme.monitor, "s"),
        ):
            good = np.isfinite(values)
            plot.add_curve(name, colour, symbol=symbol).set_points(
                found.at[good], values[good] * scale
            )
        plot.add_entry(
            LegendEntry("95 % band of noise", band.name(QColor.NameFormat.HexArgb), area=True)
        )

    def _stress(self, missing: MissingStress, kind: str) -> None:
        plot, theme = self.missing, self._session.theme
        quantity = self.quantity.currentText()
        values, text = missing.stretch, "stretch"
        if kind == "actuator" and "oltage" in quantity:
            values, text = (missing.voltage * 1e-3) ** 2, "voltage squared (kV\N{SUPERSCRIPT TWO})"
        elif "rate" in quantity:
            values, text = missing.rate, "stretch rate (1/s)"
        elif "time" in quantity:
            values, text = missing.time, "time (s)"
        plot.set_axis("bottom", text)
        rising = missing.rate >= 0.0
        for name, which, colour, symbol in (
            ("loading", rising, theme.command, "o"), ("unloading", ~rising, theme.monitor, "s"),
        ):  # fmt: skip
            rows = np.flatnonzero(which)
            rows = rows[:: max(1, rows.size // (_POINTS // 2))]
            plot.add_curve(name, colour, symbol=symbol, line=False, size=3).set_points(
                values[rows], missing.stress[rows]
            )
