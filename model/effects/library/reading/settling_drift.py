"""Drift of the sensor's zero that settles: electronics that warm up.

The reading is moved by d (1 - exp(-t/tau)), t since the record began.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="settling drift",
    family="drift",
    acts_on="sensor",
    summary="the reading drifts to another zero and settles, whatever the film does",
    law=Law(
        equations=(r"r = x + d \left(1 - \exp(-t/\tau)\right)",),
        symbols=("d", r"\tau"),
        source="a relaxation of first order",
    ),
    parameters=(
        Parameter("drift", "m", (-5e-3, 5e-3), "of the zero, final", 3e-6, 0.0),
        Parameter(
            "time_constant",
            "s",
            (0.5, 1e3),
            "of the settling",
            10.0,
            starts=(10.0, 3.0, 60.0),
            logarithmic=True,
        ),
    ),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x - c[k] * math.expm1(-t / c[k + 1])
