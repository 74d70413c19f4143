"""Drag that grows with the rate in any form.

The nominal stress sum_i d_i B_i(|lam'|) sign(lam') acts against the motion, with steps B_i
(``model.splines``) on knots at 0 and three times apart from 6e-3/s on; the last one goes on with
the slope that it has at its knot. At rest the drag is linear. The weights d_i are the stresses that
the drag gains from step to step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.hooks import FASTEST
from dearig.model.effects.shared.splines import hat, step

__all__ = ["EFFECT", "stiffness", "stress"]

_KNOTS = (0.0, 6e-3, 1.8e-2, 5.4e-2, 0.162, 0.486)  # 1/s
_STEPS = len(_KNOTS)
_LAST, _BEFORE = _KNOTS[-1], _KNOTS[-2]
_WIDTH = _LAST - _BEFORE


@jit
def _drag(c, k, rate):
    """Stress in Pa at the rate, which is not negative, and its slope in Pa s."""
    total, slope = 0.0, 0.0
    for i in range(_STEPS - 1):
        if c[k + i] > 0.0:
            left, middle, right = _KNOTS[max(i - 1, 0)], _KNOTS[i], _KNOTS[i + 1]
            total += c[k + i] * step(rate, left, middle, right)
            slope += c[k + i] * hat(rate, left, middle, right)
    if rate > _BEFORE:
        inside = (min(rate, _LAST) - _BEFORE) / _WIDTH
        beyond = max(rate - _LAST, 0.0) / _WIDTH
        total += c[k + _STEPS - 1] * (inside * inside + 2.0 * beyond)
        slope += 2.0 * c[k + _STEPS - 1] * inside / _WIDTH
    return total, slope


def _over_rate(values: Mapping[str, float]) -> Curve:
    """Return the drag over the rate."""
    c = np.array([values[f"drag_{i + 1}"] for i in range(_STEPS)])
    rate = np.concatenate(([0.0], np.geomspace(2e-4, FASTEST, 60)))
    drag = np.array([_drag(c, 0, r)[0] for r in rate])
    return Curve(rate, drag, "rate of stretch (1/s)", "drag (Pa)")


EFFECT = Effect(
    name="general drag",
    family="drag",
    acts_on="load",
    summary="a force against the motion that grows with its rate, in any form",
    law=Law(
        equations=(
            (
                r"\sigma = \sigma_0 + \operatorname{sign}(\dot{\lambda}) \sum_{i=1}^{6} d_i "
                r"B_i(|\dot{\lambda}|)"
            ),
        ),
        symbols=tuple(f"d_{i}" for i in range(1, 7)),
        source="J. O. Ramsay, Statistical Science 3, 425 (1988)",
        where=(
            (
                "B_i",
                (
                    "smooth step from 0 to 1, the integral of a hat of area 1 with the knots i "
                    "- 1, i and i + 1 of 0, 0.006, 0.018, 0.054, 0.162 and 0.486 1/s, none "
                    "below the first; beyond the last it goes on with its slope"
                ),
            ),
            ("d_i", "stress gained at step i"),
        ),
    ),
    parameters=tuple(
        Parameter(f"drag_{i + 1}", "Pa", (0.0, 1e5), f"gained at step {i + 1}", 4.0, 0.0)
        for i in range(_STEPS)
    ),
    is_hysteretic=True,  # steep at rest: turning points need short steps
    is_general=True,
    curve=_over_rate,
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    drag, _ = _drag(c, k, abs(rate))
    return math.copysign(drag, rate)


@jit
def stiffness(c, k, m, j, lam, rate):
    if abs(rate) <= FASTEST:
        _, slope = _drag(c, k, abs(rate))
        return 0.0, slope
    # the slope is straight between knots: the largest is at one of them
    largest = 0.0
    for i in range(_STEPS):
        _, slope = _drag(c, k, _KNOTS[i])
        largest = max(largest, slope)
    return 0.0, largest
