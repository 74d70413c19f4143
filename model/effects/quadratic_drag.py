"""Drag that grows with the square of the rate: a plate moving through air or oil.

The nominal stress d |lam'| lam' acts against the motion. With d = rho C_d A L1^2/(2 L2 Z).
"""

from __future__ import annotations

from model.effects.description import Effect, Parameter
from model.jit import jit

__all__ = ["EFFECT", "stiffness", "stress"]

EFFECT = Effect(
    name="quadratic drag",
    family="drag",
    acts_on="load",
    words="a force against the motion that grows with the square of its rate",
    parameters=(
        Parameter(
            "drag", "Pa s^2", (0.0, 1e6), "nominal stress per squared rate of stretch", 1e4, 0.0
        ),
    ),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * abs(rate) * rate


@jit
def stiffness(c, k, m, j, lam):
    # at a rate of 0.2/s: edges of the drive hardly go beyond
    return 0.0, 0.4 * c[k]
