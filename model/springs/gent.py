"""Gent spring (thesis eq. 26): W = -mu J/2 ln(1 - (I1 - 3)/J)."""

from __future__ import annotations

import math

from dearig.model.jit import jit

NAME = "gent"


@jit
def energy(strain: float, modulus: float, limit: float) -> float:
    """Return the free energy density in J/m^3 at ``strain`` = I1 - 3, with ``limit`` = J."""
    return -0.5 * modulus * limit * math.log1p(-strain / limit)


@jit
def slope(strain: float, modulus: float, limit: float) -> float:
    """Return dW/dI1 in Pa."""
    return 0.5 * modulus * limit / (limit - strain)


@jit
def curvature(strain: float, modulus: float, limit: float) -> float:
    """Return d2W/dI1^2 in Pa."""
    room = limit - strain
    return 0.5 * modulus * limit / (room * room)


@jit
def locking_strain(limit: float) -> float:
    """Return I1 - 3 at which the spring locks: J itself."""
    return limit
