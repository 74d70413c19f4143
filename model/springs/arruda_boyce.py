"""Arruda-Boyce spring (thesis eq. 25): eight chains of n links with Langevin statistics.

    W = mu sqrt(n) [ beta lambda_c - sqrt(n) ln(sinh(beta)/beta) ],
    lambda_c = sqrt(I1/3),  beta = L^-1(lambda_c/sqrt(n)).

The thesis prints lambda_c = I1/3 without the root, which is not a stretch (it would make the small
strain modulus depend on the square of the stretch); the root is what Arruda and Boyce (1993) have.
``modulus`` is mu: as in eq. 25 the initial shear modulus is a little larger for few links.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.springs.description import LIMIT, ShapeParameter, SpringLaw

SPRING = SpringLaw(
    name="arruda-boyce",
    title="Arruda-Boyce",
    summary="Stress of eight chains of finitely many links, which lock when they are straight.",
    source="E. M. Arruda and M. C. Boyce, J. Mech. Phys. Solids 41, 389 (1993)",
    parameters=(
        ShapeParameter(
            LIMIT, "J", (1.0, math.inf), math.inf, "number of links of a chain",
            fit_within=(1.001, 9e8),
        ),
    ),
    starts=lambda square: tuple((square * f,) for f in (1.2, 3.0, 10.0, 100.0)),
)  # fmt: skip


@jit
def langevin(beta: float) -> tuple[float, float]:
    """Return the Langevin function coth(beta) - 1/beta and its slope.

    Below 0.05 by its series, beyond 20 by its asymptote, which cannot overflow.
    """
    if beta < 0.05:
        b2 = beta * beta
        return (
            beta * (1.0 / 3.0 - b2 * (1.0 / 45.0 - b2 * (2.0 / 945.0 - b2 / 4725.0))),
            1.0 / 3.0 - b2 * (1.0 / 15.0 - b2 * (2.0 / 189.0 - b2 / 675.0)),
        )
    if beta > 20.0:
        return 1.0 - 1.0 / beta, 1.0 / (beta * beta)
    sinh = math.sinh(beta)
    return math.cosh(beta) / sinh - 1.0 / beta, 1.0 / (beta * beta) - 1.0 / (sinh * sinh)


@jit
def inverse_langevin(x: float) -> float:
    """Return beta with coth(beta) - 1/beta = x, for 0 <= x < 1, to rounding.

    Two Newton steps from Kroeger's rational approximation (2015, error below 0.28 %). They are
    taken in 1/beta, in which the Langevin function of a stretched chain is a straight line.
    """
    if x < 1e-4:
        return 3.0 * x + 1.8 * x * x * x
    x2 = x * x
    beta = (3.0 * x - x * x2 / 5.0 * (6.0 + x2 - 2.0 * x2 * x2)) / (1.0 - x2)
    for _ in range(2):
        value, rate = langevin(beta)
        beta /= 1.0 - (x - value) / (rate * beta)
    return beta


@jit
def energy(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return U at ``strain`` = I1 - 3; 0 at rest."""
    root = math.sqrt(shape[0])
    total = 0.0
    for sign, invariant in ((1.0, strain + 3.0), (-1.0, 3.0)):
        chain = math.sqrt(invariant / 3.0)
        beta = inverse_langevin(chain / root)
        # ln(sinh b / b) without overflow
        log_sinhc = beta + math.log1p(-math.exp(-2.0 * beta)) - math.log(2.0 * beta)
        total += sign * root * (beta * chain - root * log_sinhc)
    return total


@jit
def slope(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return dU/dI1: sqrt(n) beta / (6 lambda_c)."""
    chain = math.sqrt((strain + 3.0) / 3.0)
    root = math.sqrt(shape[0])
    return root * inverse_langevin(chain / root) / (6.0 * chain)


@jit
def curvature(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return d2U/dI1^2."""
    chain = math.sqrt((strain + 3.0) / 3.0)
    root = math.sqrt(shape[0])
    beta = inverse_langevin(chain / root)
    _, rate = langevin(beta)
    dbeta_dchain = 1.0 / (rate * root)
    return root / 36.0 * (dbeta_dchain - beta / chain) / (chain * chain)


@jit
def locking_strain(shape: tuple[float, float, float, float]) -> float:
    """Return I1 - 3 at which the chains are straight: 3 n - 3."""
    return 3.0 * shape[0] - 3.0
