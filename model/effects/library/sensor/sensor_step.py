"""A reading that jumps at one moment: a mount slips, or something hits the target.

The reading is moved by d from the time t_0 on, over 20 ms so that a fit can find it.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Parameter
from dearig.model.effects.shared.filters import switched

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sudden change of reading",
    family="unknown",
    acts_on="sensor",
    summary="the reading jumps at one moment and stays there",
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
