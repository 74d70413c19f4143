"""Figures of a fit: parameters with their intervals, and errors by number of branches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dearig.report.figures.defaults import style, text_size
from dearig.report.figures.style import (
    MARK,
    MEASURED,
    MODEL,
    THESIS,
    UNSURE,
    WIDTH,
    blank,
    drawable,
    legend,
    log_axis,
    log_ticks,
)
from dearig.report.text.numbers import symbol
from dearig.report.text.thesis import table_3
from dearig.units import SHOWN, parameter_unit

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dearig.analysis.outcomes import BranchTrial
    from dearig.model.fitting import Estimate, Identification

__all__ = [
    "branches_figure",
    "correlation_columns",
    "correlation_figure",
    "correlations",
    "parameter_columns",
    "parameters_figure",
    "starts_columns",
    "starts_figure",
]

#: Parameters up to which a matrix has numbers, and the correlation from which its cells are dark.
_NUMBERS_MAX, _DARK = 14, 0.6
#: Width in inches from which the legend of parameters has two columns.
_LEGEND_TWO = 4.0


def parameters_figure(fit: Identification) -> Figure:
    """Draw every parameter with its 95 % interval; open ends are arrows, undetermined ones grey.

    The thesis's Table 3 is drawn next to a network with as many branches.
    """
    groups = _groups(fit)
    rows = [len(g) for g in groups.values()]
    with style():
        figure = blank(WIDTH, 0.75 + 0.27 * sum(rows) + 0.62 * len(rows))
        axes = figure.subplots(len(rows), 1, squeeze=False, height_ratios=[n + 0.6 for n in rows])[
            :, 0
        ]
        for ax, (label, estimates) in zip(axes, groups.items(), strict=True):
            _intervals(ax, label, estimates, fit)
        handles: dict[str, Artist] = {}
        for ax in axes:
            for handle, name in zip(*ax.get_legend_handles_labels(), strict=True):
                handles.setdefault(name, handle)
        names = [name for name in _PARAMETER_LABELS if name in handles]
        beside = 2 if figure.get_size_inches()[0] > _LEGEND_TWO else 1
        figure.legend(
            [handles[name] for name in names], names, loc="outside upper left", ncols=beside
        )
        figure.align_ylabels(axes)
    return figure


def parameter_columns(fit: Identification) -> tuple[tuple[str, list[object]], ...]:
    """Return the data of ``parameters_figure``; NaN stands for an open end."""
    known = fit.covariance.size > 0
    published = table_3(fit.model)
    rows = []
    for e in fit.estimates:
        factor, unit = parameter_unit(e.unit)
        low, high = (e.low, e.high) if known and e.free else (math.nan, math.nan)
        ends = (low * factor if low > 0.0 else math.nan, high * factor)
        rows.append(
            (
                e.name, unit, e.value * factor,
                *(end if math.isfinite(end) else math.nan for end in ends),
                "yes" if e.determined else "no", published.get(e.name, math.nan) * factor,
            )
        )  # fmt: skip
    names = ("parameter", "unit", "value", "low95", "high95", "determined", "thesis_table_3")
    columns = zip(*rows, strict=True)
    return tuple((name, list(column)) for name, column in zip(names, columns, strict=True))


def starts_columns(fit: Identification) -> tuple[tuple[str, list[object]], ...]:
    """Return the data of ``starts_figure``."""
    return (
        ("start", list(range(1, len(fit.starts) + 1))),
        ("mean_square_over_noise", [cost for cost, _ in fit.starts]),
        ("followed_to_its_end", ["yes" if followed else "no" for _, followed in fit.starts]),
    )


def starts_figure(fit: Identification) -> Figure:
    """Draw what each start of the global search reached, sorted: a plateau is one optimum."""
    costs = np.array([cost for cost, _ in fit.starts])
    followed = np.array([end for _, end in fit.starts], dtype=bool)
    number = np.arange(1, costs.size + 1)
    with style():
        figure = blank(WIDTH, 2.1)
        ax = figure.subplots()
        ax.plot(number, costs, color=MARK, linewidth=0.8, zorder=1)
        for which, fill, label in (
            (followed, MEASURED, "followed to its end"),
            (~followed, "white", "left after its first steps"),
        ):
            if which.any():
                ax.plot(
                    number[which], costs[which], "o", color=MEASURED, markerfacecolor=fill,
                    markersize=5.0, label=label,
                )  # fmt: skip
        left, right = costs.min() / 1.6, costs.max() * 1.6
        log_axis(ax, "y", left, right)
        ax.set_xticks(number)
        ax.set_xlabel("Start, the best first")
        ax.set_ylabel("Mean square\nover noise")
        legend(ax, 2)
    return figure


def correlations(covariance: np.ndarray) -> np.ndarray:
    """Return the correlation matrix (f, f) of a ``covariance`` (f, f)."""
    sigma = np.sqrt(np.diag(covariance))
    sigma = np.where(sigma > 0.0, sigma, 1.0)  # of one at a bound: its row is 0
    return np.asarray(covariance / sigma / sigma[:, None])


def correlation_columns(
    names: Sequence[str], covariance: np.ndarray
) -> tuple[tuple[str, list[object]], ...]:
    """Return the data of ``correlation_figure``."""
    matrix = correlations(covariance)
    return (("parameter", list(names)), *((n, list(matrix[:, i])) for i, n in enumerate(names)))


def correlation_figure(names: Sequence[str], covariance: np.ndarray) -> Figure:
    """Draw the correlation of parameters ``names`` as a matrix with numbers."""
    matrix, count = correlations(covariance), len(names)
    labels = [drawable(symbol(n).replace("_", " "), 22) for n in names]
    with style():
        figure = blank(WIDTH, 2.0 + 0.26 * count)
        ax = figure.subplots()
        # cells are drawn as shapes: a page shows no pictures of points
        ax.pcolormesh(range(count), range(count), matrix, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        ax.invert_yaxis()
        ax.set_xticks(range(count), labels, rotation=45, ha="right", rotation_mode="anchor")
        ax.set_yticks(range(count), labels)
        ax.grid(visible=False)
        if count <= _NUMBERS_MAX:
            for (row, column), value in np.ndenumerate(matrix):
                colour = "white" if abs(value) > _DARK else MARK
                ax.text(
                    column, row, f"{value:.2f}", ha="center", va="center", color=colour,
                    fontsize=text_size(7.5),
                )  # fmt: skip
    return figure


def branches_figure(trials: Sequence[BranchTrial], kind: str) -> Figure:
    """Draw training error, validation error and BIC against the number of branches."""
    shown = SHOWN[kind]
    n = np.array([t.branches for t in trials])
    train = np.array([t.train_rms for t in trials]) * shown.error_factor
    validation = np.array(
        [math.nan if t.validation_rms is None else t.validation_rms for t in trials]
    )
    bic = np.array([t.bic for t in trials])
    with style():
        figure = blank(WIDTH, 4.2)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
        upper.plot(n, train, "o-", color=MEASURED, label="training", markersize=5)
        if np.isfinite(validation).any():
            upper.plot(
                n, validation * shown.error_factor, "s--", color=MODEL, label="validation",
                markersize=5,
            )  # fmt: skip
        finite = np.concatenate((train, validation * shown.error_factor))
        finite = finite[np.isfinite(finite)]
        if finite.size and finite.min() > 0.0 and finite.max() > 8.0 * finite.min():
            log_axis(upper, "y", 0.8 * finite.min(), 1.25 * finite.max())
        else:
            upper.set_ylim(bottom=0.0)
        upper.set_ylabel(f"RMS error ({shown.error_unit})")
        above = bic - np.nanmin(np.where(np.isfinite(bic), bic, np.nan))
        lower.plot(n, above, "D-", color=MARK, markersize=4.5)
        # the smallest values decide, and the first can be thousands above them
        lower.set_yscale("symlog", linthresh=10.0)
        log_ticks(lower.yaxis)
        lower.set_ylim(bottom=-2.0)
        lower.set_ylabel("BIC above\nits minimum")
        lower.set_xlabel("Number of branches")
        lower.set_xticks(n)
        for i, ax in enumerate((upper, lower)):
            for trial in trials:
                if trial.chosen:
                    ax.axvline(
                        trial.branches, color=THESIS, linewidth=7, alpha=0.25, zorder=0,
                        label="chosen" if i == 0 else None,
                    )  # fmt: skip
        legend(upper, 3)
        figure.align_ylabels([upper, lower])
    return figure


def _groups(fit: Identification) -> dict[str, list[Estimate]]:
    """Return the estimates by the label of their axis."""
    labels = {"mu": "Modulus", "J": "Locking limit", "T": "Relaxation time"}
    groups: dict[str, list[Estimate]] = {}
    for e in fit.estimates:
        what = labels.get(e.name.partition("_")[0], e.name)
        unit = parameter_unit(e.unit)[1]
        groups.setdefault(f"{what} ({unit})" if unit else what, []).append(e)
    return groups


_FITTED = "fitted, with 95 % interval"
_BARE = "fitted, no interval"
_FOLLOWS = "derived from other parameters"
_FIXED = "fixed before the fit"
_UNDETERMINED = "not determined by these data"
_TABLE_3 = "thesis, Table 3"
_PARAMETER_LABELS = (_FITTED, _BARE, _FOLLOWS, _FIXED, _UNDETERMINED, _TABLE_3)


def _intervals(ax: Axes, label: str, estimates: Sequence[Estimate], fit: Identification) -> None:
    known = fit.covariance.size > 0
    published = table_3(fit.model)
    factor = parameter_unit(estimates[0].unit)[0]
    beside = [published[e.name] for e in estimates if e.name in published]
    ends = np.array([x for e in estimates for x in (e.value, e.low, e.high)] + beside) * factor
    ends = ends[np.isfinite(ends)]
    log = not (ends < 0.0).any()
    if log:
        ends = ends[ends > 0.0] if (ends > 0.0).any() else np.array([1.0])
        left, right = ends.min() / 2.5, ends.max() * 2.5
        # at least a decade, or the axis has no label
        spare = max(0.0, 1.2 - math.log10(right / left)) / 2.0
        left, right = left * 10.0**-spare, right * 10.0**spare
    else:
        margin = 0.1 * float(np.ptp(ends)) or 1.0
        left, right = ends.min() - margin, ends.max() + margin
    for row, e in enumerate(estimates):
        colour = MEASURED if e.determined or not known else UNSURE
        value = float(np.clip(e.value * factor, left, right))
        if e.free and known:
            _interval(ax, row, e.low * factor, e.high * factor, (left, right), colour)
        if not e.free:
            marker, name = "s", _FIXED if e.is_fixed else _FOLLOWS
        elif e.determined or not known:
            marker, name = "o", _FITTED if known else _BARE
        else:
            marker, name = "o", _UNDETERMINED
        hollow = known and not e.determined
        ax.plot(
            [value], [row], marker, color=colour, markersize=5.5, label=name, linestyle="none",
            markerfacecolor="white" if hollow else colour, zorder=3,
        )  # fmt: skip
        if e.name in published:
            ax.plot(
                [published[e.name] * factor], [row + 0.27], "D", color=THESIS, markersize=3.6,
                label=_TABLE_3, linestyle="none", zorder=2.5,
            )  # fmt: skip
    if log:
        log_axis(ax, "x", left, right)
    else:
        ax.set_xlim(left, right)
    ax.set_ylim(len(estimates) - 0.4, -0.6)
    ax.set_yticks(range(len(estimates)), [drawable(symbol(e.name), 18) for e in estimates])
    ax.grid(visible=False, axis="y")
    ax.set_xlabel(drawable(label, 60), labelpad=1.5)


def _interval(
    ax: Axes, row: int, low: float, high: float, limits: tuple[float, float], colour: str
) -> None:
    """Draw an interval with a stop at each end, or an arrow at an open end."""
    left, right = limits
    ends = (left if low == 0.0 else low, right if math.isinf(high) else high)
    ax.plot(ends, [row, row], color=colour, linewidth=1.6, solid_capstyle="butt", zorder=2)
    for end, is_open, arrow in (
        (ends[0], low == 0.0, "<"),
        (ends[1], math.isinf(high), ">"),
    ):
        ax.plot(
            [end], [row], arrow if is_open else "|", color=colour, markersize=6, zorder=2.2,
            clip_on=False, linestyle="none",
        )  # fmt: skip
