"""Figures of recordings: drive, measurement and model, and the error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dearig.analysis.decimate import decimate, decimate_path
from dearig.report.figures.defaults import style, text_size
from dearig.report.figures.style import (
    COLUMNS,
    DRIVE,
    ERROR,
    MARK,
    MEASURED,
    MODEL,
    NOISE,
    UNSURE,
    WIDTH,
    blank,
    decimated_log,
    drawable,
    few_ticks,
    legend,
    log_axis,
    shade,
)
from dearig.report.text.numbers import significant
from dearig.units import SHOWN, Shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from dearig.analysis.outcomes import Comparison

__all__ = ["comparison_figure", "loop_figure", "overview_figure"]


def comparison_figure(comparison: Comparison) -> Figure:
    """Draw drive, measurement and model, and error over time (as the thesis's Fig. 10-16)."""
    with style():
        figure = blank(WIDTH, 4.1)
        axes = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.7, 1.2))
        _stack(list(axes), comparison)
        figure.align_ylabels(axes)
    return figure


def loop_figure(comparison: Comparison) -> Figure:
    """Draw measurement and model against the drive; the area of a loop is dissipated energy."""
    shown = SHOWN[comparison.kind]
    with style():
        figure = blank(WIDTH, 3.4)
        ax = figure.subplots()
        drive = comparison.drive * shown.drive_factor
        for values, name, look in (
            (comparison.measured, "measured", _measured_look()),
            (comparison.model, "model", _model_look()),
        ):
            ax.plot(*decimate_path(drive, values * shown.factor, COLUMNS // 2), label=name, **look)
        ax.set_xlabel(shown.drive_label)
        ax.set_ylabel(shown.label)
        legend(ax)
    return figure


def overview_figure(train: Comparison, validation: Sequence[Comparison]) -> Figure:
    """Draw an identification: its training recording, and the errors of all others."""
    bars = len(validation)
    with style():
        figure = blank(1.2 * WIDTH, 5.6 + (0.9 + 0.24 * bars if bars else 0.0))
        upper: Figure | SubFigure = figure
        if bars:
            halves = figure.subfigures(2, 1, squeeze=False, height_ratios=(5.6, 0.9 + 0.24 * bars))[
                :, 0
            ]
            upper = halves[0]
            _validation_bars(halves[1].subplots(), train, validation)
        stacked = list(upper.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.7, 1.2)))
        _stack(stacked, train)
        upper.align_ylabels(stacked)
    return figure


def _measured_look() -> dict[str, Any]:
    return {"color": MEASURED, "linewidth": 1.9}


def _model_look() -> dict[str, Any]:
    # thin and dashed on top of thick and solid: where they agree, both are visible
    return {"color": MODEL, "linewidth": 1.1, "dashes": (4, 1.6)}


def _stack(axes: list[Axes], comparison: Comparison) -> None:
    shown = SHOWN[comparison.kind]
    drive, both, error = axes
    time = comparison.time
    log = _is_hold(comparison)
    if log:
        time = time - time[0]

    def curve(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # the first sample, at time zero, is not on a logarithmic axis
        return decimated_log(time[1:], values[1:]) if log else decimate(time, values, COLUMNS)

    drive.plot(*curve(comparison.drive * shown.drive_factor), color=DRIVE, linewidth=1.2)
    drive.set_ylabel(shown.drive_label)
    both.plot(*curve(comparison.measured * shown.factor), label="measured", **_measured_look())
    both.plot(*curve(comparison.model * shown.factor), label="model", **_model_look())
    both.set_ylabel(shown.label)
    if comparison.band is not None:
        half, model = comparison.band.half_width, comparison.model
        shade(both, time, (model - half) * shown.factor, (model + half) * shown.factor)
        half = half * shown.error_factor
        shade(error, time, -half, half, "95 % band")
    legend(both)
    _noise_band(error, comparison, shown)
    error.plot(
        *curve((comparison.measured - comparison.model) * shown.error_factor),
        color=ERROR,
        linewidth=0.8,
    )
    error.set_ylabel(shown.error_label)
    if log:
        error.set_xlabel("Time since the start (s)")
        log_axis(error, "x", time[1], time[-1])
    else:
        error.set_xlabel("Time (s)")
        error.set_xlim(time[0], time[-1])
    for ax in axes:
        few_ticks(ax, y=5)


def _is_hold(comparison: Comparison) -> bool:
    """Return True for a film recording whose drive is constant nearly all the time.

    In such a relaxation test the stress changes early, which only a logarithmic time axis shows.
    """
    if comparison.kind != "film" or comparison.time.size < 3:
        return False
    drive = comparison.drive
    moving = np.flatnonzero(np.abs(drive - drive[-1]) > 0.01 * float(np.ptp(drive)))
    if moving.size == 0:
        return False
    since = comparison.time - comparison.time[0]
    return bool(since[moving[-1]] < 0.1 * since[-1])


def _noise_band(ax: Axes, comparison: Comparison, shown: Shown) -> None:
    if comparison.noise is not None:
        floor = comparison.noise * shown.error_factor
        ax.axhspan(-floor, floor, color=NOISE, linewidth=0, zorder=0.5)
        for i, edge in enumerate((-floor, floor)):
            # edges on top of the curve, which covers the band where the error is noise
            ax.axhline(
                edge, color=MARK, linewidth=0.8, linestyle=(0, (3, 2)), zorder=4,
                label=None if i else
                f"\N{PLUS-MINUS SIGN} noise floor, {significant(floor)} {shown.error_unit}",
            )  # fmt: skip
    if comparison.noise is not None or comparison.band is not None:
        legend(ax)
    ax.axhline(0.0, color=UNSURE, linewidth=0.6, zorder=0.6)


def _validation_bars(ax: Axes, train: Comparison, validation: Sequence[Comparison]) -> None:
    shown = SHOWN[train.kind]
    names = {"A": "one frequency", "B": "one amplitude", "": "other recordings"}
    colours = {"A": MEASURED, "B": "#E69F00", "": DRIVE}
    rms = np.array([c.errors.rms for c in validation]) * shown.error_factor
    finite = rms[np.isfinite(rms)]
    floors = [c.noise for c in validation if c.noise is not None]
    longest = float(finite.max()) if finite.size else 1.0
    labelled = set()
    for row, comparison in enumerate(validation):
        length = rms[row] if math.isfinite(rms[row]) else longest
        ax.barh(
            row, length, height=0.68, color=colours[comparison.table],
            label=None if comparison.table in labelled else names[comparison.table],
        )  # fmt: skip
        labelled.add(comparison.table)
        ax.annotate(
            significant(float(rms[row])), (length, row), (3, 0), textcoords="offset points",
            va="center", fontsize=text_size(8.5),
        )  # fmt: skip
    if floors:
        floor = float(np.median(floors)) * shown.error_factor
        ax.axvline(floor, color=MARK, linewidth=1.1, linestyle=(0, (3, 2)), label="noise floor")
    ax.set_yticks(range(len(validation)), [drawable(c.row or c.name, 24) for c in validation])
    ax.set_ylim(len(validation) - 0.4, -0.6)
    ax.set_xlim(0.0, 1.12 * longest or 1.0)
    ax.grid(visible=False, axis="y")
    ax.set_xlabel(f"RMS error on validation recordings ({shown.error_unit})")
    legend(ax, 4)
