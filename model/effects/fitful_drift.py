"""Drift of the sensor's zero that goes up and down again and again: of a longer record.

As ``wandering_drift``, by a polynomial of the thirteenth degree: what wanders so fast that nine
numbers follow it for half a minute asks for as many more as the record is longer. It plays nearly
anything slow, and is sought only where nine have led and have left something.
"""

from __future__ import annotations

from dearig.model.effects.restless_drift import EFFECT as RESTLESS
from dearig.model.effects.wandering_drift import finer, walked
from dearig.model.jit import jit

__all__ = ["EFFECT", "sense"]

EFFECT = finer(
    RESTLESS,
    "fitful drift",
    "the reading goes up and down again and again, whatever the film does",
    {"decic": "nine", "undecic": "ten", "duodecic": "eleven", "tredecic": "twelve"},
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + walked(c, k, 13, t)
