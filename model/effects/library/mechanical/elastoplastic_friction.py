"""Dry friction of bristles that bend elastically at first and slip later: small swings are elastic.

The law of Dupont, Hayward, Armstrong and Altpeter (IEEE Trans. Autom. Control 47, 2002): as
``easing friction``, but bristles follow the film while they are bent by less than a fraction of the
deflection at which they slip, or bend back; beyond, they slip more and more. The excess decreases
as exp(-|lam'/v|^d), with Stribeck's d = 2 and Tustin's d = 1 as cases (Bo and Pavelescu, Wear 82,
1982).
"""

from __future__ import annotations

import math
from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law, Parameter
from dearig.model.effects.library.mechanical.easing_friction import EFFECT as EASING
from dearig.model.effects.library.mechanical.easing_friction import stiffness
from dearig.model.effects.shared.filters import bent, bristles_slip

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = replace(
    EASING,
    name="elastoplastic friction",
    summary="friction that is larger at low speed and elastic for small swings",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + \frac{F}{p} (z + \tau \dot{z})",
            r"\dot{z} = \dot{\lambda} \left(1 - \xi s(\xi)\right)",
            r"\xi = \frac{z \operatorname{sign} \dot{\lambda}}{\rho}",
            (
                r"s(\xi) = \begin{cases} 0 & \xi \le a \\ \frac{1}{2} - \frac{1}{2} \cos\left(\pi "
                r"\frac{\xi - a}{1 - a}\right) & a < \xi < 1 \\ 1 & \xi \ge 1 \end{cases}"
            ),
            r"\rho = p \left(1 + \eta \exp\left(-|\dot{\lambda}/v|^d\right)\right)",
        ),
        symbols=("F", "p", r"\tau", r"\eta", "v", "a", "d"),
        source=(
            "P. Dupont, V. Hayward, B. Armstrong and F. Altpeter, IEEE Trans. Autom. Control "
            "47, 787 (2002)"
        ),
        where=(
            ("z", "deflection of the bristles, as a stretch"),
            (r"\rho", "deflection at which all of them slip"),
            (r"\xi", "deflection along the motion over that"),
            ("s", "part of the travel that slips"),
        ),
    ),
    parameters=(
        *EASING.parameters,
        Parameter(
            "elastic",
            "",
            (0.0, 0.9),
            "part of the deflection up to which nothing slips",
            0.1,
            starts=(0.6,),
        ),
        Parameter(
            "easing_exponent",
            "",
            (0.5, 3.0),
            "of the rate, by which the excess decreases",
            0.3,
            starts=(2.0,),
        ),
    ),
)


@jit
def reach(c, k, rate):
    """Deflection, in stretch, at which all bristles slip while the film moves at ``rate``."""
    return c[k + 1] * (1.0 + c[k + 3] * math.exp(-(abs(rate / c[k + 4]) ** c[k + 6])))


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    z = m[j]
    if since > 0.0:
        # on the way here the rate was, in the mean, that of the way
        z = bent(z, lam - lam0, reach(c, k, (lam - lam0) / since), c[k + 5])
    at = math.copysign(z, z * rate) / reach(c, k, rate)
    slips = bristles_slip(at, c[k + 5]) * at
    return c[k] * (z + c[k + 2] * rate * (1.0 - slips)) / c[k + 1]


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = bent(m[j], lam - lam0, reach(c, k, (lam - lam0) / h), c[k + 5])
    return 0
