"""Leakage through the film, whose current drops a part of the voltage in the electrodes.

Conduction that grows faster than the field (Poole-Frenkel, space charge) leaves the film short of
s V (|V|/8 kV)^n at the voltage V: nothing at small voltages, most at the peak.
"""

from __future__ import annotations

from model.effects.description import Effect, Parameter
from model.jit import jit

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="leakage",
    family="leakage",
    acts_on="electrode",
    words="the film sees less than the amplifier gives, the more the higher the voltage",
    parameters=(
        Parameter("loss", "", (0.0, 0.5), "part of the voltage that is lost at 8 kV", 0.02, 0.0),
        Parameter(
            "exponent",
            "",
            (0.5, 12.0),
            "by which the lost part grows with the voltage",
            2.0,
            starts=(2.0, 5.0),
        ),
    ),
)


_REFERENCE = 8e3  # V


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    # no more can be lost than there is
    a = start * max(1.0 - c[k] * (abs(start) / _REFERENCE) ** c[k + 1], 0.0)
    b = end * max(1.0 - c[k] * (abs(end) / _REFERENCE) ** c[k + 1], 0.0)
    return a, b
