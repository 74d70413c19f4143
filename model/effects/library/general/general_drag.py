"""Drag that grows with the rate in any form.

At rest the drag is linear. The last step goes on with the slope that it has at its knot.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.compiled.jit import jit
from dearig.model.effects.hooks import FASTEST
from dearig.model.effects.shared.general import Axis, SmoothSteps, Weights, general
from dearig.model.effects.shared.splines import rise, spline

__all__ = ["EFFECT", "stiffness", "stress"]

_STEPS = 6
_PLACES = (6e-3, 1.8e-2, 5.4e-2, 0.162, 0.486)  # 1/s
_KNOTS = (0.0, 0.0, *_PLACES, math.inf)


class _OverRates(SmoothSteps):
    def range(self) -> np.ndarray:
        """Return rates of every order."""
        return np.concatenate(([0.0], np.geomspace(2e-4, FASTEST, 60)))


EFFECT = general(
    name="general drag",
    family="drag",
    acts_on="load",
    summary="a force against the motion that grows with its rate, in any form",
    equations=(
        r"\sigma = \sigma_0 + \operatorname{sign}(\dot{\lambda}) \sum_{i=1}^{6} d_i "
        r"B_i(|\dot{\lambda}|)",
    ),
    shapes=_OverRates(
        _KNOTS,
        "with the knots i - 1, i and i + 1 of 0, 0.006, 0.018, 0.054, 0.162 and 0.486 1/s, none "
        "below the first; beyond the last it goes on with its slope",
    ),
    weights=Weights(
        "drag", "d", "Pa", (0.0, 1e5), "gained at step", 4.0, stands_for="stress gained at step i"
    ),
    over=Axis("rate of stretch (1/s)"),
    shows=Axis("drag (Pa)"),
    is_hysteretic=True,  # steep at rest: turning points need short steps
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return math.copysign(spline(c, k, abs(rate), _KNOTS), rate)


@jit
def stiffness(c, k, m, j, lam, rate):
    if abs(rate) <= FASTEST:
        return 0.0, rise(c, k, abs(rate), _KNOTS)
    # the slope is straight between knots: the largest is at one of them
    largest = rise(c, k, 0.0, _KNOTS)
    for place in _PLACES:
        largest = max(largest, rise(c, k, place, _KNOTS))
    return 0.0, largest
