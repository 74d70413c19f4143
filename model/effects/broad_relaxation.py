"""Slow polarisation spread over many times, as most polymers have it: a broad Debye spectrum.

Cole and Cole's (J. Chem. Phys. 9, 341 (1941)): the strength is spread over y = ln(T_i/T) as
1/(cosh((1 - alpha) y) - cos(pi alpha)). Six Debye terms as of ``dielectric_relaxation`` stand for
it, at (1 - alpha) y = -2.5, -1.5 ... 2.5.
"""

from __future__ import annotations

import math

from model.effects.description import Effect, Parameter
from model.effects.dielectric_relaxation import SETTLED
from model.filters import lagged
from model.jit import jit

__all__ = ["EFFECT", "polarise"]

EFFECT = Effect(
    name="broad dielectric relaxation",
    family="dielectric_relaxation",
    acts_on="dielectric",
    words="a part of the force follows the voltage over decades of time, whatever the stretch",
    parameters=(
        Parameter(
            "strength", "", (-0.5, 2.0), "slow part of the permittivity over the fast", 0.01, 0.0
        ),
        Parameter(
            "relaxation_time",
            "s",
            (2e-3, 60.0),
            "of the slow polarisation",
            0.1,
            starts=(0.1, 1.0),
            logarithmic=True,
        ),
        Parameter(
            "alpha",
            "",
            (0.1, 0.8),
            "of Cole and Cole: the larger, the broader is the spectrum",
            0.1,
            starts=(0.4,),
        ),
        SETTLED,
    ),
    memory=6,
)

_TERMS = 6
_FIRST = -2.5
_HEIGHTS = tuple(math.cosh(_FIRST + i) for i in range(_TERMS))


@jit
def polarise(c, k, m, j, start, end, h):
    before, after, whole = 0.0, 0.0, 0.0
    sharp = math.cos(math.pi * c[k + 2])
    for i in range(_TERMS):
        weight = 1.0 / (_HEIGHTS[i] - sharp)
        whole += weight
        before += weight * m[j + i]
        late = c[k + 1] * math.exp((_FIRST + i) / (1.0 - c[k + 2]))
        m[j + i] = lagged(m[j + i], start, end, h, late)
        after += weight * m[j + i]
    share = c[k] / (1.0 + c[k + 3] * c[k])
    return (
        share * start * (before / whole - c[k + 3] * start),
        share * end * (after / whole - c[k + 3] * end),
    )
