"""Neo-Hookean spring (thesis eq. 24): W = mu/2 (I1 - 3)."""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.springs.description import SpringLaw

SPRING = SpringLaw(
    name="neo-hookean",
    title="neo-Hookean",
    summary="Stress of Gaussian chains, which never lock.",
    source="R. S. Rivlin, Phil. Trans. R. Soc. A 240, 459 (1948)",
    parameters=(),
    starts=lambda _: ((),),
)


@jit
def energy(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return U at ``strain`` = I1 - 3."""
    return 0.5 * strain


@jit
def slope(strain: float, shape: tuple[float, float, float, float]) -> float:
    """Return dU/dI1."""
    return 0.5
