"""Drift of the sensor's zero that wanders: a mount or a room that warms and cools.

A smooth walk over a record of half a minute is little more than a polynomial of the fifth degree.
The reading is moved by the sum of a_n (T_n(2s - 1) - T_n(-1)), s = t/30 s: Chebyshev's polynomials,
so that the numbers do not do each other's work. How it goes on is not known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from dearig.model.effects.description import Effect, Parameter
from dearig.model.jit import allocating, jit

__all__ = ["EFFECT", "sense"]

_SPAN = 30.0  # s

WALK = (-1e-2, 1e-2)  # m


@jit
def walked(c, k, terms, t):
    s = 2.0 * t / _SPAN - 1.0
    now, before, start, way = s, 1.0, -1.0, 0.0
    for i in range(terms):
        way += c[k + i] * (now - start)
        now, before, start = 2.0 * s * now - before, now, -start
    return way


@allocating
def ways(time, terms):
    """What each of ``terms`` numbers adds at ``time`` (N,) s: (N, terms)."""
    alone, found = np.zeros(terms), np.zeros((time.size, terms))
    for i in range(terms):
        alone[:] = 0.0
        alone[i] = 1.0
        for n in range(time.size):
            found[n, i] = walked(alone, 0, terms, time[n])
    return found


EFFECT = Effect(
    name="wandering drift",
    family="drift",
    acts_on="sensor",
    summary="the reading wanders with time, whatever the film does",
    parameters=(
        Parameter("linear", "m", WALK, "half of its part in 30 s", 3e-6, 0.0),
        Parameter("quadratic", "m", WALK, "half of its part there and back", 3e-6, 0.0),
        Parameter("cubic", "m", WALK, "half of its part with two turns", 3e-6, 0.0),
        Parameter("quartic", "m", WALK, "half of its part with three turns", 3e-6, 0.0),
        Parameter("quintic", "m", WALK, "half of its part with four turns", 3e-6, 0.0),
    ),
    is_reproducible=False,
    drift_basis=partial(ways, terms=5),
)


def finer(coarse: Effect, name: str, summary: str, more: Mapping[str, str]) -> Effect:
    """Return a drift that adds ``more`` parameters (name: number of turns) to ``coarse``."""
    added = (
        Parameter(number, "m", WALK, f"half of its part with {turns} turns", 3e-6, 0.0)
        for number, turns in more.items()
    )
    parameters = (*coarse.parameters, *added)
    follows = partial(ways, terms=len(parameters))
    return replace(
        coarse,
        name=name,
        summary=summary,
        parameters=parameters,
        generalises=coarse.name,
        drift_basis=follows,
    )


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + walked(c, k, 5, t)
