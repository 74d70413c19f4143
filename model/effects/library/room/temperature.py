"""Stiffness that follows the recorded temperature.

Rubber elasticity grows with absolute temperature, 1/300 a kelvin; viscous losses decrease it. The
network's stress is multiplied by 1 + a (theta - theta_0), with the thermometer's theta.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "soften"]

EFFECT = Effect(
    name="temperature",
    family="thermal",
    acts_on="environment",
    summary="the stiffness follows the recorded temperature",
    law=Law(
        equations=(r"\sigma = \max\left(1 + a (\theta - \theta_0), 0.05\right) \sigma_0",),
        symbols=("a",),
        source="the first term of a series in the temperature",
        where=(
            (r"\theta", "temperature of the room"),
            (r"\theta_0", "that at the start of the recording"),
        ),
    ),
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
