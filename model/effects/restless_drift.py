"""Drift of the sensor's zero that wanders up and down in a record: air that moves about a mount.

As ``wandering_drift``, by a polynomial of the ninth degree, which follows two turns there and back
in half a minute. So many numbers play much that is slow: they are sought only where fewer have led.
"""

from __future__ import annotations

from functools import partial

from model.effects.description import Effect, Parameter
from model.effects.wandering_drift import EFFECT as WANDERING
from model.effects.wandering_drift import WALK, walked, ways
from model.jit import jit

__all__ = ["EFFECT", "sense"]

_MORE = ("sextic", "septic", "octic", "nonic")

EFFECT = Effect(
    name="restless drift",
    family="drift",
    acts_on="sensor",
    words="the reading wanders up and down within the record, whatever the film does",
    parameters=(
        *WANDERING.parameters,
        *(
            Parameter(name, "m", WALK, f"half of its part with {turns} turns", 3e-6, 0.0)
            for name, turns in zip(_MORE, ("five", "six", "seven", "eight"), strict=True)
        ),
    ),
    recurs=False,
    refines=WANDERING.name,
    ways=partial(ways, terms=9),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + walked(c, k, 9, t)
