"""Figures of signals over time without a comparison: recordings, sequences, predictions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.decimate import decimate
from dearig.report.figures.defaults import style
from dearig.report.figures.style import (
    COLUMNS,
    DRIVE,
    MEASURED,
    MODEL,
    WIDTH,
    blank,
    few_ticks,
    legend,
    shade,
)
from dearig.units import SHOWN

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dearig.analysis.readings.band import PredictionBand

__all__ = ["signal_figure", "voltage_figure"]


def voltage_figure(time: np.ndarray, voltage: np.ndarray) -> Figure:
    """Return a figure of ``voltage`` (N,) in V over ``time`` (N,) in s."""
    shown = SHOWN["actuator"]
    with style():
        figure = blank(1.2 * WIDTH, 2.2)
        ax = figure.subplots()
        curve = decimate(time, voltage * shown.drive_factor, COLUMNS)
        ax.plot(*curve, color=DRIVE, linewidth=1.2)
        ax.set_xlabel("Time (s)")
        ax.set_ylabel(shown.drive_label)
        ax.set_xlim(time[0], time[-1])
        few_ticks(ax, y=5)
    return figure


def signal_figure(
    kind: str,
    time: np.ndarray,
    drive: np.ndarray | None,
    measured: np.ndarray | None = None,
    model: np.ndarray | None = None,
    band: PredictionBand | None = None,
) -> Figure:
    """Return a figure of the drive, and of what was measured or predicted or both, over time.

    ``kind`` is actuator (V, m) or film (stretch, Pa); the arrays are (N,) in SI units on ``time``
    in s, and a curve that is None is left out. ``band`` is that of the prediction; it has axes of
    its own below, since it is narrower than a line is thick.
    """
    shown = SHOWN[kind]
    with style():
        figure = blank(1.2 * WIDTH, 3.6 if band is None else 4.8)
        heights = (1.0, 1.7) if band is None else (1.0, 1.7, 1.0)
        axes = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights))
        upper, lower = axes[:2]
        if drive is not None:
            curve = decimate(time, drive * shown.drive_factor, COLUMNS)
            upper.plot(*curve, color=DRIVE, linewidth=1.2)
        upper.set_ylabel(shown.drive_label.replace(" (", "\n("))
        both = measured is not None and model is not None
        for values, name, colour, dashes in (
            (measured, "measured", MEASURED, (1, 0)),
            (model, "model", MODEL, (4, 1.6) if both else (1, 0)),
        ):
            if values is not None:
                curve = decimate(time, values * shown.factor, COLUMNS)
                lower.plot(*curve, color=colour, linewidth=1.3, label=name, dashes=dashes)
        lower.set_ylabel(shown.label.replace(" (", "\n("))
        if band is not None and model is not None:
            half = band.half_width
            shade(lower, time, (model - half) * shown.factor, (model + half) * shown.factor)
            half = half * shown.error_factor
            shade(axes[2], time, -half, half)
            axes[2].axhline(0.0, color=MODEL, linewidth=0.8)
            axes[2].set_ylabel(f"95 % band\n({shown.error_unit})")
        axes[-1].set_xlabel("Time (s)")
        lower.set_xlim(time[0], time[-1])
        if both:
            legend(lower)
        for ax in axes:
            few_ticks(ax, y=5)
        figure.align_ylabels(axes)
    return figure
