"""Lag of the amplifier, first order: dV/dt = (V_command - V)/tau."""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="amplifier lag",
    family="amplifier",
    acts_on="amplifier",
    summary="the voltage at the film lags the command by a fixed time",
    law=Law(
        equations=(r"\tau \dot{V} = U - V",),
        symbols=(r"\tau",),
        source="a low-pass of first order",
    ),
    parameters=(Parameter("time_constant", "s", (0.0, 1.0), "of the amplifier's lag", 5e-3, 0.0),),
    memory=1,
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    before = m[j]
    m[j] = lagged(before, start, end, h, c[k])
    return before, m[j]
