"""Softening by use without an end: stiffness lost with the logarithm of the travel.

The stress is multiplied by 1 - a ln(1 + p/p_0), p the travel in stretch since the start: each
tenfold number of cycles costs the same, as filled and unfilled rubbers relax under cyclic load
 (Derham and Thomas, Rubber Chem. Technol. 50, 1977).
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.library.mechanical.ageing import commit

__all__ = ["EFFECT", "commit", "soften"]

EFFECT = Effect(
    name="logarithmic ageing",
    family="softening",
    acts_on="film stress",
    summary="the film softens with the logarithm of the number of cycles",
    law=Law(
        equations=(
            r"\sigma = \left(1 - a \ln\left(1 + \frac{p}{p_0}\right)\right) \sigma_0",
            r"p = \int_0^t |\dot{\lambda}|\,\mathrm{d}t",
        ),
        symbols=("a", "p_0"),
        source="G. B. Derham and A. G. Thomas, Rubber Chem. Technol. 50, 397 (1977)",
        where=(("p", "travel of the film in stretch, up and down, since the start"),),
    ),
    parameters=(
        Parameter(
            "softening",
            "",
            (-0.2, 0.2),
            "relative loss of stress per factor e of travel",
            1e-3,
            0.0,
            fit_within=(0.0, 0.2),
        ),
        Parameter(
            "path",
            "",
            (5e-3, 50.0),
            "travel in stretch, up and down, at which the loss sets in",
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
