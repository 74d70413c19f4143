"""Slow polarisation with a broad spectrum of relaxation times, as in most polymers.

Cole and Cole's (J. Chem. Phys. 9, 341 (1941)): the strength is spread over y = ln(T_i/T) as
1/(cosh((1 - alpha) y) - cos(pi alpha)). The spectrum ends at
-w and w: on short ramps these ends are most of the difference between a broad and a narrow one.
Seven Debye terms as in ``dielectric_relaxation``, evenly spaced in y, represent it.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.library.electric.dielectric_relaxation import SETTLED
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "polarise"]

EFFECT = Effect(
    name="broad dielectric relaxation",
    family="dielectric_relaxation",
    acts_on="dielectric",
    summary="part of the force follows the voltage over decades of time, at any stretch",
    law=Law(
        equations=(
            r"V_E^2 = \frac{V (V + d\,u)}{1 + g d}",
            r"u = \frac{\sum_{i=0}^{6} w_i u_i}{\sum_{i=0}^{6} w_i}",
            r"w_i = \frac{1}{\cosh((1 - \alpha) y_i) - \cos \pi\alpha}",
            r"T \exp(y_i)\,\dot{u}_i = V - u_i",
            r"y_i = \left(\frac{i}{3} - 1\right) W",
        ),
        symbols=("d", "T", r"\alpha", "W", "g"),
        source="K. S. Cole and R. H. Cole, J. Chem. Phys. 9, 341 (1941)",
        where=(
            ("u_i", "slow polarisation with the time T exp(y_i), as a voltage"),
            ("u", "their weighted mean"),
            ("w_i", "density of the relaxation times"),
            ("y_i", "logarithm of a relaxation time over T"),
        ),
    ),
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
            "of Cole and Cole: the spectrum is broader for a larger one",
            0.1,
            starts=(0.4,),
        ),
        Parameter(
            "half_width",
            "",
            (1.0, 7.0),
            "ln(longest time/relaxation time), where the spectrum ends",
            1.0,
            starts=(4.0,),
        ),
        SETTLED,
    ),
    memory=7,
)

_TERMS = 7


@jit
def polarise(c, k, m, j, start, end, h):
    before, after, whole = 0.0, 0.0, 0.0
    sharp = math.cos(math.pi * c[k + 2])
    step = 2.0 * c[k + 3] / (_TERMS - 1)
    late, later = c[k + 1] * math.exp(-c[k + 3]), math.exp(step)
    side, ratio = math.exp((1.0 - c[k + 2]) * c[k + 3]), math.exp((c[k + 2] - 1.0) * step)
    for i in range(_TERMS):
        weight = 1.0 / (0.5 * (side + 1.0 / side) - sharp)
        whole += weight
        before += weight * m[j + i]
        m[j + i] = lagged(m[j + i], start, end, h, late)
        after += weight * m[j + i]
        late *= later
        side *= ratio
    share = c[k] / (1.0 + c[k + 4] * c[k])
    return (
        share * start * (before / whole - c[k + 4] * start),
        share * end * (after / whole - c[k + 4] * end),
    )
