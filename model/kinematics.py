"""How one stretch deforms the whole incompressible film, for the three ways a film is held.

    constrained-width   lam2 = 1            the thesis's actuator
    uniaxial            lam2 = lam^-1/2     a tensile test
    equibiaxial         lam2 = lam          a balloon or a frame pulled both ways

All of them reduce to I1 - 3 as a function of the one stretch, to the share of dW/dlam that one
direction carries, and to the electrical term: the film in a true field phi/z feels the nominal
stress eps (phi/Z)^2 a(lam), with a = 1/2 d(lam1 lam2)^2/dlam times that share.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.jit import allocating, jit

__all__ = [
    "directions",
    "electric",
    "electric_along",
    "electric_slope",
    "pull_slope",
    "strain_and_pull",
    "thinning",
    "thinning_squared",
    "thinning_squared_slope",
]


@jit
def strain_and_pull(held: int, s: float, inverse: float) -> tuple[float, float]:
    """``(I1 - 3, P)`` of a spring at squared stretch ``s`` = e^2, with ``inverse`` = 1/s.

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
    """d(P/e)/de: how the geometric part of the nominal stress grows with stretch ``e``."""
    u = 1.0 / e
    if held == 0:
        u2 = u * u
        return 1.0 + 3.0 * u2 * u2
    if held == 1:
        return 1.0 + 2.0 * u * u * u
    u3 = u * u * u
    return 1.0 + 5.0 * u3 * u3


@jit
def directions(held: int) -> float:
    """In how many directions ``lam`` is imposed: they share dW/dlam among them."""
    return 2.0 if held == 2 else 1.0


def thinning(held: int, stretch: np.ndarray) -> np.ndarray:
    """Z/z, the thickness before over the thickness after: true field = phi/Z times this."""
    return stretch ** (1.0, 0.5, 2.0)[held]


@jit
def thinning_squared(held: int, lam: float) -> float:
    """(Z/z)^2: the true field squared over (phi/Z)^2, and the capacitance over that at rest."""
    if held == 0:
        return lam * lam
    if held == 1:
        return lam
    return lam * lam * lam * lam


@jit
def thinning_squared_slope(held: int, lam: float) -> float:
    """d(thinning_squared)/dlam."""
    if held == 0:
        return 2.0 * lam
    if held == 1:
        return 1.0
    return 4.0 * lam * lam * lam


@jit
def electric(held: int, lam: float) -> float:
    """Maxwell stress over eps (phi/Z)^2, nominal, in one direction."""
    if held == 0:
        return lam
    if held == 1:
        return 0.5
    return lam * lam * lam


@allocating
def electric_along(held: int, stretch: np.ndarray) -> np.ndarray:
    """``electric`` (N,) at each ``stretch`` (N,)."""
    out = np.empty(stretch.size)
    for i in range(stretch.size):
        out[i] = electric(held, stretch[i])
    return out


@jit
def electric_slope(held: int, lam: float) -> float:
    """d(electric)/dlam."""
    if held == 0:
        return 1.0
    if held == 1:
        return 0.0
    return 3.0 * lam * lam
