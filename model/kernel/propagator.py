"""The linear part of the film's motion over one step, in closed form.

z'' = -k z - d z' + w I + N and I' = z - f I, where z is how far the film has moved since the step
began and I what the branches have given way by, as one branch would that relaxes at their mean rate
f. ``EXPONENTIAL.md`` next to this package derives it.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.compiled.jit import inlined, jit
from dearig.model.kernel.phi import double_phi, fill_phi

__all__ = [
    "PROPAGATOR",
    "PROPAGATORS",
    "drag_class",
    "fill_propagator",
    "is_propagator_of",
    "propagator_for",
]

PROPAGATOR = 40  #: numbers of a propagator
PROPAGATORS = 256  #: that are kept
# where the values stand that it was made of, and what is derived from them
STIFFNESS, DRAG, COUPLING, STEP, DRAG_CLASS, RELAXATION = 30, 31, 32, 33, 34, 35
FADED_HALF, FADED, INVERSE_COUPLING, INVERSE_RELAXATION = 36, 37, 38, 39

_NORM_MAX = 0.5  # of the matrix for which the series of the phi functions is summed
_DRAG_MIN = 1e-2  # 1/s; a smaller drag is not in closed form
_DRAG_NEAR = 0.2  # drags that differ by less share a propagator: the rest of them is integrated
_STEP_NEAR = 1e-6  # the same of steps: the rounding of time stamps


@inlined
def drag_class(drag: float) -> int:
    """Return a number that drags have in common which may share a propagator; 0 for no drag."""
    if drag < _DRAG_MIN:
        return 0
    return 1 + int(math.log(drag / _DRAG_MIN) / math.log(1.0 + _DRAG_NEAR))


@jit
def fill_propagator(
    k: float, d: float, branches: np.ndarray, h: float, room: np.ndarray, out: np.ndarray
) -> None:
    """Fill ``out`` (PROPAGATOR,) for a stiffness k in 1/s^2, a drag d in 1/s and a step of h s.

    Of each matrix only the columns are kept that act on the rate, on a force or on I:

    * 0..8 the exponential over half a step, by rows (z, rate, I);
    * 9..11 and 12..14 h/2 phi_1 and (h/2)^2 phi_2 over half a step, on a force;
    * 15..17 and 27..29 the exponential over the step, on the rate and on I;
    * 18..26 the weights of Cox and Matthews's method over the step, on the force at its start, at
      both its midpoints and at its end;
    * then what the names of this module's constants say.

    ``branches`` (2, 3) is ``network_stiffness``'s, ``room`` (7, 3, 3).
    """
    w = relaxation = 0.0
    for i in range(branches.shape[1]):
        w += branches[0, i] * branches[1, i]
        relaxation += branches[0, i] * branches[1, i] ** 2
    relaxation = relaxation / w if w > 0.0 else 1.0
    fastest = max(max(math.sqrt(k), d), max(w ** (1.0 / 3.0), relaxation))
    doublings, part = 0, 0.5 * h
    while part * fastest > _NORM_MAX:
        part *= 0.5
        doublings += 1
    a, phi = room[0], room[1:5]
    a[:] = 0.0
    a[0, 1] = a[2, 0] = part
    a[1, 0], a[1, 1], a[1, 2], a[2, 2] = -part * k, -part * d, part * w, -part * relaxation
    fill_phi(a, doublings, room[5:], phi)
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = phi[0, i, j]
        out[9 + i] = 0.5 * h * phi[1, i, 1]
        out[12 + i] = 0.25 * h * h * phi[2, i, 1]
    double_phi(phi, room[5])
    for i in range(3):
        first, second, third = phi[1, i, 1], phi[2, i, 1], phi[3, i, 1]
        out[15 + i] = phi[0, i, 1]
        out[18 + i] = h * (first - 3.0 * second + 4.0 * third)
        out[21 + i] = h * (2.0 * second - 4.0 * third)
        out[24 + i] = h * (4.0 * third - second)
        out[27 + i] = phi[0, i, 2]
    out[STIFFNESS], out[DRAG], out[COUPLING], out[STEP] = k, d, w, h
    out[DRAG_CLASS], out[RELAXATION] = drag_class(d), relaxation
    # how much of a flow of 1 that fades like exp(-f t) has gone by, in s
    out[FADED_HALF] = -math.expm1(-0.5 * relaxation * h) / relaxation
    out[FADED] = -math.expm1(-relaxation * h) / relaxation
    out[INVERSE_COUPLING] = 1.0 / w if w > 0.0 else 0.0
    out[INVERSE_RELAXATION] = 1.0 / relaxation


@inlined
def is_propagator_of(propagator: np.ndarray, k: float, near: float, drag: int, h: float) -> bool:
    """Whether ``propagator`` is of a stiffness so ``near`` to k, that class of drag, that step."""
    return bool(
        abs(k - propagator[STIFFNESS]) <= near
        and drag == propagator[DRAG_CLASS]
        and abs(h - propagator[STEP]) <= _STEP_NEAR * h
    )


@inlined
def propagator_for(
    propagators: np.ndarray,
    branches: np.ndarray,
    phi: np.ndarray,
    current: int,
    stiffness: float,
    grain: float,
    drag: float,
    h: float,
    fine: int,
) -> int:
    """Return the row of ``propagators`` for a film so stiff, filled where it was not.

    ``propagators`` is (n, PROPAGATOR), ``branches`` is ``network_stiffness``'s, ``phi``
    (7, 3, 3) is room. Stiffnesses are told apart by ``grain`` 1/s^2; the ``current`` row is kept
    where it is near enough. A row is found again by a hash of what it was made of.
    """
    group = drag_class(drag)
    row = current
    if not is_propagator_of(propagators[row], stiffness, 0.5 * grain, group, h):
        level = max(math.floor(stiffness / grain), 1.0)
        middle = (level + 0.5) * grain
        row = (int(level) + 37 * fine + 101 * group) % propagators.shape[0]
        if not is_propagator_of(propagators[row], middle, 0.0, group, h):
            fill_propagator(middle, drag, branches, h, phi, propagators[row])
    return row
