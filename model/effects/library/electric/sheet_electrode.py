"""Electrode as a sheet: charge spreads from the contact at one edge over the film.

Along the sheet the voltage obeys a diffusion equation, C R_s dV/dt = V'' on a length of one, with
the contact's resistance R_c at the edge: beta = R_s/R_c. It is solved by modes, mu tan(mu) = beta,
each a lag of R_s C/mu^2. Its share 2 beta^2/(mu^2 (mu^2 + beta^2 + beta)) of the mean square of
the voltage is that of the mean temperature of a plate in heat conduction (Carslaw and
Jaeger, section 3.11). Three modes represent all: the third has the rest, a tenth. As
in ``electrode resistance`` the capacitance C = C_0 (Z/z)^2 grows with stretch.
"""

from __future__ import annotations

import math
from dataclasses import replace

from dearig.model.coefficients import CAPACITANCE, HELD
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law, Parameter
from dearig.model.effects.library.electric.electrode_resistance import EFFECT as LUMPED
from dearig.model.effects.shared.filters import lagged
from dearig.model.kinematics import thinning_squared

__all__ = ["EFFECT", "charge", "supply"]

_MODES = 3
_HALVINGS = 50  # of the interval in which a root lies: to the last digit

EFFECT = replace(
    LUMPED,
    name="sheet electrode",
    summary="the electrode charges as a sheet: late where it is far from the contact",
    law=Law(
        equations=(
            r"V = \left(\frac{z}{Z}\right)^2 \sqrt{\sum_{i=1}^{3} w_i q_i^2}",
            (
                r"(1 - k) R C\,\dot{q}_i = \mu_i^2 \left( \left(\frac{Z}{z}\right)^2 U - q_i "
                r"\right)"
            ),
            r"C = C_0 \left(\frac{Z}{z}\right)^2",
            r"\mu_i \tan \mu_i = \beta",
            r"w_i = \frac{2 \beta^2}{\mu_i^2 (\mu_i^2 + \beta^2 + \beta)} \quad (i \le 2)",
            "w_3 = 1 - w_1 - w_2",
            r"\beta = \frac{1 - k}{k}",
        ),
        symbols=("R", "k"),
        source="H. S. Carslaw and J. C. Jaeger, Conduction of Heat in Solids, section 3.11",
        where=(
            ("q_i", "charge of mode i, as a voltage of the unstretched film"),
            ("w_i", "share of mode i in the mean square of the voltage"),
            (r"\mu_i", "root of number i"),
            (r"\beta", "resistance of the sheet over that of the contact"),
        ),
    ),
    parameters=(
        replace(LUMPED.parameters[0], meaning="of contact and sheet, end to end"),
        Parameter(
            "contact",
            "",
            (0.02, 0.95),
            "fraction of the resistance at the contact",
            0.1,
            starts=(0.2,),
        ),
    ),
    memory=2 * _MODES,
)


@jit
def _mode(beta, n):
    """Root mu of mu tan(mu) = ``beta`` in the ``n``-th half period from 0."""
    low, high = 0.0, 0.5 * math.pi
    for _ in range(_HALVINGS):
        a = 0.5 * (low + high)
        if (n * math.pi + a) * math.sin(a) < beta * math.cos(a):
            low = a
        else:
            high = a
    return n * math.pi + 0.5 * (low + high)


@jit
def _share(beta, mu2):
    """Share of the mode with the squared root ``mu2`` in the mean square, and in the mean."""
    return 2.0 * beta * beta / (mu2 * (mu2 + beta * beta + beta))


@jit
def charge(c, k, m, j, voltage):
    # the force goes with the mean square of the modes, the charge with their mean
    beta = (1.0 - c[k + 1]) / c[k + 1]
    mean, square, left = 0.0, 0.0, 1.0
    for i in range(_MODES):
        if m[j + _MODES + i] == 0.0:
            return 0.0  # before the first step
        share = left if i == _MODES - 1 else _share(beta, m[j + _MODES + i] ** 2)
        left -= share
        mean += share * m[j + i]
        square += share * m[j + i] ** 2
    return voltage * (mean / math.copysign(math.sqrt(square), m[j]) - 1.0) if square else 0.0


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    # charge as voltage times (Z/z)^2, as where the electrode is one resistance
    held, half = int(c[HELD]), 0.5 * h * rate
    first, last = thinning_squared(held, lam - half), thinning_squared(held, lam + half)
    sheet = (1.0 - c[k + 1]) * c[k]
    beta = (1.0 - c[k + 1]) / c[k + 1]
    tau = sheet * c[CAPACITANCE] * thinning_squared(held, lam)
    before, after, left = 0.0, 0.0, 1.0
    for i in range(_MODES):
        if m[j + _MODES + i] == 0.0:
            m[j + _MODES + i] = _mode(beta, i)  # once: it is the contact's alone
        mu2 = m[j + _MODES + i] ** 2
        share = left if i == _MODES - 1 else _share(beta, mu2)
        left -= share
        before += share * m[j + i] ** 2
        m[j + i] = lagged(m[j + i], first * start, last * end, h, tau / mu2)
        after += share * m[j + i] ** 2
    return (
        math.copysign(math.sqrt(before), m[j]) / first,
        math.copysign(math.sqrt(after), m[j]) / last,
    )
