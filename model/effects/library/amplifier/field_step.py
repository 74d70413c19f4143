"""A sudden loss of field: an electrode that cracks, so that part of the film is not charged.

From the time t_0 on the voltage is multiplied by 1 - s, over 20 ms so that a fit can find it.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import switched

__all__ = ["EFFECT", "supply"]

EFFECT = Effect(
    name="sudden loss of field",
    family="unknown",
    acts_on="electrode",
    summary="the force of the voltage drops at one moment and stays lower",
    law=Law(
        equations=(
            r"V = \left(1 - s\,S(t - t_0)\right) U",
            (
                r"S(u) = \min\left(\max\left(\frac{u}{20\,\mathrm{ms}} + \frac{1}{2}, 0\right), "
                r"1\right)"
            ),
        ),
        symbols=("s", "t_0"),
        source="a change at one moment",
        where=(("S", "switch from 0 to 1 over 20 ms"),),
    ),
    parameters=(
        Parameter("loss", "", (-0.5, 0.5), "relative loss of voltage", 5e-3, 0.0),
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


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    a = 1.0 - c[k] * switched(t - c[k + 1])
    b = 1.0 - c[k] * switched(t + h - c[k + 1])
    return start * a, end * b
