"""Drift of the sensor's zero that wanders: a mount or a room that warms and cools.

A smooth walk over a record of half a minute is little more than a cubic in time: the reading is
moved by a s + b s^2 + c s^3, s = t/30 s.
"""

from __future__ import annotations

from model.effects.description import Effect, Parameter
from model.jit import jit

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="wandering drift",
    family="drift",
    acts_on="sensor",
    words="the reading wanders with time, whatever the film does",
    parameters=(
        Parameter("linear", "m", (-1e-2, 1e-2), "in 30 s", 3e-6, 0.0),
        Parameter("quadratic", "m", (-1e-2, 1e-2), "in 30 s", 3e-6, 0.0),
        Parameter("cubic", "m", (-1e-2, 1e-2), "in 30 s", 3e-6, 0.0),
    ),
)

_SPAN = 30.0  # s


@jit
def sense(c, k, m, j, t, dt, x, u):
    s = t / _SPAN
    return x + s * (c[k] + s * (c[k + 1] + s * c[k + 2]))
