"""Quadratic I-splines: monotone steps from 0 to 1, of which general laws are made.

The derivative of a step is a hat, so a sum of neighbouring steps has a piecewise linear derivative
and no corners (Ramsay, Statistical Science 3, 1988). Non-negative weights give monotone curves.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.compiled.jit import jit

__all__ = ["SOURCE", "even", "hat", "rise", "spline", "step"]

#: Where they were published.
SOURCE = "J. O. Ramsay, Statistical Science 3, 425 (1988)"


def even(count: int, parts: int, *, at_rest: bool) -> tuple[float, ...]:
    """Return knots of ``count`` steps, ``parts`` to 1; those ``at_rest`` begin with their slope."""
    first = (0.0,) if at_rest else ()
    return (*first, *(i / parts for i in range(count + 2 - len(first))))


@jit
def step(x: float, left: float, middle: float, right: float) -> float:
    """Return the integral up to ``x`` of a hat from ``left`` over ``middle`` to ``right``, area 1.

    ``left`` may be ``middle``: then the hat begins at its top. ``right`` may be infinite: then the
    hat is constant from ``middle`` on, and the step 1 there.
    """
    if x <= left:
        return 0.0
    if x < middle:
        wide = middle - left if right == math.inf else right - left
        return (x - left) * (x - left) / ((middle - left) * wide)
    if right == math.inf:
        return 1.0 + 2.0 * (x - middle) / (middle - left)
    if x >= right:
        return 1.0
    return 1.0 - (right - x) * (right - x) / ((right - middle) * (right - left))


@jit
def hat(x: float, left: float, middle: float, right: float) -> float:
    """Return the derivative of ``step``."""
    if x < left or x >= right:
        return 0.0
    wide = middle - left if right == math.inf else right - left
    if x < middle:
        return 2.0 * (x - left) / ((middle - left) * wide)
    if right == math.inf:
        return 2.0 / wide
    return 2.0 * (right - x) / ((right - middle) * wide)


@jit
def spline(c: np.ndarray, k: int, x: float, knots: tuple[float, ...]) -> float:
    """Return the sum of the steps on ``knots`` at ``x``, with the weights ``c[k]``, ..."""
    total = 0.0
    for i in range(len(knots) - 2):
        if c[k + i] != 0.0:
            total += c[k + i] * step(x, knots[i], knots[i + 1], knots[i + 2])
    return total


@jit
def rise(c: np.ndarray, k: int, x: float, knots: tuple[float, ...]) -> float:
    """Return the derivative of ``spline``."""
    total = 0.0
    for i in range(len(knots) - 2):
        if c[k + i] != 0.0:
            total += c[k + i] * hat(x, knots[i], knots[i + 1], knots[i + 2])
    return total
