"""What the next experiment should vary, by what the columns of a table leave open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dearig.batch.trend import Trend
from dearig.batch.trend_columns import Design

__all__ = ["NextExperiment", "proposals"]

#: Films from which their scatter is known within a factor of two, with a probability of 91 %: the
#: chi-square with 4 degrees of freedom is between 4/2^2 and 4 2^2.
_FILMS_MIN = 5


@dataclass(frozen=True)
class NextExperiment:
    """What to vary: ``kind`` is vary, separate, record, films, repeat or narrow; and why.

    ``number`` is the column of the table that the sentence names, "" where it names none.
    """

    kind: str
    columns: tuple[str, ...]
    sentence: str
    number: str = ""


def proposals(design: Design, trends: Sequence[Trend], films: int) -> tuple[NextExperiment, ...]:
    """Return what to vary next, the most useful first.

    First what shows no effect because it was not varied or not recorded, then what cannot be told
    apart, then films that are few or differ, and last the effect that is known least.
    """
    found = [
        NextExperiment(
            "record", (label,), f"Record the {label}: fewer than half of the runs have it."
        )
        for label in design.missing
    ]
    for sentence in design.left_out:
        label, _, why = sentence.partition(": ")
        if label not in design.missing:
            kind = "vary" if label in design.constant else "separate"
            found.append(NextExperiment(kind, (label,), f"{kind.capitalize()} the {label}: {why}"))
    for column in design.columns:
        low, high = column.range
        if high - low < column.least_range:
            found.append(
                NextExperiment(
                    "vary",
                    (column.label,),
                    f"Vary the {column.label} by {column.least_range:g} {column.unit} and more: it "
                    f"was within {low:.4g} and {high:.4g} {column.unit}.",
                )
            )
    for a, b, r in design.entangled:
        wider = 1.0 / math.sqrt(max(1.0 - r * r, 1e-6))
        found.append(
            NextExperiment(
                "separate",
                (a, b),
                f"Vary {a} and {b} independently of each other: their correlation is {r:.2f}, so "
                f"that the interval of each is {wider:.1f} times as wide as without it.",
            )
        )
    if films < _FILMS_MIN:
        found.append(
            NextExperiment(
                "films",
                ("film",),
                f"Measure more films: with {films}, the scatter between films is poorly known; "
                f"{_FILMS_MIN} or more tell a common effect from one film's own.",
            )
        )
    for trend in trends:
        for effect in trend.effects:
            if effect.verdict == "one_film":
                film = effect.own[0].film
                found.append(
                    NextExperiment(
                        "repeat",
                        (effect.column.label,),
                        f"Repeat film {film} over its range of {effect.column.label}: its "
                        f"{trend.name} changes by another slope than that of the other films.",
                        trend.name,
                    )
                )
    return (*found, *_least_known(trends))


def _least_known(trends: Sequence[Trend]) -> list[NextExperiment]:
    """Return the effect that is seen on its own only, whose interval is widest for its size."""
    wide = [
        (0.5 * (effect.high - effect.low) / abs(effect.slope), trend.name, effect.column)
        for trend in trends
        for effect in trend.effects
        if effect.verdict in ("common", "untold", "doubtful")
        and effect.simultaneous[0] <= 0.0 <= effect.simultaneous[1]
    ]
    if not wide:
        return []
    part, name, column = max(wide, key=lambda each: each[0])
    low, high = column.range
    return [
        NextExperiment(
            "narrow",
            (column.label,),
            f"Repeat runs at both ends of {column.label} ({low:.4g} and {high:.4g} "
            f"{column.unit}".rstrip()
            + f"): its effect on {name} is known within {100.0 * part:.0f} % only.",
            name,
        )
    ]
