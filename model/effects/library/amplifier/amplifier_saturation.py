"""Saturation of the amplifier: the output approaches a limit V_s.

V/(1 + (|V|/V_s)^n)^(1/n) (Rapp's model of an amplifier), V_s = 8 kV/(n s)^(1/n). For a
small loss s the output is s V (|V|/8 kV)^n too low, as behind a film that leaks: no record
distinguishes the two.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="amplifier saturation",
    family="amplifier",
    acts_on="amplifier",
    summary="the film gets less voltage than commanded, the more the higher the voltage",
    law=Law(
        equations=(
            r"V = \frac{U}{\left(1 + n s \left(|U| / 8\,\mathrm{kV}\right)^n\right)^{1/n}}",
        ),
        symbols=("s", "n"),
        source="C. Rapp, Proc. 2nd European Conf. Satellite Communications, 179 (1991)",
    ),
    parameters=(
        Parameter(
            "loss",
            "",
            (0.0, 0.5),
            "relative loss of voltage at 8 kV while it is small: (1 + n s)^(-1/n) is left",
            0.02,
            0.0,
        ),
        Parameter(
            "exponent",
            "",
            (1.0, 12.0),
            "of the loss as a power of the voltage: sharpness of the bend",
            2.0,
            starts=(2.0, 5.0),
        ),
    ),
    memory=2,
)


_REFERENCE = 8e3  # V


@jit
def _bent(loss, n, voltage):
    return voltage / (1.0 + n * loss * (abs(voltage) / _REFERENCE) ** n) ** (1.0 / n)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    # a step begins where the one before has ended: that voltage is known
    before = m[j + 1] if start == m[j] else _bent(c[k], c[k + 1], start)
    if h > 0.0:
        m[j], m[j + 1] = end, _bent(c[k], c[k + 1], end)
        return before, m[j + 1]
    return before, before
