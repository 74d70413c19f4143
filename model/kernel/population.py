"""Films that differ, through one record each from rest: a population of a fit.

Films like the thesis's go four at a time, one instruction of the processor for all four
(``dearig.model.compiled.packs``): in steps that suit every one of them, each with the closed form
of its own linear part. Others, and those that fail or become stiff among four, go alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dearig.model.coefficients import ELECTRIC, HELD, INERTIA, REST
from dearig.model.compiled.by_name import MATRIX, by_name
from dearig.model.compiled.jit import allocating, inlined, jit, read_only
from dearig.model.compiled.packs import WIDTH, rows
from dearig.model.effects import MEMORY, SENSOR_MEMORY
from dearig.model.film.network import branch_count
from dearig.model.film.sensor import at_sensor
from dearig.model.kernel.drive import LOG, drive_with_log, start_ringing
from dearig.model.kernel.effect_forces import MOVING, active_effects
from dearig.model.kernel.exponential_rk import (
    BRANCHES_MAX,
    TABLE,
    film_steps,
    film_table,
    is_swift,
)
from dearig.model.kernel.motion import LONGEST, SHORTEST, spring_table
from dearig.model.kernel.propagator import (
    PROPAGATOR,
    STEP,
    STIFFNESS,
    propagator_for,
)
from dearig.model.kernel.rest import rest_stretch
from dearig.model.kernel.sensor import read_sensor
from dearig.model.kernel.status import COARSE, OK
from dearig.model.kernel.step_control import (
    EVEN,
    LOOK_EVERY,
    STIFFNESS_NEAR,
    Policy,
    Stiffness,
    pace_of,
    policy_of,
    steps_by_ringing,
    stiffness_at,
    stiffness_changed,
    too_stiff,
)
from dearig.model.kinematics import electric

__all__ = ["read_members", "read_population"]

_WORTH = 3  # films from which on a pack is quicker than one after the other
_PROPAGATORS = 128  # of each film that are kept


class _Pack(NamedTuple):
    """The arrays of ``WIDTH`` films, the first index or the last the film's."""

    limits: np.ndarray  # (2, n + 1, WIDTH): least and greatest stretch of springs, by their own
    table: np.ndarray  # (TABLE, WIDTH): film_table
    branches: np.ndarray  # (WIDTH, 2, BRANCHES_MAX): network_stiffness
    shared_out: np.ndarray  # (2, BRANCHES_MAX, WIDTH): the same
    propagators: np.ndarray  # (WIDTH, _PROPAGATORS, PROPAGATOR)
    used: np.ndarray  # (PROPAGATOR, WIDTH): of the interval
    row: np.ndarray  # (WIDTH,): of propagators
    grain: np.ndarray  # (WIDTH,): 1/s^2, by which stiffnesses are told apart
    phi: np.ndarray  # (7, 3, 3)
    y: np.ndarray  # (2 + n, WIDTH)
    alone: np.ndarray  # (WIDTH, 2 + n + MEMORY): the same, film by film
    seen: np.ndarray  # (WIDTH,): stretches at which stiffnesses were taken
    springs_stiffness: np.ndarray  # (WIDTH,): 1/s^2
    pulls: np.ndarray  # (WIDTH,): acceleration, 1/s^2, by V^2
    trace: np.ndarray  # (5, WIDTH): see rk4_steps


@inlined
def _look(policy: Policy, cs: np.ndarray, room: _Pack, t: float) -> Stiffness:
    """Return what limits the steps of the films: the softest springs, else the stiffest film."""
    for i in range(WIDTH):
        for j in range(room.y.shape[0]):
            room.alone[i, j] = room.y[j, i]
    found = stiffness_at(policy, 0, cs[0], room.alone[0], t, room.branches[0])
    room.springs_stiffness[0] = found.springs
    for i in range(1, WIDTH):
        one = stiffness_at(policy, 0, cs[i], room.alone[i], t, room.branches[i])
        room.springs_stiffness[i] = one.springs
        found = Stiffness(
            min(found.springs, one.springs),
            max(found.omega, one.omega),
            max(found.drag, one.drag),
            max(found.rk4_rate, one.rk4_rate),
            max(found.exponential_rate, one.exponential_rate),
            max(found.calm_rate, one.calm_rate),
            False,
        )
    for i in range(WIDTH):
        lam = room.alone[i, 0]
        room.seen[i] = lam
        room.grain[i] = STIFFNESS_NEAR * max(room.springs_stiffness[i], 1.0)
        room.pulls[i] = cs[i, ELECTRIC] / cs[i, INERTIA] * electric(int(cs[i, HELD]), lam)
        for j in range(BRANCHES_MAX):
            room.shared_out[0, j, i] = room.branches[i, 0, j]
            room.shared_out[1, j, i] = room.branches[i, 1, j]
    return found


@inlined
def _take_propagators(room: _Pack, softer: float, h: float, fine: int) -> None:
    """Let ``room.used`` be of ``fine`` steps of ``h`` s; a field of ``softer`` V^2 pulls on."""
    used = room.used
    for i in range(WIDTH):
        stiffness = room.springs_stiffness[i] - room.table[1, i] * softer
        if (
            abs(stiffness - used[STIFFNESS, i]) > 0.5 * room.grain[i]
            or abs(h - used[STEP, i]) > EVEN * h
        ):
            row = propagator_for(
                room.propagators[i], room.branches[i], room.phi, room.row[i], stiffness,
                room.grain[i], 0.0, h, fine,
            )  # fmt: skip
            room.row[i] = row
            for j in range(PROPAGATOR):
                used[j, i] = room.propagators[i, row, j]


@inlined
def _all_admissible(room: _Pack) -> bool:
    """Whether ``admissible`` holds of every film."""
    y, good = room.y, True
    for i in range(WIDTH):
        good = good and math.isfinite(y[1, i])
    for j in range(y.shape[0] - 1):
        for i in range(WIDTH):
            own = y[1 + j, i] if j else 1.0
            least, greatest = room.limits[0, j, i] * own, room.limits[1, j, i] * own
            good = good & (least < y[0, i]) & (y[0, i] < greatest)
    return good


@by_name(f"none({f'{MATRIX}, ' * 5}{'float64, ' * 4}int64, int64, {MATRIX})")
def _steps(
    table: np.ndarray,
    gives: np.ndarray,
    flows: np.ndarray,
    propagator: np.ndarray,
    y: np.ndarray,
    v0: float,
    v1: float,
    t: float,
    h: float,
    steps: int,
    stride: int,
    trace: np.ndarray,
) -> None:
    # without effects their coefficients and memory are not read
    film_steps(
        0, table, table, rows(table), rows(gives), rows(flows), rows(propagator), rows(y), 0.0,
        v0, v1, t, 0.0, h, steps, stride, rows(trace),
    )  # fmt: skip


@jit
def _follow(
    policy: Policy,
    cs: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    stretch: np.ndarray,
    rate: np.ndarray,
    room: _Pack,
) -> tuple[bool, int]:
    """Carry a pack along a record: the loop of ``drive``'s ``_follow``, of films without effects.

    False where a film needs what the loop does not have: the stiff method, or a reason to fail.
    """
    # One piece: step control carries some twenty numbers from sample to sample.
    samples, y, trace = time.shape[0], room.y, room.trace
    film = _look(policy, cs, room, time[0])
    pace, dt_paced = pace_of(policy, film, 1.0), 0.0
    ringing, jump, dt_before, taken = 0.0, 0.0, 1.0, 0
    last = last_begin = voltage[0]
    for i in range(WIDTH):
        ringing = max(ringing, abs(trace[0, i]))
    for k in range(samples):
        for i in range(WIDTH):
            stretch[i, k], rate[i, k] = y[0, i], y[1, i]
        if k == samples - 1:
            break
        dt, v0, v1 = time[k + 1] - time[k], voltage[k], ends[k]
        if not (dt > 0.0 and math.isfinite(v0) and math.isfinite(v1) and math.isfinite(dt)):
            return False, taken
        if k and k % LOOK_EVERY == 0:
            film = _look(policy, cs, room, time[k])
            dt_paced = 0.0
        if abs(dt - dt_paced) > EVEN * dt:
            pace, dt_paced = pace_of(policy, film, dt), dt
        if not pace.explicit:
            return False, taken
        jump_before = jump
        jumped = v1 * v1 - last * last - (last * last - last_begin * last_begin) * (dt / dt_before)
        strongest = 0.0
        for i in range(WIDTH):
            strongest = max(strongest, room.pulls[i])
        jump = jumped * strongest
        hasty = not policy.fine_only
        fine = steps_by_ringing(policy, film, pace, dt, jump, ringing, hasty)
        forced = 0.0
        if v0 != last and pace.calm_steps > 1 and policy.fine_only:
            for i in range(WIDTH):
                trace[0, i] += jumped * room.pulls[i]
                trace[1, i] += jumped * room.pulls[i]
            forced = 3.0 * min(abs(jump), abs(jump_before))
        h = dt / fine
        _take_propagators(room, 0.5 * (v0 * v0 + v1 * v1), h, fine)
        _steps(
            room.table, room.shared_out[0], room.shared_out[1], room.used, y, v0, v1, time[k], h,
            fine, fine // pace.calm_steps if fine > pace.calm_steps else 1, trace,
        )  # fmt: skip
        taken += fine
        bend, changed = 0.0, False
        for i in range(WIDTH):
            bend = max(bend, trace[2, i])
            changed = changed | stiffness_changed(y[0, i], room.seen[i])
        ringing = max(ringing * pace.fading, bend * pace.per_phase2 - forced)
        if not _all_admissible(room):
            return False, taken
        if changed:
            softer = film
            film, dt_paced = _look(policy, cs, room, time[k]), 0.0
            if too_stiff(film, softer):
                return False, taken
        last, last_begin, dt_before = v1, v0, dt
    return True, taken


@allocating
def _prepared(cs: np.ndarray, voltage: float, fidelity: int) -> tuple[Policy, _Pack]:
    """Return the steps of films ``cs`` (WIDTH, C) and their arrays, at rest at ``voltage``.

    As in ``drive``, what makes arrays and the loop are called one after the other.
    """
    count = branch_count(cs[0])
    size = 2 + count + MEMORY
    room = _Pack(
        np.zeros((2, count + 1, WIDTH)),
        np.zeros((TABLE, WIDTH)),
        np.zeros((WIDTH, 2, BRANCHES_MAX)),
        np.zeros((2, BRANCHES_MAX, WIDTH)),
        np.empty((WIDTH, _PROPAGATORS, PROPAGATOR)),
        np.zeros((PROPAGATOR, WIDTH)),
        np.zeros(WIDTH, dtype=np.int64),
        np.zeros(WIDTH),
        np.empty((7, 3, 3)),
        np.zeros((2 + count, WIDTH)),
        np.zeros((WIDTH, size)),
        np.zeros(WIDTH),
        np.zeros(WIDTH),
        np.zeros(WIDTH),
        np.zeros((5, WIDTH)),
    )
    room.propagators[:, :, STEP] = 0.0  # of no step
    work, trace = np.zeros(size), np.zeros(5)
    for i in range(WIDTH):
        springs = spring_table(cs[i])
        room.limits[:, :, i] = springs[SHORTEST : LONGEST + 1]
        room.table[:, i] = film_table(cs[i], springs)
        for j in range(2 + count):
            room.y[j, i] = room.alone[i, j] = 0.0 if j == 1 else cs[i, REST]
        start_ringing(cs[i], springs, room.alone[i], voltage, work, trace)
        room.trace[0, i] = room.trace[1, i] = trace[0]
    return policy_of(0, 0, True, fidelity), room


@jit
def _settle(pack: np.ndarray, status: np.ndarray) -> bool:
    """Enter the stretches at rest in films ``pack`` (WIDTH, C), and how they were found.

    Returns whether the films may step with one another.
    """
    together = True
    for i in range(pack.shape[0]):
        c = pack[i]
        found, c[REST] = rest_stretch(c, 0.0)
        if i < status.shape[0]:
            status[i] = found
        together = together and found == OK and is_swift(c) and active_effects(c) & MOVING == 0
    return together


@allocating
def read_members(
    cs: np.ndarray,
    film_of: np.ndarray,
    first: int,
    last: int,
    length: float,
    time: np.ndarray,
    stretch: np.ndarray,
    rate: np.ndarray,
    lag: float,
    at: np.ndarray,
    readings: np.ndarray,
) -> None:
    """Fill the ``readings`` (P, M) in m of members ``cs`` (P, C) of films ``first`` to ``last``.

    ``film_of`` (P,) is the film of each member; ``stretch`` and ``rate`` (F, N) are those of the
    films from ``first`` on, at ``time`` (N,) s, the stretch less that at rest. Readings are at the
    times ``at`` (M,) s, of the film as it was ``lag`` s before.
    """
    seen, speed = at - lag, np.empty(at.shape[0])
    memory = np.zeros(SENSOR_MEMORY)
    for member in range(cs.shape[0]):
        film = film_of[member] - first
        if film < 0 or film >= last - first:
            continue
        shown = readings[member]
        at_sensor(time, stretch[film], rate[film], seen, shown, speed)
        shown *= length
        speed *= length
        memory[:] = 0.0
        read_sensor(cs[member], at, shown, speed, memory)


def read_population(
    cs: np.ndarray,
    films: np.ndarray,
    film_of: np.ndarray,
    length: float,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    lag: float,
    at: np.ndarray,
    fidelity: int,
    readings: np.ndarray,
    status: np.ndarray,
) -> int:
    """Carry members ``cs`` (P, C) from rest along a record; return the steps taken.

    ``films`` (F,) are the places in ``cs`` of one member of each film, ``film_of`` (P,) says of
    each member which film it reads. The record is as ``drive_by_voltage`` has it, ``length`` m is
    that of the films. ``readings`` (P, M) in m and ``status`` (F,) are filled: at the times ``at``
    (M,) s, of the film as it was ``lag`` s before. What a film did not reach reads as far as it
    came. A step of a pack counts as one.
    """
    record = (read_only(time), read_only(voltage), read_only(ends))
    air, at = read_only(air), read_only(at)
    stretch, rate = np.empty((2, WIDTH, time.size))
    log, taken = np.zeros((0, LOG)), 0
    for begin in range(0, films.size, WIDTH):
        end = min(begin + WIDTH, films.size)
        # the last film fills a pack
        pack = cs[films[np.minimum(np.arange(begin, begin + WIDTH), end - 1)]]
        together = _settle(pack, status[begin:end])
        # in quick steps a film alone ends elsewhere than in a pack, and costs are compared
        together = together and (end - begin >= _WORTH or fidelity == COARSE)
        if together:
            policy, room = _prepared(pack, voltage[0], fidelity)
            together, steps = _follow(policy, pack, *record, stretch, rate, room)
            taken += steps
        for i in range(end - begin):
            rest = pack[i, REST]
            if status[begin + i] != OK:
                stretch[i], rate[i] = 0.0, 0.0
                continue
            if not together:
                branches = branch_count(pack[i])
                y = np.zeros(2 + branches + MEMORY)
                y[: 2 + branches] = rest
                y[1] = 0.0
                status[begin + i], _, steps = drive_with_log(
                    pack[i], *record, air, y, stretch[i], rate[i], fidelity, 0, log
                )
                taken += steps
            stretch[i] -= rest
        read_members(cs, film_of, begin, end, length, time, stretch, rate, lag, at, readings)
    return taken
