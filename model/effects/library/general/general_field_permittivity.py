"""Permittivity that changes with the true field in any form.

The Maxwell stress is multiplied by 1 + sum_i a_i B_i(E^2), with steps B_i (``model.splines``)
between the squares of evenly spaced fields up to the reach. The weights a_i have either sign.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dearig.model.coefficients import HELD, THICKNESS
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.shared.splines import step
from dearig.model.kinematics import thinning_squared

__all__ = ["EFFECT", "permittivity"]

_STEPS = 6


@jit
def _factor(c, k, square):
    spacing, total = c[k + _STEPS] / (_STEPS - 1), 1.0
    for i in range(_STEPS):
        if c[k + i] != 0.0:
            left, middle, right = max(i - 1, 0) * spacing, i * spacing, (i + 1) * spacing
            total += c[k + i] * step(square, left * left, middle * middle, right * right)
    return max(total, 0.05)


def _over_field(values: Mapping[str, float]) -> Curve:
    """Return the permittivity over the field."""
    c = np.array([values[f"change_{i + 1}"] for i in range(_STEPS)] + [values["reach"]])
    field = np.linspace(0.0, 1.2 * values["reach"], 60)
    factor = np.array([_factor(c, 0, e * e) for e in field])
    return Curve(field * 1e-6, factor, "true field (MV/m)", "permittivity over that at rest")


EFFECT = Effect(
    name="general field-dependent permittivity",
    family="permittivity",
    acts_on="dielectric",
    summary="the force is not proportional to the square of the field, in any form",
    law=Law(
        equations=(
            r"\sigma_E = \max\left(1 + \sum_{i=1}^{6} a_i B_i(E^2), 0.05\right) \sigma_M",
            r"E = \frac{V}{z}",
        ),
        symbols=(*(f"a_{i}" for i in range(1, 7)), r"E_f"),
        source="J. O. Ramsay, Statistical Science 3, 425 (1988)",
        where=(
            (
                "B_i",
                (
                    "smooth step from 0 to 1, the integral of a hat of area 1 with its knots "
                    "at the squares of i - 2, i - 1 and i times E_f/5, none below 0"
                ),
            ),
            ("a_i", "weight of step i"),
        ),
    ),
    parameters=(
        *(
            Parameter(
                f"change_{i + 1}",
                "",
                (-1.0, 1.0),
                f"of the permittivity at step {i + 1}",
                5e-3,
                0.0,
            )
            for i in range(_STEPS)
        ),
        Parameter(
            "reach",
            "V/m",
            (1e6, 1e9),
            "true field at the last step",
            1e7,
            starts=(1e7,),
            logarithmic=True,
        ),
    ),
    is_general=True,
    curve=_over_field,
)


@jit
def permittivity(c, k, m, j, lam, field2):
    square = field2 * thinning_squared(int(c[HELD]), lam) / (c[THICKNESS] * c[THICKNESS])
    return _factor(c, k, square)
