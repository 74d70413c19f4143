"""Dry friction that eases with speed: a film at rest holds on more firmly than one that slides.

The law of Canudas de Wit, Olsson, Astrom and Lischinsky (IEEE Trans. Autom. Control 40, 1995):
``dry friction``, whose stress while sliding is F (1 + e exp(-(lam'/v)^2)) after Stribeck, as is the
travel over which it builds up. What eases with speed drives a film that slides slowly: it squeals
at its own frequency, and sticks and slips.
"""

from __future__ import annotations

import math

from model.effects.description import Effect, Parameter
from model.filters import slid
from model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="easing friction",
    family="friction",
    acts_on="load",
    words="a force against the motion that is greater when slow: the film sticks, and slips",
    parameters=(
        Parameter("friction", "Pa", (0.0, 2e4), "nominal stress while sliding fast", 50.0, 0.0),
        Parameter(
            "presliding",
            "",
            (3e-6, 1e-3),
            "change of stretch over which it builds up",
            1e-4,
            starts=(1e-4, 5e-4),
            logarithmic=True,
        ),
        Parameter(
            "damping",
            "s",
            (1e-6, 3e-3),
            "time by which its stress runs ahead while it builds up",
            1e-3,
            starts=(1e-3,),
            logarithmic=True,
        ),
        Parameter(
            "excess", "", (0.0, 1.0), "part of it that is lost with speed", 0.1, starts=(0.15, 0.4)
        ),
        Parameter(
            "easing",
            "1/s",
            (2e-3, 0.3),
            "rate of stretch at which most of that is lost",
            1e-2,
            starts=(1e-2, 3e-2),
            logarithmic=True,
        ),
    ),
    memory=1,
    turns=True,
)


@jit
def reach(c, k, rate):
    """Deflection, in stretch, at which all bristles slip while the film moves at ``rate``."""
    return c[k + 1] * (1.0 + c[k + 3] * math.exp(-((rate / c[k + 4]) ** 2)))


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    # on the way here the rate was, in the mean, that of the way
    passed = (lam - lam0) / since if since > 0.0 else rate
    z = slid(m[j], lam - lam0, reach(c, k, passed))
    return c[k] * (z + c[k + 2] * (rate - abs(rate) * z / reach(c, k, rate))) / c[k + 1]


@jit
def stiffness(c, k, m, j, lam, rate):
    bristles = c[k] / c[k + 1]
    return bristles, bristles * c[k + 2]


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = slid(m[j], lam - lam0, reach(c, k, (lam - lam0) / h))
    return 0
