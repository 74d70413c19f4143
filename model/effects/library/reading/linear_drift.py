"""Drift of the sensor's zero at one rate: its mount creeps, or the frame sinks."""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="linear drift",
    family="drift",
    acts_on="sensor",
    summary="the reading drifts at a constant rate, whatever the film does",
    law=Law(
        equations=("r = x + d t",),
        symbols=("d",),
        source="a constant rate",
    ),
    parameters=(Parameter("drift", "m/s", (-1e-4, 1e-4), "of the zero, per second", 1e-7, 0.0),),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + c[k] * t
