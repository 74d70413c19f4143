"""Quadratic I-splines: monotone steps from 0 to 1, of which general laws are made.

The derivative of a step is a hat, so a sum of neighbouring steps has a piecewise linear derivative
and no corners (Ramsay, Statistical Science 3, 1988). Non-negative weights give monotone curves.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit

__all__ = ["hat", "step"]


@jit
def step(x: float, left: float, middle: float, right: float) -> float:
    """Return the integral up to ``x`` of a hat from ``left`` over ``middle`` to ``right``, area 1.

    ``left`` may be ``middle``: then the hat begins at its top.
    """
    if x <= left:
        return 0.0
    if x >= right:
        return 1.0
    if x < middle:
        return (x - left) * (x - left) / ((middle - left) * (right - left))
    return 1.0 - (right - x) * (right - x) / ((right - middle) * (right - left))


@jit
def hat(x: float, left: float, middle: float, right: float) -> float:
    """Return the derivative of ``step``."""
    if x < left or x >= right:
        return 0.0
    if x < middle:
        return 2.0 * (x - left) / ((middle - left) * (right - left))
    return 2.0 * (right - x) / ((right - middle) * (right - left))
