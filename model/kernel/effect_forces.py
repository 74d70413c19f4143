"""What effects do to the motion: to its voltage, its stresses, its stiffness and its drag.

Every function takes ``acting``, which says in its bits which effects are not neutral (see
``effects.assembly``), and ``m`` (MEMORY,), their internal states.
"""

from __future__ import annotations

import numpy as np

from dearig.model.coefficients import FORCE, INERTIA
from dearig.model.compiled.jit import inlined, jit
from dearig.model.effects import assembly
from dearig.model.film.network import branch_count

__all__ = [
    "BREATHES",
    "COMMIT",
    "DRAGS",
    "HYSTERETIC",
    "MOVING",
    "SOFTENS",
    "active_effects",
    "added_inertia",
    "affected",
    "breathe",
    "commit",
    "drag_at",
    "softening_stiffness",
    "stiffness_and_drag",
    "supplied",
    "supplied_at_start",
]

_supply, _polarise, _permittivity = assembly.supply, assembly.polarise, assembly.permittivity
_soften, _stress, _stiffness = assembly.soften, assembly.stress, assembly.stiffness
active_effects, added_inertia = assembly.active, assembly.inertia
commit, breathe = assembly.commit, assembly.breathe

_SUPPLY, _POLARISE = assembly.HOOK_BITS["supply"], assembly.HOOK_BITS["polarise"]
_PERMITTIVITY, _STRESS = assembly.HOOK_BITS["permittivity"], assembly.HOOK_BITS["stress"]
#: Bits of the effects that take part in the motion; of those that soften the network; of those that
#: say how stiff they are or how they drag; of those with an internal state to advance; of those
#: that depend on turning points; of those that follow the air of the room.
SOFTENS = assembly.HOOK_BITS["soften"]
MOVING = _SUPPLY | _POLARISE | _PERMITTIVITY | SOFTENS | _STRESS
DRAGS, COMMIT, HYSTERETIC = (
    assembly.HOOK_BITS["stiffness"],
    assembly.HOOK_BITS["commit"],
    assembly.HYSTERETIC,
)

BREATHES = assembly.HOOK_BITS["breathe"]

_NEARBY = 1e-4  # of the stretch: the difference by which a stiffness is taken


@inlined
def affected(
    acting: int,
    c: np.ndarray,
    m: np.ndarray,
    lam: float,
    rate: float,
    warmth: float,
    lam0: float,
    since: float,
    t: float,
    field2: float,
    pull: float,
    held_back: float,
    over: float,
) -> float:
    """Return the Maxwell stress ``pull`` less the network's ``held_back``, with effects in both.

    ``since`` s have passed since the step began at ``t`` s and stretch ``lam0``. All stresses are
    divided by ``over``.
    """
    if acting & _PERMITTIVITY:
        pull *= _permittivity(acting, c, m, lam, field2)
    if acting & SOFTENS:
        held_back *= _soften(acting, c, m, lam, since, t, warmth)
    if acting & _STRESS:
        held_back += _stress(acting, c, m, lam, rate, lam0, since, t) / over
    return pull - held_back


@inlined
def supplied_at_start(
    acting: int, c: np.ndarray, m: np.ndarray, t: float, lam: float, speed: float, va: float
) -> tuple[float, float]:
    """Return the voltage at the film when a step begins, and the voltage squared that pulls."""
    if acting & _SUPPLY:
        va, _ = _supply(acting, c, m, t, va, va, 0.0, lam, speed)
    ea = va * va
    if acting & _POLARISE:
        pa, _ = _polarise(acting, c, m, va, va, 0.0)
        ea += pa
    return va, ea


@inlined
def supplied(
    acting: int,
    c: np.ndarray,
    m: np.ndarray,
    t: float,
    half: float,
    lam: float,
    speed: float,
    grown: float,
    gained: float,
    now: float,
    va: float,
    vm: float,
    vb: float,
) -> tuple[float, float]:
    """Return the voltage squared that pulls on the film amid and after a step of 2 ``half`` s.

    ``va``, ``vm`` and ``vb`` V are supplied at the start, the middle and the end; ``now`` V is at
    the film at the start. The voltage at the film depends on the stretch (a film that grows lowers
    its own voltage). It is predicted with what is known at the start: in half of the step the
    stretch grows by ``grown`` and its rate by ``gained``.
    """
    if acting & _SUPPLY:
        _, middle = _supply(
            acting, c, m, t, va, vm, half, lam + 0.5 * grown, speed + 0.5 * gained
        )  # fmt: skip
        _, vb = _supply(
            acting, c, m, t + half, vm, vb, half, lam + 1.5 * grown, speed + 1.5 * gained
        )  # fmt: skip
        vm = middle
    em, eb = vm * vm, vb * vb
    if acting & _POLARISE:
        _, pm = _polarise(acting, c, m, now, vm, half)
        _, pb = _polarise(acting, c, m, vm, vb, half)
        em, eb = em + pm, eb + pb
    return em, eb


@jit
def stiffness_and_drag(
    acting: int, c: np.ndarray, y: np.ndarray, rate: float
) -> tuple[float, float]:
    """Stiffness in 1/s^2 and drag in 1/s that effects add at most, at a ``rate`` of stretch."""
    more, drag = _stiffness(acting, c, y[2 + branch_count(c) :], y[0], rate)
    return more / c[INERTIA], drag / c[INERTIA]


@jit
def drag_at(acting: int, c: np.ndarray, y: np.ndarray, rate: float) -> float:
    """Drag of the effects over the inertia, 1/s, at a ``rate`` of stretch."""
    _, drag = stiffness_and_drag(acting, c, y, rate)
    return drag


@jit
def softening_stiffness(acting: int, c: np.ndarray, y: np.ndarray, t: float) -> float:
    """Stiffness over the inertia, 1/s^2, that effects that soften add to the springs' or take.

    The larger of the values upwards and downwards: the film may turn here.
    """
    m, lam, near = y[2 + branch_count(c) :], y[0], _NEARBY * y[0]
    here = _soften(acting, c, m, lam, 0.0, t, 0.0)
    up = abs(_soften(acting, c, m, lam + near, 0.0, t, 0.0) - here)
    down = abs(_soften(acting, c, m, lam - near, 0.0, t, 0.0) - here)
    return float(max(up, down) / near * c[FORCE] / c[INERTIA])
