"""Creep over decades at once, as of a spring-pot whose stress relaxes as t^-a (Scott Blair).

Six branches, each six times as slow as the one before, with moduli that fall as T^-a. With the
first at 0.03 s their sum follows the power within 1 % from 0.05 s to 30 s, less a constant that
slower branches would carry: to a record of minutes that is elasticity. With a = 0 the film creeps
with the logarithm of time; and what sets in later leaves the quick to the model's own branches.
"""

from __future__ import annotations

from model.coefficients import REST
from model.effects.description import Effect, Parameter
from model.filters import lagged
from model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="power-law creep",
    family="creep",
    acts_on="film stress",
    words="the film creeps in equal steps in equal ratios of time",
    parameters=(
        Parameter(
            "modulus", "Pa", (0.0, 1e7), "of the first branch; of slower ones less", 3e3, 0.0
        ),
        Parameter("exponent", "", (0.0, 0.9), "of time", 0.2, starts=(0.2, 0.5)),
        Parameter(
            "onset",
            "s",
            (0.02, 20.0),
            "relaxation time of the first branch",
            0.03,
            starts=(0.03, 2.0),
            logarithmic=True,
        ),
    ),
    memory=6,
    drives=("voltage", "stretch"),
)


_BRANCHES = 6
_RATIO = 6.0  # of their times


@jit
def _stress(c, k, m, j, lam0, lam, since, commits):
    e0, e = lam0 - c[REST], lam - c[REST]
    total, share, tau = 0.0, c[k], c[k + 2]
    fall = _RATIO ** -c[k + 1]
    for i in range(_BRANCHES):
        q = lagged(m[j + i], e0, e, since, tau)
        total += share * (e - q)
        if commits:
            m[j + i] = q
        tau *= _RATIO
        share *= fall
    return total


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return _stress(c, k, m, j, lam0, lam, since, False)


@jit
def stiffness(c, k, m, j, lam, rate):
    fall = _RATIO ** -c[k + 1]
    total, share = 0.0, c[k]
    for _ in range(_BRANCHES):
        total += share
        share *= fall
    return total, 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    _stress(c, k, m, j, lam0, lam, h, True)
    return 0
