"""Crosshair and cursors of the plots that share an axis, and what they read."""

from __future__ import annotations

import math

import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor

from dearig.window.kit.theme import Theme
from dearig.window.plots.plot import Plot

__all__ = ["CursorGroup"]

_FIRST_PLACES = (1.0 / 3.0, 2.0 / 3.0)  # of the visible range, where the cursors appear
_DELTA = "B\N{MINUS SIGN}A"


class _CursorLabel(pg.InfLineLabel):
    """Letter of a cursor; while it is hidden it is not moved in every frame."""

    def viewTransformChanged(self) -> None:  # noqa: N802
        if self.line.isVisible():
            super().viewTransformChanged()


class CursorGroup:
    """Plots with one horizontal axis: their crosshair, their cursors A and B, and the readouts.

    The lines of a plot are made when one is shown for the first time: most are never shown, and
    pyqtgraph works on each of them when the range changes.
    """

    def __init__(self, name: str, theme: Theme) -> None:
        self.name = name
        self._theme = theme
        self.plots: list[Plot] = []
        self.hair: float | None = None  #: x of the crosshair
        self.cursors: tuple[float, float] | None = None  #: x of A and of B
        self.moving = False  # while the ranges of the other plots follow
        self._lines: dict[Plot, tuple[pg.InfiniteLine, ...]] = {}
        self._level: dict[Plot, pg.InfiniteLine] = {}
        self._pointer: tuple[Plot, float] | None = None

    # plots

    def add(self, plot: Plot) -> None:
        """Add a plot."""
        self.plots.append(plot)

    def remove(self, plot: Plot) -> None:
        """Forget a plot."""
        self.plots.remove(plot)
        self._lines.pop(plot, None)
        self._level.pop(plot, None)
        if self._pointer is not None and self._pointer[0] is plot:
            self._pointer = None

    def restyle(self, theme: Theme) -> None:
        """Use the colours of ``theme``."""
        self._theme = theme
        for plot in self._lines:
            self._restyle(plot)

    def _make_lines(self, plot: Plot) -> None:
        lines = tuple(pg.InfiniteLine(angle=90) for _ in range(3))
        level = pg.InfiniteLine(angle=0)
        for line in (*lines, level):
            line.of_tools = True
            line.setVisible(False)
            line.setZValue(50)
            plot.addItem(line, ignoreBounds=True)
        for line, name in zip(lines[1:], "AB", strict=True):
            line.label = _CursorLabel(line, name, position=0.93)
        self._lines[plot], self._level[plot] = lines, level
        self._restyle(plot)

    def _restyle(self, plot: Plot) -> None:
        colour = QColor(self._theme.accent)
        hair = pg.mkPen(QColor(self._theme.muted), width=1, style=Qt.PenStyle.DotLine)
        first, *others = self._lines[plot]
        first.setPen(hair)
        self._level[plot].setPen(hair)
        for line in others:
            line.setPen(pg.mkPen(colour, width=1))
            line.label.setColor(colour)

    @property
    def shown(self) -> list[Plot]:
        """Plots that are not hidden."""
        return [plot for plot in self.plots if plot.isVisible()]

    def value(self, plot: Plot, place: float) -> float:
        """Return the quantity at ``place`` of the horizontal axis, which may be logarithmic."""
        return 10.0**place if plot.log[0] else place

    # crosshair and cursors

    def show_hair(self, plot: Plot | None, x: float = 0.0, y: float = 0.0) -> None:
        """Show the crosshair at (``x``, ``y``) of ``plot``, in the others at ``x``; None hides."""
        self.hair = None if plot is None else x
        self._pointer = None if plot is None else (plot, y)
        self._place()

    def show_cursors(self, shown: bool) -> None:
        """Show the two cursors inside the visible range, or hide them."""
        if not shown or not self.plots:
            self.cursors = None
        else:
            first, last = self.plots[0].vb.viewRange()[0]
            a, b = (first + part * (last - first) for part in _FIRST_PLACES)
            self.cursors = (a, b)
        self._place()

    def move_cursor(self, which: int, x: float) -> None:
        """Move cursor A (0) or B (1) to ``x``."""
        if self.cursors is not None:
            a, b = self.cursors
            self.cursors = (x, b) if which == 0 else (a, x)
            self._place()

    def _place(self) -> None:
        places = (self.hair, *(self.cursors or (None, None)))
        if places != (None, None, None):
            for plot in self.plots:
                if plot not in self._lines:
                    self._make_lines(plot)
        top = next(iter(self.shown), None)
        for plot, lines in self._lines.items():
            for line, place in zip(lines, places, strict=True):
                line.setVisible(place is not None)
                if place is not None:
                    line.setValue(place)
            for line in lines[1:]:
                line.label.setVisible(plot is top and self.cursors is not None)
                line.label.updatePosition()
            level = self._level[plot]
            here = self._pointer is not None and self._pointer[0] is plot
            level.setVisible(here)
            if here and self._pointer is not None:
                level.setValue(self._pointer[1])
        self.renew_readout()

    def hide_hair_for_picture(self, hidden: bool) -> None:
        """Hide the crosshair while a picture is made."""
        for plot, lines in self._lines.items():
            lines[0].setVisible(not hidden and self.hair is not None)
            here = self._pointer is not None and self._pointer[0] is plot
            self._level[plot].setVisible(not hidden and here)

    # readouts

    def renew_readout(self) -> None:
        """Write the values at the cursors, or else at the crosshair, into the keys of the plots."""
        for plot in self.plots:
            plot.renew_key(tuple(self._read(plot, i) for i in range(len(plot.curves_in_key()))))

    def _read(self, plot: Plot, number: int) -> str:
        curve = plot.curves_in_key()[number]
        if not curve.increasing:
            return ""
        if self.cursors is not None:
            a, b = (curve.value_at(self.value(plot, x)) for x in self.cursors)
            texts = [plot.text_of("left", v) for v in (a, b, b - a)]
            return f"A {texts[0]}  B {texts[1]}  {_DELTA} {texts[2]}"
        if self.hair is not None:
            return plot.text_of("left", curve.value_at(self.value(plot, self.hair)))
        return ""

    def readout(self) -> str:
        """Return the place of the crosshair or of the cursors, with their difference."""
        if not self.plots:
            return ""
        if self.cursors is not None:
            plot = self.plots[0]
            a, b = (self.value(plot, x) for x in self.cursors)
            texts = [plot.text_of("bottom", a), plot.text_of("bottom", b)]
            text = f"A {texts[0]}   B {texts[1]}   {_DELTA} {plot.difference('bottom', b - a)}"
            if plot.axis_texts["bottom"].unit == "s" and not math.isclose(a, b):
                text += f"   1/({_DELTA}) {1.0 / abs(b - a):.4g} Hz"
            return text
        if self.hair is None or self._pointer is None:
            return ""
        plot, y = self._pointer
        x = plot.text_of("bottom", self.value(plot, self.hair))
        y = 10.0**y if plot.log[1] else y
        names = {side: text.name for side, text in plot.axis_texts.items()}
        return f"{names['bottom']} {x}   {names['left']} {plot.text_of('left', y)}"
