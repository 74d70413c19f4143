"""Strain energies of one spring, as functions of ``strain`` = I1 - 3 of that spring's own stretch.

Each spring is one file with ``NAME``, ``energy``, ``slope`` (dW/dI1), ``curvature`` (d2W/dI1^2) and
``locking_strain``. Every spring takes ``modulus`` in Pa and ``limit``: J of the Gent spring, the
links n of an Arruda-Boyce chain, nothing for the neo-Hookean one.
"""

from __future__ import annotations

from dearig.model.jit import jit
from dearig.model.springs import arruda_boyce, gent, neo_hookean

__all__ = ["SPRINGS", "curvature", "energy", "locking_strain", "slope"]

#: Names in the order of the integer codes that the kernels use.
SPRINGS: tuple[str, ...] = (neo_hookean.NAME, gent.NAME, arruda_boyce.NAME)


@jit
def energy(kind: int, strain: float, modulus: float, limit: float) -> float:
    """Return the free energy density in J/m^3 of the spring with code ``kind``."""
    if kind == 1:
        return gent.energy(strain, modulus, limit)
    if kind == 0:
        return neo_hookean.energy(strain, modulus, limit)
    return arruda_boyce.energy(strain, modulus, limit)


@jit
def slope(kind: int, strain: float, modulus: float, limit: float) -> float:
    """Return dW/dI1 in Pa of the spring with code ``kind``."""
    if kind == 1:
        return gent.slope(strain, modulus, limit)
    if kind == 0:
        return neo_hookean.slope(strain, modulus, limit)
    return arruda_boyce.slope(strain, modulus, limit)


@jit
def curvature(kind: int, strain: float, modulus: float, limit: float) -> float:
    """Return d2W/dI1^2 in Pa of the spring with code ``kind``."""
    if kind == 1:
        return gent.curvature(strain, modulus, limit)
    if kind == 0:
        return neo_hookean.curvature(strain, modulus, limit)
    return arruda_boyce.curvature(strain, modulus, limit)


@jit
def locking_strain(kind: int, limit: float) -> float:
    """Return I1 - 3 at the locking stretch, beyond which the spring has no energy."""
    if kind == 1:
        return gent.locking_strain(limit)
    if kind == 0:
        return neo_hookean.locking_strain(limit)
    return arruda_boyce.locking_strain(limit)
