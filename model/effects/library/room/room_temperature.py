"""Stiffness that follows the temperature of the room, from recording to recording too.

The network's stress is multiplied by 1 + a (theta - 23 degC), with the recorded temperature: a film
on a cold morning is another one than in a warm afternoon. ``temperature`` counts from the start of
each recording instead and leaves out what is the same throughout one.
"""

from __future__ import annotations

from dearig.model.coefficients import AIR_TEMPERATURE
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "at_rest", "soften"]

EFFECT = Effect(
    name="room temperature",
    family="thermal",
    acts_on="environment",
    summary="the stiffness follows the temperature of the room, from recording to recording",
    law=Law(
        equations=(r"\sigma = \max\left(1 + a (\theta - \theta_{23}), 0.05\right) \sigma_0",),
        symbols=("a",),
        source="the first term of a series in the temperature",
        where=((r"\theta", "temperature of the room"), (r"\theta_{23}", "23 degrees Celsius")),
    ),
    parameters=(
        Parameter(
            "stiffening", "1/K", (-0.05, 0.05), "relative change of stress per kelvin", 4e-3, 0.0
        ),
    ),
    needs="temperatures",
)

_LEAST = 0.05  # of the stress at the reference: far outside it the line would change its sign


@jit
def at_rest(c, k, m, j):
    return max(1.0 + c[k] * c[AIR_TEMPERATURE], _LEAST)


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return max(1.0 + c[k] * (c[AIR_TEMPERATURE] + warmth), _LEAST)
