"""Leakage through the film: its current drops part of the voltage in the electrodes.

The conductivity grows as exp(b E^n): the field frees charges from traps (n = 1/2; Frenkel, Phys.
Rev. 54, 647 (1938)) or lowers barriers in proportion (n = 1; Poole). So nothing is lost at small
voltages, and most at the peak.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.conduction import REMEMBERED, behind, dropped

__all__ = ["EFFECT", "drop", "supply"]

EFFECT = Effect(
    name="leakage",
    family="leakage",
    acts_on="electrode",
    summary="the film gets less voltage than the amplifier supplies, the more the higher it is",
    law=Law(
        equations=(
            r"V \left(1 + r\,g(e)\right) = U",
            r"g(e) = \exp\left(b (e^n - 1)\right)",
            r"e = \frac{\lambda V}{8\,\mathrm{kV}}",
            r"r = \frac{s}{(1 - s)\,g(1 - s)}",
        ),
        symbols=("s", "b", "n"),
        source="J. Frenkel, Phys. Rev. 54, 647 (1938)",
        where=(
            ("g", "conductivity over that at e = 1"),
            ("e", "field over that of 8 kV on the unstretched film"),
            ("r", "resistance in front of the film over that of the film at e = 1"),
        ),
    ),
    parameters=(
        Parameter(
            "loss",
            "",
            (0.0, 0.5),
            "relative loss of voltage at 8 kV, film unstretched",
            0.02,
            0.0,
        ),
        Parameter(
            "growth",
            "",
            (0.5, 20.0),
            "of the conductivity with the field",
            2.0,
            starts=(2.0, 4.0, 12.0),
        ),
        Parameter(
            "exponent",
            "",
            (0.5, 1.0),
            "of the field: 1/2 for traps (Poole-Frenkel), 1 for barriers (Poole)",
            0.1,
            starts=(0.5, 1.0),
        ),
    ),
    memory=REMEMBERED,
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    return behind(m, j, c[k], c[k + 1], c[k + 2], start, end, h, lam, 1.0)


@jit
def drop(c, k, m, j, voltage):
    return dropped(m, j, voltage)
