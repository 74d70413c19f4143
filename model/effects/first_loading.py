"""Damage by the largest stretch so far, which stays (discontinuous damage, after Miehe 1995).

The network carries 1 - s (1 - exp(-(d/r)^n)) of its stress, d the largest change of stretch since
rest: once a film has been stretched, it is softer at every stretch, and goes on to be.
"""

from __future__ import annotations

import math

from model.coefficients import REST
from model.effects.description import Effect, Parameter
from model.jit import jit

__all__ = ["EFFECT", "commit", "soften"]

EFFECT = Effect(
    name="first-loading damage",
    family="softening",
    acts_on="film stress",
    words="softer at every stretch once it has been stretched: the first lobe is unlike repeats",
    parameters=(
        Parameter("softening", "", (-0.5, 0.9), "part of the stress lost in the end", 3e-3, 0.0),
        Parameter(
            "reach",
            "",
            (1e-3, 3.0),
            "change of stretch over which it is lost",
            0.02,
            starts=(0.008, 0.03, 0.5),
            logarithmic=True,
        ),
        Parameter(
            "exponent", "", (0.5, 4.0), "of the stretch", 1.5, starts=(1.5,), logarithmic=True
        ),
    ),
    memory=1,
    turns=True,
    drives=("voltage", "stretch"),
)


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    most = max(m[j], abs(lam - c[REST]))
    return 1.0 + c[k] * math.expm1(-((most / c[k + 1]) ** c[k + 2]))


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = max(m[j], abs(lam - c[REST]))
    return 0
