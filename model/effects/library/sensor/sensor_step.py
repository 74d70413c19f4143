"""A reading that jumps at one moment: a mount slips, or something hits the target.

The reading is moved by d from the time t_0 on, over 20 ms so that a fit can find it.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import switched

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sudden change of reading",
    family="unknown",
    acts_on="sensor",
    summary="the reading jumps at one moment and stays there",
    law=Law(
        equations=(
            r"r = x + d\,S(t - t_0)",
            (
                r"S(u) = \min\left(\max\left(\frac{u}{20\,\mathrm{ms}} + \frac{1}{2}, 0\right), "
                r"1\right)"
            ),
        ),
        symbols=("d", "t_0"),
        source="a change at one moment",
        where=(("S", "switch from 0 to 1 over 20 ms"),),
    ),
    parameters=(
        Parameter("jump", "m", (-5e-3, 5e-3), "of the reading", 3e-6, 0.0),
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
def sense(c, k, m, j, t, dt, x, u):
    return x + c[k] * switched(t - c[k + 1])
