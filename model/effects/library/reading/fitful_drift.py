"""Drift of the sensor's zero that goes up and down many times, in a longer record.

As ``wandering_drift``, with Chebyshev polynomials to the thirteenth degree. It imitates nearly
anything slow: a diagnosis tries it only in place of a restless drift that leads and leaves more
than noise.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.library.reading.restless_drift import EFFECT as RESTLESS
from dearig.model.effects.library.reading.wandering_drift import drifted, finer

__all__ = ["EFFECT", "sense"]

EFFECT = finer(
    RESTLESS,
    "fitful drift",
    "the reading drifts up and down many times, whatever the film does",
    {"decic": "tenth", "undecic": "eleventh", "duodecic": "twelfth", "tredecic": "thirteenth"},
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + drifted(c, k, 13, t)
