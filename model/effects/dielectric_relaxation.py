"""Slow polarisation: a part of the permittivity follows the field with a delay (Debye).

With the slow polarisation in proportion to u, u' = (V - u)/tau, the stress D E is eps V (V + d u):
the film pulls a little harder after the voltage has stood for a while.
"""

from __future__ import annotations

from model.effects.description import Effect, Parameter
from model.filters import lagged
from model.jit import jit

__all__ = ["EFFECT", "polarise"]

EFFECT = Effect(
    name="dielectric relaxation",
    family="dielectric_relaxation",
    acts_on="dielectric",
    words="a part of the force follows the voltage with a delay of its own, whatever the stretch",
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
    ),
    memory=1,
)


@jit
def polarise(c, k, m, j, start, end, h):
    before = m[j]
    m[j] = lagged(before, start, end, h, c[k + 1])
    return c[k] * start * before, c[k] * end * m[j]
