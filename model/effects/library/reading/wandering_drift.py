"""Drift of the sensor's zero without a law: a mount or a room that warms and cools.

The reading is moved by the sum of a_n (T_n(2s - 1) - T_n(-1)), n = 1 to 5, s = t/30 s. Chebyshev's
polynomials keep the amplitudes nearly independent. Over half a minute a smooth drift is little more
than a polynomial of the fifth degree. The drift in another record does not follow from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from dearig.model.compiled.jit import allocating, jit
from dearig.model.effects.description import Effect, Parameter

__all__ = ["EFFECT", "sense"]

_SPAN = 30.0  # s

_RANGE = (-1e-2, 1e-2)  # m


@jit
def drifted(c, k, terms, t):
    s = 2.0 * t / _SPAN - 1.0
    now, before, start, total = s, 1.0, -1.0, 0.0
    for i in range(terms):
        total += c[k + i] * (now - start)
        now, before, start = 2.0 * s * now - before, now, -start
    return total


@allocating
def basis(time, terms):
    """Return what a unit of each of ``terms`` amplitudes adds at ``time`` (N,) s: (N, terms)."""
    alone, found = np.zeros(terms), np.zeros((time.size, terms))
    for i in range(terms):
        alone[:] = 0.0
        alone[i] = 1.0
        for n in range(time.size):
            found[n, i] = drifted(alone, 0, terms, time[n])
    return found


EFFECT = Effect(
    name="wandering drift",
    family="drift",
    acts_on="sensor",
    summary="the reading drifts up or down with time, whatever the film does",
    parameters=(
        Parameter(
            "linear",
            "m",
            _RANGE,
            "amplitude of the first Chebyshev polynomial over 30 s",
            3e-6,
            0.0,
        ),
        Parameter(
            "quadratic",
            "m",
            _RANGE,
            "amplitude of the second Chebyshev polynomial over 30 s",
            3e-6,
            0.0,
        ),
        Parameter(
            "cubic", "m", _RANGE, "amplitude of the third Chebyshev polynomial over 30 s", 3e-6, 0.0
        ),
        Parameter(
            "quartic",
            "m",
            _RANGE,
            "amplitude of the fourth Chebyshev polynomial over 30 s",
            3e-6,
            0.0,
        ),
        Parameter(
            "quintic",
            "m",
            _RANGE,
            "amplitude of the fifth Chebyshev polynomial over 30 s",
            3e-6,
            0.0,
        ),
    ),
    is_reproducible=False,
    drift_basis=partial(basis, terms=5),
)


def finer(coarse: Effect, name: str, summary: str, more: Mapping[str, str]) -> Effect:
    """Return a drift with ``more`` polynomials (name: ordinal) than ``coarse``."""
    added = (
        Parameter(
            number,
            "m",
            _RANGE,
            f"amplitude of the {which} Chebyshev polynomial over 30 s",
            3e-6,
            0.0,
        )
        for number, which in more.items()
    )
    parameters = (*coarse.parameters, *added)
    return replace(
        coarse,
        name=name,
        summary=summary,
        parameters=parameters,
        generalises=coarse.name,
        drift_basis=partial(basis, terms=len(parameters)),
    )


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + drifted(c, k, 5, t)
