"""Leakage through the film, whose current drops a part of the voltage in the electrodes.

The film conducts better in a strong field, which helps its charges out of their traps (n = 1/2;
Frenkel, Phys. Rev. 54, 647 (1938); n = 1 where it lowers barriers in proportion, Poole). The
conductivity goes with exp(b E^n): nothing is lost at small voltages, most at the peak.
"""

from __future__ import annotations

from dearig.model.conduction import REMEMBERED, behind
from dearig.model.effects.description import Effect, Parameter
from dearig.model.jit import jit

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="leakage",
    family="leakage",
    acts_on="electrode",
    summary="the film sees less than the amplifier gives, the more the higher the voltage",
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
            "by which the conductivity grows with the field",
            2.0,
            starts=(2.0, 4.0, 12.0),
        ),
        Parameter(
            "exponent",
            "",
            (0.5, 1.0),
            "of the field: 1/2 of traps that it empties, 1 of barriers in proportion to it",
            0.1,
            starts=(0.5, 1.0),
        ),
    ),
    memory=REMEMBERED,
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    return behind(m, j, c[k], c[k + 1], c[k + 2], start, end, h, lam, 1.0)
