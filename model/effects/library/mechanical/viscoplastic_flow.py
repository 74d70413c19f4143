"""Viscoplastic flow of the film: a stress that yields, flows with a time, and leaves a set.

A spring in series with a slider and a dashpot side by side (Bingham; Duvaut and Lions 1972), beside
the network. The elastic stretch z obeys z' = lam' while |z| is below the threshold r, and
z' = lam' - (z -+ r)/T beyond it; the stress is Y z/r. With a short time T it is an ideal yielding
element, with a small threshold a Maxwell branch. Both parts are solved exactly over a step.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="viscoplastic flow",
    family="viscoplasticity",
    acts_on="film stress",
    summary="beyond a stress the film flows with a time of its own, and keeps a set",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + Y \frac{z}{r}",
            r"\dot{z} = \dot{\lambda} - \frac{1}{T} \max(|z| - r, 0) \operatorname{sign} z",
        ),
        symbols=("Y", "r", "T"),
        source="G. Duvaut and J.-L. Lions, Les inequations en mecanique et en physique (1972)",
        where=(("z", "elastic stretch of the element"),),
    ),
    parameters=(
        Parameter("yield_stress", "Pa", (0.0, 2e5), "from which on the film flows", 150.0, 0.0),
        Parameter(
            "reach",
            "",
            (2e-4, 1.0),
            "change of stretch at which it begins to flow",
            3e-3,
            starts=(3e-3, 1e-3, 1e-2),
            logarithmic=True,
        ),
        Parameter(
            "time_constant",
            "s",
            (2e-3, 100.0),
            "in which the stress beyond the threshold relaxes",
            0.2,
            starts=(0.2, 1.5),
            logarithmic=True,
        ),
    ),
    memory=1,
    is_hysteretic=True,
    drives=("voltage", "stretch"),
)


@jit
def _flowed(z, travel, since, reach, time):
    """Elastic stretch after ``since`` s, in which the film is stretched steadily by ``travel``."""
    if since <= 0.0:
        return z + travel
    rate, left = travel / since, since
    # elastic, beyond one threshold, elastic again and beyond the other: no more parts than that
    for _ in range(4):
        if left <= 0.0:
            break
        side = math.copysign(1.0, z if z != 0.0 else rate)
        beyond = side * z - reach
        if beyond < 0.0 or (beyond == 0.0 and side * rate <= 0.0):
            if rate == 0.0:
                break
            way = math.copysign(1.0, rate)
            needed = (way * reach - z) / rate
            if needed >= left:
                return z + rate * left
            z = way * reach
            left -= needed
            beyond, side = 0.0, way
        steady = side * rate * time
        parts = left
        if steady < 0.0 < beyond:
            parts = min(left, time * math.log1p(-beyond / steady))
        z = side * (reach + steady + (beyond - steady) * math.exp(-parts / time))
        if parts < left:
            z = side * reach  # back at the threshold: elastic from here
        left -= parts
    return z


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] / c[k + 1] * _flowed(m[j], lam - lam0, since, c[k + 1], c[k + 2])


@jit
def stiffness(c, k, m, j, lam, rate):
    return c[k] / c[k + 1], 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = _flowed(m[j], lam - lam0, h, c[k + 1], c[k + 2])
    return 0
