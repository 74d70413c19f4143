"""Permittivity of a film that takes up moisture: water has 80, the film a few.

The Maxwell stress is multiplied by 1 + a w, with the moisture w of ``moist_stiffness``.
"""

from __future__ import annotations

from dearig.model.coefficients import AIR_HUMIDITY
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "breathe", "permittivity"]

EFFECT = Effect(
    name="moist permittivity",
    family="humidity",
    acts_on="dielectric",
    summary="the permittivity follows the humidity of the room, slowly",
    law=Law(
        equations=(
            r"\sigma_E = \max(1 + a w, 0.02)\,\sigma_M",
            r"\tau \dot{w} = h - \frac{1}{2} - w, \quad w(0) = h(0) - \frac{1}{2}",
        ),
        symbols=("a", r"\tau"),
        source="J. Crank, The Mathematics of Diffusion, 2nd ed., section 4.3 (1975)",
        where=(
            (
                "w",
                ("moisture: the relative humidity with which the film is in equilibrium, less 1/2"),
            ),
        ),
    ),
    parameters=(
        Parameter(
            "gain",
            "",
            (-0.9, 1.9),
            "relative change of the permittivity from a dry to a saturated room",
            0.1,
            0.0,
        ),
        Parameter(
            "sorption_time",
            "s",
            (10.0, 1e6),
            "in which the film follows the humidity",
            1e3,
            starts=(1e3, 1e5),
            logarithmic=True,
        ),
    ),
    memory=1,
    needs="humidity",
)


@jit
def breathe(c, k, m, j, warmth, moisture, h):
    m[j] = lagged(m[j], moisture, moisture, h, c[k + 1])
    return 0


@jit
def permittivity(c, k, m, j, lam, field2):
    return max(1.0 + c[k] * (c[AIR_HUMIDITY] + m[j]), 0.02)
