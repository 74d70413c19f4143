"""Plot of one or several recordings over time: drive, measurement and model, residual."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.analysis.summary import Curves
from dearig.recording.reading.marks import marks_in
from dearig.report.text.numbers import significant
from dearig.units import SHOWN
from dearig.window.kit.theme import pen
from dearig.window.kit.turns import Turns
from dearig.window.kit.widgets import plain_tip
from dearig.window.plots.area import PlotArea
from dearig.window.plots.limit_lines import MarkLine, PlotOverlay
from dearig.window.plots.plot import LegendEntry, Plot
from dearig.window.run.channel_plots import ChannelPlots
from dearig.window.session.state import Session

__all__ = ["CurvesPlot", "rms_text"]


class CurvesPlot(QWidget):
    """Three plots on one time axis, and below them the declared channels of a single recording.

    The model is dashed where several recordings share a plot.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._shown: tuple[Curves, ...] = ()
        self._with_model = True
        self._with_current = False
        self._turns = Turns(lambda: session.busy, self)
        self.area = PlotArea(session, "Curves of the selected recordings")
        # the measurement gets the most space
        self.plots = [
            self.area.add_plot(row, left=label, weight=weight)
            for row, (label, weight) in enumerate(
                (
                    ("Voltage (kV)", 3),
                    ("Displacement (mm)", 5),
                    ("Residual (µm)", 4),
                    ("Current (mA)", 3),
                )
            )
        ]
        self.marks = PlotOverlay(self.plots[1], 1.0, session.theme)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(self.area, 1)
        self.channels = ChannelPlots(session, self.area, len(self.plots))
        session.theme_changed.connect(self._draw)
        self._draw()

    @property
    def shown(self) -> tuple[Curves, ...]:
        """Recordings that are drawn."""
        return self._shown

    def show_curves(self, curves: Sequence[Curves]) -> None:
        """Draw ``curves``, all of one kind, over their whole time."""
        self._shown = tuple(curves)
        self.area.file_stem = self._shown[0].name if len(self._shown) == 1 else "recordings"
        self._draw(whole=True)

    @Slot(bool)
    def show_model(self, shown: bool) -> None:
        """Show or hide the model and the residual."""
        self._with_model = shown
        self._draw()

    @Slot(bool)
    def show_current(self, shown: bool) -> None:
        """Show or hide the monitored current."""
        self._with_current = shown
        self._draw()

    @Slot()
    def _draw(self, whole: bool = False) -> None:
        theme = self._session.theme
        self._turns.clear()
        self.area.setUpdatesEnabled(False)  # one drawing, and not one after each curve
        self.marks.set_theme(theme)
        self.marks.show_marks((), with_words=True)
        for plot in self.plots:
            plot.clear_all()
        drive, both, residual, current = self.plots
        shown = SHOWN[self._shown[0].kind if self._shown else "actuator"]
        drive.set_axis("left", shown.drive_label)
        both.set_axis("left", shown.label)
        residual.set_axis("left", f"Residual ({shown.error_unit})")
        self.area.show_plot(residual, self._with_model)
        self.area.show_plot(current, self._with_current)
        declared = self._shown[0].declared if len(self._shown) == 1 else ()
        self.channels.show_channels([(name, unit) for name, unit, _ in declared])
        for place, (_, _, values) in enumerate(declared):
            self.channels.show_values(place, *values)
        if self._shown:
            zero = pg.InfiniteLine(0.0, angle=0, pen=pen(theme.muted, dashed=True))
            residual.addItem(zero, ignoreBounds=True)
        for place, curves in enumerate(self._shown):
            self._turns.add(self._pieces(place, curves))
        if whole:
            self._turns.add((self.area.auto_range,))
        self._turns.add((partial(self.area.setUpdatesEnabled, True),))

    def _pieces(self, place: int, curves: Curves) -> Iterator[Callable[[], None]]:
        """Yield what draws ``curves``, which are shown at ``place``, a curve each."""
        theme, alone, last = self._session.theme, len(self._shown) == 1, len(self._shown) - 1
        drive, both, residual, current = self.plots
        shown = SHOWN[curves.kind]
        colour = theme.measured if alone else theme.curves[place % len(theme.curves)]
        name = "measured" if alone else curves.name
        # several recordings are named once: their keys would take the height of the plots
        own = partial(_draw_curve, in_key=alone)
        yield partial(
            own, drive, "commanded" if alone else name, theme.command if alone else colour,
            curves.drive, shown.drive_factor,
        )  # fmt: skip
        if curves.current is not None:
            yield partial(
                own, current, "monitored current" if alone else name,
                theme.monitor if alone else colour, curves.current, 1e3,
            )  # fmt: skip
        yield partial(_draw_curve, both, name, colour, curves.measured, shown.factor)
        if self._with_model and curves.model is not None and curves.residual is not None:
            model_colour = theme.models[0] if alone else colour
            yield partial(
                own, both, "model" if alone else f"model of {name}", model_colour, curves.model,
                shown.factor, dashed=not alone,
            )  # fmt: skip
            yield partial(
                own, residual, "residual" if alone else name, model_colour, curves.residual,
                shown.error_factor,
            )  # fmt: skip
        if alone:
            if curves.monitor is not None:
                yield partial(
                    _draw_curve, drive, "monitor", theme.monitor, curves.monitor,
                    shown.drive_factor,
                )  # fmt: skip
            yield partial(self._events, curves)
        elif place == last and self._with_model and any(c.model is not None for c in self._shown):
            entry = LegendEntry("model of each recording", theme.muted, dashed=True)
            yield partial(both.add_entry, entry)

    def _events(self, curves: Curves) -> None:
        theme = self._session.theme
        self.marks.show_marks(
            tuple(MarkLine(m.time, m.words, theme.text) for m in marks_in(curves.events)),
            with_words=True,
        )
        for event in curves.events:
            if event.level == "info":
                continue
            colour = theme.bad if event.level == "fault" else theme.warn
            line = pg.InfiniteLine(event.time, angle=90, pen=pen(colour, dashed=True))
            line.setToolTip(plain_tip(f"{event.time:.4g} s, {event.level}: {event.message}"))
            line.setCursor(Qt.CursorShape.WhatsThisCursor)
            self.plots[1].addItem(line, ignoreBounds=True)


def _draw_curve(
    plot: Plot,
    name: str,
    colour: str,
    points: tuple[np.ndarray, np.ndarray],
    factor: float,
    *,
    dashed: bool = False,
    in_key: bool = True,
) -> None:
    time, values = points
    plot.add_curve(name, colour, dashed=dashed, in_key=in_key).set_points(time, values * factor)


def rms_text(curves: Curves) -> str:
    """Return the RMS error of a recording with its unit, or why there is none."""
    if curves.errors is None:
        return curves.unfit
    shown = SHOWN[curves.kind]
    return f"{significant(curves.errors.rms * shown.error_factor)} {shown.error_unit} RMS"
