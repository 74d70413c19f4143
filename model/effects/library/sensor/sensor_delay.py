"""Pure delay of the sensor: the reading is the position some time ago.

A digital controller with a pipeline delays without rounding: a first-order lag with the same mean
age has rounded corners. The memory holds position and velocity at 48 times of the delay; between
these, and between samples, the motion is the cubic through both, so the delay need not be a whole
number of samples.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import moved_along

__all__ = ["EFFECT", "sense"]

_PARTS = 48
_KEPT = _PARTS + 2
_SHORTEST = 1e-9  # s: parts that are shorter are never looked back upon

EFFECT = Effect(
    name="sensor delay",
    family="sensor_lag",
    acts_on="sensor",
    summary="the reading is late by a fixed time and not rounded",
    law=Law(
        equations=("r(t) = x(t - D)",),
        symbols=("D",),
        source="a dead time",
    ),
    parameters=(Parameter("delay", "s", (0.0, 1.0), "of the reading", 5e-3, 0.0),),
    # position, rate and time at the reading before, and what was shown; then positions and rates
    # at the ends of the parts
    memory=4 + 2 * _KEPT,
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    if dt > 0.0:
        x0, u0, time = m[j], m[j + 1], m[j + 2]
        part = c[k] / _PARTS
        if part > _SHORTEST:
            first, last = math.floor(time / part) + 1, math.floor((time + dt) / part)
            for n in range(max(first, last - _KEPT + 1), last + 1):
                at = j + 4 + n % _KEPT
                m[at], m[at + _KEPT] = moved_along(x0, u0, x, u, dt, n * part - time)
        if c[k] <= dt:
            m[j + 3], _ = moved_along(x0, u0, x, u, dt, dt - c[k])
        else:
            back = (time + dt - c[k]) / part
            n = math.floor(back)
            a, b = j + 4 + n % _KEPT, j + 4 + (n + 1) % _KEPT
            m[j + 3], _ = moved_along(
                m[a], m[a + _KEPT], m[b], m[b + _KEPT], part, (back - n) * part
            )
        m[j + 2] = time + dt
    m[j], m[j + 1] = x, u
    return m[j + 3]
