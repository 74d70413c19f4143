"""Creep by one more slow branch: a spring in series with a dashpot, beside the network.

As the network's own do at small elastic strains, it answers to the logarithmic strain
e = ln(lam/lam_rest): stress mu (e - q) lam_rest/lam, q' = (e - q) lam_rest/(lam T).
"""

from __future__ import annotations

import math

from model.coefficients import REST
from model.effects.description import Effect, Parameter
from model.filters import lagged
from model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="slow branch",
    family="creep",
    acts_on="film stress",
    words="the film goes on creeping after everything else has relaxed",
    parameters=(
        Parameter("modulus", "Pa", (0.0, 1e7), "of the branch", 2e3, 0.0),
        Parameter(
            "relaxation_time",
            "s",
            (1.0, 3e4),
            "of the branch",
            30.0,
            starts=(20.0, 4.0, 200.0),
            logarithmic=True,
        ),
    ),
    memory=1,
    drives=("voltage", "stretch"),
    relaxes=True,
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    more = lam / c[REST]
    e = math.log(more)
    late = lagged(m[j], math.log(lam0 / c[REST]), e, since, c[k + 1] * more)
    return c[k] * (e - late) / more


@jit
def stiffness(c, k, m, j, lam, rate):
    return c[k], 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    more = lam / c[REST]
    m[j] = lagged(m[j], math.log(lam0 / c[REST]), math.log(more), h, c[k + 1] * more)
    return 0
