"""Sensor nonlinearity of any form: the reading is a smooth function of the position.

The reading is x + sum_i a_i B_i(x), with steps B_i (``model.splines``) on even knots up to the
travel. At rest it is right, with the slope 1. The weights a_i have either sign.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.shared.splines import step

__all__ = ["EFFECT", "sense"]

_STEPS = 8


@jit
def _error(c, k, x):
    spacing, total = c[k + _STEPS] / _STEPS, 0.0
    for i in range(_STEPS):
        if c[k + i] != 0.0:
            left = i * spacing
            total += c[k + i] * step(x, left, left + spacing, left + 2.0 * spacing)
    return total


def _over_position(values: Mapping[str, float]) -> Curve:
    """Return the error of the reading over the position."""
    c = np.array([values[f"error_{i + 1}"] for i in range(_STEPS)] + [values["travel"]])
    x = np.linspace(0.0, 1.2 * values["travel"], 80)
    error = np.array([_error(c, 0, at) for at in x])
    return Curve(x * 1e3, error * 1e6, "position (mm)", "error of the reading (um)")


EFFECT = Effect(
    name="general sensor curve",
    family="sensor_nonlinearity",
    acts_on="sensor",
    summary="the reading is a smooth curve of the position",
    law=Law(
        equations=(r"r = x + \sum_{i=1}^{8} a_i B_i(x)",),
        symbols=(*(f"a_{i}" for i in range(1, 9)), r"x_f"),
        source="J. O. Ramsay, Statistical Science 3, 425 (1988)",
        where=(
            (
                "B_i",
                (
                    "smooth step from 0 to 1, the integral of a hat of area 1 with its knots "
                    "at i - 1, i and i + 1 times x_f/8"
                ),
            ),
            ("a_i", "weight of step i"),
        ),
    ),
    parameters=(
        *(
            Parameter(f"error_{i + 1}", "m", (-1e-3, 1e-3), f"gained at step {i + 1}", 3e-6, 0.0)
            for i in range(_STEPS)
        ),
        Parameter(
            "travel",
            "m",
            (1e-4, 0.1),
            "position of the last step",
            1.5e-3,
            starts=(1.0,),
            logarithmic=True,
            relative_to="displacement",
        ),
    ),
    is_general=True,
    curve=_over_position,
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + _error(c, k, x)
