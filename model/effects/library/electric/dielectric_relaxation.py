"""Slow polarisation: a part of the permittivity follows the field with a delay (Debye).

With the slow polarisation in proportion to u, u' = (V - u)/tau, the stress D E is
eps V (V + d u)/(1 + g d): the force grows a little while the voltage is constant. With
g = 1 eps is the permittivity at rest, with g = 0 that of fast fields: data sheets give either.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "polarise"]

#: What a permittivity means: of every effect of this family.
SETTLED = Parameter(
    "settled",
    "",
    (0.0, 1.0),
    "1 if the film's permittivity is that at rest, 0 if that of fast fields",
    1.0,
    starts=(1.0,),
)

EFFECT = Effect(
    name="dielectric relaxation",
    family="dielectric_relaxation",
    acts_on="dielectric",
    summary="part of the force follows the voltage with a delay, at any stretch",
    law=Law(
        equations=(r"V_E^2 = \frac{V (V + d\,u)}{1 + g d}", r"T \dot{u} = V - u"),
        symbols=("d", "T", "g"),
        source="P. Debye, Polar Molecules (1929)",
        where=(("u", "slow polarisation, as a voltage"),),
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
            starts=(0.1, 0.02, 0.5, 3.0),
            logarithmic=True,
        ),
        SETTLED,
    ),
    memory=1,
)


@jit
def polarise(c, k, m, j, start, end, h):
    before = m[j]
    m[j] = lagged(before, start, end, h, c[k + 1])
    share = c[k] / (1.0 + c[k + 2] * c[k])
    return (
        share * start * (before - c[k + 2] * start),
        share * end * (m[j] - c[k + 2] * end),
    )
