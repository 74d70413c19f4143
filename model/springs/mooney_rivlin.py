"""Mooney-Rivlin spring: W = mu/2 [(1 - s) (I1 - 3) + s (I2 - 3)]; C1 = mu (1 - s)/2, C2 = mu s/2.

I2 - 3 of an incompressible film is lam1^-2 + lam2^-2 + lam3^-2 - 3.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.springs.description import ShapeParameter, SpringLaw
from dearig.model.springs.ogden import power_energy, power_pull, power_pull_slope

SPRING = SpringLaw(
    name="mooney-rivlin",
    title="Mooney-Rivlin",
    summary="Linear in both invariants: softens at moderate stretches.",
    source="M. Mooney, J. Appl. Phys. 11, 582 (1940)",
    parameters=(
        ShapeParameter(
            "share", "share", (0.0, 1.0), 0.0, "share C2/(C1 + C2) in the initial modulus",
            typical=0.05,
        ),
    ),
    starts=lambda _: ((0.0,), (0.3,), (0.8,)),
)  # fmt: skip


@jit
def energy(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return U at ``strain`` = I1 - 3."""
    return 0.5 * (1.0 - shape[1]) * strain


@jit
def slope(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return dU/dI1."""
    return 0.5 * (1.0 - shape[1])


@jit
def principal_energy(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return w at a principal ``stretch``."""
    return shape[1] * power_energy(stretch, -2.0)


@jit
def principal_pull(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return lam dw/dlam."""
    return shape[1] * power_pull(stretch, -2.0)


@jit
def principal_pull_slope(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return the derivative of ``principal_pull``."""
    return shape[1] * power_pull_slope(stretch, -2.0)
