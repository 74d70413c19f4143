"""Figures of a diagnosis: errors and residuals before and after, and the missing stress."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.decimate import decimate
from dearig.report.figures import style as base
from dearig.report.figures.defaults import style, text_size
from dearig.report.text.numbers import significant
from dearig.units import SHOWN, Shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dearig.analysis.outcomes import Comparison
    from dearig.model.effects import Curve
    from dearig.model.residual import Dependence, MissingStress, Signature

__all__ = [
    "bars_figure",
    "before_after_figure",
    "curve_figure",
    "dependence_figure",
    "missing_figures",
    "missing_time_figure",
    "residual_time_figure",
    "spectra_figure",
]

BEFORE = "#D55E00"
AFTER = "#0072B2"
LOADING = "#0072B2"
UNLOADING = "#E69F00"

_POINTS = 900  # of a scatter plot
_NAME = 26


def before_after_figure(before: Comparison, after: Comparison) -> Figure:
    """Draw drive, measurement, both models and both errors of one recording over time."""
    shown = SHOWN[after.kind]
    time = after.time
    with style():
        figure = base.blank(base.WIDTH, 4.8)
        axes = figure.subplots(4, 1, sharex=True, height_ratios=(0.8, 1.7, 1.0, 1.0))
        drive, both, first, last = axes
        drive.plot(
            *decimate(time, after.drive * shown.drive_factor, base.COLUMNS),
            color=base.DRIVE, linewidth=1.2,
        )  # fmt: skip
        drive.set_ylabel(_broken(shown.drive_label))
        for values, label, look in (
            (after.measured, "measured", {"color": base.MARK, "linewidth": 2.4, "alpha": 0.45}),
            (before.model, "before", {"color": BEFORE, "linewidth": 1.0, "dashes": (4, 1.6)}),
            (after.model, "after", {"color": AFTER, "linewidth": 1.0, "dashes": (1.5, 1.2)}),
        ):
            both.plot(*decimate(time, values * shown.factor, base.COLUMNS), label=label, **look)
        both.set_ylabel(_broken(shown.label))
        base.legend(both, 3)
        for ax, comparison, colour, name in (
            (first, before, BEFORE, "before"), (last, after, AFTER, "after"),
        ):  # fmt: skip
            error = (comparison.measured - comparison.model) * shown.error_factor
            if comparison.band is not None:
                half = comparison.band.half_width * shown.error_factor
                base.shade(ax, time, -half, half)
            _band(ax, comparison.noise, shown)
            ax.plot(*decimate(time, error, base.COLUMNS), color=colour, linewidth=0.8)
            rms = significant(comparison.errors.rms * shown.error_factor)
            _inside(ax, f"{name}: {rms} {shown.error_unit} RMS")
            ax.set_ylabel(f"Error\n({shown.error_unit})")
        last.set_xlabel("Time (s)")
        last.set_xlim(time[0], time[-1])
        for ax in axes:
            base.few_ticks(ax, y=4)
        figure.align_ylabels(axes)
    return figure


def residual_time_figure(before: Signature, after: Signature | None, kind: str) -> Figure:
    """Draw measured minus model over time, before and after, each on its own scale."""
    shown = SHOWN[kind]
    pairs = [("before", before, BEFORE)]
    if after is not None:
        pairs.append(("after", after, AFTER))
    with style():
        figure = base.blank(base.WIDTH, 0.6 + 1.45 * len(pairs))
        axes = figure.subplots(len(pairs), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (name, signature, colour) in zip(axes, pairs, strict=True):
            _band(ax, signature.noise, shown)
            ax.plot(
                *decimate(signature.time, signature.residual * shown.error_factor, base.COLUMNS),
                color=colour, linewidth=0.8,
            )  # fmt: skip
            over = significant(signature.rms / signature.noise)
            _inside(ax, f"{name}: {over} times the noise floor")
            ax.set_ylabel(f"Residual ({shown.error_unit})")
            base.few_ticks(ax, y=4)
        axes[-1].set_xlabel("Time (s)")
        axes[-1].set_xlim(before.time[0], before.time[-1])
        figure.align_ylabels(axes)
    return figure


def spectra_figure(before: Signature, after: Signature | None, kind: str) -> Figure:
    """Draw the amplitude density of the residual, before and after, with the noise floor."""
    shown = SHOWN[kind]
    floor = math.sqrt(before.floor_density) * shown.error_factor
    with style():
        figure = base.blank(base.WIDTH, 3.4)
        ax = figure.subplots()
        heights = [floor]
        pairs = [("before", before, BEFORE)]
        if after is not None:
            pairs.append(("after", after, AFTER))
        for name, signature, colour in pairs:
            density = np.sqrt(signature.density) * shown.error_factor
            good = (signature.frequency > 0.0) & (density > 0.0)
            f, d = signature.frequency[good], density[good]
            if f.size:
                ax.plot(*base.decimated_log(f, d), color=colour, linewidth=1.1, label=name)
                heights += [float(d.max()), float(d.min())]
        ax.axhline(
            floor, color=base.MARK, linewidth=1.0, linestyle=(0, (3, 2)), label="noise floor"
        )
        positive = before.frequency[before.frequency > 0.0]
        base.log_axis(ax, "x", positive[0], positive[-1])
        top = max(heights)
        base.log_axis(ax, "y", 0.6 * max(min(heights), 1e-5 * top), 1.6 * top)
        ax.set_xlabel("Frequency (Hz)")
        ax.set_ylabel(f"Density ({shown.error_unit}/\N{SQUARE ROOT}Hz)")
        base.legend(ax, 3)
    return figure


def dependence_figure(dependence: Dependence, kind: str) -> Figure:
    """Draw the mean residual against one quantity, for rising and for falling values."""
    shown = SHOWN[kind]
    scale = shown.error_factor
    with style():
        figure = base.blank(0.6 * base.WIDTH, 2.5)
        ax = figure.subplots()
        error = 2.0 * dependence.error * scale
        ax.fill_between(
            dependence.at, -error, error, color=base.NOISE, linewidth=0, label="95 % of noise",
            zorder=0.5, step="mid",
        )  # fmt: skip
        ax.axhline(0.0, color=base.UNSURE, linewidth=0.6, zorder=0.6)
        for values, name, colour, marker in (
            (dependence.loading, "loading", LOADING, "o"),
            (dependence.unloading, "unloading", UNLOADING, "s"),
        ):
            ax.plot(
                dependence.at, values * scale, marker, color=colour, label=name, markersize=3.2,
                linestyle="-", linewidth=1.0,
            )  # fmt: skip
        # the error of empty bins is as large as the plot and does not set its range
        seen = np.concatenate((dependence.loading, dependence.unloading)) * scale
        seen = seen[np.isfinite(seen)]
        reach = 1.25 * float(np.max(np.abs(seen))) if seen.size else 1.0
        typical = float(np.median(error))
        reach = max(reach, 2.0 * typical) or 1.0
        ax.set_ylim(-reach, reach)
        ax.set_xlabel(_labelled(dependence.quantity, dependence.unit))
        ax.set_ylabel(f"Residual ({shown.error_unit})")
        base.few_ticks(ax, x=5, y=7)
        _small_legend(ax)
    return figure


def missing_time_figure(before: MissingStress, after: MissingStress | None) -> Figure:
    """Draw the missing stress over time, before and after."""
    with style():
        figure = base.blank(1.3 * base.WIDTH, 2.2)
        ax = figure.subplots()
        for missing, name, colour in ((before, "before", BEFORE), (after, "after", AFTER)):
            if missing is not None:
                ax.plot(
                    *decimate(missing.time, missing.stress, base.COLUMNS), color=colour,
                    linewidth=0.9, label=name,
                )  # fmt: skip
        ax.axhline(0.0, color=base.UNSURE, linewidth=0.6, zorder=0.6)
        ax.set_xlim(before.time[0], before.time[-1])
        ax.set_xlabel("Time (s)")
        ax.set_ylabel("Missing stress (Pa)")
        base.few_ticks(ax, y=5)
        base.legend(ax, 2)
    return figure


def missing_figures(missing: MissingStress, kind: str) -> list[tuple[str, Figure]]:
    """Draw the missing stress against quantities; return ``(quantity, figure)`` for each."""
    quantities = [("stretch", "stretch", missing.stretch)]
    if kind == "actuator":
        quantities.append(
            ("voltage squared", _labelled("voltage squared", "kV^2"), (missing.voltage * 1e-3) ** 2)
        )
    quantities.append(("rate", "Stretch rate (1/s)", missing.rate))
    loading = missing.rate >= 0.0
    drawn = []
    for name, label, values in quantities:
        with style():
            figure = base.blank(0.6 * base.WIDTH, 2.5)
            ax = figure.subplots()
            for which, side, colour in (
                (loading, "loading", LOADING), (~loading, "unloading", UNLOADING),
            ):  # fmt: skip
                rows = np.flatnonzero(which)
                rows = rows[:: max(1, rows.size // (_POINTS // 2))]
                ax.plot(
                    values[rows], missing.stress[rows], ".", color=colour, markersize=2.4,
                    markeredgewidth=0.0, label=side, alpha=0.8,
                )  # fmt: skip
            ax.axhline(0.0, color=base.UNSURE, linewidth=0.6, zorder=0.6)
            ax.set_xlabel(label[:1].upper() + label[1:])
            ax.set_ylabel("Missing stress (Pa)")
            base.few_ticks(ax, x=4, y=6)
            _small_legend(ax, 4.0)
        drawn.append((name, figure))
    return drawn


def curve_figure(curve: Curve) -> Figure:
    """Draw the form that a general law has found."""
    with style():
        figure = base.blank(0.6 * base.WIDTH, 2.5)
        ax = figure.subplots()
        ax.plot(curve.axis, curve.values, color=AFTER, linewidth=1.4)
        ax.axhline(0.0, color=base.UNSURE, linewidth=0.6, zorder=0.6)
        ax.set_xlabel(_labelled(curve.axis_label, ""))
        ax.set_ylabel(_labelled(curve.values_label, ""))
        base.few_ticks(ax, x=5, y=6)
    return figure


def bars_figure(pairs: Sequence[tuple[Comparison, Comparison]], kind: str) -> Figure:
    """Draw the RMS error of every recording, before and after, with the noise floor of each.

    Where both are the same there is one bar.
    """
    shown = SHOWN[kind]
    rows = np.arange(len(pairs))
    sides = [("before", 0, -0.2, 0.36, BEFORE), ("after", 1, 0.2, 0.36, AFTER)]
    if all(b is a for b, a in pairs):
        sides = [("thesis model", 1, 0.0, 0.6, BEFORE)]
    errors = np.array([[c.errors.rms for c in pair] for pair in pairs]) * shown.error_factor
    floors = np.array([a.noise or 0.0 for _, a in pairs]) * shown.error_factor
    with style():
        figure = base.blank(base.WIDTH, 1.0 + 0.5 * len(pairs))
        ax = figure.subplots()
        for name, side, shift, height, colour in sides:
            ax.barh(rows + shift, errors[:, side], height=height, color=colour, label=name)
            for row, value, floor in zip(rows, errors[:, side], floors, strict=True):
                # to the right of the line of the noise floor, which would cross the number
                near = 0.0 <= floor - value < 0.12 * max(errors.max(), floor)
                ax.annotate(
                    significant(float(value)), (floor if near else value, row + shift), (4, 0),
                    textcoords="offset points", va="center", fontsize=text_size(8.5),
                )  # fmt: skip
        known = floors > 0.0
        if known.any():
            ax.vlines(
                floors[known], rows[known] - 0.42, rows[known] + 0.42, color=base.MARK,
                linewidth=1.3, linestyle=(0, (2, 1)), label="noise floor", zorder=4,
            )  # fmt: skip
        roles = {"train": "training", "validation": "validation"}
        names = [base.drawable(f"{a.name} ({roles[a.role]})", _NAME + 10) for _, a in pairs]
        ax.set_yticks(rows, names)
        ax.set_ylim(len(pairs) - 0.4, -0.6)
        ax.set_xlim(0.0, 1.15 * max(float(errors.max()), float(floors.max())))
        ax.grid(visible=False, axis="y")
        ax.set_xlabel(f"RMS error ({shown.error_unit})")
        base.legend(ax, 3)
    return figure


def _band(ax: Axes, noise: float | None, shown: Shown) -> None:
    if noise:
        floor = noise * shown.error_factor
        for edge in (-floor, floor):
            ax.axhline(edge, color=base.MARK, linewidth=0.8, linestyle=(0, (3, 2)), zorder=4)
    ax.axhline(0.0, color=base.UNSURE, linewidth=0.6, zorder=0.6)


def _inside(ax: Axes, text: str) -> None:
    """Put words above the axes at the left, clear of the curves."""
    ax.set_title(text, loc="left", fontsize=text_size(9.0), pad=2.5)


def _small_legend(ax: Axes, scale: float = 1.0) -> None:
    ax.legend(
        markerscale=scale,
        loc="lower right", bbox_to_anchor=(1.02, 1.0), ncols=3,
        fontsize=text_size(8.0), handlelength=1.0, columnspacing=0.7, handletextpad=0.35,
    )  # fmt: skip


def _labelled(quantity: str, unit: str) -> str:
    unit = unit.replace("^2", "\N{SUPERSCRIPT TWO}")
    label = f"{quantity} ({unit})" if unit else quantity
    return label[:1].upper() + label[1:]


def _broken(label: str) -> str:
    """Put the unit below the name, for a short axis."""
    return label.replace(" (", "\n(")
