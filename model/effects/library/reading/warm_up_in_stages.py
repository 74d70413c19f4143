"""Warming up in two stages, where no thermometer was recorded: the device, then its surroundings.

The network's stress is multiplied by 1 + a (1 - exp(-t/tau)) + b (1 - exp(-t/(10 tau))), t since
the record began.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "soften"]

EFFECT = Effect(
    name="warm-up in stages",
    family="thermal",
    acts_on="environment",
    summary="the stiffness changes with time, ever more slowly, whatever the film does",
    law=Law(
        equations=(
            (
                r"\sigma = \left(1 + a_1 \left(1 - \exp(-t/\tau)\right) + a_2 \left(1 - "
                r"\exp(-t/(10 \tau))\right)\right) \sigma_0"
            ),
        ),
        symbols=("a_1", "a_2", r"\tau"),
        source="Newton's law of cooling, of two bodies",
    ),
    parameters=(
        Parameter("stiffening", "", (-0.5, 0.5), "relative change of stress, first", 1e-3, 0.0),
        Parameter("later", "", (-0.5, 0.5), "relative change of stress, later", 1e-3, 0.0),
        Parameter(
            "time_constant",
            "s",
            (0.5, 3e2),
            "of the first stage, a tenth of the second's",
            5.0,
            starts=(5.0, 20.0),
            logarithmic=True,
        ),
    ),
)

_LATER = 10.0


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    part = (t + since) / c[k + 2]
    return 1.0 - c[k] * math.expm1(-part) - c[k + 1] * math.expm1(-part / _LATER)
