"""Permittivity that changes as the film stretches: chains align, fillers part.

The Maxwell stress is multiplied by 1 + a (lam - lam_rest).
"""

from __future__ import annotations

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "permittivity"]

EFFECT = Effect(
    name="strain-dependent permittivity",
    family="permittivity",
    acts_on="dielectric",
    summary="the force of the field changes in proportion to the stretch",
    law=Law(
        equations=(
            r"\sigma_E = \max(1 + a \delta, 0.05)\,\sigma_M",
            r"\delta = \lambda - \lambda_0",
        ),
        symbols=("a",),
        source="the first term of a series in the stretch",
    ),
    parameters=(
        Parameter("strain_coefficient", "", (-10.0, 10.0), "relative change per stretch", 0.5, 0.0),
    ),
)


@jit
def permittivity(c, k, m, j, lam, field2):
    return max(1.0 + c[k] * (lam - c[REST]), 0.05)
