"""Sensor nonlinearity of any form: the reading is a smooth function of the position.

At rest it is right, with the slope 1.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Parameter
from dearig.model.effects.shared.general import Axis, SmoothSteps, Weights, general
from dearig.model.effects.shared.splines import even, spline

__all__ = ["EFFECT", "sense"]

_STEPS = 8
_KNOTS = even(_STEPS, 8, at_rest=False)

EFFECT = general(
    name="general sensor curve",
    family="sensor_nonlinearity",
    acts_on="sensor",
    summary="the reading is a smooth curve of the position",
    equations=(r"r = x + \sum_{i=1}^{8} a_i B_i(x)",),
    shapes=SmoothSteps(_KNOTS, "with its knots at i - 1, i and i + 1 times x_f/8"),
    weights=Weights(
        "error", "a", "m", (-1e-3, 1e-3), "gained at step", 3e-6, stands_for="weight of step i"
    ),
    scale=(
        Parameter(
            "travel", "m", (1e-4, 0.1), "position of the last step", 1.5e-3,
            starts=(1.0,), logarithmic=True, relative_to="displacement",
        ),
        "x_f",
    ),
    over=Axis("position (mm)", 1e3),
    shows=Axis("error of the reading (um)", 1e6),
)  # fmt: skip


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + spline(c, k, x / c[k + _STEPS], _KNOTS)
