"""Softening by use that never ends: stiffness lost with the logarithm of the path gone.

The stress is multiplied by 1 - a ln(1 + p/p_0), p the stretch gone up and down since the start:
each tenfold of the cycles costs the same, which is how filled and unfilled rubbers relax under
cyclic load (Derham and Thomas, Rubber Chem. Technol. 50, 1977).
"""

from __future__ import annotations

import math

from dearig.model.effects.ageing import commit
from dearig.model.effects.description import Effect, Parameter
from dearig.model.jit import jit

__all__ = ["EFFECT", "commit", "soften"]

EFFECT = Effect(
    name="logarithmic ageing",
    family="softening",
    acts_on="film stress",
    summary="softer with every cycle, by the logarithm of their number",
    parameters=(
        Parameter(
            "softening",
            "",
            (-0.2, 0.2),
            "part of the stress lost per factor e",
            1e-3,
            0.0,
            fit_within=(0.0, 0.2),
        ),
        Parameter(
            "path",
            "",
            (5e-3, 50.0),
            "change of stretch, up and down, from which on it counts",
            0.1,
            starts=(0.1,),
            logarithmic=True,
        ),
    ),
    memory=1,
    is_hysteretic=True,
    drives=("voltage", "stretch"),
)


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.0 - c[k] * math.log1p(m[j] / c[k + 1])
