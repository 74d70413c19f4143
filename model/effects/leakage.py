"""Leakage through the film, whose current drops a part of the voltage in the electrodes.

The film conducts better in a strong field, which helps its charges out of their traps (n = 1/2;
Frenkel, Phys. Rev. 54, 647 (1938)) or from one to the next (n near 1; Mott and Gurney, hopping).
The conductivity goes with exp(b E^n), so that of the voltage V the part
s exp(b ((|V| lam/8 kV)^n - 1)) is lost: nothing at small voltages, most at the peak.
"""

from __future__ import annotations

import math

from model.effects.description import Effect, Parameter
from model.jit import jit

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="leakage",
    family="leakage",
    acts_on="electrode",
    words="the film sees less than the amplifier gives, the more the higher the voltage",
    parameters=(
        Parameter(
            "loss",
            "",
            (0.0, 0.5),
            "part of the voltage that is lost at 8 kV over the unstretched film",
            0.02,
            0.0,
        ),
        Parameter(
            "growth",
            "",
            (0.5, 20.0),
            "by which the lost part grows with the field",
            2.0,
            starts=(2.0, 4.0, 12.0),
        ),
        Parameter(
            "exponent",
            "",
            (0.5, 1.0),
            "of the field: 1/2 of traps that it empties, 1 of hops",
            0.1,
            starts=(0.5, 1.0),
        ),
    ),
)


_REFERENCE = 8e3  # V


@jit
def _left(c, k, v, lam):
    """What is left of ``v`` V; no more can be lost than there is."""
    lost = c[k] * math.exp(c[k + 1] * ((abs(v) * lam / _REFERENCE) ** c[k + 2] - 1.0))
    return v * max(1.0 - lost, 0.0)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    return _left(c, k, start, lam), _left(c, k, end, lam)
