"""Neo-Hookean spring (thesis eq. 24): W = mu/2 (I1 - 3)."""

from __future__ import annotations

from dearig.model.jit import jit

NAME = "neo-hookean"


@jit
def energy(strain: float, modulus: float, limit: float) -> float:
    """Return the free energy density in J/m^3 at ``strain`` = I1 - 3; ``limit`` is not used."""
    return 0.5 * modulus * strain


@jit
def slope(strain: float, modulus: float, limit: float) -> float:
    """Return dW/dI1 in Pa."""
    return 0.5 * modulus


@jit
def curvature(strain: float, modulus: float, limit: float) -> float:
    """Return d2W/dI1^2 in Pa."""
    return 0.0


@jit
def locking_strain(limit: float) -> float:
    """Return I1 - 3 at which the spring locks: never."""
    return float("inf")
