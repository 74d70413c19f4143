"""Resistance of electrodes that changes with the humidity of the room, without delay.

Carbon in a binder that swells loses contacts, and salts that dissolve conduct: either sign. The
film charges through R exp(g (h - 0.5)), h the relative humidity from 0 to 1, as in
``electrode_resistance``. Electrodes are thin and open to the air, so they follow it at once.
"""

from __future__ import annotations

import math

from dearig.model.coefficients import AIR_HUMIDITY
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.library.electric.electrode_resistance import charged

__all__ = ["EFFECT", "breathe", "supply"]

EFFECT = Effect(
    name="moist electrodes",
    family="humidity",
    acts_on="electrode",
    summary="the film charges through a resistance that follows the humidity of the room",
    law=Law(
        equations=(
            (
                r"\frac{\mathrm{d}(C V)}{\mathrm{d}t} = \frac{U - V}{R \exp\left(g \left(h - "
                r"1/2\right)\right)}"
            ),
            r"C = C_0 \left(\frac{Z}{z}\right)^2",
        ),
        symbols=("R", "g"),
        source="a resistance whose logarithm is proportional to humidity",
    ),
    parameters=(
        Parameter("resistance", "ohm", (0.0, 5e9), "at a relative humidity of 50 %", 1e7, 0.0),
        Parameter(
            "growth",
            "",
            (-8.0, 8.0),
            "of its logarithm from a dry to a saturated room",
            2.0,
            starts=(2.0, -2.0),
        ),
    ),
    memory=2,
    needs="humidity",
)


@jit
def breathe(c, k, m, j, warmth, moisture, h):
    m[j + 1] = moisture
    return 0


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    resistance = c[k] * math.exp(c[k + 1] * (c[AIR_HUMIDITY] + m[j + 1]))
    return charged(c, m, j, resistance, start, end, h, lam, rate)
