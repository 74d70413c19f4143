"""Rate-independent hysteresis of the film itself: one yielding element in parallel to its springs.

Bouc and Wen's model (J. Eng. Mech. Div. ASCE 102, 1976): the stress is Y b, and over the stretch r
db/d(lam/r) = 1 - |b|^n (1 - s + s sign(b lam')). With n = s = 1 it is Dahl's model; a large n
yields abruptly; with s = 1/2 unloading is as stiff as first loading. The film's loops open over a
good part of the stroke, those of dry friction within a few micrometres.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import wound_on

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="elastoplastic hysteresis",
    family="rate_independent_hysteresis",
    acts_on="film stress",
    summary="hysteresis loops at any speed that open over a part of the stroke",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + Y b",
            (
                r"r\,\dot{b} = \dot{\lambda} \left(1 - |b|^n \left(1 - s + s "
                r"\operatorname{sign}(b \dot{\lambda})\right)\right)"
            ),
        ),
        symbols=("Y", "r", "n", "s"),
        source="Y.-K. Wen, J. Eng. Mech. Div. ASCE 102, 249 (1976)",
        where=(("b", "stress over the yield stress"),),
    ),
    parameters=(
        Parameter(
            "yield_stress", "Pa", (0.0, 2e5), "stress far from the last reversal", 200.0, 0.0
        ),
        Parameter(
            "reach",
            "",
            (3e-4, 1.0),
            "change of stretch over which the stress builds up",
            5e-3,
            starts=(5e-3, 2e-3, 1.5e-2, 0.2),
            logarithmic=True,
        ),
        Parameter(
            "exponent", "", (0.7, 6.0), "of the yield: larger is sharper", 0.5, starts=(1.5,)
        ),
        Parameter(
            "asymmetry",
            "",
            (0.5, 1.0),
            "1/2 if unloading is as stiff as first loading, 1 if twice as stiff",
            0.1,
            starts=(0.8,),
        ),
    ),
    memory=2,
    is_hysteretic=True,
    drives=("voltage", "stretch"),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * wound_on(m[j], m[j + 1], (lam - lam0) / c[k + 1], c[k + 2], c[k + 3])


@jit
def stiffness(c, k, m, j, lam, rate):
    return 2.0 * c[k + 3] * c[k] / c[k + 1], 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = wound_on(m[j], m[j + 1], (lam - lam0) / c[k + 1], c[k + 2], c[k + 3])
    m[j + 1] = abs(m[j]) ** c[k + 2]
    return 0
