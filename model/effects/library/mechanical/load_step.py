"""A force that changes at one moment: a load that slips, a hook that settles.

From the time t_0 on the stress p supports the load, over 20 ms so that a fit can find it.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import switched

__all__ = ["EFFECT", "stiffness", "stress"]

EFFECT = Effect(
    name="sudden change of force",
    family="unknown",
    acts_on="load",
    summary="a force sets in at one moment and stays",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + p\,S(t - t_0)",
            (
                r"S(u) = \min\left(\max\left(\frac{u}{20\,\mathrm{ms}} + \frac{1}{2}, 0\right), "
                r"1\right)"
            ),
        ),
        symbols=("p", "t_0"),
        source="a change at one moment",
        where=(("S", "switch from 0 to 1 over 20 ms"),),
    ),
    parameters=(
        Parameter("stress", "Pa", (-2e4, 2e4), "that supports the load", 30.0, 0.0),
        Parameter(
            "moment",
            "s",
            (0.0, 1e5),
            "of the change",
            0.5,
            starts=(0.5,),
            relative_to="duration",
        ),
    ),
    is_reproducible=False,
)

stiffness = None  # the stress depends on time alone


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * switched(t + since - c[k + 1])
