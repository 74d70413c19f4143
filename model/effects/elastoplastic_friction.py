"""Dry friction of a guide whose bristles only bend at first, and slip sharply (elasto-plastic).

Dupont, Hayward, Armstrong and Altpeter (IEEE Trans. Autom. Control 47, 2002): under Dahl's law a
load creeps along under a force that swings below the friction. Here what is unloaded is as stiff as
what is fresh, and nothing slips until much of the friction is reached: Bouc and Wen's loop of equal
sides, db/d(lam/p) = 1 - |b|^n for motion the way that b points and 1 for motion back. The stress is
F (b + tau b'), with the bristles' own damping as in ``dry friction``.
"""

from __future__ import annotations

from model.effects.description import Effect, Parameter
from model.filters import wound_on
from model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_EQUAL_SIDES = 0.5

EFFECT = Effect(
    name="elastoplastic friction",
    family="friction",
    acts_on="load",
    words="a force against the motion that sets in sharply: below it the film does not slip at all",
    parameters=(
        Parameter("friction", "Pa", (0.0, 2e4), "nominal stress while sliding", 50.0, 0.0),
        Parameter(
            "presliding",
            "",
            (3e-6, 1e-3),
            "change of stretch over which it builds up",
            1e-4,
            starts=(1e-4, 5e-4),
            logarithmic=True,
        ),
        Parameter(
            "damping",
            "s",
            (1e-6, 1e-2),
            "time by which its stress runs ahead while it builds up",
            1e-3,
            starts=(1e-3,),
            logarithmic=True,
        ),
        Parameter(
            "exponent", "", (1.0, 8.0), "the larger, the sharper it slips", 1.0, starts=(3.0,)
        ),
    ),
    memory=2,
    turns=True,
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    reach, exponent = c[k + 1], c[k + 3]
    b = wound_on(m[j], m[j + 1], (lam - lam0) / reach, exponent, _EQUAL_SIDES)
    bend = rate / reach
    if b * rate > 0.0:
        bend *= 1.0 - abs(b) ** exponent
    return c[k] * (b + c[k + 2] * bend)


@jit
def stiffness(c, k, m, j, lam, rate):
    bristles = c[k] / c[k + 1]
    return bristles, bristles * c[k + 2]


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = wound_on(m[j], m[j + 1], (lam - lam0) / c[k + 1], c[k + 3], _EQUAL_SIDES)
    m[j + 1] = abs(m[j]) ** c[k + 3]
    return 0
