"""Something that the film meets beyond some travel: an elastic stop, a cable that gets taut.

The stress k (x - x_s) beyond the displacement x_s, over the length L1. No family of its own: it is
what an unnamed stress that sets in at one displacement looks like.
"""

from __future__ import annotations

from model.coefficients import LENGTH, REST
from model.effects.description import Effect, Parameter
from model.jit import jit

__all__ = ["EFFECT", "stiffness", "stress"]

EFFECT = Effect(
    name="stress beyond a displacement",
    family="unknown",
    acts_on="load",
    words="a stress that sets in at one displacement and grows from there, at any speed",
    parameters=(
        Parameter("stiffness", "Pa", (-5e6, 5e7), "stress per stretch beyond the onset", 2e4, 0.0),
        Parameter(
            "onset",
            "m",
            (2e-5, 2e-2),
            "displacement at which it sets in",
            1e-3,
            starts=(0.5, 0.3, 0.7, 0.85),
            part_of="displacement",
            logarithmic=True,
        ),
    ),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * max(lam - c[REST] - c[k + 1] / c[LENGTH], 0.0)


@jit
def stiffness(c, k, m, j, lam, rate):
    return (c[k], 0.0) if c[k] > 0.0 and lam - c[REST] > 0.5 * c[k + 1] / c[LENGTH] else (0.0, 0.0)
