"""Leakage that fades while the voltage stays: absorption besides what is conducted.

After a step of the voltage the current through a dielectric falls as t^-n towards a steady one
(J. Curie 1889; E. von Schweidler 1907). The steady one grows with a power of the field, as in
``space_charge_leakage``. Three lags u_i, a decade apart, represent the fall.
"""

from __future__ import annotations

from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law, Parameter
from dearig.model.effects.library.electric.space_charge_leakage import EFFECT as STEADY
from dearig.model.effects.shared.conduction import (
    CROWDED,
    REFERENCE,
    REMEMBERED,
    behind,
    dropped,
)
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "drop", "supply"]

_LAGS, _RATIO = 3, 10.0

EFFECT = replace(
    STEADY,
    name="fading leakage",
    summary="the film draws a current that is larger after a change of the voltage, and fades",
    law=Law(
        equations=(
            r"V \left(1 + r\,\lambda^{l + 2} g(e) \max(1 + a f, 0)\right) = U",
            (
                r"f = \frac{\sum_{i=0}^{2} 10^{-n i} (|U| - u_i)}"
                r"{8\,\mathrm{kV} \sum_{i=0}^{2} 10^{-n i}}"
            ),
            r"10^i T \dot{u}_i = |U| - u_i",
            "g(e) = e^l",
            r"e = \frac{\lambda V}{8\,\mathrm{kV}}",
            r"r = \frac{s}{(1 - s)\,g(1 - s)}",
        ),
        symbols=("s", "l", "a", "T", "n"),
        source="E. von Schweidler, Ann. Phys. 329, 711 (1907)",
        where=(
            ("g", "conductivity over that at e = 1"),
            ("e", "field over that of 8 kV on the unstretched film"),
            ("r", "resistance in front of the film over that of the film at e = 1"),
            ("f", "what has not faded yet"),
            ("u_i", "supplied voltage, late by 10^i T"),
        ),
    ),
    parameters=(
        *STEADY.parameters,
        Parameter(
            "absorption", "", (0.0, 20.0), "excess of the current after a step to 8 kV", 0.5,
            starts=(1.0,),
        ),
        Parameter(
            "time_constant", "s", (0.05, 100.0), "of the first fading", 1.0,
            starts=(1.0, 0.2), logarithmic=True,
        ),
        Parameter(
            "exponent", "", (0.2, 2.0), "of time, by which it fades", 0.3, starts=(1.0,)
        ),
    ),
    memory=REMEMBERED + _LAGS,
)  # fmt: skip


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    first, last = abs(start), abs(end)
    fading, shares, share, late = 0.0, 0.0, 1.0, c[k + 3]
    less = _RATIO ** -c[k + 4]
    for i in range(j + REMEMBERED, j + REMEMBERED + _LAGS):
        m[i] = lagged(m[i], first, last, h, late)
        fading += share * (last - m[i])
        shares += share
        share *= less
        late *= _RATIO
    eased = max(1.0 + c[k + 2] * fading / (REFERENCE * shares), 0.0) * lam ** (c[k + 1] + 2.0)
    return behind(m, j, c[k], c[k + 1], CROWDED, start, end, h, lam, eased)


@jit
def drop(c, k, m, j, voltage):
    return dropped(m, j, voltage)
