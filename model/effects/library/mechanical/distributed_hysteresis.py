"""Rate-independent hysteresis as a distribution of yielding elements (Prandtl and Ishlinskii).

Equal elements in parallel, each a spring that slips beyond its own threshold of strain. The part of
them that slips below the threshold s is (s/r)^(1/p) up to the reach r, a power law as
in Segalman (J. Appl. Mech. 72, 2005). With the spread p = 1 the thresholds are evenly spaced and
small loops are parabolic (Rayleigh); near 0 all slip at once; a large p rounds the loop from its
beginning. Twenty-four elements follow the loop of infinitely many within 1e-3 of the largest
stress.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_ELEMENTS = 24
_LOGS = tuple(math.log((i + 0.5) / _ELEMENTS) for i in range(_ELEMENTS))

EFFECT = Effect(
    name="distributed hysteresis",
    family="rate_independent_hysteresis",
    acts_on="film stress",
    summary="hysteresis loops at any speed, narrow for small strokes and wide for large ones",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + \frac{k}{24} \sum_{i=1}^{24} z_i",
            (
                r"\dot{z}_i = \dot{\lambda} \quad \mathrm{within} \quad |z_i| \le r \left(\frac{i "
                r"- 1/2}{24}\right)^p"
            ),
        ),
        symbols=("k", "r", "p"),
        source="D. J. Segalman, J. Appl. Mech. 72, 752 (2005)",
        where=(("z_i", "strain of element i, which slips at its threshold"),),
    ),
    parameters=(
        Parameter(
            "stiffness", "Pa", (0.0, 1e6), "of all elements together before one slips", 3e3, 0.0
        ),
        Parameter(
            "reach",
            "",
            (1e-3, 2.0),
            "upper end of the thresholds, as a change of stretch",
            2e-2,
            starts=(2e-2, 5e-3, 0.5),
            logarithmic=True,
        ),
        Parameter(
            "spread",
            "",
            (0.05, 4.0),
            "of the thresholds: 0 all at the reach, 1 evenly up to it",
            0.1,
            starts=(1.0,),
        ),
    ),
    memory=2 * _ELEMENTS,  # where each is, and its threshold
    drives=("voltage", "stretch"),
)


@jit
def _place_thresholds(c, k, m, j):
    """Once, behind the elements' places in the memory: they never change."""
    if m[j + _ELEMENTS] == 0.0:
        for i in range(_ELEMENTS):
            m[j + _ELEMENTS + i] = c[k + 1] * math.exp(c[k + 2] * _LOGS[i])


@jit
def _strained(m, at, travel):
    """The element at ``at`` of the memory after ``travel``: no further than where it slips."""
    threshold = m[at + _ELEMENTS]
    return min(max(m[at] + travel, -threshold), threshold)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    _place_thresholds(c, k, m, j)
    total = 0.0
    for i in range(j, j + _ELEMENTS):
        total += _strained(m, i, lam - lam0)
    return c[k] * total / _ELEMENTS


@jit
def stiffness(c, k, m, j, lam, rate):
    return c[k], 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    _place_thresholds(c, k, m, j)
    for i in range(j, j + _ELEMENTS):
        m[i] = _strained(m, i, lam - lam0)
    return 0
