"""Leakage limited by space charge: a power of the voltage.

Injected charges repel the following ones: without traps the current is proportional to the square
of the voltage (Mott and Gurney 1940), with traps of all depths to V^(l+1)/d^(2l+1) of a thickness d
(Mark and Helfrich, J. Appl. Phys. 33, 205 (1962)). A film stretched by lam is that much thinner and
wider.
"""

from __future__ import annotations

from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law
from dearig.model.effects.library.electric.leakage import EFFECT as BY_TRAPS
from dearig.model.effects.shared.conduction import CROWDED, behind, dropped

__all__ = ["EFFECT", "drop", "supply"]

_LOSS, _GROWTH, _ = BY_TRAPS.parameters

EFFECT = replace(
    BY_TRAPS,
    name="space-charge leakage",
    summary="the film draws a current that grows with a power of the voltage",
    law=Law(
        equations=(
            r"V \left(1 + r\,\lambda^{l + 2} g(e)\right) = U",
            "g(e) = e^l",
            r"e = \frac{\lambda V}{8\,\mathrm{kV}}",
            r"r = \frac{s}{(1 - s)\,g(1 - s)}",
        ),
        symbols=("s", "l"),
        source="P. Mark and W. Helfrich, J. Appl. Phys. 33, 205 (1962)",
        where=(
            ("g", "conductivity over that at e = 1"),
            ("e", "field over that of 8 kV on the unstretched film"),
            ("r", "resistance in front of the film over that of the film at e = 1"),
        ),
    ),
    parameters=(
        _LOSS,
        replace(
            _GROWTH,
            meaning="power of the field in the conductivity: 1 without traps",
            typical=1.0,
            starts=(1.0, 3.0),
        ),
    ),
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    # of the conductance V^l lam^(2 l + 2), the field has l powers of lam
    return behind(m, j, c[k], c[k + 1], CROWDED, start, end, h, lam, lam ** (c[k + 1] + 2.0))


@jit
def drop(c, k, m, j, voltage):
    return dropped(m, j, voltage)
