"""Yeoh spring: W = mu/2 [x + a x^2 + b x^3], x = I1 - 3; mu/2, mu a/2 and mu b/2 are C1, C2, C3."""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.springs.description import ShapeParameter, SpringLaw


def _starts(square: float) -> tuple[tuple[float, ...], ...]:
    """Return starts from a straight line to terms that outweigh the first at the end."""
    return tuple(
        (second / square, third / square**2)
        for second, third in ((0.0, 0.0), (0.5, 0.0), (-0.3, 0.3), (0.0, 1.0))
    )


SPRING = SpringLaw(
    name="yeoh",
    title="Yeoh",
    summary="A cubic of I1 - 3: softens at first and stiffens later.",
    source="O. H. Yeoh, Rubber Chem. Technol. 66, 754 (1993)",
    parameters=(
        ShapeParameter("quadratic", "c2", (-10.0, 10.0), 0.0, "ratio C2/C1", typical=1e-2),
        ShapeParameter("cubic", "c3", (0.0, 10.0), 0.0, "ratio C3/C1", typical=1e-4),
    ),
    starts=_starts,
)


@jit
def energy(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return U at ``strain`` = I1 - 3."""
    return 0.5 * strain * (1.0 + strain * (shape[1] + strain * shape[2]))


@jit
def slope(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return dU/dI1."""
    return 0.5 + strain * (shape[1] + 1.5 * strain * shape[2])


@jit
def curvature(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return d2U/dI1^2."""
    return shape[1] + 3.0 * strain * shape[2]
