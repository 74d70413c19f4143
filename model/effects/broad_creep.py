"""Creep spread over many times: a broad spectrum of branches slower than the film's own.

Six branches as of ``slow_branch``, two a decade from T on, with moduli that fall as a power of
time. For the power 0 the film creeps with the logarithm of time.
"""

from __future__ import annotations

import math

from model.coefficients import REST
from model.effects.description import Effect, Parameter
from model.filters import lagged
from model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="broad creep",
    family="creep",
    acts_on="film stress",
    words="the film goes on creeping over decades of time after everything else has relaxed",
    parameters=(
        Parameter("modulus", "Pa", (0.0, 1e7), "of the first branch", 1e3, 0.0),
        Parameter(
            "relaxation_time",
            "s",
            (1.0, 100.0),
            "of the first branch",
            3.0,
            starts=(3.0,),
            logarithmic=True,
        ),
        Parameter("exponent", "", (-0.2, 0.9), "of the moduli's fall with time", 0.2, starts=(0.2,)),
    ),
    memory=6,
    drives=("voltage", "stretch"),
    relaxes=True,
)

_BRANCHES = 6
_RATIO = math.sqrt(10.0)
_LOG_RATIO = math.log(_RATIO)


@jit
def _stress(c, k, m, j, lam0, lam, since, commits):
    more = lam / c[REST]
    e0, e = math.log(lam0 / c[REST]), math.log(more)
    total, share, tau = 0.0, c[k], c[k + 1]
    fall = math.exp(-c[k + 2] * _LOG_RATIO)
    for i in range(_BRANCHES):
        q = lagged(m[j + i], e0, e, since, tau * more)
        total += share * (e - q)
        if commits:
            m[j + i] = q
        tau *= _RATIO
        share *= fall
    return total / more


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return _stress(c, k, m, j, lam0, lam, since, False)


@jit
def stiffness(c, k, m, j, lam, rate):
    total, share = 0.0, c[k]
    for _ in range(_BRANCHES):
        total += share
        share *= math.exp(-c[k + 2] * _LOG_RATIO)
    return total, 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    _stress(c, k, m, j, lam0, lam, h, True)
    return 0
