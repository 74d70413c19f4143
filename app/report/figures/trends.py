"""Figures of trends: each number over each column with its band, and the life of each film."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dearig.batch.trend import Trend
from dearig.batch.trends import Trends
from dearig.report.figures.defaults import style, text_size
from dearig.report.figures.style import (
    ERROR,
    MEASURED,
    MODEL,
    UNSURE,
    WIDTH,
    blank,
    drawable,
    few_ticks,
    legend,
)
from dearig.report.text.trends import number_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["life_figure", "rows_figure", "trend_figure"]

_FILMS_MAX = 24  # in one figure
_COLUMNS = 4
_NAMED_MAX = 8  # films in a legend


def trend_figure(trend: Trend) -> Figure:
    """Draw a number over each column: films aside, the other columns at their means."""
    count = len(trend.effects)
    wide = min(count, 2)
    tall = math.ceil(count / wide)
    with style():
        figure = blank(WIDTH if wide > 1 else 0.6 * WIDTH, 2.1 * tall)
        axes = np.atleast_1d(figure.subplots(tall, wide, sharey=True)).ravel()
        for i, (ax, effect) in enumerate(zip(axes, trend.effects, strict=False)):
            seen = effect.verdict not in ("none", "doubtful")
            x, y = trend.adjusted(i)
            own = {slope.film for slope in effect.own}
            mine = np.isin(np.array(trend.model.films)[trend.model.sample.film], list(own))
            ax.plot(x[~mine], y[~mine], ".", color=MEASURED, markersize=3, alpha=0.7)
            ax.plot(x[mine], y[mine], "x", color=MODEL, markersize=4)
            curve = trend.curve(i)
            ax.fill_between(
                curve.x, curve.low, curve.high, color=MODEL if seen else UNSURE, alpha=0.25, lw=0
            )
            ax.plot(curve.x, curve.y, color=MODEL if seen else UNSURE, lw=1.2)
            unit = f" ({effect.column.unit})" if effect.column.unit else ""
            ax.set_xlabel(drawable(f"{effect.column.label}{unit}", 34))
            few_ticks(ax, x=4, y=4)
            ax.ticklabel_format(axis="y", useOffset=False)
        for ax in axes[count:]:
            ax.set_visible(False)
        for ax in axes[:count:wide]:
            ax.set_ylabel(drawable(number_name(trend.name), 24))
    return figure


def rows_figure(rows: Sequence[Mapping[str, Any]], number: str) -> Figure:
    """Draw a number of the ``rows`` of a study, with its 95 % intervals, in the order of the runs.

    Each film has its own colour; runs without the number leave a gap.
    """
    films = list(dict.fromkeys(str(row.get("film") or "") for row in rows))
    with style():
        figure = blank(1.2 * WIDTH, 2.6)
        ax = figure.subplots()
        for i, film in enumerate(films):
            mine = [
                (place, row)
                for place, row in enumerate(rows, 1)
                if str(row.get("film") or "") == film and isinstance(row.get(number), int | float)
            ]
            values = np.array([float(row[number]) for _, row in mine])
            ends = [
                [abs(v - float(v if (end := row.get(f"{number}_{side}95")) is None else end))
                 for v, (_, row) in zip(values, mine, strict=True)]
                for side in ("low", "high")
            ]  # fmt: skip
            ax.errorbar(
                [place for place, _ in mine], values, ends, fmt=".", elinewidth=0.7,
                color=f"C{i % 10}", label=drawable(film, 18) if i < _NAMED_MAX else None,
            )  # fmt: skip
        ax.set_xlabel("Recording, in the order of their starts")
        ax.set_ylabel(drawable(number_name(number), 30))
        ax.ticklabel_format(axis="y", useOffset=False)
        few_ticks(ax, y=5)
        ax.xaxis.get_major_locator().set_params(integer=True)  # type: ignore[call-arg]
        if films != [""]:
            legend(ax, 4)
    return figure


def life_figure(trends: Trends, trend: Trend) -> Figure:
    """Draw a number of each film over its days, or the order of its runs, with its jumps."""
    sample, model = trend.model.sample, trend.model
    shown = list(range(min(sample.films, _FILMS_MAX)))
    wide = min(len(shown), _COLUMNS)
    tall = math.ceil(len(shown) / wide)
    with style():
        figure = blank(WIDTH, 0.5 + 1.0 * tall)
        axes = np.atleast_1d(
            figure.subplots(tall, wide, sharey=True, sharex=True, squeeze=True)
        ).ravel()
        for ax, film in zip(axes, shown, strict=False):
            mine = np.flatnonzero(sample.film == film)
            _life(ax, trends, trend, mine)
            ax.set_title(
                drawable(model.films[film] or "no name", 14), fontsize=text_size(8.0), pad=2
            )
        for ax in axes[len(shown) :]:
            ax.set_visible(False)
        figure.supxlabel(_axis(trends, trend), fontsize=text_size(9.0))
        figure.supylabel(drawable(number_name(trend.name), 30), fontsize=text_size(9.0))
    return figure


def _life(ax: Axes, trends: Trends, trend: Trend, mine: np.ndarray) -> None:
    x = days_of(trends, trend)
    place = np.arange(1.0, mine.size + 1.0) if x is None else x[mine]
    y, low, high = (part[mine] for part in (trend.values, trend.low, trend.high))
    ax.errorbar(
        place, y, np.maximum([y - low, high - y], 0.0), fmt=".", color=MEASURED, markersize=3,
        elinewidth=0.6,
    )  # fmt: skip
    ax.plot(place, fitted(trend)[mine], color=ERROR, lw=0.9)
    rows = {change.row for change in trend.changes}
    for k, row in enumerate(trend.rows[mine]):
        if int(row) in rows and k:
            ax.axvline(0.5 * (place[k - 1] + place[k]), color=MODEL, lw=1.0, ls="--")
    few_ticks(ax, x=3, y=3)
    ax.ticklabel_format(useOffset=False)
    ax.tick_params(labelsize=text_size(7.0))


def fitted(trend: Trend) -> np.ndarray:
    """Return the number (n,) by the model, with the intercept of each film."""
    sample, fit = trend.model.sample, trend.fit
    y = fit.intercept + (sample.x - fit.centre) @ fit.slopes + fit.film_intercepts[sample.film]
    return np.asarray(trend.natural(y))


def days_of(trends: Trends, trend: Trend) -> np.ndarray | None:
    """Return the days (n,) of the runs of a trend from each film's first; None if not known."""
    days = trends.days[trend.rows]
    return days if np.isfinite(days).all() else None


def _axis(trends: Trends, trend: Trend) -> str:
    return "run of the film" if days_of(trends, trend) is None else "day of the film"
