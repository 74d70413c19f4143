"""Creep by one slow branch: a spring in series with a dashpot, in parallel with the network."""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.creep import relaxed

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="slow branch",
    family="creep",
    acts_on="film stress",
    summary="the film keeps creeping with one more relaxation time",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + \frac{\lambda_0}{\lambda} \mu (e - q)",
            r"\dot{q} = \frac{\lambda_0}{\lambda} \frac{e - q}{T}",
            r"e = \ln\frac{\lambda}{\lambda_0}",
        ),
        symbols=(r"\mu", "T"),
        source="J. C. Maxwell, Phil. Trans. R. Soc. 157, 49 (1867)",
        where=(("e", "logarithmic strain from rest"), ("q", "internal strain of the branch")),
    ),
    parameters=(
        Parameter("modulus", "Pa", (0.0, 1e7), "of the branch", 2e3, 0.0),
        Parameter(
            "relaxation_time",
            "s",
            (1.0, 3e4),
            "of the branch",
            30.0,
            starts=(20.0, 4.0, 200.0),
            logarithmic=True,
        ),
    ),
    memory=1,
    drives=("voltage", "stretch"),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return relaxed(c, m, j, lam0, lam, since, False, 1, c[k], 1.0, c[k + 1], 1.0)


@jit
def stiffness(c, k, m, j, lam, rate):
    return c[k], 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    relaxed(c, m, j, lam0, lam, h, True, 1, c[k], 1.0, c[k + 1], 1.0)
    return 0
