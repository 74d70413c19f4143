"""Creep over all decades at once: a spring-pot, whose stress relaxes as t^-a (Scott Blair).

The relaxation modulus k (t/1 s)^-a is a sum of six branches, one a decade from 0.03 s to 3000 s,
with moduli that fall as T^-a. For a = 0.2 the sum follows the power within 1.5 % from 0.05 s to
100 s, less a constant of slower branches, which a record of minutes shows as elasticity.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.creep import relaxed

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="power-law creep",
    family="creep",
    acts_on="film stress",
    summary="the film creeps by a power of time: alike in every decade",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + \frac{\lambda_0}{\lambda} \sum_{i=0}^{5} \mu_i (e - q_i)",
            (
                r"\mu_i = k \frac{a \ln 10}{\Gamma(1 + a)} "
                r"\left(\frac{T_i}{1\,\mathrm{s}}\right)^{-a}"
            ),
            r"\dot{q}_i = \frac{\lambda_0}{\lambda} \frac{e - q_i}{T_i}",
            r"T_i = 10^i \cdot 0.03\,\mathrm{s}",
            r"e = \ln\frac{\lambda}{\lambda_0}",
        ),
        symbols=("k", "a"),
        source="G. W. Scott Blair, J. Colloid Sci. 2, 21 (1947)",
        where=(
            ("e", "logarithmic strain from rest"),
            ("q_i", "internal strain of branch i"),
            (r"\mu_i", "modulus of branch i"),
            ("T_i", "relaxation time of branch i"),
            (r"\Gamma", "gamma function"),
        ),
    ),
    parameters=(
        Parameter(
            "modulus", "Pa", (0.0, 1e7), "relaxation modulus of the power law at 1 s", 3e3, 0.0
        ),
        Parameter("exponent", "", (0.02, 0.9), "of time", 0.2, starts=(0.2, 0.5)),
    ),
    memory=6,
    drives=("voltage", "stretch"),
)


_BRANCHES = 6
_FIRST = 0.03  # s
_DECADE = math.log(10.0)
_LOG_FIRST = math.log(_FIRST)


@jit
def _first_share(k, a):
    """Modulus in Pa of the first branch: T^-a exp(-t/T) over all ln T adds up to Gamma(a) t^-a."""
    # Gamma(1 + a), Abramowitz and Stegun 6.1.35, to 5e-5: this runs in every stage of every step
    gamma = 1.0 + a * (
        -0.5748646 + a * (0.9512363 + a * (-0.6998588 + a * (0.4245549 - 0.1010678 * a)))
    )
    return k * _DECADE * a / gamma * math.exp(-a * _LOG_FIRST)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    a = c[k + 1]
    share, fall = _first_share(c[k], a), math.exp(-a * _DECADE)
    return relaxed(c, m, j, lam0, lam, since, False, _BRANCHES, share, fall, _FIRST, 10.0)


@jit
def stiffness(c, k, m, j, lam, rate):
    a = c[k + 1]
    return _first_share(c[k], a) / (1.0 - math.exp(-a * _DECADE)), 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    relaxed(c, m, j, lam0, lam, h, True, _BRANCHES, 0.0, 1.0, _FIRST, 10.0)
    return 0
