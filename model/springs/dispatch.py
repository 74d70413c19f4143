"""The functions of all strain energies by the code of the law, compiled.

A code is a position in ``registry.MODULES``. ``shape`` is (limit, a, b, c): the law's parameters,
``limit`` at 0 and the others in their order, whatever a law does not have at any value. All results
are per unit modulus, which is the initial shear modulus in Pa (for Arruda-Boyce nearly so).
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.springs import (
    arruda_boyce,
    extended_tube,
    gent,
    mooney_rivlin,
    neo_hookean,
    ogden,
    ogden_two_terms,
    yeoh,
)
from dearig.model.springs.registry import FIRST_PRINCIPAL

__all__ = [
    "Shape",
    "curvature",
    "energy",
    "has_principal",
    "locking_strain",
    "principal_energy",
    "principal_pull",
    "principal_pull_slope",
    "slope",
]

Shape = tuple[float, float, float, float]


@jit
def energy(kind: int, strain: float, shape: Shape) -> float:
    """Return U at ``strain`` = I1 - 3."""
    if kind == 1:
        return gent.energy(strain, shape)
    if kind == 0:
        return neo_hookean.energy(strain, shape)
    if kind == 2:
        return arruda_boyce.energy(strain, shape)
    if kind == 3:
        return yeoh.energy(strain, shape)
    if kind == 4:
        return mooney_rivlin.energy(strain, shape)
    if kind == 7:
        return extended_tube.energy(strain, shape)
    return 0.0


@jit
def slope(kind: int, strain: float, shape: Shape) -> float:
    """Return dU/dI1."""
    if kind == 1:
        return gent.slope(strain, shape)
    if kind == 0:
        return neo_hookean.slope(strain, shape)
    if kind == 2:
        return arruda_boyce.slope(strain, shape)
    if kind == 3:
        return yeoh.slope(strain, shape)
    if kind == 4:
        return mooney_rivlin.slope(strain, shape)
    if kind == 7:
        return extended_tube.slope(strain, shape)
    return 0.0


@jit
def curvature(kind: int, strain: float, shape: Shape) -> float:
    """Return d2U/dI1^2."""
    if kind == 1:
        return gent.curvature(strain, shape)
    if kind == 2:
        return arruda_boyce.curvature(strain, shape)
    if kind == 3:
        return yeoh.curvature(strain, shape)
    if kind == 7:
        return extended_tube.curvature(strain, shape)
    return 0.0


@jit
def has_principal(kind: int) -> bool:
    """Whether the law has terms in the principal stretches."""
    return kind >= FIRST_PRINCIPAL


@jit
def principal_energy(kind: int, stretch: float, shape: Shape) -> float:
    """Return w at a principal ``stretch``; 0 at 1."""
    if kind == 5:
        return ogden.principal_energy(stretch, shape)
    if kind == 6:
        return ogden_two_terms.principal_energy(stretch, shape)
    if kind == 4:
        return mooney_rivlin.principal_energy(stretch, shape)
    if kind == 7:
        return extended_tube.principal_energy(stretch, shape)
    return 0.0


@jit
def principal_pull(kind: int, stretch: float, shape: Shape) -> float:
    """Return lam dw/dlam at a principal ``stretch``, but for a constant that cancels."""
    if kind == 5:
        return ogden.principal_pull(stretch, shape)
    if kind == 6:
        return ogden_two_terms.principal_pull(stretch, shape)
    if kind == 4:
        return mooney_rivlin.principal_pull(stretch, shape)
    if kind == 7:
        return extended_tube.principal_pull(stretch, shape)
    return 0.0


@jit
def principal_pull_slope(kind: int, stretch: float, shape: Shape) -> float:
    """Return the derivative of ``principal_pull`` by the stretch."""
    if kind == 5:
        return ogden.principal_pull_slope(stretch, shape)
    if kind == 6:
        return ogden_two_terms.principal_pull_slope(stretch, shape)
    if kind == 4:
        return mooney_rivlin.principal_pull_slope(stretch, shape)
    if kind == 7:
        return extended_tube.principal_pull_slope(stretch, shape)
    return 0.0


@jit
def locking_strain(kind: int, shape: Shape) -> float:
    """Return I1 - 3 at the locking stretch, beyond which the spring has no energy."""
    if kind == 1:
        return gent.locking_strain(shape)
    if kind == 2:
        return arruda_boyce.locking_strain(shape)
    if kind == 7:
        return extended_tube.locking_strain(shape)
    return float("inf")
