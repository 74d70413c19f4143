"""Sensor nonlinearity, quadratic: a tilted or badly linearised laser.

The reading is x + q x^2; the linear term is the sensor's gain, which only a calibration gives.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sensor curvature",
    family="sensor_nonlinearity",
    acts_on="sensor",
    summary="the reading is a quadratic function of the position, at any speed",
    law=Law(
        equations=(r"r = x + q\,x^2",),
        symbols=("q",),
        source="a term of a series in the position",
    ),
    parameters=(Parameter("quadratic", "1/m", (-300.0, 300.0), "of the reading", 5.0, 0.0),),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + c[k] * x * x
