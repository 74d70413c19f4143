"""Slow polarisation spread over many times, as most polymers have it: a broad Debye spectrum.

Six Debye terms as of ``dielectric_relaxation``, T_i = T exp(w z_i) with the weights of a bell curve
over ln T of width w (a log-normal spectrum; Cole and Cole's, J. Chem. Phys. 9, 341 (1941), is alike
but for its tails), at z_i = -2.5, -1.5 ... 2.5.
"""

from __future__ import annotations

import math

from model.effects.description import Effect, Parameter
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
            "width",
            "",
            (0.2, 3.0),
            "of the spectrum, in the logarithm of time",
            1.5,
            starts=(1.5,),
            logarithmic=True,
        ),
        Parameter(
            "settled",
            "",
            (0.0, 1.0),
            "1 where the film's data give the permittivity at rest, 0 where that of fast fields",
            1.0,
            starts=(1.0,),
        ),
    ),
    memory=6,
)

_TERMS = 6
_FIRST = -2.5
_WEIGHTS = tuple(
    math.exp(-0.5 * (_FIRST + i) ** 2) / sum(math.exp(-0.5 * (_FIRST + n) ** 2) for n in range(6))
    for i in range(_TERMS)
)


@jit
def polarise(c, k, m, j, start, end, h):
    before, after = 0.0, 0.0
    for i in range(_TERMS):
        slow = m[j + i]
        before += _WEIGHTS[i] * slow
        m[j + i] = lagged(slow, start, end, h, c[k + 1] * math.exp(c[k + 2] * (_FIRST + i)))
        after += _WEIGHTS[i] * m[j + i]
    share = c[k] / (1.0 + c[k + 3] * c[k])
    return (
        share * start * (before - c[k + 3] * start),
        share * end * (after - c[k + 3] * end),
    )
