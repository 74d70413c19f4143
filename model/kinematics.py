"""The kinematics of an incompressible film with one imposed stretch, for three ways to hold it.

    constrained-width   lam2 = 1            the thesis's actuator
    uniaxial            lam2 = lam^-1/2     a tensile test
    equibiaxial         lam2 = lam          a balloon or a frame pulled both ways

Each gives I1 - 3 as a function of the stretch, the share of dW/dlam that one direction carries, and
the electrical term: a true field phi/z causes the nominal stress eps (phi/Z)^2 a(lam), with
a = 1/2 d(lam1 lam2)^2/dlam times that share.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.compiled.jit import allocating, jit

__all__ = [
    "directions",
    "electric",
    "electric_along",
    "electric_slope",
    "pull_slope",
    "strain_and_pull",
    "thickness",
    "thickness_slope",
    "thinning",
    "thinning_squared",
    "thinning_squared_slope",
]


@jit
def strain_and_pull(held: int, s: float, inverse: float) -> tuple[float, float]:
    """Return ``(I1 - 3, P)`` of a spring at squared stretch ``s`` = e^2, ``inverse`` = 1/s.

    P is the geometric part of its true stress, e g dI1/de / 2: a spring of slope dW/dI1 carries
    the true stress 2 (dW/dI1) P in each moving direction.
    """
    if held == 0:
        return s + inverse - 2.0, s - inverse
    if held == 1:
        inner = math.sqrt(inverse)
        return s + 2.0 * inner - 3.0, s - inner
    squared = inverse * inverse
    return 2.0 * s + squared - 3.0, s - squared


@jit
def pull_slope(held: int, e: float) -> float:
    """Return d(P/e)/de, the slope of the geometric part of the nominal stress at stretch ``e``."""
    u = 1.0 / e
    if held == 0:
        u2 = u * u
        return 1.0 + 3.0 * u2 * u2
    if held == 1:
        return 1.0 + 2.0 * u * u * u
    u3 = u * u * u
    return 1.0 + 5.0 * u3 * u3


@jit
def thickness(held: int, e: float) -> float:
    """Return lam3, the stretch of the thickness, of a spring at its own stretch ``e``."""
    if held == 0:
        return 1.0 / e
    if held == 1:
        return 1.0 / math.sqrt(e)
    return 1.0 / (e * e)


@jit
def thickness_slope(held: int, e: float) -> float:
    """Return d(lam3)/de."""
    if held == 0:
        return -1.0 / (e * e)
    if held == 1:
        return -0.5 / (e * math.sqrt(e))
    return -2.0 / (e * e * e)


@jit
def directions(held: int) -> float:
    """Return the number of directions in which ``lam`` is imposed: they share dW/dlam."""
    return 2.0 if held == 2 else 1.0


def thinning(held: int, stretch: np.ndarray) -> np.ndarray:
    """Return Z/z, undeformed over deformed thickness: the true field is phi/Z times this."""
    return stretch ** (1.0, 0.5, 2.0)[held]


@jit
def thinning_squared(held: int, lam: float) -> float:
    """Return (Z/z)^2: the true field squared over (phi/Z)^2, the capacitance over that at rest."""
    if held == 0:
        return lam * lam
    if held == 1:
        return lam
    return lam * lam * lam * lam


@jit
def thinning_squared_slope(held: int, lam: float) -> float:
    """Return d(thinning_squared)/dlam."""
    if held == 0:
        return 2.0 * lam
    if held == 1:
        return 1.0
    return 4.0 * lam * lam * lam


@jit
def electric(held: int, lam: float) -> float:
    """Return the nominal Maxwell stress in one direction over eps (phi/Z)^2."""
    if held == 0:
        return lam
    if held == 1:
        return 0.5
    return lam * lam * lam


@allocating
def electric_along(held: int, stretch: np.ndarray) -> np.ndarray:
    """Return ``electric`` (N,) at each ``stretch`` (N,)."""
    out = np.empty(stretch.size)
    for i in range(stretch.size):
        out[i] = electric(held, stretch[i])
    return out


@jit
def electric_slope(held: int, lam: float) -> float:
    """Return d(electric)/dlam."""
    if held == 0:
        return 1.0
    if held == 1:
        return 0.0
    return 3.0 * lam * lam
