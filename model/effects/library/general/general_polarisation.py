"""Slow polarisation of any form: Debye terms on a fixed grid of relaxation times.

Eight terms as in ``dielectric_relaxation``; each is three times slower than the one before. Their
strengths are the weights; the force is linear in them: eps V (V + sum d_i (u_i - g V)), g as there.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.library.electric.dielectric_relaxation import SETTLED
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "polarise"]

_TERMS = 8
_RATIO = 3.0  # of neighbouring relaxation times


def _response(values: Mapping[str, float]) -> Curve:
    """Return the slow part of the permittivity after a step of the field."""
    times = values["relaxation_time"] * _RATIO ** np.arange(float(_TERMS))
    time = np.geomspace(0.1 * times[0], times[-1], 60)
    strengths = np.array([values[f"strength_{i + 1}"] for i in range(_TERMS)])
    slow = -np.expm1(-time[:, None] / times) @ strengths
    return Curve(time, slow, "time after a step (s)", "slow part of the permittivity")


EFFECT = Effect(
    name="general polarisation",
    family="dielectric_relaxation",
    acts_on="dielectric",
    summary="part of the force follows the voltage late, with times of any distribution",
    law=Law(
        equations=(
            r"V_E^2 = V \left(V + \sum_{i=1}^{8} d_i (u_i - g V)\right)",
            r"3^{i - 1}\,T \dot{u}_i = V - u_i",
        ),
        symbols=(*(f"d_{i}" for i in range(1, 9)), "T", "g"),
        source="a Prony series of P. Debye's terms, Polar Molecules (1929)",
        where=(("u_i", "slow polarisation of term i, as a voltage"), ("d_i", "strength of term i")),
    ),
    parameters=(
        *(
            Parameter(f"strength_{i + 1}", "", (0.0, 1.0), f"of term {i + 1}", 3e-3, 0.0)
            for i in range(_TERMS)
        ),
        Parameter(
            "relaxation_time",
            "s",
            (1e-3, 1.0),
            "of the first term",
            6e-3,
            starts=(6e-3,),
            logarithmic=True,
        ),
        SETTLED,
    ),
    memory=_TERMS,
    is_general=True,
    curve=_response,
)


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
