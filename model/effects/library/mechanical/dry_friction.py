"""Dry friction of a guide, with the travel over which it builds up (pre-sliding).

Dahl's model (1968): the stress approaches F against the motion, dz/dlam = 1 - z/p sign(lam'), so
that for motion one way z goes to +-p exponentially over the stretch p, and the stress is F z/p.
The exact solution is used from one turning point to the next, so z is rate-independent at any step.

The bristles are damped (Canudas de Wit and others, IEEE Trans. Autom. Control 40, 1995): the stress
leads F z/p by the time tau, F/p (z + tau z'). Without it a film that sticks would ring on its guide
for long; a film that slides is not damped by it.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import slid

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="dry friction",
    family="friction",
    acts_on="load",
    summary="a constant force against the motion: the film lags at every turning point",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + \frac{F}{p} (z + \tau \dot{z})",
            r"\dot{z} = \dot{\lambda} - |\dot{\lambda}| \frac{z}{p}",
        ),
        symbols=("F", "p", r"\tau"),
        source=(
            "P. R. Dahl, Aerospace Corp. TOR-0158(3107-18)-1 (1968); C. Canudas de Wit et "
            "al., IEEE Trans. Autom. Control 40, 419 (1995)"
        ),
        where=(("z", "deflection of the bristles, as a stretch"),),
    ),
    parameters=(
        Parameter("friction", "Pa", (0.0, 2e4), "nominal stress while sliding", 50.0, 0.0),
        Parameter(
            "presliding",
            "",
            (3e-6, 1e-3),
            "change of stretch over which the friction builds up",
            1e-4,
            starts=(1e-4, 1e-5, 5e-4),
            logarithmic=True,
        ),
        Parameter(
            "damping",
            "s",
            (1e-6, 1e-2),
            "lead time of the stress while it builds up",
            1e-3,
            starts=(1e-3,),
            logarithmic=True,
        ),
    ),
    memory=1,
    is_hysteretic=True,
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    reach = c[k + 1]
    z = slid(m[j], lam - lam0, reach)
    return c[k] * (z + c[k + 2] * (rate - abs(rate) * z / reach)) / reach


@jit
def stiffness(c, k, m, j, lam, rate):
    bristles = c[k] / c[k + 1]
    return bristles, bristles * c[k + 2]


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = slid(m[j], lam - lam0, c[k + 1])
    return 0
