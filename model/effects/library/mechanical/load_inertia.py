"""Inertia of the hanging load, which the thesis leaves out.

The load moves with the film's lower edge, l1 = lam L1, so its inertial force m L1 lam'' over the
section L2 Z adds m L1/(L2 Z) to the coefficient of lam'': 208 kg/m for 200 g on the thesis's film,
against the film's own 1.9 kg/m. The film alone rings at about 70 Hz, with the load at about 7 Hz.
"""

from __future__ import annotations

from dearig.model.coefficients import LENGTH, SECTION
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "inertia"]

EFFECT = Effect(
    name="load inertia",
    family="load_inertia",
    acts_on="inertia",
    summary="a mass moves with the film: it rings after every edge of the voltage",
    law=Law(
        equations=(
            (
                r"\left(\frac{\rho L_1^2}{3} + \frac{m L_1}{L_2 Z}\right) \ddot{\lambda} = "
                r"\frac{F}{L_2 Z} + \sigma_E - \sigma"
            ),
        ),
        symbols=("m",),
        source="Newton's second law",
    ),
    parameters=(
        Parameter(
            "moving_mass",
            "kg",
            (0.0, 2.0),
            "mass that moves with the film's lower edge",
            0.1,
            0.0,
            # where the excitation sweeps over the ringing, another mass rings at another time
            starts=tuple(0.005 * 1.4**i for i in range(17)),
        ),
    ),
)


@jit
def inertia(c, k, m, j):
    return c[k] * c[LENGTH] / c[SECTION]
