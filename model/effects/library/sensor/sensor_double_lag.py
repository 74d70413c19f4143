"""Lag of the sensor, second order: two low-passes in series.

r' = (q - r)/tau behind q' = (x - q)/tau, each solved exactly for the cubic through positions and
rates. The delay is that of a first-order lag of 2 tau; corners are rounder.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import low_pass

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sensor double lag",
    family="sensor_lag",
    acts_on="sensor",
    summary="the reading lags by a fixed time and is rounded, as behind two filters",
    law=Law(
        equations=(r"\tau \dot{q} = x - q", r"\tau \dot{r} = q - r"),
        symbols=(r"\tau",),
        source="two low-passes of first order in series",
        where=(("q", "output of the first low-pass"),),
    ),
    parameters=(Parameter("time_constant", "s", (0.0, 0.5), "of each low-pass", 5e-3, 0.0),),
    memory=4,
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    if dt > 0.0:
        tau, first, second = c[k], m[j], m[j + 1]
        m[j] = low_pass(first, m[j + 2], m[j + 3], x, u, dt, tau)
        # what the second sees, with the rates that follow from the first
        before, after = (m[j + 2] - first) / tau, (x - m[j]) / tau
        m[j + 1] = low_pass(second, first, before, m[j], after, dt, tau)
    m[j + 2], m[j + 3] = x, u
    return m[j + 1]
