"""Drag that grows with a power of the rate between 0 and 2: grease, gels, fluids with filler.

The nominal stress d (lam'/R) ((|lam'| + s)/R)^(n - 1), R = 0.1/s, acts against the motion. Far
above the rate s it is the power n of the rate (Ostwald and de Waele); below it the drag is linear,
so that the stress has a slope at rest. With n near 0 it is a friction that sets in smoothly.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.hooks import FASTEST
from dearig.model.effects.library.mechanical.power_drag import greatest_rate

__all__ = ["EFFECT", "stiffness", "stress"]

EFFECT = Effect(
    name="thinning drag",
    family="drag",
    acts_on="load",
    summary="a force against the motion that grows with a power of its rate, below 1 or above",
    law=Law(
        equations=(
            (
                r"\sigma = \sigma_0 + d \frac{\dot{\lambda}}{r} \left(\frac{|\dot{\lambda}| + "
                r"s}{r}\right)^{n - 1}"
            ),
            r"r = 0.1\,\mathrm{s}^{-1}",
        ),
        symbols=("d", "n", "s"),
        source="the power law of W. Ostwald and A. de Waele, linear at small rates",
        where=(("r", "rate of reference"),),
    ),
    parameters=(
        Parameter("drag", "Pa", (0.0, 1e4), "nominal stress at a rate of 0.1/s", 20.0, 0.0),
        Parameter("exponent", "", (0.0, 2.0), "of the rate", 0.3, starts=(0.5, 0.2, 1.4)),
        Parameter(
            "linear_below",
            "1/s",
            (2e-4, 0.1),
            "rate below which the drag is linear",
            2e-3,
            starts=(2e-3,),
            logarithmic=True,
        ),
    ),
    is_hysteretic=True,  # steep at rest: turning points need short steps
)

_REFERENCE = 0.1  # 1/s


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    size = (abs(rate) + c[k + 2]) / _REFERENCE
    return c[k] * rate / _REFERENCE * size ** (c[k + 1] - 1.0)


@jit
def _slope(c, k, rate):
    size = (rate + c[k + 2]) / _REFERENCE
    whole = (c[k + 1] * rate + c[k + 2]) / _REFERENCE
    return c[k] / _REFERENCE * size ** (c[k + 1] - 2.0) * whole


@jit
def stiffness(c, k, m, j, lam, rate):
    rate = abs(rate)
    if rate <= FASTEST:
        return 0.0, _slope(c, k, rate)
    # thinning, the slope is largest at rest, otherwise at the largest rate
    exponent = max(c[k + 1], 0.1)
    fastest = greatest_rate(c[k] / _REFERENCE**exponent, exponent)
    return 0.0, max(_slope(c, k, 0.0), _slope(c, k, fastest))
