"""Viscoplastic flow of the film: beyond a threshold, a stress flows with a power of its excess.

A spring in series with a dashpot and a slider side by side (Perzyna), parallel to the network. The
elastic stretch z obeys z' = lam' -+ u ((|z|/r - s)/(1 - s))^n with u = 0.01/s, and the stress is
Y z/r: Y is what the element bears while the film is stretched at u. With n = 1 it is Bingham's
element; with s near 1, or a large n, an ideal yielding one. ``nonlinear_creep`` has no threshold.
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
    summary="beyond a stress the film flows with a power of the excess, and keeps a set",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + Y \frac{z}{r}",
            (
                r"\dot{z} = \dot{\lambda} - 0.01\,\mathrm{s}^{-1} \left(\frac{\max(|z|/r - s, 0)}"
                r"{1 - s}\right)^n \operatorname{sign} z"
            ),
        ),
        symbols=("Y", "r", "s", "n"),
        source="P. Perzyna, Adv. Appl. Mech. 9, 243 (1966)",
        where=(("z", "elastic stretch of the element"), ("r", "that at which it bears Y")),
    ),
    parameters=(
        Parameter("flow_stress", "Pa", (0.0, 2e5), "while it flows at 0.01/s", 150.0, 0.0),
        Parameter(
            "reach", "", (2e-4, 1.0), "change of stretch at which it bears that stress", 5e-3,
            starts=(5e-3, 1.5e-3, 1.5e-2), logarithmic=True,
        ),
        Parameter(
            "threshold", "", (0.1, 0.99), "part of that stress below which nothing flows", 0.1,
            starts=(0.5,),
        ),
        Parameter(
            "exponent", "", (1.0, 20.0), "of the rate over the stress", 2.0,
            starts=(1.5, 4.0), logarithmic=True,
        ),
    ),
    memory=1,
    is_hysteretic=True,
    drives=("voltage", "stretch"),
)  # fmt: skip

_RATE = 0.01  # 1/s: of a film that moves by a tenth of a millimetre in a second
_TRAVEL = 0.1  # reaches, of a part of a step: within 1e-2 of the stress at any rate
_LITTLE = 0.02  # of the exponent, a relaxation: the series is within 3e-6
_NEARLY_LINEAR = 1e-6  # above 1, an exponent
_PARTS = 200  # of a step: 20 reaches, far beyond which the film flows steadily


@jit
def _relaxed(z, h, reach, threshold, exponent):
    """Elastic stretch after ``h`` s without travel."""
    edge = threshold * reach
    width, more = reach - edge, exponent - 1.0
    over = (abs(z) - edge) / width
    if over <= 0.0:
        return z
    late = h * _RATE / width * over**more
    if exponent * late < _LITTLE:
        left = 1.0 - late * (1.0 - 0.5 * exponent * late)
    elif more < _NEARLY_LINEAR:
        left = math.exp(-late)
    else:
        left = math.exp(-math.log1p(more * late) / more)
    return math.copysign(edge + width * over * left, z)


@jit
def flowed(z, travel, since, reach, threshold, exponent):
    """Elastic stretch after ``since`` s, in which the film is stretched steadily by ``travel``.

    It relaxes for half of each part of the step, is stretched, and relaxes for the other half.
    """
    parts = 1 + int(min(abs(travel) / (_TRAVEL * reach), _PARTS))
    h = since / parts
    z = _relaxed(z, 0.5 * h, reach, threshold, exponent)
    for _ in range(parts - 1):
        z = _relaxed(z + travel / parts, h, reach, threshold, exponent)
    return _relaxed(z + travel / parts, 0.5 * h, reach, threshold, exponent)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] / c[k + 1] * flowed(m[j], lam - lam0, since, c[k + 1], c[k + 2], c[k + 3])


@jit
def stiffness(c, k, m, j, lam, rate):
    return c[k] / c[k + 1], 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = flowed(m[j], lam - lam0, h, c[k + 1], c[k + 2], c[k + 3])
    return 0
