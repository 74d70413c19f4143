"""Permittivity of a film that takes up moisture: water has 80, the film a few.

The Maxwell stress is multiplied by 1 + a w, with the moisture w of ``moist_stiffness``.
"""

from __future__ import annotations

from dearig.model.coefficients import AIR_HUMIDITY
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.library.room.moist_stiffness import (
    CRANK,
    SORPTION,
    SORPTION_TIME,
    WETNESS,
    breathe,
)

__all__ = ["EFFECT", "breathe", "permittivity"]

EFFECT = Effect(
    name="moist permittivity",
    family="humidity",
    acts_on="dielectric",
    summary="the permittivity follows the humidity of the room, slowly",
    law=Law(
        equations=(
            r"\sigma_E = \max(1 + a w, 0.02)\,\sigma_M",
            SORPTION,
        ),
        symbols=("a", r"\tau"),
        source=CRANK,
        where=WETNESS,
    ),
    parameters=(
        Parameter(
            "gain",
            "",
            (-0.9, 1.9),
            "relative change of the permittivity from a dry to a saturated room",
            0.1,
            0.0,
        ),
        SORPTION_TIME,
    ),
    memory=1,
    needs="humidity",
)


@jit
def permittivity(c, k, m, j, lam, field2):
    return max(1.0 + c[k] * (c[AIR_HUMIDITY] + m[j]), 0.02)
