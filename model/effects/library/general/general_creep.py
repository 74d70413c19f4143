"""Creep of any form: Maxwell branches on a fixed grid of relaxation times.

Ten branches as in ``slow_branch`` parallel to the network; each relaxes twice as slowly as the one
before. Their moduli are the weights. A branch between two nodes is met to (ln 2)^2/32 = 1.5 %.
"""

from __future__ import annotations

import math

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Parameter
from dearig.model.effects.shared.filters import lagged
from dearig.model.effects.shared.general import Axis, Relaxations, Weights, general

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_BRANCHES = 10
_RATIO = 2.0  # of neighbouring relaxation times

EFFECT = general(
    name="general creep",
    family="creep",
    acts_on="film stress",
    summary="the film creeps over seconds to minutes, with relaxation times of any distribution",
    equations=(
        r"\sigma = \sigma_0 + \frac{\lambda_0}{\lambda} \sum_{i=1}^{10} \mu_i (e - q_i)",
        r"\dot{q}_i = \frac{\lambda_0}{\lambda} \frac{e - q_i}{2^{i - 1}\,T}",
        r"e = \ln\frac{\lambda}{\lambda_0}",
    ),
    source="J. C. Maxwell, Phil. Trans. R. Soc. 157, 49 (1867), as a Prony series",
    shapes=Relaxations(
        _BRANCHES,
        _RATIO,
        (("e", "logarithmic strain from rest"), ("q_i", "internal strain of branch i")),
    ),
    weights=Weights(
        "modulus", r"\mu", "Pa", (0.0, 1e7), "of branch", 300.0, stands_for="modulus of branch i"
    ),
    scale=(
        Parameter(
            "relaxation_time", "s", (0.05, 100.0), "of the first branch", 0.8,
            starts=(0.8, 0.1), logarithmic=True,
        ),
        "T",
    ),
    over=Axis("time (s)"),
    shows=Axis("relaxation modulus (Pa)"),
    memory=_BRANCHES,
    drives=("voltage", "stretch"),
)  # fmt: skip


@jit
def _relaxed(c, k, m, j, lam0, lam, since, commits):
    e0, e = math.log(lam0 / c[REST]), math.log(lam / c[REST])
    time = c[k + _BRANCHES] * 0.5 * (lam0 + lam) / c[REST]
    total = 0.0
    for i in range(_BRANCHES):
        if c[k + i] > 0.0:
            q = lagged(m[j + i], e0, e, since, time)
            total += c[k + i] * (e - q)
            if commits:
                m[j + i] = q
        time *= _RATIO
    return total * c[REST] / lam


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return _relaxed(c, k, m, j, lam0, lam, since, False)


@jit
def stiffness(c, k, m, j, lam, rate):
    total = 0.0
    for i in range(_BRANCHES):
        total += c[k + i]
    return total, 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    _relaxed(c, k, m, j, lam0, lam, h, True)
    return 0
