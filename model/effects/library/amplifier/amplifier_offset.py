"""Offset of the amplifier: the film gets V + V_0, so V^2 grows by 2 V V_0 + V_0^2."""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="amplifier offset",
    family="amplifier",
    acts_on="amplifier",
    summary="a constant voltage is added: a force proportional to the voltage itself",
    law=Law(
        equations=("V = U + V_0",),
        symbols=("V_0",),
        source="an additive constant",
    ),
    parameters=(Parameter("offset", "V", (-2e3, 2e3), "of the output", 20.0, 0.0),),
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    return start + c[k], end + c[k]
