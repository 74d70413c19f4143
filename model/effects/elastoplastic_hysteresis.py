"""Rate-independent hysteresis of the film itself: one yielding element in parallel to its springs.

Bouc and Wen's model with equal constants, which is Dahl's: a stress that approaches Y over the
stretch r against every reversal. The film's own loops open over a good part of the stroke, where
those of dry friction open within a few micrometres.
"""

from __future__ import annotations

from model.effects.description import Effect, Parameter
from model.filters import slid
from model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="elastoplastic hysteresis",
    family="rate_independent_hysteresis",
    acts_on="film stress",
    words="loops that do not depend on the speed, opening over a part of the stroke",
    parameters=(
        Parameter(
            "yield_stress", "Pa", (0.0, 2e5), "stress far from the last reversal", 200.0, 0.0
        ),
        Parameter(
            "reach",
            "",
            (1e-3, 1.0),
            "change of stretch over which the stress builds up",
            5e-3,
            starts=(5e-3, 2e-3, 1.5e-2, 0.2),
            logarithmic=True,
        ),
    ),
    memory=1,
    drives=("voltage", "stretch"),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * slid(m[j], lam - lam0, c[k + 1]) / c[k + 1]


@jit
def stiffness(c, k, m, j, lam):
    return c[k] / c[k + 1], 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = slid(m[j], lam - lam0, c[k + 1])
    return 0
