"""Limit of the amplifier with a knee, beyond which the slope is 1 - s of that below."""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="amplifier limit",
    family="amplifier",
    acts_on="amplifier",
    summary="above one voltage the film gets less than was commanded",
    law=Law(
        equations=(r"V = U - s\,\operatorname{sign}(U) \max(|U| - V_k, 0)",),
        symbols=("s", "V_k"),
        source="a characteristic of two straight lines",
    ),
    parameters=(
        Parameter("flattening", "", (0.0, 1.0), "relative loss of slope beyond the knee", 0.2, 0.0),
        Parameter(
            "knee",
            "V",
            (1e3, 2e4),
            "voltage at which the output begins to flatten",
            7e3,
            starts=(0.85, 0.7, 0.5),
            relative_to="voltage",
        ),
    ),
)


@jit
def _limited(volts, part, knee):
    return volts - part * math.copysign(max(abs(volts) - knee, 0.0), volts)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    return _limited(start, c[k], c[k + 1]), _limited(end, c[k], c[k + 1])
