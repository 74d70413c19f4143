"""Drag in proportion to the rate: air around the load, a viscous guide, losses in the frame.

The nominal stress d lam' acts against the motion. A Maxwell branch that relaxes much faster
than the record shows has the same effect: slow data do not distinguish the two.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "stiffness", "stress"]

EFFECT = Effect(
    name="linear drag",
    family="drag",
    acts_on="load",
    summary="a force against the motion, proportional to its rate",
    law=Law(
        equations=(r"\sigma = \sigma_0 + d \dot{\lambda}",),
        symbols=("d",),
        source="a force in proportion to the rate (Stokes)",
    ),
    parameters=(
        Parameter("drag", "Pa s", (0.0, 1e5), "nominal stress per rate of stretch", 300.0, 0.0),
    ),
    drives=("voltage", "stretch"),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * rate


@jit
def stiffness(c, k, m, j, lam, rate):
    return 0.0, c[k]
