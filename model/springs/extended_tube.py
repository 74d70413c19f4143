"""Extended tube: chains of finite length (modulus Gc) in tubes formed by entanglements (Ge).

W = Gc/2 [(1 - d) x/(1 - d x) + ln(1 - d x)] + 2 Ge/beta^2 (sum lam^-beta - 3),  x = I1 - 3,
d = delta^2. It locks at x = 1/d, which is ``limit``. The initial modulus is mu = Gc (1 - 2 d) + Ge;
s = Ge/mu.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.springs.description import LIMIT, ShapeParameter, SpringLaw
from dearig.model.springs.ogden import power_energy, power_pull, power_pull_slope


def _starts(square: float) -> tuple[tuple[float, ...], ...]:
    return tuple((square * f, s, 0.5) for f in (1.5, 5.0, 50.0) for s in (0.1, 0.5))


SPRING = SpringLaw(
    name="extended-tube",
    summary="Chains of finite length, confined to tubes by entanglements.",
    source="M. Kaliske and G. Heinrich, Rubber Chem. Technol. 72, 602 (1999)",
    parameters=(
        # below 2 the first term's modulus is negative
        ShapeParameter(
            LIMIT, "J", (2.0, math.inf), math.inf, "value 1/delta^2 of I1 - 3 at which it locks",
            fit_within=(2.002, 9e8),
        ),
        ShapeParameter(
            "share", "share", (0.0, 1.0), 0.0, "share of the tubes in the initial modulus",
            typical=0.05,
        ),
        ShapeParameter(
            "release", "beta", (0.0, 1.0), 1.0,
            "release beta of the tubes' confinement: 1 for short chains, towards 0 for long",
            typical=0.1,
        ),
    ),
    starts=_starts,
)  # fmt: skip


@jit
def _chains(shape: tuple[float, float, float, float]) -> float:
    """Return Gc/mu."""
    return (1.0 - shape[1]) / (1.0 - 2.0 / shape[0])


@jit
def energy(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return U at ``strain`` = I1 - 3."""
    d = 1.0 / shape[0]
    part = (1.0 - d) * strain / (1.0 - d * strain) + math.log1p(-d * strain)
    return 0.5 * _chains(shape) * part


@jit
def slope(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return dU/dI1."""
    d = 1.0 / shape[0]
    inverse = 1.0 / (1.0 - d * strain)
    return 0.5 * _chains(shape) * inverse * ((1.0 - d) * inverse - d)


@jit
def curvature(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return d2U/dI1^2."""
    d = 1.0 / shape[0]
    inverse = 1.0 / (1.0 - d * strain)
    return 0.5 * _chains(shape) * d * inverse * inverse * (2.0 * (1.0 - d) * inverse - d)


@jit
def locking_strain(shape: tuple[float, float, float, float]) -> float:
    """Return I1 - 3 at which the chains are straight."""
    return shape[0]


@jit
def principal_energy(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return w at a principal ``stretch``."""
    return shape[1] * power_energy(stretch, -shape[2])


@jit
def principal_pull(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return lam dw/dlam."""
    return shape[1] * power_pull(stretch, -shape[2])


@jit
def principal_pull_slope(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return the derivative of ``principal_pull``."""
    return shape[1] * power_pull_slope(stretch, -shape[2])
