"""Lag of the sensor, first order: a low-pass behind the laser.

The reading r follows r' = (x - r)/tau, solved exactly for the cubic through positions and rates.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import low_pass

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sensor lag",
    family="sensor_lag",
    acts_on="sensor",
    summary="the reading lags by a fixed time, loading and unloading alike",
    law=Law(
        equations=(r"\tau \dot{r} = x - r",),
        symbols=(r"\tau",),
        source="a low-pass of first order",
    ),
    parameters=(Parameter("time_constant", "s", (0.0, 1.0), "of the low-pass", 5e-3, 0.0),),
    memory=3,
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    if dt > 0.0:
        m[j] = low_pass(m[j], m[j + 1], m[j + 2], x, u, dt, c[k])
    m[j + 1], m[j + 2] = x, u
    return m[j]
