"""Leakage by charges that hop over equal barriers, with the field and against it.

The current goes with sinh(b E) (Mott and Gurney 1940; Eyring): at small fields the film is a
plain resistor, unlike leakage by traps; at large ones the current grows exponentially.
"""

from __future__ import annotations

from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law
from dearig.model.effects.library.electric.leakage import EFFECT as BY_TRAPS
from dearig.model.effects.shared.conduction import HOPS, behind, dropped

__all__ = ["EFFECT", "drop", "supply"]

EFFECT = replace(
    BY_TRAPS,
    name="hopping leakage",
    summary="the film draws a current at any voltage, exponentially more at a high one",
    law=Law(
        equations=(
            r"V \left(1 + r\,g(e)\right) = U",
            r"g(e) = \frac{\sinh(b e)}{e \sinh b}",
            r"e = \frac{\lambda V}{8\,\mathrm{kV}}",
            r"r = \frac{s}{(1 - s)\,g(1 - s)}",
        ),
        symbols=("s", "b"),
        source="N. F. Mott and R. W. Gurney, Electronic Processes in Ionic Crystals (1940)",
        where=(
            ("g", "conductivity over that at e = 1"),
            ("e", "field over that of 8 kV on the unstretched film"),
            ("r", "resistance in front of the film over that of the film at e = 1"),
        ),
    ),
    parameters=(BY_TRAPS.parameters[0], replace(BY_TRAPS.parameters[1], starts=(1.0, 4.0))),
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    return behind(m, j, c[k], c[k + 1], HOPS, start, end, h, lam, 1.0)


@jit
def drop(c, k, m, j, voltage):
    return dropped(m, j, voltage)
