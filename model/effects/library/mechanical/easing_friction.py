"""Dry friction that decreases with speed (Stribeck): it is larger at rest than while sliding.

The law of Canudas de Wit, Olsson, Astrom and Lischinsky (IEEE Trans. Autom. Control 40, 1995):
``dry friction``, whose stress while sliding is F (1 + e exp(-(lam'/v)^2)) after Stribeck, as is the
travel over which it builds up. Friction that decreases with speed feeds energy into a film that
slides slowly: it squeals at its own frequency, and sticks and slips.
"""

from __future__ import annotations

import math
from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law, Parameter
from dearig.model.effects.library.mechanical.dry_friction import EFFECT as DRY
from dearig.model.effects.library.mechanical.dry_friction import stiffness
from dearig.model.effects.shared.filters import slid

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_FRICTION, _PRESLIDING, _DAMPING = DRY.parameters

EFFECT = replace(
    DRY,
    name="easing friction",
    summary="friction that is larger at low speed: the film sticks and slips",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + \frac{F}{p} (z + \tau \dot{z})",
            r"\dot{z} = \dot{\lambda} - |\dot{\lambda}| \frac{z}{\rho}",
            r"\rho = p \left(1 + \eta \exp\left(-(\dot{\lambda}/v)^2\right)\right)",
        ),
        symbols=("F", "p", r"\tau", r"\eta", "v"),
        source=(
            "C. Canudas de Wit, H. Olsson, K. J. Astrom and P. Lischinsky, IEEE Trans. "
            "Autom. Control 40, 419 (1995)"
        ),
        where=(
            ("z", "deflection of the bristles, as a stretch"),
            (r"\rho", "deflection at which all of them slip"),
        ),
    ),
    parameters=(
        replace(_FRICTION, meaning="nominal stress while sliding fast"),
        replace(_PRESLIDING, starts=(1e-4, 5e-4)),
        _DAMPING,
        Parameter(
            "excess",
            "",
            (0.0, 1.0),
            "friction at rest over that while sliding fast, less 1",
            0.1,
            starts=(0.15, 0.4),
        ),
        Parameter(
            "easing",
            "1/s",
            (2e-3, 0.3),
            "rate of stretch at which most of the excess is lost",
            1e-2,
            starts=(1e-2, 3e-2),
            logarithmic=True,
        ),
    ),
)


@jit
def reach(c, k, rate):
    """Deflection, in stretch, at which all bristles slip while the film moves at ``rate``."""
    return c[k + 1] * (1.0 + c[k + 3] * math.exp(-((rate / c[k + 4]) ** 2)))


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    z = m[j]
    if since > 0.0:
        # on the way here the rate was, in the mean, that of the way
        z = slid(z, lam - lam0, reach(c, k, (lam - lam0) / since))
    return c[k] * (z + c[k + 2] * (rate - abs(rate) * z / reach(c, k, rate))) / c[k + 1]


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = slid(m[j], lam - lam0, reach(c, k, (lam - lam0) / h))
    return 0
