"""A slack strip buckles: it carries no compressive stress.

This happens where a film is unloaded faster than it recovers. The measured stress is 1 - s of a
compressive one; s = 1 is a strip without bending stiffness. Only a film pulled by its ends can do
this.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "measured_stress"]

EFFECT = Effect(
    name="slack",
    family="slack",
    acts_on="film stress",
    summary="the strip buckles in place of pushing: no stress on the way back",
    law=Law(
        equations=(
            (
                r"\sigma_c = \begin{cases} \sigma & \sigma > 0 \\ (1 - s) \sigma & "
                r"\sigma \le 0 \end{cases}"
            ),
        ),
        symbols=("s",),
        source="buckling of a strip without bending stiffness",
        where=((r"\sigma_c", "nominal stress that the load cell reads"),),
    ),
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
