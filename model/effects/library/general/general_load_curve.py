"""A load of any characteristic: a force on the film that is a smooth function of its stretch.

A magnet near the load, a spring that bends, a weight on a cam. It belongs to no named family.
"""

from __future__ import annotations

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Parameter
from dearig.model.effects.shared.general import Axis, SmoothSteps, Weights, general
from dearig.model.effects.shared.splines import even, rise, spline

__all__ = ["EFFECT", "stiffness", "stress"]

_STEPS = 6
_KNOTS = even(_STEPS, 5, at_rest=True)

EFFECT = general(
    name="general load curve",
    family="unknown",
    acts_on="load",
    summary="a force that changes with the position, in any form, at any speed",
    equations=(r"\sigma = \sigma_0 + \sum_{i=1}^{6} f_i B_i(\lambda - \lambda_0)",),
    shapes=SmoothSteps(_KNOTS, "with its knots at i - 2, i - 1 and i times r/5, none below 0"),
    weights=Weights(
        "gained", "f", "Pa", (-1e5, 1e5), "at step", 10.0, stands_for="stress gained at step i"
    ),
    scale=(
        Parameter(
            "reach", "", (2e-3, 5.0), "change of stretch at the last step", 2.4e-2,
            starts=(2.4e-2,), logarithmic=True,
        ),
        "r",
    ),
    over=Axis("change of stretch"),
    shows=Axis("stress (Pa)"),
)  # fmt: skip


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return spline(c, k, (lam - c[REST]) / c[k + _STEPS], _KNOTS)


@jit
def stiffness(c, k, m, j, lam, rate):
    # between knots the slope is straight: the largest is at one of them
    largest = 0.0
    for knot in _KNOTS:
        largest = max(largest, rise(c, k, knot, _KNOTS))
    return largest / c[k + _STEPS], 0.0
