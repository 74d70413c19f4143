"""Permittivity that changes with the stretch in any form."""

from __future__ import annotations

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Parameter
from dearig.model.effects.shared.general import Axis, SmoothSteps, Weights, general
from dearig.model.effects.shared.splines import even, spline

__all__ = ["EFFECT", "permittivity"]

_STEPS = 6
_KNOTS = even(_STEPS, 5, at_rest=True)

EFFECT = general(
    name="general strain-dependent permittivity",
    family="permittivity",
    acts_on="dielectric",
    summary="the force of the field changes with the stretch, in any form",
    equations=(
        r"\sigma_E = \max\left(1 + \sum_{i=1}^{6} a_i B_i(\lambda - \lambda_0), "
        r"0.05\right) \sigma_M",
    ),
    shapes=SmoothSteps(_KNOTS, "with its knots at i - 2, i - 1 and i times r/5, none below 0"),
    weights=Weights(
        "change", "a", "", (-1.0, 1.0), "of the permittivity at step", 5e-3,
        stands_for="weight of step i",
    ),
    scale=(
        Parameter(
            "reach", "", (2e-3, 5.0), "change of stretch at the last step", 2.4e-2,
            starts=(2.4e-2,), logarithmic=True,
        ),
        "r",
    ),
    over=Axis("change of stretch"),
    shows=Axis("permittivity over that at rest"),
    onto=1.0,
)  # fmt: skip


@jit
def permittivity(c, k, m, j, lam, field2):
    return max(1.0 + spline(c, k, (lam - c[REST]) / c[k + _STEPS], _KNOTS), 0.05)
