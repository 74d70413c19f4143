"""Current through the film, and the part of the voltage that it drops before it gets there.

Of the voltage V that is supplied, a film of conductivity g(E) gets v with v (1 + r g) = V: behind a
resistance the current that the film takes lowers the field by which it conducts.
"""

from __future__ import annotations

import math

import numpy as np

from model.jit import jit

__all__ = ["HOPS", "behind", "conductivity"]

#: As the exponent of the field: charges hop.
HOPS = 0.0

_REFERENCE = 8e3  # V over the unstretched film
_TOLERANCE = 1e-4  # of the voltage, the last of Newton's steps: what is left is its square
_ITERATIONS = 30


@jit
def conductivity(growth: float, exponent: float, field: float) -> tuple[float, float]:
    """Over that at ``field`` 1; and how it grows, d(ln g)/d(ln E).

    Of traps which the field empties exp(b (E^n - 1)), of hops (``HOPS``) sinh(b E)/E over the same.
    """
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
) -> float:
    """Voltage at the film in V by Newton's steps from a ``guess``; the current is convex."""
    if supplied <= 0.0:
        return 0.0
    v = guess
    for _ in range(_ITERATIONS):
        conducts, grows = conductivity(growth, exponent, v * lam / _REFERENCE)
        drop = ratio * conducts
        change = (v * (1.0 + drop) - supplied) / (1.0 + drop * (1.0 + grows))
        v = min(max(v - change, 0.0), supplied)
        if abs(change) < _TOLERANCE * supplied:
            break
    return v


@jit
def behind(
    m: np.ndarray,
    j: int,
    loss: float,
    growth: float,
    exponent: float,
    start: float,
    end: float,
    lam: float,
) -> tuple[float, float]:
    """Voltage at the film before and after a step in which it goes from ``start`` to ``end`` V.

    ``loss`` is the part that is lost at 8 kV over the unstretched film. Two numbers are remembered:
    the ratio r, and the voltage at the film, from where the next one is sought.
    """
    if m[j] == 0.0:
        left = 1.0 - loss
        m[j] = loss / (left * conductivity(growth, exponent, left)[0])
    first, last = abs(start), abs(end)
    guess = m[j + 1] if 0.0 < m[j + 1] <= first else first
    before = _reached(m[j], growth, exponent, first, lam, guess)
    guess = min(before * last / first, last) if first > 0.0 else last
    after = _reached(m[j], growth, exponent, last, lam, guess)
    m[j + 1] = after
    return math.copysign(before, start), math.copysign(after, end)
