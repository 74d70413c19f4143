"""A strip that hangs slack: it cannot push.

Where the network would push (a film unloaded faster than it recovers), a strip buckles and what is
measured is nothing: the stress felt is (1 - s) of it, and s = 1 is a strip without any stiffness in
bending. Only a film pulled by its ends can do this.
"""

from __future__ import annotations

from dearig.model.effects.description import Effect, Parameter
from dearig.model.jit import jit

__all__ = ["EFFECT", "measured_stress"]

EFFECT = Effect(
    name="slack",
    family="slack",
    acts_on="film stress",
    summary="the strip buckles in place of pushing: no stress on the way back",
    parameters=(
        Parameter(
            "looseness",
            "",
            (0.0, 1.0),
            "fraction of a compressive stress that is not measured",
            0.5,
            0.0,
        ),
    ),
    drives=("stretch",),
)


@jit
def measured_stress(c, k, m, j, sigma):
    return sigma if sigma > 0.0 else (1.0 - c[k]) * sigma
