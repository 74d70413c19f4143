"""Dry friction of a guide, with the little travel that it takes to build up (pre-sliding).

Dahl's model (1968): the stress approaches F against the motion, dz/dlam = 1 - z/p sign(lam'), so
that for motion one way z goes to +-p exponentially over the stretch p, and the stress is F z/p.
The exact solution is used from one turning point to the next, so the model is rate-independent at
any step.
"""

from __future__ import annotations

from model.effects.description import Effect, Parameter
from model.filters import slid
from model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="dry friction",
    family="friction",
    acts_on="load",
    words="a force of one size against the motion: the film stays behind at every turning point",
    parameters=(
        Parameter("friction", "Pa", (0.0, 2e4), "nominal stress while sliding", 50.0, 0.0),
        Parameter(
            "presliding",
            "",
            (3e-6, 1e-3),
            "change of stretch over which it builds up",
            1e-4,
            starts=(1e-4, 1e-5, 5e-4),
            logarithmic=True,
        ),
    ),
    memory=1,
    turns=True,
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * slid(m[j], lam - lam0, c[k + 1]) / c[k + 1]


@jit
def stiffness(c, k, m, j, lam, rate):
    return c[k] / c[k + 1], 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = slid(m[j], lam - lam0, c[k + 1])
    return 0
