"""Figures of one residual: histogram, quantiles, correlations and spectrum."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.decimate import decimate
from dearig.analysis.residual import (
    autocorrelation,
    cross_correlation,
    even,
    quantiles,
    spectrum,
)
from dearig.report.figures.defaults import style
from dearig.report.figures.style import (
    COLUMNS,
    MEASURED,
    MODEL,
    NOISE,
    UNSURE,
    WIDTH,
    blank,
    decimated_log,
    few_ticks,
    legend,
    log_axis,
)
from dearig.report.text.numbers import significant
from dearig.units import SHOWN

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dearig.analysis.outcomes import Comparison

__all__ = ["bin_text", "residual_figure", "residual_panels"]


def residual_figure(comparison: Comparison) -> Figure:
    """Draw histogram, autocorrelation and spectrum of the residual in one row."""
    with style():
        figure = blank(1.6 * WIDTH, 2.7)
        for ax, draw in zip(figure.subplots(1, 3), _RESIDUAL_PANELS, strict=True):
            draw(ax, comparison)
    return figure


def residual_panels(comparison: Comparison) -> tuple[tuple[Figure, str], ...]:
    """Draw every panel as a figure of its own, with its caption."""
    figures = []
    with style():
        for draw, caption in (
            (_histogram, f"Histogram of the error{bin_text(comparison)}, and that of noise alone."),
            (_correlation, "Autocorrelation of the error; that of noise lies in the grey band."),
            (_spectrum, "Amplitude density of the error; that of white noise is flat."),
            (_quantiles, "Quantiles of the error against those of a normal distribution (Q-Q)."),
            (
                _cross_correlation,
                "Correlation of the error with the drive: the response that the model lacks.",
            ),
        ):
            figure = blank(0.6 * WIDTH, 2.5)
            draw(figure.subplots(), comparison)
            figures.append((figure, caption))
    return tuple(figures)


def _histogram(ax: Axes, comparison: Comparison) -> None:
    shown = SHOWN[comparison.kind]
    residual = _residual(comparison) * shown.error_factor
    noise = None if comparison.noise is None else comparison.noise * shown.error_factor
    edges = _edges(residual, noise or 0.0, comparison.step * shown.error_factor)
    counts, _ = np.histogram(residual, edges)
    width = edges[1] - edges[0]
    ax.bar(
        edges[:-1], counts / (residual.size * width), width, align="edge", color=MEASURED,
        label="residual",
    )  # fmt: skip
    if noise:
        x = np.linspace(edges[0], edges[-1], 201)
        bell = np.exp(-0.5 * (x / noise) ** 2) / (noise * math.sqrt(2.0 * math.pi))
        ax.plot(x, bell, color=MODEL, linewidth=1.4, label="noise")
        # the curve of noise far below the residual is narrow and high; cut, it leaves bars visible
        tallest = float(counts.max()) / (residual.size * width)
        ax.set_ylim(0.0, 1.08 * max(tallest, min(float(bell.max()), 2.0 * tallest)))
    ax.set_xlim(edges[0], edges[-1])
    ax.set_xlabel(shown.error_label)
    ax.set_ylabel(f"Density (1/{shown.error_unit})")
    few_ticks(ax, x=4, y=4)
    legend(ax)


def _edges(residual: np.ndarray, noise: float, step: float) -> np.ndarray:
    """Return the edges of the bins of a histogram.

    A bin is a whole number of converter steps wide: otherwise some would hold one step more than
    others, and the histogram of plain noise would have teeth. Its edges are between two steps.
    """
    # a few outliers must not squeeze everything else into one bar
    centre = float(np.median(residual))
    reach = min(4.5 * float(np.std(residual)), 1.1 * float(np.max(np.abs(residual - centre))))
    reach = max(reach, 4.0 * noise, step) or 1.0
    bins = int(np.clip(math.sqrt(residual.size), 12, 60))
    if step <= 0.0:
        return np.linspace(centre - reach, centre + reach, bins + 1)
    steps = max(round(2.0 * reach / bins / step), 1)
    first, last = (math.floor((centre + side * reach) / (steps * step)) for side in (-1.0, 1.0))
    return (np.arange(first, last + 2) * steps - steps // 2 - 0.5) * step


def bin_text(comparison: Comparison) -> str:
    """Return how wide the bins of the histogram are, in converter steps where these are known."""
    if comparison.step <= 0.0:
        return ""
    shown = SHOWN[comparison.kind]
    step = comparison.step * shown.error_factor
    noise = (comparison.noise or 0.0) * shown.error_factor
    edges = _edges(_residual(comparison) * shown.error_factor, noise, step)
    steps = round((edges[1] - edges[0]) / step)
    many = "a converter step" if steps == 1 else f"{steps} converter steps"
    return f" in bins of {many} ({significant(steps * step)} {shown.error_unit})"


def _correlation(ax: Axes, comparison: Comparison) -> None:
    step, residual = even(comparison.time, _residual(comparison))
    lag, correlation = autocorrelation(step, residual)
    chance = 2.0 / math.sqrt(residual.size)
    ax.axhspan(-chance, chance, color=NOISE, linewidth=0, zorder=0.5, label="95 % of noise")
    ax.axhline(0.0, color=UNSURE, linewidth=0.6, zorder=0.6)
    ax.plot(*decimated_log(lag, correlation), color=MEASURED, linewidth=1.1)
    log_axis(ax, "x", lag[0], lag[-1])
    ax.set_ylim(min(-0.25, 1.1 * float(correlation.min())), 1.05)
    ax.set_yticks([-0.5, 0.0, 0.5, 1.0] if correlation.min() < -0.4 else [0.0, 0.5, 1.0])
    ax.set_xlabel("Lag (s)")
    ax.set_ylabel("Autocorrelation")
    legend(ax)


def _quantiles(ax: Axes, comparison: Comparison) -> None:
    shown = SHOWN[comparison.kind]
    normal, own = quantiles(_residual(comparison) * shown.error_factor)
    ax.plot(normal, own, ".", color=MEASURED, markersize=3, label="residual")
    if comparison.noise:
        noise = comparison.noise * shown.error_factor
        ends = normal[[0, -1]]
        ax.plot(ends, noise * ends, color=MODEL, linewidth=1.4, label="noise")
    ax.set_xlabel("Normal quantile (standard deviations)")
    ax.set_ylabel(shown.error_label)
    few_ticks(ax, x=5, y=5)
    legend(ax)


def _cross_correlation(ax: Axes, comparison: Comparison) -> None:
    step, residual = even(comparison.time, _residual(comparison))
    _, drive = even(comparison.time, comparison.drive)
    lag, correlation = cross_correlation(step, drive, residual)
    chance = 2.0 / math.sqrt(residual.size)
    ax.axhspan(-chance, chance, color=NOISE, linewidth=0, zorder=0.5, label="95 % of white noise")
    ax.axhline(0.0, color=UNSURE, linewidth=0.6, zorder=0.6)
    ax.plot(*decimate(lag, correlation, COLUMNS // 2), color=MEASURED, linewidth=1.1)
    reach = max(0.1, 1.15 * float(np.max(np.abs(correlation))))
    ax.set_ylim(-reach, reach)
    ax.set_xlim(lag[0], lag[-1])
    ax.set_xlabel("Lag behind the drive (s)")
    ax.set_ylabel("Correlation with the drive")
    few_ticks(ax, x=5, y=5)
    legend(ax)


def _spectrum(ax: Axes, comparison: Comparison) -> None:
    shown = SHOWN[comparison.kind]
    step, residual = even(comparison.time, _residual(comparison) * shown.error_factor)
    frequency, density = spectrum(step, residual)
    ax.plot(*decimated_log(frequency, density), color=MEASURED, linewidth=1.1)
    if comparison.noise:
        level = comparison.noise * shown.error_factor * math.sqrt(2.0 * step)
        ax.axhline(level, color=MODEL, linewidth=1.4, label="white noise")
        legend(ax)
    log_axis(ax, "x", frequency[0], frequency[-1])
    highest = float(density.max())
    if highest > 0.0:
        log_axis(ax, "y", 0.7 * max(float(density.min()), 1e-5 * highest), 1.4 * highest)
    ax.set_xlabel("Frequency (Hz)")
    ax.set_ylabel(f"Density ({shown.error_unit}/\N{SQUARE ROOT}Hz)")


_RESIDUAL_PANELS: tuple[Callable[[Axes, Comparison], None], ...] = (
    _histogram,
    _correlation,
    _spectrum,
)


def _residual(comparison: Comparison) -> np.ndarray:
    residual = comparison.measured - comparison.model
    return np.where(np.isfinite(residual), residual, 0.0)
