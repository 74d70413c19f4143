"""Sensor nonlinearity, cubic: a laser spot that leaves the middle of its range.

The reading is x + r x^3.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sensor bend",
    family="sensor_nonlinearity",
    acts_on="sensor",
    summary="the reading is a cubic function of the position, most wrong at the far end",
    law=Law(
        equations=(r"r = x + c\,x^3",),
        symbols=("c",),
        source="a term of a series in the position",
    ),
    parameters=(Parameter("cubic", "1/m^2", (-2e5, 2e5), "of the reading", 3e3, 0.0),),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + c[k] * x * x * x
