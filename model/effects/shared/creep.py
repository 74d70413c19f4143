"""Maxwell branches besides the network's own, for effects that creep.

As the network's branches do at small elastic strains (to second order, held at the sides as the
film is), each follows the logarithmic strain e = ln(lam/lam_rest), with the stress
mu (e - q) lam_rest/lam and q' = (e - q) lam_rest/(lam T).
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.shared.filters import lagged

__all__ = ["relaxed"]


@jit
def relaxed(
    c: np.ndarray,
    m: np.ndarray,
    j: int,
    lam0: float,
    lam: float,
    since: float,
    commits: bool,
    count: int,
    modulus: float,
    fall: float,
    time: float,
    ratio: float,
) -> float:
    """Stress in Pa of ``count`` branches, ``since`` s after the step began at ``lam0``.

    The first has the modulus ``modulus`` Pa and the relaxation time ``time`` s. These change by the
    factors ``fall`` and ``ratio`` from one branch to the next. The internal strains q are in the
    state ``m`` from ``j`` on; ``commits`` carries them to the end.
    """
    e0, e = math.log(lam0 / c[REST]), math.log(lam / c[REST])
    time *= 0.5 * (lam0 + lam) / c[REST]
    total = 0.0
    for i in range(count):
        q = lagged(m[j + i], e0, e, since, time)
        total += modulus * (e - q)
        if commits:
            m[j + i] = q
        modulus *= fall
        time *= ratio
    stress: float = total * c[REST] / lam
    return stress
