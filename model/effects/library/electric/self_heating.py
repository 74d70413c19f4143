"""Warming by the film's own losses, where no thermometer was recorded.

Losses are proportional to the square of the voltage, and the heat leaves with one time constant:
T' = ((V/5 kV)^2 - T)/tau, T in units of the temperature under constant 5 kV. The network's
stress is multiplied by 1 + a T.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "polarise", "soften"]

#: What warms the film, and by how much: of every effect of this warming.
WARMING = r"\tau \dot{\theta} = \left(\frac{V}{5\,\mathrm{kV}}\right)^2 - \theta"
WARMTH = ((r"\theta", "warming over that under constant 5 kV"),)

EFFECT = Effect(
    name="self-heating",
    family="thermal",
    acts_on="environment",
    summary="the stiffness follows the square of the voltage, with a delay of seconds or minutes",
    law=Law(
        equations=(
            r"\sigma = (1 + a \theta) \sigma_0",
            WARMING,
        ),
        symbols=("a", r"\tau"),
        source="Newton's law of cooling",
        where=WARMTH,
    ),
    parameters=(
        Parameter(
            "stiffening",
            "",
            (-0.5, 0.5),
            "relative change of stress under constant 5 kV, final",
            3e-3,
            0.0,
        ),
        Parameter(
            "time_constant",
            "s",
            (1.0, 3e3),
            "of the warming",
            20.0,
            starts=(20.0, 5.0, 100.0),
            logarithmic=True,
        ),
    ),
    memory=1,
)

_REFERENCE2 = 5e3**2  # V^2


@jit
def polarise(c, k, m, j, start, end, h):
    m[j] = lagged(m[j], start * start / _REFERENCE2, end * end / _REFERENCE2, h, c[k + 1])
    return 0.0, 0.0


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.0 + c[k] * m[j]
