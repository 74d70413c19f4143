"""Stiffness that follows the recorded temperature.

Rubber elasticity grows with absolute temperature, 1/300 a kelvin; viscous losses decrease it. The
network's stress is multiplied by 1 + a (theta - theta_0), with the thermometer's theta.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Parameter

__all__ = ["EFFECT", "soften"]

EFFECT = Effect(
    name="temperature",
    family="thermal",
    acts_on="environment",
    summary="the stiffness follows the recorded temperature",
    parameters=(
        Parameter(
            "stiffening", "1/K", (-0.2, 0.2), "relative change of stress per kelvin", 1e-3, 0.0
        ),
    ),
    needs="temperature",
)


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return max(1.0 + c[k] * warmth, 0.05)
