"""The motion of the film without effects: thesis eq. 48, its stiffness and its limits."""

from __future__ import annotations

import math

import numpy as np

from dearig.model.coefficients import (
    ELECTRIC,
    FORCE,
    HELD,
    INERTIA,
    KIND,
    LIMIT,
    LOCKING,
    MODULUS,
    RATE,
    SHAPE,
    WIDTH,
)
from dearig.model.compiled.jit import allocating, inlined, jit
from dearig.model.film.network import HEAD, branch_count, nominal_pull_slope, shape_at, true_pull
from dearig.model.kernel.status import LOCKED, NOT_CONVERGED, PULL_IN
from dearig.model.kinematics import electric, electric_slope, strain_and_pull
from dearig.model.springs import SPRINGS, Shape

__all__ = [
    "LONGEST",
    "SHORTEST",
    "STIFFENING",
    "STRETCH_MAX",
    "admissible",
    "network_stiffness",
    "rates",
    "reason_to_fail",
    "spring_table",
    "strain_at",
]

STRETCH_MAX = 100.0  #: beyond any elastomer: a runaway, whatever the springs say
_NEO_HOOKEAN = SPRINGS.index("neo-hookean")
_LOCKED = 0.9  # of the locking strain: a film that fails beyond it is locked

# rows of the spring table behind those of ``dearig.model.coefficients``
SHORTEST = WIDTH  #: row of the spring table: least stretch short of locking
LONGEST = WIDTH + 1  #: the same: the greatest
STIFFENING = WIDTH + 2  #: row of the spring table: 1/J, 0 for a neo-Hookean spring


@jit
def strain_at(held: int, e: float) -> float:
    """I1 - 3 of a spring at its own stretch ``e``."""
    strain, _ = strain_and_pull(held, e * e, 1.0 / (e * e))
    return strain


@jit
def _shape(springs: np.ndarray, i: int) -> Shape:
    """Shape of spring ``i`` of the spring table."""
    return springs[LIMIT, i], springs[SHAPE, i], springs[SHAPE + 1, i], springs[SHAPE + 2, i]


@inlined
def rates(
    held: int,
    uniform: int,
    c: np.ndarray,
    springs: np.ndarray,
    y: np.ndarray,
    field2: float,
    dy: np.ndarray,
) -> None:
    """Right-hand side of eq. 48 at voltage squared ``field2`` in V^2, written into ``dy``.

    ``uniform`` is the code of the strain energy when all springs share it, else -1.
    """
    lam = y[0]
    s = lam * lam
    inverse = 1.0 / s
    kind = uniform if uniform >= 0 else int(springs[KIND, 0])
    stress = springs[MODULUS, 0] * true_pull(held, kind, _shape(springs, 0), s, inverse)
    for i in range(1, springs.shape[1]):
        inner = y[1 + i] * y[1 + i]
        kind = uniform if uniform >= 0 else int(springs[KIND, i])
        pull = true_pull(held, kind, _shape(springs, i), s / inner, inner * inverse)
        stress += springs[MODULUS, i] * pull
        dy[1 + i] = springs[RATE, i] * pull
    dy[0] = y[1]
    load = c[FORCE] + c[ELECTRIC] * field2 * electric(held, lam)
    dy[1] = (load - stress / lam) / c[INERTIA]


@jit
def network_stiffness(c: np.ndarray, y: np.ndarray, branches: np.ndarray) -> tuple[float, float]:
    """Tangent stiffness of all springs at ``y`` over the inertia, 1/s^2, and the fastest flow, 1/s.

    ``branches`` (2, 3 or more) is filled: the stiffness of each branch, 1/s^2, and the rate at
    which it relaxes, 1/s.
    """
    held = int(c[HELD])
    lam = y[0]
    stiffness = c[HEAD + MODULUS] * nominal_pull_slope(
        held, int(c[HEAD + KIND]), shape_at(c, HEAD), c[HEAD + LOCKING], lam
    )
    fastest = 0.0
    for i in range(branch_count(c)):
        k = HEAD + WIDTH * (i + 1)
        e = lam / y[2 + i]
        bend = nominal_pull_slope(held, int(c[k + KIND]), shape_at(c, k), c[k + LOCKING], e)
        branches[0, i] = c[k + MODULUS] * bend / (y[2 + i] * y[2 + i]) / c[INERTIA]
        branches[1, i] = c[k + RATE] * bend * e / y[2 + i]
        stiffness += branches[0, i] * c[INERTIA]
        fastest = max(fastest, branches[1, i])
    return max(stiffness, 0.0) / c[INERTIA], fastest


@jit
def reason_to_fail(c: np.ndarray, y: np.ndarray, field2: float) -> int:
    """Status that says why the integration cannot go on from state ``y``.

    ``PULL_IN`` when the tangent stiffness of springs and field together is no longer positive,
    ``LOCKED`` when a spring has used up nearly all of its strain, otherwise ``NOT_CONVERGED``.
    """
    held = int(c[HELD])
    lam = y[0]
    stiffness = c[HEAD + MODULUS] * nominal_pull_slope(
        held, int(c[HEAD + KIND]), shape_at(c, HEAD), c[HEAD + LOCKING], lam
    )
    used = strain_at(held, lam) / c[HEAD + LOCKING]
    for i in range(branch_count(c)):
        k = HEAD + WIDTH * (i + 1)
        e = lam / y[2 + i]
        bend = nominal_pull_slope(held, int(c[k + KIND]), shape_at(c, k), c[k + LOCKING], e)
        stiffness += c[k + MODULUS] * bend / (y[2 + i] * y[2 + i])
        used = max(used, strain_at(held, e) / c[k + LOCKING])
    if lam > 0.5 * STRETCH_MAX or stiffness <= c[ELECTRIC] * field2 * electric_slope(held, lam):
        return PULL_IN if field2 > 0.0 else NOT_CONVERGED
    return LOCKED if used > _LOCKED else NOT_CONVERGED


@jit
def _locking_stretch(held: int, locking: float, sign: float) -> float:
    """Stretch above (``sign`` 1) or below (-1) 1 at which I1 - 3 reaches ``locking``."""
    near, far = 1.0, float(STRETCH_MAX**sign)
    if strain_at(held, far) < locking:
        return far
    for _ in range(60):
        middle = 0.5 * (near + far)
        if strain_at(held, middle) < locking:
            near = middle
        else:
            far = middle
    return near


@allocating
def spring_table(c: np.ndarray) -> np.ndarray:
    """Springs as (WIDTH + 3, n + 1): one row a property, so that loops over springs read in order.

    The rows added are the least and the greatest stretch short of locking, and 1/J (0 for a
    neo-Hookean spring, of no meaning for a spring of chains).
    """
    held = int(c[HELD])
    count = branch_count(c) + 1
    table = np.empty((WIDTH + 3, count))
    for i in range(count):
        k = HEAD + WIDTH * i
        for m in range(WIDTH):
            table[m, i] = c[k + m]
        table[SHORTEST, i] = _locking_stretch(held, c[k + LOCKING], -1.0)
        table[LONGEST, i] = _locking_stretch(held, c[k + LOCKING], 1.0)
        table[STIFFENING, i] = 0.0 if c[k + KIND] == _NEO_HOOKEAN else 1.0 / c[k + LIMIT]
    return table


@inlined
def admissible(springs: np.ndarray, y: np.ndarray) -> bool:
    """True when every stretch is positive and finite and no spring is locked."""
    lam = y[0]
    good = springs[SHORTEST, 0] < lam < springs[LONGEST, 0] and math.isfinite(y[1])
    for i in range(1, springs.shape[1]):
        xi = y[1 + i]
        good = good and springs[SHORTEST, i] * xi < lam < springs[LONGEST, i] * xi
    return good
