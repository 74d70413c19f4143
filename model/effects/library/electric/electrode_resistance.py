"""Resistance of the electrodes, through which the film charges; its capacitance grows with stretch.

One section: d(C V)/dt = (V_amplifier - V)/R, C = C_0 (Z/z)^2, which is C_0 lam^2 with the width
held. A film that grows lowers its own voltage, so that its ringing is damped by the resistance.
Carbon grease and powders have kilohms to megohms a square, and cracks make it more.
"""

from __future__ import annotations

from dearig.model.coefficients import CAPACITANCE, HELD
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import lagged
from dearig.model.kinematics import thinning_squared

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="electrode resistance",
    family="electrode_resistance",
    acts_on="electrode",
    summary="the film charges through a resistance: the force is delayed, more when stretched",
    law=Law(
        equations=(
            r"\frac{\mathrm{d}(C V)}{\mathrm{d}t} = \frac{U - V}{R}",
            r"C = C_0 \left(\frac{Z}{z}\right)^2",
        ),
        symbols=("R",),
        source="charging of a capacitor through a resistor",
    ),
    parameters=(
        Parameter("resistance", "ohm", (0.0, 5e9), "between the amplifier and the film", 1e7, 0.0),
    ),
    memory=1,
)


@jit
def charged(c, m, j, resistance, start, end, h, lam, rate):
    """Voltage at the film before and after ``h`` s behind a ``resistance`` in ohm."""
    # what is carried along is the charge, as voltage times (Z/z)^2: it knows no rate of stretch
    held, half = int(c[HELD]), 0.5 * h * rate
    first, last = thinning_squared(held, lam - half), thinning_squared(held, lam + half)
    before = m[j]
    tau = resistance * c[CAPACITANCE] * thinning_squared(held, lam)
    m[j] = lagged(before, first * start, last * end, h, tau)
    return before / first, m[j] / last


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    return charged(c, m, j, c[k], start, end, h, lam, rate)
