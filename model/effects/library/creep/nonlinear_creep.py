"""Creep whose rate is a power of the stress (Norton; of chains, Bergstrom and Boyce).

``viscoplastic_flow`` without a threshold. With n = 1 it is a Maxwell branch.
"""

from __future__ import annotations

from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law
from dearig.model.effects.library.mechanical.viscoplastic_flow import EFFECT as BEYOND
from dearig.model.effects.library.mechanical.viscoplastic_flow import flowed, stiffness

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_STRESS, _REACH, _, _EXPONENT = BEYOND.parameters

EFFECT = replace(
    BEYOND,
    name="nonlinear creep",
    family="creep",
    summary="the film creeps with a power of the stress: fast where it has moved far",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + Y \frac{z}{r}",
            (
                r"\dot{z} = \dot{\lambda} - 0.01\,\mathrm{s}^{-1} "
                r"\left(\frac{|z|}{r}\right)^n \operatorname{sign} z"
            ),
        ),
        symbols=("Y", "r", "n"),
        source="J. S. Bergstrom and M. C. Boyce, J. Mech. Phys. Solids 46, 931 (1998)",
        where=(("z", "elastic stretch of the element"), ("r", "that at which it bears Y")),
    ),
    parameters=(
        _STRESS,
        _REACH,
        # a steeper one cannot be told from a threshold
        replace(_EXPONENT, bounds=(1.0, 6.0), starts=(3.0, 1.5)),
    ),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] / c[k + 1] * flowed(m[j], lam - lam0, since, c[k + 1], 0.0, c[k + 2])


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = flowed(m[j], lam - lam0, h, c[k + 1], 0.0, c[k + 2])
    return 0
