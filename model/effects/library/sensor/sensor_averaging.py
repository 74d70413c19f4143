"""Undeclared moving average of the sensor over a time window.

The mean over the last w s is a difference of two values of the reading's integral. The memory
holds the integral and the position at 24 times of the window; between these the integral is the
cubic that agrees with both. From reading to reading it is exact for the cubic through positions and
rates.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import along_cubic

__all__ = ["EFFECT", "sense"]

_PARTS = 24
_KEPT = _PARTS + 2
_SHORTEST = 1e-9  # s: parts that are shorter are never looked back upon

EFFECT = Effect(
    name="sensor averaging",
    family="sensor_lag",
    acts_on="sensor",
    summary="the reading is a mean over a time window: late, and rounded at corners",
    law=Law(
        equations=(r"r(t) = \frac{1}{w} \int_{t - w}^{t} x(t')\,\mathrm{d}t'",),
        symbols=("w",),
        source="a moving average",
    ),
    parameters=(Parameter("window", "s", (0.0, 2.0), "of the mean", 1e-2, 0.0),),
    # position, rate, integral and time at the reading before, and what was shown; then integrals
    # and positions at the ends of the parts
    memory=5 + 2 * _KEPT,
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    window = c[k]
    if dt > 0.0:
        x0, u0, sum0, time = m[j], m[j + 1], m[j + 2], m[j + 3]
        part = window / _PARTS
        if part > _SHORTEST:
            first, last = math.floor(time / part) + 1, math.floor((time + dt) / part)
            for n in range(max(first, last - _KEPT + 1), last + 1):
                at = j + 5 + n % _KEPT
                so_far, there = along_cubic(x0, u0, x, u, dt, n * part - time)
                m[at], m[at + _KEPT] = sum0 + so_far, there
        total, _ = along_cubic(x0, u0, x, u, dt, dt)
        if window <= dt:
            before, _ = along_cubic(x0, u0, x, u, dt, dt - window)
        else:
            back = (time + dt - window) / part
            n = math.floor(back)
            a, b = j + 5 + n % _KEPT, j + 5 + (n + 1) % _KEPT
            # the integral's own slope is the position
            _, before = along_cubic(m[a], m[a + _KEPT], m[b], m[b + _KEPT], part, (back - n) * part)
            before -= sum0
        m[j + 2], m[j + 3], m[j + 4] = sum0 + total, time + dt, (total - before) / window
    m[j], m[j + 1] = x, u
    return m[j + 4]
