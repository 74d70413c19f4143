"""Softening by use: the network loses stiffness with the travel of the film.

The stress is multiplied by 1 - a (1 - exp(-p/p_0)), p the travel in stretch, up and down, since the
start.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "commit", "soften"]

EFFECT = Effect(
    name="ageing",
    family="softening",
    acts_on="film stress",
    summary="the film softens with every cycle, most in the first cycles",
    law=Law(
        equations=(
            r"\sigma = \left(1 - a \left(1 - \exp(-p/p_0)\right)\right) \sigma_0",
            r"p = \int_0^t |\dot{\lambda}|\,\mathrm{d}t",
        ),
        symbols=("a", "p_0"),
        source="a loss in proportion to what is left of it",
        where=(("p", "travel of the film in stretch, up and down, since the start"),),
    ),
    parameters=(
        Parameter(
            "softening",
            "",
            (-0.5, 0.9),
            "final relative loss of stress",
            2e-3,
            0.0,
            fit_within=(0.0, 0.9),
        ),
        Parameter(
            "path",
            "",
            (5e-3, 50.0),
            "travel in stretch, up and down, over which it is lost",
            0.1,
            starts=(0.1, 0.5),
            logarithmic=True,
        ),
    ),
    memory=1,
    is_hysteretic=True,
    drives=("voltage", "stretch"),
)


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.0 + c[k] * math.expm1(-m[j] / c[k + 1])


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] += abs(lam - lam0)
    return 0
