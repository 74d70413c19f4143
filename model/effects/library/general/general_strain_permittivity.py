"""Permittivity that changes with the stretch in any form.

The Maxwell stress is multiplied by 1 + sum_i a_i B_i(lam - lam_rest), with steps B_i
(``model.splines``) on even knots from rest up to the reach. The weights a_i have either sign.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.shared.splines import step

__all__ = ["EFFECT", "permittivity"]

_STEPS = 6


@jit
def _factor(c, k, away):
    spacing, total = c[k + _STEPS] / (_STEPS - 1), 1.0
    for i in range(_STEPS):
        if c[k + i] != 0.0:
            middle = i * spacing
            total += c[k + i] * step(away, max(middle - spacing, 0.0), middle, middle + spacing)
    return max(total, 0.05)


def _over_stretch(values: Mapping[str, float]) -> Curve:
    """Return the permittivity over the stretch."""
    c = np.array([values[f"change_{i + 1}"] for i in range(_STEPS)] + [values["reach"]])
    away = np.linspace(0.0, 1.2 * values["reach"], 60)
    factor = np.array([_factor(c, 0, e) for e in away])
    return Curve(away, factor, "change of stretch", "permittivity over that at rest")


EFFECT = Effect(
    name="general strain-dependent permittivity",
    family="permittivity",
    acts_on="dielectric",
    summary="the force of the field changes with the stretch, in any form",
    law=Law(
        equations=(
            (
                r"\sigma_E = \max\left(1 + \sum_{i=1}^{6} a_i B_i(\lambda - \lambda_0), "
                r"0.05\right) \sigma_M"
            ),
        ),
        symbols=(*(f"a_{i}" for i in range(1, 7)), "r"),
        source="J. O. Ramsay, Statistical Science 3, 425 (1988)",
        where=(
            (
                "B_i",
                (
                    "smooth step from 0 to 1, the integral of a hat of area 1 with its knots "
                    "at i - 2, i - 1 and i times r/5, none below 0"
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
            "",
            (2e-3, 5.0),
            "change of stretch at the last step",
            2.4e-2,
            starts=(2.4e-2,),
            logarithmic=True,
        ),
    ),
    is_general=True,
    curve=_over_stretch,
)


@jit
def permittivity(c, k, m, j, lam, field2):
    return _factor(c, k, lam - c[REST])
