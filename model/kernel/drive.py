"""Carry the film along a record of voltages: interval by interval, each by the method it needs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dearig.model.coefficients import ELECTRIC, HELD, INERTIA, UNIFORM
from dearig.model.compiled.jit import allocating, inlined, jit, read_only
from dearig.model.effects import MEMORY
from dearig.model.kernel.effect_forces import (
    BREATHES,
    active_effects,
    added_inertia,
    breathe,
    drag_at,
)
from dearig.model.kernel.exponential_rk import BRANCHES_MAX, exponential_steps, film_table, is_swift
from dearig.model.kernel.motion import admissible, rates, reason_to_fail, spring_table
from dearig.model.kernel.propagator import (
    DRAG,
    PROPAGATOR,
    PROPAGATORS,
    STIFFNESS,
    propagator_for,
)
from dearig.model.kernel.rk4 import rk4_steps
from dearig.model.kernel.rodas import LONGEST, STEPS_OF_RODAS, cross_by_rodas
from dearig.model.kernel.status import BAD_INPUT, CAREFUL, NOT_CONVERGED, OK
from dearig.model.kernel.step_control import (
    DRAG_SUBSTEPS_MAX,
    EVEN,
    LOOK_EVERY,
    STIFFNESS_NEAR,
    Pace,
    Policy,
    Stiffness,
    drag_between,
    pace_of,
    policy_of,
    refinement,
    steps_by_ringing,
    stiffness_at,
    stiffness_changed,
    too_stiff,
)
from dearig.model.kinematics import electric

__all__ = [
    "LOG",
    "drive_by_voltage",
    "drive_with_log",
    "log_interval",
    "start_ringing",
]

LOG = 3 + 2 * BRANCHES_MAX  #: numbers of an interval in a log

_DRAG_MISSED = 1.5  # of the steps taken: so many may a drag ask for after the fact


class Workspace(NamedTuple):
    """The arrays of one simulation."""

    springs: np.ndarray  # (WIDTH + 3, n + 1): spring_table
    table: np.ndarray  # film_table, or (0,)
    branches: np.ndarray  # (2, 3 or more): network_stiffness
    propagators: np.ndarray  # (PROPAGATORS, PROPAGATOR)
    phi: np.ndarray  # (7, 3, 3)
    work: np.ndarray  # (15, y.size)
    before: np.ndarray  # (y.size,): the state at the last sample
    trace: np.ndarray  # (5,): accelerations and speeds met, see rk4_steps and exponential_steps
    log: np.ndarray  # (N, LOG), or (0, LOG) where none is kept: log_interval


@inlined
def start_ringing(
    c: np.ndarray, springs: np.ndarray, y: np.ndarray, v: float, dy: np.ndarray, trace: np.ndarray
) -> None:
    """Let ``trace`` begin at ``y``: an acceleration there may be the start of an oscillation."""
    rates(int(c[HELD]), int(c[UNIFORM]), c, springs, y, v * v, dy)
    trace[0] = trace[1] = dy[1]


@inlined
def _copy(source: np.ndarray, target: np.ndarray, count: int) -> None:
    for j in range(count):
        target[j] = source[j]


@inlined
def _cross_exponentially(
    policy: Policy,
    film: Stiffness,
    pace: Pace,
    c: np.ndarray,
    room: Workspace,
    current: int,
    grain: float,
    y: np.ndarray,
    v0: float,
    v1: float,
    t: float,
    warmth: float,
    dt: float,
    fine: int,
    change: float,
    hasty: bool,
) -> tuple[int, int, int]:
    """Cross one interval ``dt`` from ``room.before`` in ``fine`` steps, or more where a drag asks.

    ``change`` is how much the rate of stretch may change meanwhile. Returns the steps taken, also
    those in vain, the steps of the interval, and the row of ``room.propagators`` that was used.
    """
    before, trace = room.before, room.trace
    taken, row, drag, asked = 0, current, 0.0, 0.0
    seen, seen_before = trace[0], trace[1]
    if policy.drags:
        slow, fast = max(abs(before[1]) - change, 0.0), abs(before[1]) + change
        drag, asked = drag_between(policy.acting, c, before, slow, fast, dt, hasty)
    # a film that the field pulls on is softer by that
    stiffness = film.springs - room.table[1] * 0.5 * (v0 * v0 + v1 * v1)
    while True:
        # a drag may change with the rate: then in finer steps
        fine = max(fine, math.ceil(min(asked, DRAG_SUBSTEPS_MAX)))
        h = dt / fine
        row = propagator_for(
            room.propagators, room.branches, room.phi, row, stiffness, grain, drag, h, fine
        )
        exponential_steps(
            policy.acting, c, room.table, room.branches, room.propagators[row], y, v0, v1, t,
            warmth, h, fine, fine // pace.calm_steps if fine > pace.calm_steps else 1, trace,
        )  # fmt: skip
        taken += fine
        if not policy.drags or fine >= DRAG_SUBSTEPS_MAX:
            break
        # the film may have been faster or slower on the way than was predicted
        met, asked = drag_between(policy.acting, c, before, trace[3], trace[4], dt, hasty)
        if asked <= _DRAG_MISSED * fine:
            break
        drag, fine = met, fine + 1
        if not math.isfinite(asked):
            drag, asked = drag_at(policy.acting, c, before, 0.0), 0.0
            fine = DRAG_SUBSTEPS_MAX
        trace[0], trace[1] = seen, seen_before
        _copy(before, y, y.shape[0])
    return taken, fine, row


@inlined
def log_interval(
    log: np.ndarray, k: int, fine: int, propagator: np.ndarray, branches: np.ndarray
) -> None:
    """Enter in ``log`` (N, LOG) how interval ``k`` was crossed.

    In so many steps, with the stiffness and the drag of the propagator, and with ``branches`` of
    ``network_stiffness``. A log of 0 steps is of an interval that the exponential method did not
    cross.
    """
    log[k, 0], log[k, 1], log[k, 2] = fine, propagator[STIFFNESS], propagator[DRAG]
    for i in range(BRANCHES_MAX):
        log[k, 3 + i] = branches[0, i]
        log[k, 3 + BRANCHES_MAX + i] = branches[1, i]


@jit
def _follow(
    policy: Policy,
    acting: int,
    c: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    y: np.ndarray,
    stretch: np.ndarray,
    rate: np.ndarray,
    room: Workspace,
) -> tuple[int, int, int]:
    """Do what ``drive_by_voltage`` does: one compiled loop with its control."""
    # One piece: step control carries some twenty numbers from sample to sample.
    # Sections are those of EXPONENTIAL.md
    samples, held = time.shape[0], int(c[HELD])
    springs, branches, trace = room.springs, room.branches, room.trace
    before = room.before
    carried = y.shape[0] if policy.acting else 1 + springs.shape[1]
    warm = air.shape[1] == samples
    breathes = warm and policy.acting & BREATHES != 0
    memory = y[y.shape[0] - MEMORY :]
    film = stiffness_at(policy, acting, c, y, time[0], branches)
    grain = STIFFNESS_NEAR * max(film.springs, 1.0)
    field_gain = c[ELECTRIC] / c[INERTIA]
    row = 0
    pace, dt_paced, lam_seen = pace_of(policy, film, 1.0), 0.0, y[0]
    ringing, jump, rate_before, dt_before = 0.0, 0.0, y[1], 1.0
    last = last_begin = voltage[0]
    status, reached, taken, h, fresh = OK, samples, 0, LONGEST, True
    for k in range(samples):
        stretch[k], rate[k] = y[0], y[1]
        if k == samples - 1:
            break
        dt, v0, v1 = time[k + 1] - time[k], voltage[k], ends[k]
        if not (dt > 0.0 and math.isfinite(v0) and math.isfinite(v1) and math.isfinite(dt)):
            status, reached = BAD_INPUT, k + 1
            break
        # the pace for this interval, section 7
        if fresh:
            start_ringing(c, springs, y, v0, room.work[0], trace)
            ringing, fresh = abs(trace[0]), False
        if k and k % LOOK_EVERY == 0:
            film, lam_seen = stiffness_at(policy, acting, c, y, time[k], branches), y[0]
            dt_paced = 0.0
        if abs(dt - dt_paced) > EVEN * dt:
            pace, dt_paced = pace_of(policy, film, dt), dt
        explicit, fine = pace.explicit, 0
        if explicit:
            # how the field jumps, and how its slope does: the jump of section 7
            sloped = (last * last - last_begin * last_begin) * (dt / dt_before)
            jump_before = jump
            jump = v1 * v1 - last * last - sloped
            jump *= field_gain * electric(held, y[0])
            theta = air[0, k] if warm else 0.0
            if breathes:
                breathe(policy.acting, c, memory, theta, air[1, k], dt)
            _copy(y, before, carried)
            # a slow staircase rings within each of its long treads, but does not ring on
            treads = v0 != last and pace.calm_steps > 1
            if policy.exponential:
                hasty = not policy.fine_only
                if policy.watched and not film.steep:
                    excited = max(ringing * pace.fading, abs(jump - jump_before))
                    hasty = excited < policy.calm_below * film.springs
                fine = steps_by_ringing(policy, film, pace, dt, jump, ringing, hasty)
                treads = treads and policy.fine_only
                change = 0.0
                # a jump cannot carry the film on faster than springs let it oscillate
                if policy.drags:
                    change = abs(y[1] - rate_before) + abs(jump) * min(dt, 1.0 / film.omega)
                rate_before = y[1]
            else:
                fine = pace.steps * refinement(pace, jump, ringing)
            forced = 0.0
            if treads:
                trace[0] += jump
                trace[1] += jump
                forced = 3.0 * min(abs(jump), abs(jump_before))
            # the interval itself: the exponential method, or classical Runge-Kutta
            if policy.exponential:
                more, fine, row = _cross_exponentially(
                    policy, film, pace, c, room, row, grain, y,
                    v0, v1, time[k], theta, dt, fine, change, hasty,
                )  # fmt: skip
                taken += more
            else:
                rk4_steps(
                    policy.acting, c, springs, y, v0, v1, time[k], theta, dt / fine, fine,
                    fine // pace.steps, room.work, trace,
                )  # fmt: skip
                taken += fine
            # what rings on; whether the film has become too stiff for an explicit method
            ringing = max(ringing * pace.fading, trace[2] * pace.per_phase2 - forced)
            explicit = admissible(springs, y)
            if explicit and stiffness_changed(y[0], lam_seen):
                softer = film
                film, lam_seen = stiffness_at(policy, acting, c, y, time[k], branches), y[0]
                dt_paced = 0.0
                explicit = policy.acting != 0 or not too_stiff(film, softer)
            if not explicit:
                _copy(before, y, carried)
        if policy.exponential and room.log.shape[0]:
            log_interval(room.log, k, fine if explicit else 0, room.propagators[row], branches)
        last, last_begin, dt_before = v1, v0, dt
        # the stiff method, section 8
        if not explicit:
            fresh = True
            taken += STEPS_OF_RODAS
            if policy.acting:
                status = NOT_CONVERGED
            else:
                status, h = cross_by_rodas(c, springs, y, v0, v1, dt, h, room.work)
        if status != OK:
            status, reached = reason_to_fail(c, y, max(v0 * v0, v1 * v1)), k + 1
            break
    if status != OK:
        for k in range(reached, samples):
            stretch[k] = stretch[reached - 1]
            rate[k] = 0.0
    return status, reached, taken


@allocating
def _prepared(
    c: np.ndarray, y: np.ndarray, fidelity: int, others: int, log: np.ndarray
) -> tuple[Policy, int, np.ndarray, Workspace]:
    """Return the steps of film ``c``, its effects, its coefficients with all inertia, and arrays.

    What makes arrays counts their owners, in every call: the loop must not. And what calls the
    loop from compiled code contains it: it would be compiled once more.
    """
    springs = spring_table(c)
    c = c.copy()
    acting = active_effects(c)
    c[INERTIA] += added_inertia(acting, c, y)
    policy = policy_of(acting, acting | others, is_swift(c), fidelity)
    room = Workspace(
        springs,
        film_table(c, springs) if policy.exponential else np.zeros(0),
        np.zeros((2, max(springs.shape[1] - 1, BRANCHES_MAX))),
        np.zeros((PROPAGATORS, PROPAGATOR)),
        np.empty((7, 3, 3)),
        np.zeros((15, y.shape[0])),
        y.copy(),
        np.zeros(5),
        log,
    )
    return policy, acting, c, room


def drive_by_voltage(
    c: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    y: np.ndarray,
    stretch: np.ndarray,
    rate: np.ndarray,
    fidelity: int = CAREFUL,
) -> tuple[int, int, int]:
    """Carry state ``y`` (2 + n + MEMORY,) along a record.

    ``time`` s and ``voltage`` V are (N,), increasing and not necessarily even. From each sample to
    the next the voltage goes linearly to that in ``ends`` (N,), from where it may jump: for a
    converter's output, which stands until the next sample, that is ``voltage`` itself. ``air``
    (2, N) is the temperature in K and the relative humidity (0 to 1) of the room above those of the
    start, or (2, 0) where none were recorded.
    ``fidelity`` is ``CAREFUL``, ``QUICK``, ``ROUGH`` or ``COARSE``. ``c`` must know the stretch at
    rest (``dearig.model.simulation.actuator.at_rest``). ``stretch`` and ``rate`` (N,) are filled;
    element 0 is the state as given, so that a record can be cut and continued.

    Returns ``(status, reached, steps)``: on any status but ``OK`` the samples from ``reached`` on
    are filled with the last stretch that was reached, never with NaN. ``steps`` were taken; a
    sample by the stiff method counts for the explicit steps that take as long.
    """
    log = np.zeros((0, LOG))
    return drive_with_log(c, time, voltage, ends, air, y, stretch, rate, fidelity, 0, log)


def drive_with_log(
    c: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    y: np.ndarray,
    stretch: np.ndarray,
    rate: np.ndarray,
    fidelity: int,
    others: int,
    log: np.ndarray,
) -> tuple[int, int, int]:
    """Do what ``drive_by_voltage`` does, in steps that suit the effects ``others`` as well.

    ``others`` has the bits of effects that may be neutral in ``c``. How each interval is crossed is
    entered in ``log`` (N, LOG), see ``log_interval``; it may be (0, LOG).
    """
    drive = (read_only(time), read_only(voltage), read_only(ends), read_only(air))
    policy, acting, own, room = _prepared(c, y, fidelity, others, log)
    return _follow(policy, acting, own, *drive, y, stretch, rate, room)
