"""Drift of the sensor's zero that goes up and down within a record: moving air at a mount.

As ``wandering_drift``, with Chebyshev polynomials to the ninth degree, enough for two swings in
half a minute. So many amplitudes imitate much that is slow: a diagnosis tries this one only in
place of a wandering drift that leads and leaves more than noise.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.library.reading.wandering_drift import EFFECT as WANDERING
from dearig.model.effects.library.reading.wandering_drift import drifted, finer

__all__ = ["EFFECT", "sense"]

EFFECT = finer(
    WANDERING,
    "restless drift",
    "the reading drifts up and down several times, whatever the film does",
    {"sextic": "sixth", "septic": "seventh", "octic": "eighth", "nonic": "ninth"},
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + drifted(c, k, 9, t)
