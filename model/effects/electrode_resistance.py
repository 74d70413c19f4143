"""Resistance of the electrodes, through which the film charges; its capacitance grows with stretch.

One section: d(C V)/dt = (V_amplifier - V)/R, C = C_0 (Z/z)^2, which is C_0 lam^2 with the width
held. A film that grows lowers its own voltage, so that its ringing is damped by the resistance.
Carbon grease and powders have kilohms to megohms a square, and cracks make it more.
"""

from __future__ import annotations

from model.coefficients import CAPACITANCE, HELD
from model.effects.description import Effect, Parameter
from model.filters import lagged
from model.jit import jit
from model.kinematics import thinning_squared, thinning_squared_slope

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="electrode resistance",
    family="electrode_resistance",
    acts_on="electrode",
    words="the film charges through a resistance: a delay of the force that grows with stretch",
    parameters=(
        Parameter("resistance", "ohm", (0.0, 5e9), "between amplifier and film", 1e7, 0.0),
    ),
    memory=1,
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    held = int(c[HELD])
    squared = thinning_squared(held, lam)
    charging = 1.0 / (c[k] * c[CAPACITANCE] * squared)
    # dV/dt = charging (V_amplifier - V) - growing V: one lag, behind a part of what is supplied
    both = charging + rate * thinning_squared_slope(held, lam) / squared
    if abs(both) < 1e-6 * charging:
        both = 1e-6 * charging
    part = charging / both
    before = m[j]
    m[j] = lagged(before, part * start, part * end, h, 1.0 / both)
    return before, m[j]
