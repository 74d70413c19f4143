"""Drag in proportion to the rate and to its square: a viscous guide, and the wake of what moves.

The nominal stress (d + q |lam'|) lam' acts against the motion. Below the rate d/q the fluid's
viscosity dominates, above it the fluid's inertia (Forchheimer 1901, of flow through a bed). In slow
lobes a power of the rate explains as much; on a fast edge it does not.
"""

from __future__ import annotations

from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law, Parameter
from dearig.model.effects.library.mechanical.linear_drag import EFFECT as LINEAR
from dearig.model.effects.library.mechanical.power_drag import greatest_rate

__all__ = ["EFFECT", "stiffness", "stress"]

EFFECT = replace(
    LINEAR,
    name="mixed drag",
    summary="a force against the motion that grows with its rate and with the square of the rate",
    law=Law(
        equations=(r"\sigma = \sigma_0 + \left(d + q |\dot{\lambda}|\right) \dot{\lambda}",),
        symbols=("d", "q"),
        source="P. Forchheimer, Z. Ver. Dtsch. Ing. 45, 1782 (1901)",
    ),
    parameters=(
        *LINEAR.parameters,
        Parameter("quadratic", "Pa s^2", (0.0, 1e6), "nominal stress per rate squared", 5e3, 0.0),
    ),
    drives=("voltage",),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return (c[k] + c[k + 1] * abs(rate)) * rate


@jit
def stiffness(c, k, m, j, lam, rate):
    return 0.0, c[k] + 2.0 * c[k + 1] * min(rate, greatest_rate(c[k + 1], 2.0))
