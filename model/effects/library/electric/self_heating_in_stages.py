"""Warming by the film's own losses, first of the film and later of its surroundings.

Where no thermometer was recorded: two bodies as in ``self_heating``, the film, and frame and air.
The network's stress is multiplied by 1 + a T + b T_2.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "polarise", "soften"]

EFFECT = Effect(
    name="self-heating in stages",
    family="thermal",
    acts_on="environment",
    summary="the stiffness follows the square of the voltage, in seconds and then in minutes",
    law=Law(
        equations=(
            r"\sigma = (1 + a_1 \theta_1 + a_2 \theta_2) \sigma_0",
            r"\tau_i \dot{\theta}_i = \left(\frac{V}{5\,\mathrm{kV}}\right)^2 - \theta_i",
        ),
        symbols=("a_1", "a_2", r"\tau_1", r"\tau_2"),
        source="Newton's law of cooling, of two bodies",
        where=(
            (
                r"\theta_i",
                (
                    "warming of the film (1) and of its surroundings (2) over that under "
                    "constant 5 kV"
                ),
            ),
        ),
    ),
    parameters=(
        Parameter(
            "stiffening",
            "",
            (-0.5, 0.5),
            "relative change of stress under constant 5 kV, first",
            3e-3,
            0.0,
        ),
        Parameter(
            "later",
            "",
            (-0.5, 0.5),
            "relative change of stress under constant 5 kV, final",
            3e-3,
            0.0,
        ),
        Parameter(
            "time_constant", "s", (1.0, 3e2), "of the first", 8.0, starts=(8.0,), logarithmic=True
        ),
        Parameter(
            "later_time_constant",
            "s",
            (10.0, 3e3),
            "of the second",
            80.0,
            starts=(80.0,),
            logarithmic=True,
        ),
    ),
    memory=2,
)

_REFERENCE2 = 5e3**2  # V^2


@jit
def polarise(c, k, m, j, start, end, h):
    before, after = start * start / _REFERENCE2, end * end / _REFERENCE2
    m[j] = lagged(m[j], before, after, h, c[k + 2])
    m[j + 1] = lagged(m[j + 1], before, after, h, c[k + 3])
    return 0.0, 0.0


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.0 + c[k] * m[j] + c[k + 1] * m[j + 1]
