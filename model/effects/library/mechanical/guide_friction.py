"""Friction of a guide that presses more, or less, the further the load has moved.

The nominal stress max(f + g (lam - lam_rest), 0) lam'/(|lam'| + s) acts against the motion: below
the rate s it is a drag, so that it has a slope at rest.
"""

from __future__ import annotations

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.hooks import FASTEST

__all__ = ["EFFECT", "stiffness", "stress"]

EFFECT = Effect(
    name="guide friction",
    family="friction",
    acts_on="load",
    summary="a force against the motion that changes with the position, at any speed",
    law=Law(
        equations=(
            (
                r"\sigma = \sigma_0 + \max(f + g \delta, 0) "
                r"\frac{\dot{\lambda}}{|\dot{\lambda}| + s}"
            ),
            r"\delta = \lambda - \lambda_0",
        ),
        symbols=("f", "g", "s"),
        source="Coulomb's friction under a normal force that changes along the way",
    ),
    parameters=(
        Parameter("friction", "Pa", (0.0, 1e4), "at the rest stretch", 5.0, 0.0),
        Parameter("growth", "Pa", (-1e6, 1e6), "of the friction for a stretch of 1", 150.0, 0.0),
        Parameter(
            "rate",
            "1/s",
            (5e-3, 0.1),  # a steeper one turns within a step
            "of stretch over which it sets in",
            8e-3,
            starts=(8e-3,),
            logarithmic=True,
        ),
    ),
    is_hysteretic=True,  # steep at rest: turning points need short steps
)


@jit
def _level(c, k, lam):
    return max(c[k] + c[k + 1] * (lam - c[REST]), 0.0)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return _level(c, k, lam) * rate / (abs(rate) + c[k + 2])


@jit
def stiffness(c, k, m, j, lam, rate):
    level, speed = _level(c, k, lam), abs(rate)
    # a force that falls along the way counts as none
    growth = max(c[k + 1], 0.0)
    if speed > FASTEST:
        speed = 0.0  # the drag is the largest at rest
    return growth, level * c[k + 2] / ((speed + c[k + 2]) * (speed + c[k + 2]))
