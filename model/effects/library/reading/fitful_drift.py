"""Drift of the sensor's zero without a law: a mount or a room that warms and cools, moving air.

The reading is moved by the sum of a_n (T_n(2s - 1) - T_n(-1)), n = 1 to 13, s = t/30 s. Chebyshev's
polynomials keep the amplitudes nearly independent. Thirteen of them imitate nearly anything slow.
The drift in another record does not follow from it.
"""

from __future__ import annotations

import numpy as np

from dearig.model.compiled.jit import allocating, jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

_SPAN = 30.0  # s
_RANGE = (-1e-2, 1e-2)  # m
_TERMS = 13
#: Name of each amplitude, and which polynomial it is of.
_NAMES = (
    ("linear", "first"), ("quadratic", "second"), ("cubic", "third"), ("quartic", "fourth"),
    ("quintic", "fifth"), ("sextic", "sixth"), ("septic", "seventh"), ("octic", "eighth"),
    ("nonic", "ninth"), ("decic", "tenth"), ("undecic", "eleventh"), ("duodecic", "twelfth"),
    ("tredecic", "thirteenth"),
)  # fmt: skip


@jit
def drifted(c, k, t):
    s = 2.0 * t / _SPAN - 1.0
    now, before, start, total = s, 1.0, -1.0, 0.0
    for i in range(_TERMS):
        total += c[k + i] * (now - start)
        now, before, start = 2.0 * s * now - before, now, -start
    return total


@allocating
def basis(time):
    """Return what a unit of each amplitude adds at ``time`` (N,) s: (N, 13)."""
    alone, found = np.zeros(_TERMS), np.zeros((time.size, _TERMS))
    for i in range(_TERMS):
        alone[:] = 0.0
        alone[i] = 1.0
        for n in range(time.size):
            found[n, i] = drifted(alone, 0, time[n])
    return found


EFFECT = Effect(
    name="fitful drift",
    family="drift",
    acts_on="sensor",
    summary="the reading drifts up and down many times, whatever the film does",
    law=Law(
        equations=(
            (
                r"r = x + \sum_{n=1}^{13} a_n \left(T_n\left(\frac{2 t}{30\,\mathrm{s}} - "
                r"1\right) - T_n(-1)\right)"
            ),
        ),
        symbols=tuple(f"a_{{{n}}}" for n in range(1, 14)),
        source="a series of Chebyshev polynomials",
        where=(("T_n", "Chebyshev polynomial of degree n"), ("a_n", "amplitude of degree n")),
    ),
    parameters=tuple(
        Parameter(
            name, "m", _RANGE, f"amplitude of the {which} Chebyshev polynomial over 30 s", 3e-6, 0.0
        )
        for name, which in _NAMES
    ),
    is_reproducible=False,
    drift_basis=basis,
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + drifted(c, k, t)
