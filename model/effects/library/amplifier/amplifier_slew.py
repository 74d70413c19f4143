"""Slew limit of the amplifier: the slope of the output has a largest value."""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import slewed

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="amplifier slew",
    family="amplifier",
    acts_on="amplifier",
    summary="fast edges of the voltage reach the film late, slow changes on time",
    law=Law(
        equations=(
            r"|\dot{V}| \le \frac{1}{\kappa}",
            (
                r"\dot{V} = \frac{1}{\kappa} \operatorname{sign}(U - V) \quad \mathrm{while} "
                r"\quad V \ne U"
            ),
        ),
        symbols=(r"\kappa",),
        source="a limit of the slope",
    ),
    parameters=(
        # shown by the steepest edges only: sought where it would touch so much of the time
        Parameter(
            "inverse_slew",
            "s/V",
            (0.0, 2e-3),
            "inverse of the largest slope",
            5e-5,
            0.0,
            starts=(
                0.002,
                0.005,
                0.01,
                0.02,
                0.03,
                0.045,
                0.065,
                0.09,
                0.13,
                0.18,
                0.25,
                0.35,
                0.5,
            ),
            relative_to="slope",
        ),
    ),
    memory=1,
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    before = m[j]
    m[j] = slewed(before, start, end, h, 1.0 / c[k])
    return before, m[j]
