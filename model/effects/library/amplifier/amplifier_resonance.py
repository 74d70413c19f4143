"""Lag of the amplifier, second order: a control loop with its own frequency and damping.

V'' = (V_command - V)/tau^2 - 2 z V'/tau, with tau = 1/(2 pi f): it lags as a
first-order lag does, and overshoots where the damping ratio z is below 0.7.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import swung

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="amplifier resonance",
    family="amplifier",
    acts_on="amplifier",
    summary="the voltage at the film lags and is rounded, or overshoots",
    law=Law(
        equations=(r"\tau^2 \ddot{V} + 2 \zeta \tau \dot{V} + V = U",),
        symbols=(r"\tau", r"\zeta"),
        source="a low-pass of second order",
    ),
    parameters=(
        Parameter("time_constant", "s", (0.0, 0.5), "inverse angular frequency", 5e-3, 0.0),
        Parameter("damping", "", (0.05, 0.98), "ratio", 0.1, starts=(0.7,), logarithmic=True),
    ),
    memory=2,
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    before = m[j]
    if h > 0.0:
        m[j], m[j + 1] = swung(m[j], m[j + 1], start, end, h, 1.0 / c[k], c[k + 1])
    return before, m[j]
