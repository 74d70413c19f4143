"""Ogden spring of one term: W = 2 mu/alpha^2 (lam1^alpha + lam2^alpha + lam3^alpha - 3).

mu is the initial shear modulus; the mu_1 of Ogden's paper is 2 mu/alpha. Incompressibility allows a
multiple of ln lam1 + ln lam2 + ln lam3 = 0 to be taken off, so that alpha = 0 is not an exception
(Hencky's energy).
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.springs.description import ShapeParameter, SpringLaw

SPRING = SpringLaw(
    name="ogden",
    title="Ogden",
    summary="One power of the principal stretches.",
    source="R. W. Ogden, Proc. R. Soc. A 326, 565 (1972)",
    parameters=(
        ShapeParameter("exponent", "alpha", (-20.0, 20.0), 2.0, "power alpha", typical=0.5),
    ),
    starts=lambda _: ((-2.0,), (1.0,), (2.0,), (4.0,), (8.0,)),
)

_SMALL = 1e-4  # of alpha ln lam: below, rounding of the closed forms exceeds their series' error


@jit
def power_energy(stretch: float, alpha: float) -> float:
    """Return 2/alpha^2 (lam^alpha - 1 - alpha ln lam)."""
    log = math.log(stretch)
    x = alpha * log
    if abs(x) < _SMALL:
        return log * log * (1.0 + x / 3.0)
    return 2.0 * (math.expm1(x) - x) / (alpha * alpha)


@jit
def power_pull(stretch: float, alpha: float) -> float:
    """Return lam times the derivative of ``power_energy``: 2/alpha (lam^alpha - 1)."""
    log = math.log(stretch)
    x = alpha * log
    if abs(x) < _SMALL:
        return 2.0 * log * (1.0 + 0.5 * x * (1.0 + x / 3.0))
    return 2.0 * math.expm1(x) / alpha


@jit
def power_pull_slope(stretch: float, alpha: float) -> float:
    """Return the derivative of ``power_pull``: 2 lam^(alpha - 1)."""
    return 2.0 * stretch ** (alpha - 1.0)


@jit
def principal_energy(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return w at a principal ``stretch``."""
    return power_energy(stretch, shape[1])


@jit
def principal_pull(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return lam dw/dlam."""
    return power_pull(stretch, shape[1])


@jit
def principal_pull_slope(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return the derivative of ``principal_pull``."""
    return power_pull_slope(stretch, shape[1])
