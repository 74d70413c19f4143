"""Permittivity that changes as the film warms by its own losses, where no thermometer was recorded.

The warming T is that of ``self_heating``. The Maxwell stress is multiplied by 1 + a T.
"""

from __future__ import annotations

from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law
from dearig.model.effects.library.electric.self_heating import EFFECT as STIFFENING
from dearig.model.effects.library.electric.self_heating import WARMING, WARMTH, polarise

__all__ = ["EFFECT", "permittivity", "polarise"]

_CHANGE, _TIME = STIFFENING.parameters

EFFECT = replace(
    STIFFENING,
    name="heated permittivity",
    acts_on="dielectric",
    summary="the force of the field follows the square of the voltage, with a delay of seconds",
    law=Law(
        equations=(r"\sigma_E = \max(1 + a \theta, 0.05) \sigma_M", WARMING),
        symbols=("a", r"\tau"),
        source="Newton's law of cooling",
        where=WARMTH,
    ),
    parameters=(
        replace(
            _CHANGE,
            name="change",
            meaning="relative change of the permittivity under constant 5 kV, final",
            typical=1e-2,
        ),
        _TIME,
    ),
)


@jit
def permittivity(c, k, m, j, lam, field2):
    return max(1.0 + c[k] * m[j], 0.05)
