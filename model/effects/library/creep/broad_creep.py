"""Creep with a broad spectrum of relaxation times, slower than the film's own branches.

Six branches as in ``slow_branch``, two per decade from T on, with moduli that decrease as a power
of time. With the power 0 the film creeps with the logarithm of time.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.creep import relaxed

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="broad creep",
    family="creep",
    acts_on="film stress",
    summary="the film keeps creeping over decades of time",
    law=Law(
        equations=(
            (
                r"\sigma = \sigma_0 + \frac{\lambda_0}{\lambda} \sum_{i=0}^{5} \mu\,10^{-n i/2} "
                "(e - q_i)"
            ),
            r"\dot{q}_i = \frac{\lambda_0}{\lambda} \frac{e - q_i}{10^{i/2}\,T}",
            r"e = \ln\frac{\lambda}{\lambda_0}",
        ),
        symbols=(r"\mu", "T", "n"),
        source="Maxwell branches whose moduli are a power of their times",
        where=(("e", "logarithmic strain from rest"), ("q_i", "internal strain of branch i")),
    ),
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
        Parameter(
            "exponent",
            "",
            (-0.2, 0.9),
            "of the decrease of the moduli with time",
            0.2,
            starts=(0.2,),
        ),
    ),
    memory=6,
    drives=("voltage", "stretch"),
)

_BRANCHES = 6
_RATIO = math.sqrt(10.0)
_LOG_RATIO = math.log(_RATIO)


@jit
def _fall(c, k):
    return math.exp(-c[k + 2] * _LOG_RATIO)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    fall = _fall(c, k)
    return relaxed(c, m, j, lam0, lam, since, False, _BRANCHES, c[k], fall, c[k + 1], _RATIO)


@jit
def stiffness(c, k, m, j, lam, rate):
    total, share, fall = 0.0, c[k], _fall(c, k)
    for _ in range(_BRANCHES):
        total += share
        share *= fall
    return total, 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    relaxed(c, m, j, lam0, lam, h, True, _BRANCHES, c[k], _fall(c, k), c[k + 1], _RATIO)
    return 0
