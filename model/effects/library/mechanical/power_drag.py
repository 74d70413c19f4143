"""Drag that grows with a power of the rate: a plate moving through air or oil.

The nominal stress d |lam'/r|^n sign(lam'), r = 0.1/s, acts against the motion: n is 2 where the
fluid's inertia dominates, as rho C_d A (L1 lam')^2/2, and 1 where its viscosity does.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.hooks import FASTEST

__all__ = ["EFFECT", "stiffness", "stress"]

EFFECT = Effect(
    name="power-law drag",
    family="drag",
    acts_on="load",
    summary="a force against the motion that grows with a power of its rate",
    law=Law(
        equations=(
            (
                r"\sigma = \sigma_0 + d \left|\frac{\dot{\lambda}}{0.1\,\mathrm{s}^{-1}}\right|^n "
                r"\operatorname{sign} \dot{\lambda}"
            ),
        ),
        symbols=("d", "n"),
        source="a power of the rate: 2 is Newton's drag, 1 Stokes's",
    ),
    parameters=(
        Parameter("drag", "Pa", (0.0, 1e4), "nominal stress at a rate of 0.1/s", 50.0, 0.0),
        Parameter("exponent", "", (1.0, 3.0), "of the rate", 0.3, starts=(2.0, 1.5)),
    ),
)

_REFERENCE = 0.1  # 1/s
_DRIVE = 3e3  # Pa: a Maxwell stress of 8 MV/m


@jit
def greatest_rate(drag, exponent):
    """Rate in 1/s of a fast edge, or, if less, at which drag * rate**exponent holds the drive."""
    return min(FASTEST, (_DRIVE / max(drag, 1e-3)) ** (1.0 / exponent))


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return math.copysign(c[k] * (abs(rate) / _REFERENCE) ** c[k + 1], rate)


@jit
def stiffness(c, k, m, j, lam, rate):
    slope = c[k] * c[k + 1] / _REFERENCE
    there = min(rate, FASTEST) / _REFERENCE
    part = there ** (c[k + 1] - 1.0)
    if c[k] * part * there > _DRIVE:
        there = greatest_rate(c[k] / _REFERENCE ** c[k + 1], c[k + 1]) / _REFERENCE
        part = there ** (c[k + 1] - 1.0)
    return 0.0, slope * part
