"""Dry friction of bristles that only bend at first, and slip later: what swings a little stays.

The law of Dupont, Hayward, Armstrong and Altpeter (IEEE Trans. Autom. Control 47, 2002): as
``easing friction``, but where bristles are bent by less than a part of the deflection at which they
slip, or back, they follow the film; from there to that deflection they slip the more.
"""

from __future__ import annotations

import math

from model.effects.description import Effect, Parameter
from model.filters import bent, bristles_slip
from model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="elastoplastic friction",
    family="friction",
    acts_on="load",
    words="a force against the motion, greater when slow, that a small swing does not overcome",
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
            (1e-6, 1e-2),
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
        Parameter(
            "elastic", "", (0.0, 0.9), "part of it up to which nothing slips", 0.1, starts=(0.6,)
        ),
    ),
    memory=1,
    turns=True,
)


@jit
def _reach(c, k, rate):
    return c[k + 1] * (1.0 + c[k + 3] * math.exp(-((rate / c[k + 4]) ** 2)))


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    # on the way here the rate was, in the mean, that of the way
    passed = (lam - lam0) / since if since > 0.0 else rate
    z = bent(m[j], lam - lam0, _reach(c, k, passed), c[k + 5])
    at = math.copysign(z, z * rate) / _reach(c, k, rate)
    slips = bristles_slip(at, c[k + 5]) * at
    return c[k] * (z + c[k + 2] * rate * (1.0 - slips)) / c[k + 1]


@jit
def stiffness(c, k, m, j, lam, rate):
    bristles = c[k] / c[k + 1]
    return bristles, bristles * c[k + 2]


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = bent(m[j], lam - lam0, _reach(c, k, (lam - lam0) / h), c[k + 5])
    return 0
