"""Permittivity that changes with the true field in any form: steps in its square."""

from __future__ import annotations

import numpy as np

from dearig.model.coefficients import HELD, THICKNESS
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Parameter
from dearig.model.effects.shared.general import Axis, SmoothSteps, Weights, general
from dearig.model.effects.shared.splines import even, spline
from dearig.model.kinematics import thinning_squared

__all__ = ["EFFECT", "permittivity"]

_STEPS = 6
_KNOTS = tuple(knot * knot for knot in even(_STEPS, 5, at_rest=True))


class _OverFields(SmoothSteps):
    def range(self) -> np.ndarray:
        """Return even fields."""
        return np.sqrt(super().range()[-1]) * np.linspace(0.0, 1.0, 60)


EFFECT = general(
    name="general field-dependent permittivity",
    family="permittivity",
    acts_on="dielectric",
    summary="the force is not proportional to the square of the field, in any form",
    equations=(
        r"\sigma_E = \max\left(1 + \sum_{i=1}^{6} a_i B_i(E^2), 0.05\right) \sigma_M",
        r"E = \frac{V}{z}",
    ),
    shapes=_OverFields(
        _KNOTS,
        "with its knots at the squares of i - 2, i - 1 and i times E_f/5, none below 0",
    ),
    weights=Weights(
        "change", "a", "", (-1.0, 1.0), "of the permittivity at step", 5e-3,
        stands_for="weight of step i",
    ),
    scale=(
        Parameter(
            "reach", "V/m", (1e6, 1e9), "true field at the last step", 1e7,
            starts=(1e7,), logarithmic=True,
        ),
        "E_f",
    ),
    over=Axis("true field (MV/m)", 1e-6),
    shows=Axis("permittivity over that at rest"),
    onto=1.0,
    scaled=np.square,
)  # fmt: skip


@jit
def permittivity(c, k, m, j, lam, field2):
    thickness, reach = c[THICKNESS], c[k + _STEPS]
    square = field2 * thinning_squared(int(c[HELD]), lam) / (thickness * thickness)
    return max(1.0 + spline(c, k, square / (reach * reach), _KNOTS), 0.05)
