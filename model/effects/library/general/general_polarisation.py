"""Slow polarisation of any form: Debye terms on a fixed grid of relaxation times.

Eight terms as in ``dielectric_relaxation``; each is three times slower than the one before. Their
strengths are the weights; the force is linear in them: eps V (V + sum d_i (u_i - g V)), g as there.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Parameter
from dearig.model.effects.library.electric.dielectric_relaxation import SETTLED
from dearig.model.effects.shared.filters import lagged
from dearig.model.effects.shared.general import Axis, Relaxations, Weights, general

__all__ = ["EFFECT", "polarise"]

_TERMS = 8
_RATIO = 3.0  # of neighbouring relaxation times

EFFECT = general(
    name="general polarisation",
    family="dielectric_relaxation",
    acts_on="dielectric",
    summary="part of the force follows the voltage late, with times of any distribution",
    equations=(
        r"V_E^2 = V \left(V + \sum_{i=1}^{8} d_i (u_i - g V)\right)",
        r"3^{i - 1}\,T \dot{u}_i = V - u_i",
    ),
    source="a Prony series of P. Debye's terms, Polar Molecules (1929)",
    shapes=Relaxations(
        _TERMS, _RATIO, (("u_i", "slow polarisation of term i, as a voltage"),), is_rising=True
    ),
    weights=Weights(
        "strength", "d", "", (0.0, 1.0), "of term", 3e-3, stands_for="strength of term i"
    ),
    scale=(
        Parameter(
            "relaxation_time", "s", (1e-3, 1.0), "of the first term", 6e-3,
            starts=(6e-3,), logarithmic=True,
        ),
        "T",
    ),
    more=((SETTLED, "g"),),
    over=Axis("time after a step (s)"),
    shows=Axis("slow part of the permittivity"),
    memory=_TERMS,
)  # fmt: skip


@jit
def polarise(c, k, m, j, start, end, h):
    before, after = 0.0, 0.0
    late, settled = c[k + _TERMS], c[k + _TERMS + 1]
    for i in range(_TERMS):
        if c[k + i] > 0.0:
            before += c[k + i] * (m[j + i] - settled * start)
            m[j + i] = lagged(m[j + i], start, end, h, late)
            after += c[k + i] * (m[j + i] - settled * end)
        late *= _RATIO
    return start * before, end * after
