"""The generalised Maxwell network: stress and stiffness of its springs."""

from __future__ import annotations

import math

import numpy as np

from dearig.model.coefficients import (
    EFFECTS_AT,
    HELD,
    KIND,
    LIMIT,
    LOCKING,
    MODULUS,
    SHAPE,
    WIDTH,
)
from dearig.model.compiled.jit import jit
from dearig.model.effects import PARAMETER_COUNT
from dearig.model.kinematics import (
    directions,
    pull_slope,
    strain_and_pull,
    thickness,
    thickness_slope,
)
from dearig.model.springs import (
    SPRINGS,
    Shape,
    curvature,
    gent,
    has_principal,
    principal_pull,
    principal_pull_slope,
    slope,
)

__all__ = [
    "HEAD",
    "branch_count",
    "network_stress",
    "nominal_pull",
    "nominal_pull_slope",
    "shape_at",
    "true_pull",
]

_GENT = SPRINGS.index("gent")

HEAD = EFFECTS_AT + PARAMETER_COUNT  #: where the springs begin in the coefficient vector


@jit
def branch_count(c: np.ndarray) -> int:
    """Return the number of Maxwell branches in coefficient vector ``c``."""
    return int((c.shape[0] - HEAD) // WIDTH - 1)


@jit
def shape_at(c: np.ndarray, k: int) -> Shape:
    """Return the shape of the spring whose numbers begin at ``k`` in coefficient vector ``c``."""
    return c[k + LIMIT], c[k + SHAPE], c[k + SHAPE + 1], c[k + SHAPE + 2]


@jit
def true_pull(held: int, kind: int, shape: Shape, s: float, inverse: float) -> float:
    """Return the true stress over the modulus of a spring at squared stretch ``s``, 1/s given.

    Beyond locking the value has no meaning: callers check the strain against the locking strain.
    """
    strain, pull = strain_and_pull(held, s, inverse)
    if kind == _GENT:
        return 2.0 * gent.slope(strain, shape) * pull
    return _other_pull(held, kind, shape, s, strain, pull)


# The other laws are functions of their own: the compiler then inlines Gent's spring into the loops
# of the integrators, as if there were no others.
@jit
def _other_pull(held: int, kind: int, shape: Shape, s: float, strain: float, pull: float) -> float:
    stress = 2.0 * slope(kind, strain, shape) * pull
    if has_principal(kind):
        # the film is free in its thickness: sigma_1 = lam1 dW/dlam1 - lam3 dW/dlam3
        e = math.sqrt(s)
        stress += principal_pull(kind, e, shape) - principal_pull(kind, thickness(held, e), shape)
    return stress


@jit
def nominal_pull(held: int, kind: int, shape: Shape, locking: float, e: float) -> float:
    """Return the nominal stress over the modulus of a spring at its own stretch ``e``.

    inf at and beyond locking.
    """
    s = e * e
    strain, _ = strain_and_pull(held, s, 1.0 / s)
    if not strain < locking:
        return np.inf
    return true_pull(held, kind, shape, s, 1.0 / s) / e


@jit
def nominal_pull_slope(held: int, kind: int, shape: Shape, locking: float, e: float) -> float:
    """Return d(nominal_pull)/de; inf at and beyond locking."""
    strain, pull = strain_and_pull(held, e * e, 1.0 / (e * e))
    if not strain < locking:
        return np.inf
    pull /= e
    if kind == _GENT:
        return 2.0 * (
            gent.curvature(strain, shape) * 2.0 * directions(held) * pull * pull
            + gent.slope(strain, shape) * pull_slope(held, e)
        )
    return _other_pull_slope(held, kind, shape, e, strain, pull)


@jit
def _other_pull_slope(
    held: int, kind: int, shape: Shape, e: float, strain: float, pull: float
) -> float:
    bend = 2.0 * (
        curvature(kind, strain, shape) * 2.0 * directions(held) * pull * pull
        + slope(kind, strain, shape) * pull_slope(held, e)
    )
    if has_principal(kind):
        thin = thickness(held, e)
        rise = principal_pull(kind, e, shape) - principal_pull(kind, thin, shape)
        bend += principal_pull_slope(kind, e, shape) / e - rise / (e * e)
        bend -= principal_pull_slope(kind, thin, shape) * thickness_slope(held, e) / e
    return bend


@jit
def network_stress(c: np.ndarray, lam: float, xi: np.ndarray) -> float:
    """Return the nominal stress of all springs in Pa at ``lam`` and inner stretches ``xi`` (n,)."""
    held = int(c[HELD])
    total = c[HEAD + MODULUS] * nominal_pull(
        held, int(c[HEAD + KIND]), shape_at(c, HEAD), c[HEAD + LOCKING], lam
    )
    for i in range(branch_count(c)):
        k = HEAD + WIDTH * (i + 1)
        pull = nominal_pull(held, int(c[k + KIND]), shape_at(c, k), c[k + LOCKING], lam / xi[i])
        total += c[k + MODULUS] * pull / xi[i]
    return float(total)
