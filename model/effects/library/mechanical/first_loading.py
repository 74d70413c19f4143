"""Damage by the largest stretch so far, which stays (discontinuous damage, after Miehe 1995).

The network carries 1 - s (1 - q) of its stress, q = (1 + b x)^(-1/b) with x = (d/r)^n and d the
largest change of stretch since rest: once a film has been stretched, it stays softer
at every stretch. The remaining loss decreases as exp(-x) for b = 0 (Miehe) and as 1/(1 + x) for
b = 1: a broader distribution of the strengths of the network.
"""

from __future__ import annotations

import math

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "commit", "soften"]

EFFECT = Effect(
    name="first-loading damage",
    family="softening",
    acts_on="film stress",
    summary="the film stays softer once it has been stretched: the first lobe differs",
    law=Law(
        equations=(
            r"\sigma = \left(1 - s \left(1 - (1 + b X)^{-1/b}\right)\right) \sigma_0",
            r"X = \left(\frac{1}{r} \max_{t' \le t} |\lambda(t') - \lambda_0|\right)^n",
        ),
        symbols=("s", "r", "n", "b"),
        source="C. Miehe, Eur. J. Mech. A 14, 697 (1995)",
        where=(
            (
                "X",
                (
                    "largest change of stretch so far over the reach, to the power n; for b = "
                    "0 the loss is 1 - exp(-X)"
                ),
            ),
        ),
    ),
    parameters=(
        Parameter(
            "softening",
            "",
            (-0.5, 0.9),
            "final relative loss of stress",
            3e-3,
            0.0,
            fit_within=(0.0, 0.9),
        ),
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
        Parameter(
            "breadth",
            "",
            (0.0, 2.0),
            "of the loss: 0 exponential in stretch, 1 algebraic",
            0.3,
            starts=(1.0, 0.0),
        ),
    ),
    memory=2,
    drives=("voltage", "stretch"),
)


_NONE = 1e-6  # a breadth that is none


@jit
def _lost(c, k, most):
    """What is lost, of all that can be, after a change of stretch by ``most``: negative."""
    x = (most / c[k + 1]) ** c[k + 2]
    if c[k + 3] > _NONE:
        x = math.log1p(c[k + 3] * x) / c[k + 3]
    return math.expm1(-x)


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    # mostly the film has been there before, and what it lost is known
    most = abs(lam - c[REST])
    return 1.0 + c[k] * (_lost(c, k, most) if most > m[j] else m[j + 1])


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    most = abs(lam - c[REST])
    if most > m[j]:
        m[j], m[j + 1] = most, _lost(c, k, most)
    return 0
