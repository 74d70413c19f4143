"""The generalised Maxwell network: stress and stiffness of its springs."""

from __future__ import annotations

import numpy as np

from dearig.model.coefficients import EFFECTS_AT, HELD, KIND, LIMIT, LOCKING, MODULUS, WIDTH
from dearig.model.effects import PARAMETER_COUNT
from dearig.model.jit import jit
from dearig.model.kinematics import directions, pull_slope, strain_and_pull
from dearig.model.springs import curvature, slope

__all__ = [
    "HEAD",
    "branch_count",
    "network_stress",
    "nominal_pull",
    "nominal_pull_slope",
    "true_pull",
]

HEAD = EFFECTS_AT + PARAMETER_COUNT  #: where the springs begin in the coefficient vector


@jit
def branch_count(c: np.ndarray) -> int:
    """Return the number of Maxwell branches in coefficient vector ``c``."""
    return int((c.shape[0] - HEAD) // WIDTH - 1)


@jit
def true_pull(held: int, kind: int, limit: float, s: float, inverse: float) -> float:
    """Return the true stress over the modulus of a spring at squared stretch ``s``, 1/s given.

    Beyond locking the value has no meaning: callers check the strain against the locking strain.
    """
    strain, pull = strain_and_pull(held, s, inverse)
    return 2.0 * slope(kind, strain, 1.0, limit) * pull


@jit
def nominal_pull(held: int, kind: int, limit: float, locking: float, e: float) -> float:
    """Return the nominal stress over the modulus of a spring at its own stretch ``e``.

    inf at and beyond locking.
    """
    strain, pull = strain_and_pull(held, e * e, 1.0 / (e * e))
    if not strain < locking:
        return np.inf
    return 2.0 * slope(kind, strain, 1.0, limit) * pull / e


@jit
def nominal_pull_slope(held: int, kind: int, limit: float, locking: float, e: float) -> float:
    """Return d(nominal_pull)/de; inf at and beyond locking."""
    strain, pull = strain_and_pull(held, e * e, 1.0 / (e * e))
    if not strain < locking:
        return np.inf
    pull /= e
    return 2.0 * (
        curvature(kind, strain, 1.0, limit) * 2.0 * directions(held) * pull * pull
        + slope(kind, strain, 1.0, limit) * pull_slope(held, e)
    )


@jit
def network_stress(c: np.ndarray, lam: float, xi: np.ndarray) -> float:
    """Return the nominal stress of all springs in Pa at ``lam`` and inner stretches ``xi`` (n,)."""
    held = int(c[HELD])
    total = c[HEAD + MODULUS] * nominal_pull(
        held, int(c[HEAD + KIND]), c[HEAD + LIMIT], c[HEAD + LOCKING], lam
    )
    for i in range(branch_count(c)):
        k = HEAD + WIDTH * (i + 1)
        pull = nominal_pull(held, int(c[k + KIND]), c[k + LIMIT], c[k + LOCKING], lam / xi[i])
        total += c[k + MODULUS] * pull / xi[i]
    return float(total)
