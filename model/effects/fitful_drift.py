"""Drift of the sensor's zero that goes up and down again and again: of a longer record.

As ``wandering_drift``, by a polynomial of the thirteenth degree: what wanders so fast that nine
numbers follow it for half a minute asks for as many more as the record is longer. It plays nearly
anything slow, and is sought only where nine have led and have left something.
"""

from __future__ import annotations

from functools import partial

from model.effects.description import Effect, Parameter
from model.effects.restless_drift import EFFECT as RESTLESS
from model.effects.wandering_drift import WALK, walked, ways
from model.jit import jit

__all__ = ["EFFECT", "sense"]

_MORE = ("decic", "undecic", "duodecic", "tredecic")

EFFECT = Effect(
    name="fitful drift",
    family="drift",
    acts_on="sensor",
    words="the reading goes up and down again and again, whatever the film does",
    parameters=(
        *RESTLESS.parameters,
        *(
            Parameter(name, "m", WALK, f"half of its part with {turns} turns", 3e-6, 0.0)
            for name, turns in zip(_MORE, ("nine", "ten", "eleven", "twelve"), strict=True)
        ),
    ),
    recurs=False,
    refines=RESTLESS.name,
    ways=partial(ways, terms=13),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + walked(c, k, 13, t)
