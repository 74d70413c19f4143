"""Current through the film, and the part of the voltage that it drops before it gets there.

Of the voltage V that is supplied, a film of conductivity g(E) gets v with v (1 + r g) = V: behind a
resistance the current that the film takes lowers the field by which it conducts.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.jit import jit

__all__ = ["CROWDED", "HOPS", "REMEMBERED", "behind", "conductivity"]

#: As the exponent of the field: charges hop, or crowd.
HOPS, CROWDED = 0.0, -1.0
#: Numbers that ``behind`` remembers.
REMEMBERED = 4

_REFERENCE = 8e3  # V over the unstretched film
_TOLERANCE = 1e-4  # of the voltage, the last of Newton's steps: what is left is its square
_ITERATIONS = 30


@jit
def conductivity(growth: float, exponent: float, field: float) -> tuple[float, float]:
    """Over that at ``field`` 1; and how it grows, d(ln g)/d(ln E).

    Of traps which the field empties exp(b (E^n - 1)), of hops (``HOPS``) sinh(b E)/E over the same,
    of charges that crowd (``CROWDED``) E^b.
    """
    if exponent == CROWDED:
        return field**growth, growth
    steep = growth * field
    if exponent == HOPS:
        if steep < 1e-3:
            return growth / math.sinh(growth), 0.0
        return math.sinh(steep) / (field * math.sinh(growth)), steep / math.tanh(steep) - 1.0
    power = field**exponent
    return math.exp(growth * (power - 1.0)), growth * exponent * power


@jit
def _reached(
    ratio: float, growth: float, exponent: float, supplied: float, lam: float, guess: float
) -> tuple[float, float]:
    """Voltage at the film in V by Newton's steps from a ``guess``; the current is convex.

    And how it follows what is supplied, d(ln v)/d(ln V).
    """
    if supplied <= 0.0:
        return 0.0, 1.0
    v, follows = guess, 1.0
    for _ in range(_ITERATIONS):
        conducts, grows = conductivity(growth, exponent, v * lam / _REFERENCE)
        drop = ratio * conducts
        slope = 1.0 + drop * (1.0 + grows)
        change = (v * (1.0 + drop) - supplied) / slope
        v = min(max(v - change, 0.0), supplied)
        follows = (1.0 + drop) / slope
        if abs(change) < _TOLERANCE * supplied:
            break
    return v, follows


@jit
def behind(
    m: np.ndarray,
    j: int,
    loss: float,
    growth: float,
    exponent: float,
    start: float,
    end: float,
    h: float,
    lam: float,
    eased: float,
) -> tuple[float, float]:
    """Voltage at the film before and after ``h`` s in which it goes from ``start`` to ``end`` V.

    ``loss`` is the part that is lost at 8 kV over the unstretched film; stretched by ``lam``, it
    conducts ``eased`` times as well in the same field. ``REMEMBERED`` numbers are: the ratio r, and
    of the step before the voltage that it ended at, that at the film then, and how the one follows
    the other. A step begins where the one before has ended; from there the next voltage at the film
    is foreseen so well that one of Newton's steps will do. With ``h`` = 0 none is made.
    """
    if m[j] == 0.0:
        left = 1.0 - loss
        m[j] = loss / (left * conductivity(growth, exponent, left)[0])
    first, last = abs(start), abs(end)
    if first != m[j + 1]:
        guess = m[j + 2] if 0.0 < m[j + 2] <= first else first
        m[j + 2], m[j + 3] = _reached(m[j] * eased, growth, exponent, first, lam, guess)
        m[j + 1] = first
    before = m[j + 2]
    if h > 0.0:
        guess = last
        if first > 0.0:
            guess = min(max(before * (1.0 + m[j + 3] * (last / first - 1.0)), 0.0), last)
        m[j + 2], m[j + 3] = _reached(m[j] * eased, growth, exponent, last, lam, guess)
        m[j + 1] = last
    return math.copysign(before, start), math.copysign(m[j + 2], end)
