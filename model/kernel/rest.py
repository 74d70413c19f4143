"""The rest state under the load and a constant voltage."""

from __future__ import annotations

import numpy as np

from dearig.model.coefficients import ELECTRIC, FORCE, HELD, KIND, LOCKING, MODULUS
from dearig.model.compiled.jit import jit
from dearig.model.effects import assembly
from dearig.model.film.network import HEAD, nominal_pull, shape_at
from dearig.model.kernel.motion import STRETCH_MAX, strain_at
from dearig.model.kernel.status import NO_REST, OK, PULL_IN
from dearig.model.kinematics import electric

__all__ = ["rest_stretch"]

_at_rest, _active = assembly.at_rest, assembly.active


@jit
def rest_stretch(c: np.ndarray, field2: float) -> tuple[int, float]:
    """Return ``(status, stretch)`` at rest under the load and voltage squared ``field2`` in V^2.

    The branches carry nothing at rest, so only the equilibrium spring counts, with what effects
    make of it in the air of the room. The first root of the balance, which is the stable one, is
    bracketed from the undeformed film outwards and bisected.
    ``NO_REST`` without a load-bearing spring, ``PULL_IN`` when the field leaves no stable stretch.
    """
    held = int(c[HELD])
    kind = int(c[HEAD + KIND])
    # no state has moved yet: the hook is given none
    modulus = c[HEAD + MODULUS] * _at_rest(_active(c), c, c[:0])
    shape, locking = shape_at(c, HEAD), c[HEAD + LOCKING]
    if not (modulus > 0.0 and c[FORCE] >= 0.0 and field2 >= 0.0):
        return NO_REST, 1.0
    drive = c[ELECTRIC] * field2
    # steps of 1 % cannot jump over the first root
    low, high = 1.0, 1.0
    for _ in range(4000):
        high = low * 1.01
        if strain_at(held, high) >= locking:
            # the pull is infinite at the locking stretch: the root lies before it
            break
        balance = modulus * nominal_pull(held, kind, shape, locking, high)
        if balance >= c[FORCE] + drive * electric(held, high):
            break
        low = high
        if low > STRETCH_MAX:
            return (PULL_IN if drive > 0.0 else NO_REST), low
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        balance = modulus * nominal_pull(held, kind, shape, locking, middle)
        if balance >= c[FORCE] + drive * electric(held, middle):
            high = middle
        else:
            low = middle
    return OK, 0.5 * (low + high)
