"""Leakage current through the film, and the voltage that it drops over a series resistance.

Of a supplied voltage V, a film of conductivity g(E) behind a resistance gets v, with
v (1 + r g) = V. The current that the film takes lowers the field, on which its conductivity
depends.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.compiled.jit import jit

__all__ = ["CROWDED", "HOPS", "REFERENCE", "REMEMBERED", "behind", "conductivity", "dropped"]

#: Values of the exponent that name a law: hopping conduction, space-charge-limited current.
HOPS, CROWDED = 0.0, -1.0
#: Numbers of internal state of ``behind``.
REMEMBERED = 4

REFERENCE = 8e3  #: V over the unstretched film, whose field is 1
_TOLERANCE = 1e-4  # of the voltage, the last of Newton's steps: what is left is its square
_ITERATIONS = 30


@jit
def conductivity(growth: float, exponent: float, field: float) -> tuple[float, float]:
    """Return the conductivity over that at ``field`` 1, and its slope d(ln g)/d(ln E).

    Traps that the field empties give exp(b (E^n - 1)), with b the ``growth`` and n the
    ``exponent``. Hopping (``HOPS``) gives sinh(b E)/(E sinh b), space charge (``CROWDED``) E^b.
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
    """Return the voltage at the film in V, and d(ln v)/d(ln V).

    Newton's method from a ``guess``; the current is convex, so that it converges.
    """
    if supplied <= 0.0:
        return 0.0, 1.0
    v, follows = guess, 1.0
    for _ in range(_ITERATIONS):
        conducts, grows = conductivity(growth, exponent, v * lam / REFERENCE)
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
    """Return the voltage at the film before and after ``h`` s.

    The supplied voltage goes from ``start`` to ``end`` V. ``loss`` is the part lost at 8 kV over
    the unstretched film; stretched by ``lam``, the film conducts ``eased`` times as well in the
    same field. The state ``m[j : j + REMEMBERED]`` holds the ratio r and, of the end of the step
    before, the supplied voltage, the voltage at the film and d(ln v)/d(ln V). A step begins where
    the one before has ended; the state predicts the next voltage so well that one Newton step is
    enough. With ``h`` = 0 no step is made.
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


@jit
def dropped(m: np.ndarray, j: int, voltage: float) -> float:
    """Return the voltage that ``behind`` has lost at the end of its last step, signed as it."""
    return math.copysign(m[j + 1] - m[j + 2], voltage)
