"""Trends of many recordings as sentences, tables and JSON."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dearig.batch.trend import VERDICTS, ChangePoint, Trend, TrendSlope
from dearig.batch.trends import Trends
from dearig.report.text.numbers import interval, quoted, significant, symbol
from dearig.report.text.tables import Row, Table
from dearig.units import name_and_unit

__all__ = [
    "change_table",
    "effect_table",
    "number_name",
    "own_table",
    "proposal_texts",
    "trend_title",
    "trends_json",
    "trends_texts",
]

_PROPOSALS = 6  # that are shown; all are in the JSON
_AT_ONCE = "All at once, 95\N{NO-BREAK SPACE}%"  # head of a column


def trends_json(trends: Trends, source: Path, written: dict[str, Path | None]) -> dict[str, Any]:
    """Return the trends for ``--json``; ``written`` are the files by their kinds."""
    return {
        "format": "dearig-trends/1",
        "source": str(source),
        "recordings": len(trends.rows),
        "without_result": trends.failed,
        "films": len(set(trends.films)),
        "files": {k: None if path is None else str(path) for k, path in written.items()},
        "left_out": list(trends.left_out),
        "simultaneous": {
            "method": "Šidák",
            "confidence": 0.95,
            "intervals": trends.intervals,
            "confidence_of_each": trends.confidence_of_each,
        },
        "numbers": [_trend_json(trend) for trend in trends.trends],
        "next": [
            {"kind": p.kind, "columns": list(p.columns), "sentence": p.sentence}
            for p in trends.proposals
        ],
    }


def _trend_json(trend: Trend) -> dict[str, Any]:
    return {
        "name": trend.name,
        "runs": int(trend.rows.size),
        "films": trend.model.sample.films,
        "model": "mixed" if trend.fit.mixed else "ordinary_least_squares",
        "why_not_mixed": trend.fit.why or None,
        "unit": "percent" if trend.relative else "of the number",
        "value_at_means": trend.at_means,
        "between_films": trend.spread(trend.fit.between),
        "scatter": trend.spread(trend.fit.scatter),
        "measured": trend.spread(trend.fit.measured),
        "effects": [
            {
                "column": effect.column.label,
                "per": effect.column.unit,
                "slope": effect.slope,
                "ci95": [effect.low, effect.high],
                "ci95_simultaneous": list(effect.simultaneous),
                "p": effect.p,
                "p_equal_slopes": effect.p_equal,
                "verdict": effect.verdict,
                "films": [
                    {"film": own.film, "slope": own.slope, "ci95": [own.low, own.high]}
                    for own in effect.own
                ],
            }
            for effect in trend.effects
        ],
        "change_points": [
            {
                "film": change.film,
                "last": change.last,
                "first": change.first,
                "started": change.started,
                "size": change.size,
                "ci95": [change.low, change.high],
            }
            for change in trend.changes
        ],
    }


def trends_texts(trends: Trends) -> Iterator[str]:
    """Yield what the trends say together, the common effects first."""
    films = len(set(trends.films))
    count = len(trends.rows)
    failed = f"; {trends.failed} more have no result" if trends.failed else ""
    yield f"{count} recordings of {films} film{'' if films == 1 else 's'}{failed}."
    yield from _models(trends)
    yield from _at_once(trends)
    every = [(trend, effect) for trend in trends.trends for effect in trend.effects]
    for verdict in ("common", "untold", "differs", "one_film"):
        for trend, effect in every:
            if effect.verdict == verdict:
                yield _effect_text(trend, effect)
    if not any(effect.verdict in ("common", "untold") for _, effect in every):
        yield "No effect is seen in all films."
    for trend in trends.trends:
        for change in trend.changes:
            yield _change_text(trend, change)


def _models(trends: Trends) -> Iterator[str]:
    whys = dict.fromkeys(t.fit.why for t in trends.trends if not t.fit.mixed)
    if any(t.fit.mixed for t in trends.trends):
        yield (
            "Each number is fitted by a linear mixed model with a random intercept of each film. "
            "A run has the weight of its own error and of the scatter beyond it."
        )
    for why in whys:
        names = [
            number_name(t.name, unit=False)
            for t in trends.trends
            if not t.fit.mixed and t.fit.why == why
        ]
        those = ", ".join(names) if len(names) < len(trends.trends) else "The numbers"
        yield (
            f"{those}: ordinary least squares in place of a mixed model, because {why}; the "
            f"intervals have no scatter between films in them."
        )


def _at_once(trends: Trends) -> Iterator[str]:
    if trends.intervals > 1:
        yield (
            f"A single 95 % interval of an effect misses the true slope in 1 of 20 studies. The "
            f"{trends.intervals} intervals under “{_AT_ONCE}” hold all true slopes at once in 95 % "
            f"of studies (Šidák; each one alone in "
            f"{significant(100.0 * trends.confidence_of_each, 4)} %)."
        )


def _effect_text(trend: Trend, effect: TrendSlope) -> str:
    per = _per(effect)
    low, high = sorted((effect.low, effect.high))
    size = f"{_signed(effect.slope, effect)} {_unit(trend)} {per} (95 %: {interval_of(low, high)})"
    name = f"{number_name(trend.name, unit=False)} over {effect.column.label}"
    if effect.verdict == "common":
        return f"{name}: {size}, common to all films."
    if effect.verdict == "untold":
        return f"{name}: {size}; with one film it is not known whether it is common."
    own = "; ".join(
        f"{slope.film} has {significant(slope.slope, 3)} {_unit(trend)} {per} "
        f"({interval_of(*sorted((slope.low, slope.high)))})"
        for slope in effect.own
    )
    if effect.verdict == "one_film":
        return f"{name}: one film has an effect of its own: {own}; the others have {size}."
    detail = f": {own}" if own else ""
    return f"{name}: films differ{detail}; their mean is {size}."


def _change_text(trend: Trend, change: ChangePoint) -> str:
    when = f" ({change.started[:16].replace('T', ' ')})" if change.started else ""
    return (
        f"Film {change.film or 'without a name'}: {number_name(trend.name, unit=False)} jumps by "
        f"{quoted(change.size, change.low, change.high)} {_unit(trend)} "
        f"({interval_of(change.low, change.high)}) between {change.last} and {change.first}{when}."
    )


def interval_of(low: float, high: float) -> str:
    """Return an interval whose ends may be 0 or negative."""
    if low > 0.0 or high < 0.0:
        return interval(low, high)
    return f"{significant(low, 2)} to {significant(high, 2)}"


def _signed(value: float, effect: TrendSlope) -> str:
    text = quoted(value, *sorted((effect.low, effect.high)))
    return text if value < 0.0 else f"+{text}"


def _unit(trend: Trend) -> str:
    return "%" if trend.relative else name_and_unit(trend.name)[1]


def number_name(column: str, unit: bool = True) -> str:
    """Return the name of a number for a person, with its unit in brackets: mu_0_kPa, rms_um."""
    name, of = name_and_unit(column)
    key = name.replace(" ", "_")
    # mu_0, T_1, ... have symbols
    shown = symbol(key) if symbol(key) != key else {"rms": "RMS", "nrmse": "NRMSE"}.get(name, name)
    return f"{shown} ({of})" if of and unit else shown


def _per(effect: TrendSlope) -> str:
    return f"per {effect.column.unit}" if effect.column.unit else "per unit"


def trend_title(trend: Trend) -> str:
    """Return number, runs and scatters of a trend in a line."""
    fit, unit = trend.fit, _unit(trend)
    parts = [f"{trend.rows.size} runs", f"{trend.model.sample.films} films"]
    if fit.mixed:
        parts.append(f"films differ by {significant(trend.spread(fit.between), 2)} {unit}")
    parts.append(f"runs scatter by {significant(trend.spread(fit.scatter), 2)} {unit}")
    if fit.measured > 0.0:
        parts.append(f"a fit is known within {significant(trend.spread(fit.measured), 2)} {unit}")
    return f"{number_name(trend.name, unit=False)}: {', '.join(parts)} (standard deviations)"


def effect_table(trends: Trends) -> Table:
    """Return the effect of each column on each number."""
    rows = [
        Row(
            (
                f"{number_name(trend.name, unit=False)}, {effect.column.label}",
                f"{_signed(effect.slope, effect)} {_unit(trend)} {_per(effect)}",
                interval_of(*sorted((effect.low, effect.high))),
                interval_of(*sorted(effect.simultaneous)),
                VERDICTS[effect.verdict],
            ),
            muted=effect.verdict in ("none", "doubtful"),
            mark=effect.verdict in ("one_film", "differs"),
        )
        for trend in trends.trends
        for effect in trend.effects
    ]
    head = (("", ""), ("Slope", ""), ("95 % interval", ""), (_AT_ONCE, ""), ("Films", ""))
    return Table("Effects", head, tuple(rows), " ".join(map(_left_out, trends.left_out)))


def own_table(trends: Trends) -> Table | None:
    """Return the slopes of single films; None where there are none."""
    rows = [
        Row(
            (
                f"{own.film}: {number_name(trend.name, unit=False)} over {effect.column.label}",
                significant(own.slope, 3),
                interval_of(*sorted((own.low, own.high))),
                f"{_unit(trend)} {_per(effect)}",
            )
        )
        for trend in trends.trends
        for effect in trend.effects
        for own in effect.own
    ]
    head = (("", ""), ("Slope", ""), ("95 % interval", ""), ("Unit", ""))
    return Table("Films with an effect of their own", head, tuple(rows)) if rows else None


def change_table(trends: Trends) -> Table | None:
    """Return the change points; None where there are none."""
    rows = [
        Row(
            (
                f"{change.film}: {number_name(trend.name, unit=False)}",
                quoted(change.size, change.low, change.high),
                interval_of(change.low, change.high),
                _unit(trend),
                change.last,
                change.first,
                change.started[:16].replace("T", " "),
            )
        )
        for trend in trends.trends
        for change in trend.changes
    ]
    head = (
        ("", ""), ("Jump", ""), ("95 % interval", ""), ("Unit", ""), ("Last before", ""),
        ("First after", ""), ("Started", ""),
    )  # fmt: skip
    return Table("Change points", head, tuple(rows)) if rows else None


def proposal_texts(trends: Trends) -> tuple[str, ...]:
    """Return what the next experiment should vary, the most useful first."""
    found = tuple(
        p.sentence.replace(p.number, number_name(p.number, unit=False)) if p.number else p.sentence
        for p in trends.proposals[:_PROPOSALS]
    )
    return found or (
        "Nothing stands out: all columns were varied, and can be told apart. More runs narrow all "
        "intervals.",
    )


def _left_out(sentence: str) -> str:
    """Return a sentence on a number or a column, which begins with its name."""
    name, colon, why = sentence.partition(": ")
    return f"{number_name(name, unit=False)}{colon}{why}"
