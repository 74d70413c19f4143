"""Saturation of the amplifier: the output bends towards a limit, V_s tanh(V/V_s)."""

from __future__ import annotations

import math

from model.effects.description import Effect, Parameter
from model.jit import jit

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="amplifier saturation",
    family="amplifier",
    acts_on="amplifier",
    words="the film sees less than was asked for, the more the higher the voltage",
    parameters=(
        Parameter("inverse_limit", "1/V", (0.0, 5e-4), "one over the limit V_s", 3e-5, 0.0),
    ),
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    return math.tanh(c[k] * start) / c[k], math.tanh(c[k] * end) / c[k]
