"""Films that hardly differ, side by side through one record, in the steps of the first of them.

Derivatives are differences of such films. Where each takes steps of its own, a difference contains
the noise of the step control. In common steps it is smooth, so that increments can be small. The
record is read once, and the arithmetic of ``WIDTH`` films is one instruction of the processor
(``dearig.model.compiled.packs``). Hooks of effects are called for each film.

The closed form of the linear part is that of the first film too: what it lacks of another film is
in that film's remainder, as everything is that it leaves out (``EXPONENTIAL.md``, section 2).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dearig.model.coefficients import INERTIA, REST
from dearig.model.compiled.by_name import MATRIX, VECTOR, by_name
from dearig.model.compiled.jit import allocating, jit, read_only
from dearig.model.compiled.packs import WIDTH, rows
from dearig.model.effects import MEMORY
from dearig.model.film.network import branch_count
from dearig.model.kernel.drive import LOG, drive_with_log
from dearig.model.kernel.effect_forces import (
    BREATHES,
    MOVING,
    active_effects,
    added_inertia,
    breathe,
)
from dearig.model.kernel.exponential_rk import (
    BRANCHES_MAX,
    TABLE,
    film_steps,
    film_table,
    is_swift,
)
from dearig.model.kernel.lane_forces import Lanes
from dearig.model.kernel.motion import STRETCH_MAX, spring_table
from dearig.model.kernel.propagator import PROPAGATOR, PROPAGATORS, propagator_for
from dearig.model.kernel.status import NOT_CONVERGED, OK

__all__ = ["carry_in_lanes", "drive_in_lanes"]

_Array = np.ndarray
_Arrays = tuple[_Array, _Array, _Array, _Array, _Array, _Array]

_GRAIN = 1e-3  # of the stiffness: propagators of a log differ by more, see STIFFNESS_NEAR


@by_name(
    f"none({MATRIX}, {MATRIX}, {VECTOR}, {MATRIX}, {MATRIX}, {'float64, ' * 4}int64, {MATRIX})"
)
def _carry_plain(
    table: np.ndarray,
    branches: np.ndarray,
    propagator: np.ndarray,
    y: np.ndarray,
    origin: np.ndarray,
    v0: float,
    v1: float,
    t: float,
    h: float,
    steps: int,
    trace: np.ndarray,
) -> None:
    # without effects their coefficients and memory are not read
    film_steps(
        0, table, table, rows(table), branches[0], branches[1], propagator, rows(y),
        rows(origin)[0], v0, v1, t, 0.0, h, steps, steps, rows(trace),
    )  # fmt: skip


@by_name(
    f"none(int64, {MATRIX}, int64[::1], {MATRIX}, {MATRIX}, {MATRIX}, {VECTOR}, {MATRIX}, "
    f"{MATRIX}, {'float64, ' * 5}int64, {MATRIX})"
)
def _carry(
    moving: int,
    values: np.ndarray,
    acting: np.ndarray,
    memory: np.ndarray,
    table: np.ndarray,
    branches: np.ndarray,
    propagator: np.ndarray,
    y: np.ndarray,
    origin: np.ndarray,
    v0: float,
    v1: float,
    t: float,
    warmth: float,
    h: float,
    steps: int,
    trace: np.ndarray,
) -> None:
    films: Any = Lanes(values, acting)
    film_steps(
        moving, films, memory, rows(table), branches[0], branches[1], propagator, rows(y),
        rows(origin)[0], v0, v1, t, warmth, h, steps, steps, rows(trace),
    )  # fmt: skip


@jit
def _follow(
    values: np.ndarray,
    acting: np.ndarray,
    memory: np.ndarray,
    tables: np.ndarray,
    y: np.ndarray,
    origin: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    log: np.ndarray,
    propagators: np.ndarray,
    branches: np.ndarray,
    phi: np.ndarray,
    trace: np.ndarray,
    moved: np.ndarray,
    rate: np.ndarray,
) -> bool:
    """Carry packs of films along a record: as ``log`` (N, LOG) says."""
    films, samples = moved.shape
    packs = tables.shape[0]
    moving = acting[0, 0]
    for film in range(1, packs * WIDTH):
        moving |= acting[film // WIDTH, film % WIDTH]
    warm = air.shape[1] == samples
    row, grain = 0, _GRAIN * max(log[0, 1], 1.0)
    for k in range(samples):
        for p in range(packs):
            for i in range(min(WIDTH, films - p * WIDTH)):
                moved[p * WIDTH + i, k], rate[p * WIDTH + i, k] = y[p, 0, i], y[p, 1, i]
        if k == samples - 1:
            break
        dt, fine = time[k + 1] - time[k], int(log[k, 0])
        h = dt / fine
        for i in range(BRANCHES_MAX):
            branches[0, i], branches[1, i] = log[k, 3 + i], log[k, 3 + BRANCHES_MAX + i]
        row = propagator_for(propagators, branches, phi, row, log[k, 1], grain, log[k, 2], h, fine)
        theta = air[0, k] if warm else 0.0
        for p in range(packs):
            if moving == 0:
                _carry_plain(
                    tables[p], branches, propagators[row], y[p], origin[p], voltage[k], ends[k],
                    time[k], h, fine, trace,
                )  # fmt: skip
                continue
            if warm and moving & BREATHES:
                for i in range(WIDTH):
                    breathe(acting[p, i], values[p, i], memory[p, i], theta, air[1, k], dt)
            _carry(
                moving, values[p], acting[p], memory[p], tables[p], branches, propagators[row],
                y[p], origin[p], voltage[k], ends[k], time[k], theta, h, fine, trace,
            )  # fmt: skip
    # a film that ran away does not come back, and NaN stays NaN
    followed = True
    for film in range(films):
        p, i = film // WIDTH, film % WIDTH
        followed = followed and 0.0 < origin[p, 0, i] + y[p, 0, i] < STRETCH_MAX
    return followed


@allocating
def _packed(cs: np.ndarray) -> _Arrays:
    """Return the first six arrays of ``_follow`` for films ``cs`` (P, C) at rest."""
    films = cs.shape[0]
    packs = (films + WIDTH - 1) // WIDTH
    values = np.zeros((packs, WIDTH, cs.shape[1]))
    acting = np.zeros((packs, WIDTH), dtype=np.int64)
    memory = np.zeros((packs, WIDTH, MEMORY))
    tables = np.zeros((packs, TABLE, WIDTH))
    y = np.zeros((packs, 2 + BRANCHES_MAX, WIDTH))
    origin = np.zeros((packs, 1, WIDTH))
    for place in range(packs * WIDTH):
        p, i, film = place // WIDTH, place % WIDTH, min(place, films - 1)
        c = values[p, i]
        c[:] = cs[film]
        on = active_effects(c)
        c[INERTIA] += added_inertia(on, c, memory[p, i])
        acting[p, i] = on if on & MOVING else 0
        tables[p, :, i] = film_table(c, spring_table(c))
        origin[p, 0, i] = c[REST]
        # a branch that is missing does not move from 1
        y[p, 2 + branch_count(c) :, i] = 1.0 - c[REST]
    return values, acting, memory, tables, y, origin


def carry_in_lanes(
    cs: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    log: np.ndarray,
    moved: np.ndarray,
    rate: np.ndarray,
) -> bool:
    """Carry films ``cs`` (P, C) from rest along a record, in the steps of ``log`` (N, LOG).

    The rest is as in ``drive_in_lanes``. Returns False where a film runs away.
    """
    record = (read_only(time), read_only(voltage), read_only(ends), read_only(air))
    return _follow(
        *_packed(cs), *record, log,
        np.zeros((PROPAGATORS, PROPAGATOR)), np.zeros((2, BRANCHES_MAX)), np.empty((7, 3, 3)),
        np.zeros((5, WIDTH)), moved, rate,
    )  # fmt: skip


def drive_in_lanes(
    cs: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    y: np.ndarray,
    moved: np.ndarray,
    rate: np.ndarray,
    fidelity: int,
) -> tuple[int, int]:
    """Carry films ``cs`` (P, C) from rest along a record, in the steps of the first.

    ``cs`` know their stretches at rest, ``y`` is the state of the first there. The record is as
    ``drive_by_voltage`` has it. ``moved`` and ``rate`` (P, N) are filled with the stretches less
    those at rest and their rates, of the first by the same arithmetic as of the others.

    Returns ``(status, steps)``. ``NOT_CONVERGED`` where the films cannot share steps: the first is
    not ``is_swift``, fails or becomes stiff, or one of the others runs away.
    """
    if not is_swift(cs[0]):
        return NOT_CONVERGED, 0
    others = 0
    for c in cs:
        others |= int(active_effects(c))
    log = np.zeros((time.size, LOG))
    status, _, steps = drive_with_log(
        cs[0], time, voltage, ends, air, y, moved[0], rate[0], fidelity, others, log
    )
    shared = status == OK and bool(log[:-1, 0].all())
    if shared:
        shared = carry_in_lanes(cs, time, voltage, ends, air, log, moved, rate)
        # a step of a pack takes as long as one of a film
        steps += steps * -(-len(cs) // WIDTH)
    return OK if shared else NOT_CONVERGED, steps
