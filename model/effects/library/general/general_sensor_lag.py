"""A sensor with any response to an impulse: the general law of its lag.

The reading is a weighted mean of earlier positions. The weight of an age is a staircase: w_i over
ages between two edges a_(i-1) and a_i, each twice as far as the one before, all later by a delay;
what the weights leave of 1 is read at once. A delay, a moving average, lags in series and filters
that do not overshoot have such a response. The mean over a step is a difference of two values of
the position's integral. The memory holds the integral and the position at 64 times of the longest
age; between these the integral is the cubic that agrees with both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.shared.filters import along_cubic

__all__ = ["EFFECT", "sense"]

_STEPS = 6
_REACH = 2.0 ** (_STEPS - 1)  # of the last edge over the first
_PARTS = 64
_KEPT = _PARTS + 2


def _response(values: Mapping[str, float]) -> Curve:
    """Return the weight of each age, in 1/s."""
    edges = values["delay"] + values["age"] * np.array([0.0, *(2.0 ** np.arange(_STEPS))])
    weights = np.array([values[f"share_{i}"] for i in range(1, _STEPS + 1)])
    # both sides of every edge
    inner = np.repeat(edges, 2)[1:-1]
    inner[1::2] *= 1.0 - 1e-9
    return Curve(
        inner, np.repeat(weights / np.diff(edges), 2), "age (s)", "weight of the age (1/s)"
    )


EFFECT = Effect(
    name="general sensor lag",
    family="sensor_lag",
    acts_on="sensor",
    summary="the reading is a mean of earlier positions, weighted by their age in any way",
    law=Law(
        equations=(
            r"r = x + \sum_{i=1}^{6} w_i \left(m_i - x\right)",
            r"m_i = \frac{1}{a_i - b_i} \int_{b_i}^{a_i} x(t - D - s)\,\mathrm{d}s",
            r"a_i = 2^{i - 1} A",
        ),
        symbols=(*(f"w_{i}" for i in range(1, _STEPS + 1)), "A", "D"),
        source="the response to an impulse, as a staircase over the logarithm of the age",
        where=(
            ("m_i", "mean position over the ages of step i"),
            ("a_i", "highest age of step i"),
            ("b_i", "lowest age of step i: the highest of the step before, 0 of the first"),
            ("s", "age"),
        ),
    ),
    parameters=(
        *(
            Parameter(f"share_{i}", "", (0.0, 1.0), f"of the positions of step {i}", 0.1, 0.0)
            for i in range(1, _STEPS + 1)
        ),
        Parameter(
            "age", "s", (5e-4, 3e-2), "at the end of the first step", 2e-3,
            starts=(2e-3, 8e-3), logarithmic=True,
        ),
        Parameter("delay", "s", (0.0, 0.5), "of all of it", 5e-3, starts=(0.0, 5e-3, 2e-2)),
    ),
    # position, rate, integral and time at the reading before, and what was shown; then integrals
    # and positions at the ends of the parts
    memory=5 + 2 * _KEPT,
    is_general=True,
    fitted_shapes=("age", "delay"),
    curve=_response,
)  # fmt: skip


@jit
def _until(m, j, part, dt, x, u, total, ago):
    """Integral of the position until ``ago`` s before a reading that is ``dt`` s after the last."""
    x0, u0, sum0, time = m[j], m[j + 1], m[j + 2], m[j + 3]
    if ago <= 0.0:
        return sum0 + total
    if ago <= dt:
        so_far, _ = along_cubic(x0, u0, x, u, dt, dt - ago)
        return sum0 + so_far
    back = (time + dt - ago) / part
    n = math.floor(back)
    if n < 0:
        return 0.0
    a, b = j + 5 + n % _KEPT, j + 5 + (n + 1) % _KEPT
    # the integral's own slope is the position
    _, there = along_cubic(m[a], m[a + _KEPT], m[b], m[b + _KEPT], part, (back - n) * part)
    return there


@jit
def sense(c, k, m, j, t, dt, x, u):
    if dt > 0.0:
        x0, u0, sum0, time = m[j], m[j + 1], m[j + 2], m[j + 3]
        age, delay = c[k + _STEPS], c[k + _STEPS + 1]
        part = (delay + _REACH * age) / _PARTS
        first, last = math.floor(time / part) + 1, math.floor((time + dt) / part)
        for n in range(max(first, last - _KEPT + 1), last + 1):
            at = j + 5 + n % _KEPT
            so_far, there = along_cubic(x0, u0, x, u, dt, n * part - time)
            m[at], m[at + _KEPT] = sum0 + so_far, there
        total, _ = along_cubic(x0, u0, x, u, dt, dt)
        shown, near, edge = x, 0.0, age
        later = _until(m, j, part, dt, x, u, total, delay)
        for i in range(_STEPS):
            earlier = _until(m, j, part, dt, x, u, total, delay + edge)
            if c[k + i] != 0.0:
                shown += c[k + i] * ((later - earlier) / (edge - near) - x)
            later, near = earlier, edge
            edge *= 2.0
        m[j + 2], m[j + 3], m[j + 4] = sum0 + total, time + dt, shown
    m[j], m[j + 1] = x, u
    return m[j + 4]
