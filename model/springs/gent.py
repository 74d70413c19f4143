"""Gent spring (thesis eq. 26): W = -mu J/2 ln(1 - (I1 - 3)/J)."""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.springs.description import LIMIT, ShapeParameter, SpringLaw

SPRING = SpringLaw(
    name="gent",
    title="Gent",
    summary="Stiffens towards a greatest strain, and is neo-Hookean far below it.",
    source="A. N. Gent, Rubber Chem. Technol. 69, 59 (1996)",
    parameters=(
        ShapeParameter(
            LIMIT, "J", (0.0, math.inf), math.inf, "value of I1 - 3 at which the spring locks",
            fit_within=(1e-3, 9e8),
        ),
    ),
    starts=lambda square: tuple((square * f,) for f in (1.2, 3.0, 10.0, 100.0)),
)  # fmt: skip


@jit
def energy(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return U at ``strain`` = I1 - 3."""
    return -0.5 * shape[0] * math.log1p(-strain / shape[0])


@jit
def slope(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return dU/dI1."""
    return 0.5 * shape[0] / (shape[0] - strain)


@jit
def curvature(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return d2U/dI1^2."""
    room = shape[0] - strain
    return 0.5 * shape[0] / (room * room)


@jit
def locking_strain(shape: tuple[float, float, float, float]) -> float:
    """Return I1 - 3 at which the spring locks: J itself."""
    return shape[0]
