"""Plots of one channel of a recording with models before and after, and their residuals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from PySide6.QtCore import QSignalBlocker, Slot
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from dearig.analysis.outcomes import Comparison
from dearig.report.text.numbers import significant
from dearig.units import SHOWN, SHOWN_CHANNELS, Shown, ShownChannel
from dearig.window.kit.flow import Flow
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel, name_list
from dearig.window.plots.area import PlotArea
from dearig.window.plots.plot import LegendEntry
from dearig.window.session.state import Session

__all__ = ["BeforeAfterPlot"]

_Pair = tuple[Comparison, Comparison | None]


class _Signal(NamedTuple):
    """Readings (M,) at ``time`` (M,) s with the prediction of a model, in SI units."""

    time: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    rms: float
    noise: float


class BeforeAfterPlot(QWidget):
    """Shows one of several recordings; the second model of a pair may be None."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._pairs: tuple[_Pair, ...] = ()
        self.record = name_list()
        self.record.setToolTip(
            "Validation recordings, which no fit and no selection used, come first"
        )
        of = QLabel("Recor&ding")
        of.setBuddy(self.record)
        self.channel = name_list()
        self.channel.setToolTip("Measured signal that is shown with its predictions and residuals")
        shown = QLabel("C&hannel")
        shown.setBuddy(self.channel)
        self.error_summary = ElidedLabel("muted", hugging=True)
        top = Flow()
        top.add(of, self.record)
        top.add(shown, self.channel)
        top.add(self.error_summary, share=1)
        self.area = PlotArea(session, "Measurement, models and residuals")
        labels = ("Voltage (kV)", "Displacement (mm)", "Residual (µm)", "Residual (µm)")
        # each residual has a plot: one would hide the other, which is about as large
        self.plots = [
            self.area.add_plot(row, left=label, weight=weight)
            for row, (label, weight) in enumerate(zip(labels, (3, 6, 4, 4), strict=True))
        ]
        self.area.share_y(*self.plots[2:])
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.addLayout(top)
        outer.addWidget(self.area, 1)
        self.record.currentIndexChanged.connect(self._another_record)
        self.channel.currentIndexChanged.connect(self._draw)
        session.theme_changed.connect(self._draw)

    def show_pairs(self, pairs: tuple[_Pair, ...]) -> None:
        """Show these pairs, starting with the first."""
        self._pairs = pairs
        with QSignalBlocker(self.record):
            self.record.clear()
            for one, _ in pairs:
                role = "training" if one.role == "train" else "validation"
                self.record.addItem(f"{one.name} ({role})")
        self._another_record()

    @Slot()
    def _another_record(self) -> None:
        """Offer the channels of the recording, and keep the one that was shown."""
        index, kept = self.record.currentIndex(), self.channel.currentData()
        with QSignalBlocker(self.channel):
            self.channel.clear()
            if 0 <= index < len(self._pairs):
                before = self._pairs[index][0]
                self.channel.addItem(SHOWN[before.kind].quantity, "")
                for curve in before.curves:
                    self.channel.addItem(SHOWN_CHANNELS[curve.name].title, curve.name)
            self.channel.setCurrentIndex(max(self.channel.findData(kept), 0))
        self.channel.setEnabled(self.channel.count() > 1)
        self._draw()

    @Slot()
    def _draw(self) -> None:
        theme = self._session.theme
        for plot in self.plots:
            plot.clear_all()
        index = self.record.currentIndex()
        if not 0 <= index < len(self._pairs):
            self.error_summary.show_text("")
            return
        before, after = self._pairs[index]
        shown = SHOWN[before.kind]
        drive = self.plots[0]
        drive.set_axis("left", shown.drive_label)
        drive.add_curve("commanded", theme.command).set_points(
            before.time, before.drive * shown.drive_factor
        )
        name = self.channel.currentData()
        if name:
            models = [_of_channel(c, name) for c in (before, after) if c is not None]
            self._draw_models(models, SHOWN_CHANNELS[name])
        else:
            self._draw_models([_of_signal(c) for c in (before, after) if c is not None], shown)
        of = f"{SHOWN_CHANNELS[name].title.lower()} " if name else ""
        self.area.file_stem = f"{before.name} {of}residuals"
        self.area.auto_range()

    def _draw_models(self, models: list[_Signal], shown: Shown | ShownChannel) -> None:
        """Draw the readings, which are those of each of ``models``, predictions and residuals."""
        theme, (_, both, *residuals) = self._session.theme, self.plots
        both.set_axis("left", shown.label)
        first = models[0]
        both.add_curve("measured", theme.measured).set_points(
            first.time, first.measured * shown.factor
        )
        said, names = [], ("before", "after") if len(models) > 1 else ("model",)
        level = first.noise * shown.error_factor
        for place, error in enumerate(residuals):
            self.area.show_plot(error, place < len(models))
            if place >= len(models):
                continue
            signal, name, colour = models[place], names[place], theme.models[place]
            error.set_axis("left", f"Residual ({shown.error_unit})")
            both.add_curve(name, colour).set_points(signal.time, signal.model * shown.factor)
            left = (signal.measured - signal.model) * shown.error_factor
            error.add_curve(f"residual, {name}", colour).set_points(signal.time, left)
            said.append(
                f"{name} {significant(signal.rms * shown.error_factor)} {shown.error_unit} RMS"
            )
            if level:
                error.add_levels(theme, "Noise floor", -level, level)
                error.add_entry(LegendEntry("noise floor", theme.muted, dashed=True))
        if level:
            said.append(f"noise {significant(level)} {shown.error_unit}")
        self.error_summary.show_text("   ".join(said))


def _of_signal(comparison: Comparison) -> _Signal:
    c = comparison
    return _Signal(c.time, c.measured, c.model, c.errors.rms, c.noise or 0.0)


def _of_channel(comparison: Comparison, name: str) -> _Signal:
    (c,) = (curve for curve in comparison.curves if curve.name == name)
    return _Signal(c.time, c.measured, c.predicted, c.rms, c.noise)
