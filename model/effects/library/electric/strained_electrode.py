"""Resistance of electrodes that lose contact as they are stretched, or gain it.

As ``electrode resistance``, with R = R_0 exp(g (lam - lam_rest)): carbon black, grease and thin
metal change their resistance with strain, by a gauge factor g of a few, and of tens to hundreds
near percolation. Electrodes that come apart by more than e^40 do not conduct.
"""

from __future__ import annotations

import math

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.library.electric.electrode_resistance import charged

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="strained electrode",
    family="electrode_resistance",
    acts_on="electrode",
    summary="the film charges through a resistance that changes with the stretch",
    law=Law(
        equations=(
            r"\frac{\mathrm{d}(C V)}{\mathrm{d}t} = \frac{U - V}{R_0 \exp(g \delta)}",
            r"C = C_0 \left(\frac{Z}{z}\right)^2",
            r"\delta = \lambda - \lambda_0",
        ),
        symbols=("R_0", "g"),
        source=(
            "a resistance whose logarithm is proportional to strain: of films near percolation"
        ),
    ),
    parameters=(
        Parameter(
            "resistance", "ohm", (0.0, 5e9), "between the amplifier and the film at rest", 1e7, 0.0
        ),
        Parameter(
            "gauge",
            "",
            (-300.0, 300.0),
            "relative change of the resistance per change of stretch",
            5.0,
            starts=(10.0, 100.0),
        ),
    ),
    memory=1,
)


_APART = 40.0  # e^40 times 1 Mohm and 1 pF is a time of 7,000 years


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    resistance = c[k] * math.exp(min(c[k + 1] * (lam - c[REST]), _APART))
    return charged(c, m, j, resistance, start, end, h, lam, rate)
