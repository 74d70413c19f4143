"""Trends of the numbers of many recordings: what changes them, in all films or in one.

A study's table gives parameters with their intervals, errors, and the conditions of each run. Each
number is fitted by a mixed model with the columns as common effects and a random intercept of each
film.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri

from dearig.analysis.cores import for_simulations
from dearig.batch.film_effects import DIFFER, Explained, explain
from dearig.batch.mixed_model import Sample, fit_linear, slopes_differ
from dearig.batch.next_experiment import NextExperiment, proposals
from dearig.batch.table_file import write_csv, write_parquet
from dearig.batch.trend import ChangePoint, FilmSlope, Trend, TrendSlope
from dearig.batch.trend_columns import (
    FREEDOM_MIN,
    Covariate,
    columns_in,
    days_of_films,
    design_of,
    films_in,
)
from dearig.errors import InputError
from dearig.progress import Progress, quiet
from dearig.recording.files import system_text

__all__ = ["Trends", "find_trends", "table_of", "write_trends"]

log = logging.getLogger(__name__)

#: Errors of the model, and the peak displacement: their trends are found like those of parameters.
_ERRORS = ("rms_um", "rms_kPa", "nrmse_pct", "peak_displacement_mm")
_SIGNIFICANT = 0.05
#: Of a single interval, and of all simultaneous ones together.
_CONFIDENCE = 1.0 - _SIGNIFICANT
_QUANTILE_95 = float(ndtri(0.975))  # an interval of 95 % leaves out 2.5 % on either side


@dataclass(frozen=True)
class Trends:
    """Trends of a table: its ``rows``, their ``films``, the trend of each number, and proposals.

    ``left_out`` are sentences on columns and numbers without a trend. ``days`` (n,) are the days of
    each row since the first one of its film.
    """

    rows: tuple[Mapping[str, Any], ...]
    films: tuple[str, ...]
    failed: int
    trends: tuple[Trend, ...]
    left_out: tuple[str, ...]
    proposals: tuple[NextExperiment, ...]
    days: np.ndarray

    @property
    def intervals(self) -> int:
        """Number of simultaneous intervals: one for each effect."""
        return sum(len(trend.design.columns) for trend in self.trends)

    @property
    def confidence_of_each(self) -> float:
        """Confidence of each of the simultaneous intervals."""
        return _sidak(self.intervals)

    def effect_rows(self) -> list[dict[str, Any]]:
        """Return one row of plain values for each number and column, for a table."""
        return [
            {
                "number": trend.name,
                "column": effect.column.label,
                "per": effect.column.unit,
                "slope": effect.slope,
                "low95": effect.low,
                "high95": effect.high,
                "low95_simultaneous": effect.simultaneous[0],
                "high95_simultaneous": effect.simultaneous[1],
                "slope_unit": "percent" if trend.relative else "of the number",
                "p": effect.p,
                "p_equal_slopes": effect.p_equal,
                "verdict": effect.verdict,
                "films_of_their_own": ", ".join(own.film for own in effect.own),
                "runs": trend.rows.size,
                "films": trend.model.sample.films,
                "model": "mixed" if trend.fit.mixed else "ordinary least squares",
                "between_films": trend.spread(trend.fit.between),
                "scatter": trend.spread(trend.fit.scatter),
                "measured": trend.spread(trend.fit.measured),
            }
            for trend in self.trends
            for effect in trend.effects
        ]

    def change_rows(self) -> list[dict[str, Any]]:
        """Return one row of plain values for each change point, for a table."""
        return [
            {
                "number": trend.name,
                "film": change.film,
                "last": change.last,
                "first": change.first,
                "started": change.started,
                "jump": change.size,
                "low95": change.low,
                "high95": change.high,
                "jump_unit": "percent" if trend.relative else "of the number",
            }
            for trend in self.trends
            for change in trend.changes
        ]


def table_of(path: Path) -> Path:
    """Return the table of a study: ``path`` itself, or that in the folder ``path``."""
    if not path.is_dir():
        return path
    found = path / "study.csv"
    if not found.is_file():
        raise InputError(
            f"{path} has no study.csv: give the folder of a study, or its table",
            command=("study",),
        )
    return found


def write_trends(trends: Trends, folder: Path) -> dict[str, Path | None]:
    """Write effects and change points as tables to ``folder``; return the files by their kinds."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder} cannot be created: {system_text(error)}") from error
    effects, changes = folder / "trends.csv", folder / "changes.csv"
    write_csv(trends.effect_rows(), effects)
    write_csv(trends.change_rows(), changes)
    parquet = write_parquet(trends.effect_rows(), folder / "trends.parquet")
    return {"effects": effects, "changes": changes, "parquet": parquet}


def numbers_in(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the numbers whose trends are found: parameters with an interval, and errors."""
    names = dict.fromkeys(name for row in rows for name in row)
    return [name for name in names if f"{name}_low95" in names or name in _ERRORS]


@for_simulations()
def find_trends(
    rows: Sequence[Mapping[str, Any]],
    *,
    source: Path,
    numbers: Sequence[str] = (),
    against: Sequence[str] = (),
    progress: Progress = quiet,
) -> Trends:
    """Return the trends of the rows of a study's table from the file ``source``.

    ``numbers`` and ``against`` name columns of the table, by default all parameters and errors, and
    temperature, humidity, cycles, days, settings and rig. Parameters that the data of a recording
    do not determine are left out. Raises ``InputError`` where no number has a trend.
    """
    if not rows or "recording" not in rows[0]:
        raise InputError(f"{source} is not a table of a study: it has no rows with recordings")
    good = [row for row in rows if row.get("state", "ok") == "ok"]
    if not good:
        raise InputError(f"{source}: no recording in it has a result")
    # in the order of time: jumps are looked for in it
    good.sort(key=lambda row: (str(row.get("started") or ""), str(row["recording"])))
    names = list(numbers) or numbers_in(good)
    unknown = [n for n in numbers if not any(n in row for row in good)]
    if unknown:
        raise InputError(
            f"{source} has no column {unknown[0]!r}; its numbers are {', '.join(numbers_in(good))}"
        )
    films = films_in(good)
    columns = columns_in(good, films, against)
    found: list[Trend] = []
    reasons: list[str] = []
    for i, name in enumerate(names):
        progress("trends", i / len(names))
        trend = _trend(good, films, columns, name, reasons)
        if trend is not None:
            found.append(trend)
    progress("trends", 1.0)
    if not found:
        raise InputError(
            f"{source}: no trend can be computed. {' '.join(dict.fromkeys(reasons))}".rstrip()
        )
    each = _sidak(sum(len(trend.design.columns) for trend in found))
    found = _judged([_with_effects(trend, each) for trend in found])
    every = np.ones(len(good), dtype=bool)
    return Trends(
        tuple(good), tuple(films), len(rows) - len(good), tuple(found),
        tuple(dict.fromkeys(reasons)), proposals(design_of(columns, every), found, len(set(films))),
        days_of_films(good, films),
    )  # fmt: skip


def _trend(
    rows: Sequence[Mapping[str, Any]],
    films: Sequence[str],
    columns: Sequence[Covariate],
    name: str,
    reasons: list[str],
) -> Trend | None:
    """Return the trend of one number, without its effects.

    Where there is none, ``reasons`` receives the reason.
    """
    at = np.array([i for i, row in enumerate(rows) if _is_known(row, name)], dtype=int)
    if at.size < 2 + FREEDOM_MIN:  # intercept and one slope
        reasons.append(f"{name}: {at.size} runs have a value that their data determine.")
        return None
    used = np.zeros(len(rows), dtype=bool)
    used[at] = True
    design = design_of(columns, used)
    if not design.columns:
        reasons.extend(design.left_out)
        return None
    whole = np.all([np.isfinite(column.values[at]) for column in design.columns], axis=0)
    if not whole.all():
        reasons.append(f"{name}: {int((~whole).sum())} runs lack a value of a column.")
        at = at[whole]
        used[:] = False
        used[at] = True
        design = design_of(columns, used)
    if not design.columns or at.size < 1 + len(design.columns) + FREEDOM_MIN:
        reasons.append(f"{name}: {at.size} runs are too few for {len(design.columns)} columns.")
        return None
    reasons.extend(design.left_out)
    values, low, high = (
        np.array([float(rows[i][name] if end is None else end(rows[i], name)) for i in at])
        for end in (None, _low, _high)
    )
    if float(np.ptp(values)) <= 1e-9 * float(np.max(np.abs(values))):
        reasons.append(f"{name}: the same in all runs: it was given, not measured.")
        return None
    relative = bool((values > 0.0).all() and (low > 0.0).all())
    y, ends = (np.log(values), np.log([low, high])) if relative else (values, np.array([low, high]))
    error = (ends[1] - ends[0]) / (2.0 * _QUANTILE_95)
    _, film = np.unique([films[i] for i in at], return_inverse=True)
    x = np.column_stack([column.values[at] for column in design.columns])
    sample = Sample(y, x, film, error)
    local = tuple(replace(c, values=c.values[at]) for c in design.columns)
    design = replace(design, columns=local)
    names = tuple(films[int(at[film == f][0])] for f in range(sample.films))
    model = explain(sample, names, relative)
    return Trend(name, at, values, low, high, design, model, (), tuple(_changes(rows, at, model)))


def _is_known(row: Mapping[str, Any], name: str) -> bool:
    value = row.get(name)
    return (
        isinstance(value, int | float)
        and math.isfinite(value)
        and row.get(f"{name}_determined") is not False
    )


def _low(row: Mapping[str, Any], name: str) -> float:
    value, low = row[name], row.get(f"{name}_low95")
    # an end that is not known lies as far away as the other one
    high = row.get(f"{name}_high95")
    if low is None:
        low = value if high is None else value - (high - value)
    return float(low)


def _high(row: Mapping[str, Any], name: str) -> float:
    value, high = row[name], row.get(f"{name}_high95")
    return float(value + (value - _low(row, name)) if high is None else high)


def _sidak(intervals: int) -> float:
    """Return the confidence of each of so many ``intervals`` that hold the truth at once with 95 %.

    By Šidák (J. Am. Stat. Assoc. 62, 1967, 626): it holds for all correlations of normal errors, so
    that those between numbers, which are fitted separately, need not be known.
    """
    return float(_CONFIDENCE ** (1.0 / intervals))


def _with_effects(trend: Trend, each: float) -> Trend:
    """Return the trend with its effects; ``each`` is the confidence of a simultaneous interval."""
    columns = enumerate(trend.design.columns)
    effects = tuple(_effect(trend.model, column, i, each) for i, column in columns)
    return replace(trend, effects=effects)


def _effect(model: Explained, column: Covariate, i: int, each: float) -> TrendSlope:
    """Return the effect of ``column``, of place ``i``, and which films have another one.

    ``each`` is the confidence of its simultaneous interval.
    """
    sample, fit, in_unit = model.sample, model.fit, model.in_unit
    p_equal = slopes_differ(sample, fit.variances, i) if sample.films > 1 else None
    places = model.slopes_of(i)
    verdict = "common" if sample.films > 1 else "untold"
    if len(places) == 1:
        verdict = "one_film"
    elif places or (p_equal is not None and p_equal < DIFFER):
        # films as a sample: the interval of the mean slope has their scatter in it
        verdict, fit = "differs", fit_linear(model.without_slopes_of(i).sample, random_slope=i)
    slope, (low, high) = float(fit.slopes[i]), fit.interval(i)
    if verdict in ("common", "untold") and low <= 0.0 <= high:
        verdict = "none"
    own = tuple(_own_slope(model, i, place) for place in places)
    wide = fit.interval(i, each)
    return TrendSlope(
        column, in_unit(slope), in_unit(low), in_unit(high), (in_unit(wide[0]), in_unit(wide[1])),
        float(fit.p_values[i]), p_equal, verdict, own,
    )  # fmt: skip


def _own_slope(model: Explained, i: int, place: int) -> FilmSlope:
    """Return the slope of a film that has one of its own: the common one and its difference."""
    fit = model.fit
    at = [1 + i, 1 + place]
    slope = float(fit.slopes[i] + fit.slopes[place])
    half = fit.quantile(place) * math.sqrt(max(float(fit.covariance[np.ix_(at, at)].sum()), 0.0))
    film = model.films[model.extras[place - model.columns].film]
    in_unit = model.in_unit
    return FilmSlope(film, in_unit(slope), in_unit(slope - half), in_unit(slope + half))


def _judged(trends: Sequence[Trend]) -> list[Trend]:
    """Return the trends with doubtful effects marked: by Holm's correction over all of them."""
    every = sorted(
        (effect.p, trend.name, i)
        for trend in trends
        for i, effect in enumerate(trend.effects)
    )  # fmt: skip
    sure: set[tuple[str, int]] = set()
    for place, (p, name, i) in enumerate(every):
        if p * (len(every) - place) >= _SIGNIFICANT:
            break
        sure.add((name, i))
    return [
        replace(
            trend,
            effects=tuple(
                replace(effect, verdict="doubtful")
                if effect.verdict in ("common", "untold") and (trend.name, i) not in sure
                else effect
                for i, effect in enumerate(trend.effects)
            ),
        )
        for trend in trends
    ]


def _changes(
    rows: Sequence[Mapping[str, Any]], at: np.ndarray, model: Explained
) -> list[ChangePoint]:
    """Return the jumps of each film; ``at`` (n,) are the rows of the sample."""
    found = []
    for place, extra in enumerate(model.extras, start=model.columns):
        if extra.column is not None:
            continue
        mine = np.flatnonzero(model.sample.film == extra.film)
        before, after = int(at[mine[extra.run - 1]]), int(at[mine[extra.run]])
        low, high = model.fit.interval(place)
        size = float(model.fit.slopes[place])
        found.append(
            ChangePoint(
                model.films[extra.film], str(rows[before]["recording"]),
                str(rows[after]["recording"]), str(rows[after].get("started") or ""),
                model.in_unit(size), model.in_unit(low), model.in_unit(high), after,
            )
        )  # fmt: skip
    return sorted(found, key=lambda change: change.row)
