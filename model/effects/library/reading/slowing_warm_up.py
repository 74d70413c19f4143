"""Warming with a broad spectrum of rates, where no thermometer was recorded: a thick wall, a room.

The network's stress is multiplied by 1 + a (1 - (1 + t/tau)^-p), t since the record began: bodies
warm at rates that are gamma distributed about p/tau. ``warm_up`` is the limit of large p, where all
warm alike.
"""

from __future__ import annotations

import math
from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law, Parameter
from dearig.model.effects.library.reading.warm_up import EFFECT as WARM_UP

__all__ = ["EFFECT", "soften"]

_STIFFENING, _TIME_CONSTANT = WARM_UP.parameters

EFFECT = replace(
    WARM_UP,
    name="slowing warm-up",
    summary="the stiffness changes by a power of time, whatever the film does",
    law=Law(
        equations=(r"\sigma = \left(1 + a \left(1 - (1 + t/\tau)^{-p}\right)\right) \sigma_0",),
        symbols=("a", r"\tau", "p"),
        source="relaxations whose rates are gamma distributed",
    ),
    parameters=(
        _STIFFENING,
        replace(_TIME_CONSTANT, meaning="after which the change slows down", starts=(5.0, 20.0)),
        Parameter(
            "power",
            "",
            (0.1, 5.0),
            "of time in the remaining change",
            0.5,
            starts=(1.0,),
            logarithmic=True,
        ),
    ),
)


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.0 - c[k] * math.expm1(-c[k + 2] * math.log1p((t + since) / c[k + 1]))
