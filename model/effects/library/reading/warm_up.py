"""Warming up, where no thermometer was recorded: stiffness that settles after the start.

The network's stress is multiplied by 1 + a (1 - exp(-t/tau)), t since the record began.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "soften"]

EFFECT = Effect(
    name="warm-up",
    family="thermal",
    acts_on="environment",
    summary="the stiffness settles at another value with time, whatever the film does",
    law=Law(
        equations=(r"\sigma = \left(1 + a \left(1 - \exp(-t/\tau)\right)\right) \sigma_0",),
        symbols=("a", r"\tau"),
        source="Newton's law of cooling",
    ),
    parameters=(
        Parameter("stiffening", "", (-0.5, 0.5), "final relative change of stress", 1e-3, 0.0),
        Parameter(
            "time_constant",
            "s",
            (1.0, 3e3),
            "of the warming",
            20.0,
            starts=(20.0, 5.0, 200.0),
            logarithmic=True,
        ),
    ),
)


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.0 - c[k] * math.expm1(-(t + since) / c[k + 1])
