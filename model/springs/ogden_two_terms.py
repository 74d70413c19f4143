"""Ogden spring of two terms: (1 - s) of the initial modulus has one power, s another.

W = mu (1 - s) 2/alpha^2 (sum lam^alpha - 3) + mu s 2/beta^2 (sum lam^beta - 3)
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.springs.description import ShapeParameter, SpringLaw
from dearig.model.springs.ogden import power_energy, power_pull, power_pull_slope

SPRING = SpringLaw(
    name="ogden-two-terms",
    title="Ogden (two terms)",
    summary="Two powers of the principal stretches.",
    source="R. W. Ogden, Proc. R. Soc. A 326, 565 (1972)",
    parameters=(
        ShapeParameter("exponent", "alpha", (-20.0, 20.0), 2.0, "power alpha", typical=0.5),
        ShapeParameter("second_exponent", "beta", (-20.0, 20.0), 2.0, "power beta", typical=0.5),
        ShapeParameter(
            "share", "share", (0.0, 1.0), 0.0, "share of the second power in the initial modulus",
            typical=0.05,
        ),
    ),
    starts=lambda _: ((1.0, 4.0, 0.1), (1.5, -2.0, 0.1), (2.0, 8.0, 0.01), (0.5, 2.5, 0.5)),
)  # fmt: skip


@jit
def principal_energy(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return w at a principal ``stretch``."""
    first, second = power_energy(stretch, shape[1]), power_energy(stretch, shape[2])
    return (1.0 - shape[3]) * first + shape[3] * second


@jit
def principal_pull(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return lam dw/dlam."""
    first, second = power_pull(stretch, shape[1]), power_pull(stretch, shape[2])
    return (1.0 - shape[3]) * first + shape[3] * second


@jit
def principal_pull_slope(stretch: float, shape: tuple[float, float, float, float]) -> float:
    """Return the derivative of ``principal_pull``."""
    first, second = power_pull_slope(stretch, shape[1]), power_pull_slope(stretch, shape[2])
    return (1.0 - shape[3]) * first + shape[3] * second
