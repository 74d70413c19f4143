"""Stiffness of a film that takes up moisture: water between the chains plasticises it.

The network's stress is multiplied by 1 + a w. The moisture w is a relative humidity (0 to 1) less
0.5: that with which the film is in equilibrium. A record begins in equilibrium with the air; then
the film follows it, w' = (h - w)/tau. Fick's diffusion from both faces of a film of thickness Z has
tau = Z^2/(pi^2 D) as its slowest time (Crank, The Mathematics of Diffusion, 1975, section 4.3).
"""

from __future__ import annotations

from dearig.model.coefficients import AIR_HUMIDITY
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "at_rest", "breathe", "soften"]

#: How moisture follows the room: of every effect of it.
SORPTION = r"\tau \dot{w} = h - \frac{1}{2} - w, \quad w(0) = h(0) - \frac{1}{2}"
WETNESS = (
    ("w", "moisture: the relative humidity with which the film is in equilibrium, less 1/2"),
)
CRANK = "J. Crank, The Mathematics of Diffusion, 2nd ed., section 4.3 (1975)"
SORPTION_TIME = Parameter(
    "sorption_time",
    "s",
    (10.0, 1e6),
    "in which the film follows the humidity",
    1e3,
    starts=(1e3, 1e5),
    logarithmic=True,
)

EFFECT = Effect(
    name="moist stiffness",
    family="humidity",
    acts_on="film stress",
    summary="the stiffness follows the humidity of the room, slowly",
    law=Law(
        equations=(
            r"\sigma = (1 + a w) \sigma_0",
            SORPTION,
        ),
        symbols=("a", r"\tau"),
        source=CRANK,
        where=WETNESS,
    ),
    parameters=(
        Parameter(
            "stiffening",
            "",
            (-0.9, 0.9),
            "relative change of stress from a dry to a saturated room",
            0.1,
            0.0,
        ),
        SORPTION_TIME,
    ),
    memory=1,
    needs="humidity",
)


@jit
def at_rest(c, k, m, j):
    return 1.0 + c[k] * c[AIR_HUMIDITY]


@jit
def breathe(c, k, m, j, warmth, moisture, h):
    m[j] = lagged(m[j], moisture, moisture, h, c[k + 1])
    return 0


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.0 + c[k] * (c[AIR_HUMIDITY] + m[j])
