"""Leakage that grows with moisture: ions in the water of the film carry a current.

Of the supplied voltage a part is lost in the electrodes, as in ``leakage`` with a conductivity that
does not depend on the field. It grows as exp(g w), with the moisture w of ``moist_stiffness``.
"""

from __future__ import annotations

import math

from dearig.model.coefficients import AIR_HUMIDITY
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.library.room.moist_stiffness import (
    CRANK,
    SORPTION,
    SORPTION_TIME,
    WETNESS,
)
from dearig.model.effects.shared.conduction import REMEMBERED, behind, dropped
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "breathe", "drop", "supply"]

EFFECT = Effect(
    name="moist leakage",
    family="humidity",
    acts_on="electrode",
    summary="the film gets less voltage than the amplifier supplies, the more the moister it is",
    law=Law(
        equations=(
            r"V \left(1 + \frac{s}{1 - s} \exp(g w)\right) = U",
            SORPTION,
        ),
        symbols=("s", "g", r"\tau"),
        source=CRANK,
        where=WETNESS,
    ),
    parameters=(
        Parameter("loss", "", (0.0, 0.5), "relative loss of voltage at 50 % humidity", 0.02, 0.0),
        Parameter(
            "growth",
            "",
            (0.5, 15.0),
            "of its logarithm from a dry to a saturated room",
            4.0,
            starts=(4.0, 8.0),
        ),
        SORPTION_TIME,
    ),
    memory=REMEMBERED + 1,
    needs="humidity",
)

_OHMIC = 0.0  # growth with the field, of any exponent


@jit
def breathe(c, k, m, j, warmth, moisture, h):
    at = j + REMEMBERED
    m[at] = lagged(m[at], moisture, moisture, h, c[k + 2])
    return 0


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    moister = math.exp(c[k + 1] * (c[AIR_HUMIDITY] + m[j + REMEMBERED]))
    return behind(m, j, c[k], _OHMIC, 1.0, start, end, h, lam, moister)


@jit
def drop(c, k, m, j, voltage):
    return dropped(m, j, voltage)
