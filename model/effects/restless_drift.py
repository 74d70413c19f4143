"""Drift of the sensor's zero that wanders up and down in a record: air that moves about a mount.

As ``wandering_drift``, by a polynomial of the ninth degree, which follows two turns there and back
in half a minute. So many numbers play much that is slow: they are sought only where fewer have led.
"""

from __future__ import annotations

from dearig.model.effects.wandering_drift import EFFECT as WANDERING
from dearig.model.effects.wandering_drift import finer, walked
from dearig.model.jit import jit

__all__ = ["EFFECT", "sense"]

EFFECT = finer(
    WANDERING,
    "restless drift",
    "the reading wanders up and down within the record, whatever the film does",
    {"sextic": "five", "septic": "six", "octic": "seven", "nonic": "eight"},
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + walked(c, k, 9, t)
