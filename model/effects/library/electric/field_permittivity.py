"""Permittivity that changes with the true field: saturation of dipoles, or electrostriction.

The Maxwell stress is multiplied by 1/(1 - b (E/E_0)^2), E_0 = 8 MV/m, E = V/z the true field.
"""

from __future__ import annotations

from dearig.model.coefficients import HELD, THICKNESS
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.kinematics import thinning_squared

__all__ = ["EFFECT", "permittivity"]

EFFECT = Effect(
    name="field-dependent permittivity",
    family="permittivity",
    acts_on="dielectric",
    summary="the force is not proportional to the square of the field",
    law=Law(
        equations=(
            r"\sigma_E = \frac{\sigma_M}{\max\left(1 - b (E/E_0)^2, 0.2\right)}",
            r"E = \frac{V}{z}",
            r"E_0 = 8\,\mathrm{MV/m}",
        ),
        symbols=("b",),
        source="the first term of a series in the square of the field",
        where=(("E_0", "field of reference"),),
    ),
    parameters=(
        Parameter(
            "field_coefficient",
            "",
            (-2.0, 0.5),
            "relative change of the permittivity at 8 MV/m",
            0.03,
            0.0,
        ),
    ),
)


_REFERENCE = 8e6  # V/m


@jit
def permittivity(c, k, m, j, lam, field2):
    full = c[THICKNESS] * _REFERENCE
    strength = field2 * thinning_squared(int(c[HELD]), lam) / (full * full)
    return 1.0 / max(1.0 - c[k] * strength, 0.2)
