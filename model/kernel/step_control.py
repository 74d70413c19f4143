"""How many steps a sample interval takes: by stiffness, fidelity, drag and ringing."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dearig.model.compiled.jit import inlined, jit
from dearig.model.kernel.effect_forces import (
    DRAGS,
    HYSTERETIC,
    MOVING,
    SOFTENS,
    drag_at,
    softening_stiffness,
    stiffness_and_drag,
)
from dearig.model.kernel.motion import network_stiffness
from dearig.model.kernel.status import CAREFUL, COARSE, QUICK, ROUGH

__all__ = [
    "DRAG_SUBSTEPS_MAX",
    "EFFECT_SUBSTEPS_MAX",
    "EVEN",
    "LOOK_EVERY",
    "STIFFNESS_NEAR",
    "Pace",
    "Policy",
    "Stiffness",
    "drag_between",
    "pace_of",
    "policy_of",
    "refinement",
    "steps_by_ringing",
    "stiffness_at",
    "stiffness_changed",
]

_STEP_MAX = 2.5e-3  # s; a thesis record is then good to 0.03 um
_QUICK_STEP_MAX = 5e-3  # s; at fidelities below CAREFUL
_COARSE_STEP_MAX = 5e-2  # s; a coarse drive was checked against the whole one
_PHASE_MAX = 1.20  # rad: (angular frequency or relaxation rate) times step
_ROUGH_PHASE_MAX = 2.0  # the same of what effects add to the springs, at ROUGH
# of a drag, which must only stay stable: to a phase of 2.8 in classical Runge-Kutta, kept below 2.2
_DRAG_PHASE = 0.55
_JUMP_ERROR = 5e-8  # in stretch: allowed after one jump of the voltage
_RINGING_ERROR = 5e-9  # in stretch a radian of ringing, which lasts for some hundred radians
_REFINEMENT_MAX = 20.0
_MOVED = 5e-3  # of the stretch: then the stiffness is computed again
_STIFFER = 1.25  # growth of the number of steps that a sample may meet on its way
_RK4_SUBSTEPS_MAX = 2  # beyond that, one RODAS step is cheaper
_EXPONENTIAL_SUBSTEPS_MAX = 4  # the same for the quicker method
#: In the longest step. With effects there is no stiff method: what needs more steps, such as
#: friction that builds up within a nanometre, is given up. No record could resolve it.
EFFECT_SUBSTEPS_MAX = 25
DRAG_SUBSTEPS_MAX = 4 * EFFECT_SUBSTEPS_MAX  #: in a sample
# Change of a drag over a step, as a phase: that part is not in closed form. By the fourth root less
# where the film moves further than this stretch until the drag takes it up, or in a sample.
_DRAG_CHANGE = 20.0
_NEAR, _NEAR_QUICK = 1e-8, 5e-7
_DRAG_CHANGE_LEAST = 1.0
_TAKEN_UP = 3.0  # time constants of a drag, after which it has slowed the film to 1/20
#: Between the least drag of a sample (0) and the largest (1): the one in closed form. With it the
#: error was the smallest over linear, quadratic and power-law drags.
_DRAG_HIGH = 0.7
_RINGING = 1e-4  # in stretch, from which on steps must resolve it: 7.5 um on 75 mm
_CALM = 2e-5  # in stretch, up to which effects that soften need not resolve it
_STEEP = 0.05  # of the stiffness: softening effects that change it by more are resolved anyway
#: Of the stiffness: so near need that of a closed form be. The difference is integrated.
STIFFNESS_NEAR = 0.005
LOOK_EVERY = 64  #: samples: the film's stiffness follows the stretch slowly
EVEN = 1e-6  #: of an interval: so near are intervals of one length


class Policy(NamedTuple):
    """What a fidelity and a set of effects mean for the steps of a whole record."""

    acting: int  # effects that take part in the motion, in bits; 0 if none does
    exponential: bool  # the film's oscillation is in closed form
    drags: bool  # an effect says how it drags
    fine_only: bool  # CAREFUL, or hysteretic effects: every step resolves the ringing
    watched: bool  # effects that soften: fine steps only while the film rings
    coarse: bool  # COARSE
    substeps_max: int  # in the longest step, before a stiff method takes over
    longest: float  # s, of a step; 0 where every step resolves the ringing
    phase_max: float  # rad
    calm_below: float  # in stretch: the ringing that a watched effect need not resolve


class Stiffness(NamedTuple):
    """What limits the steps where the film is."""

    springs: float  # 1/s^2, over the inertia
    omega: float  # rad/s, of springs and effects
    drag: float  # 1/s, of the effects at most
    rk4_rate: float  # steps a second of classical Runge-Kutta
    exponential_rate: float  # steps a second of the exponential method
    calm_rate: float  # the same while a watched effect is calm
    steep: bool  # a watched effect is never calm here


class Pace(NamedTuple):
    """How intervals of one length are crossed."""

    explicit: bool  # not stiff
    steps: int  # of an interval
    calm_steps: int  # the same while a watched effect is calm
    jump_gain: float  # error of a step after a jump of the acceleration of 1/s^2, of that allowed
    ringing_gain: float  # the same, of an acceleration that oscillates so far
    fading: float  # of the ringing in one interval
    per_phase2: float  # second differences of the acceleration to its amplitude


@jit
def policy_of(own: int, acting: int, exponential: bool, fidelity: int) -> Policy:
    """Return how a film with its ``own`` effects is stepped at a ``fidelity``.

    Its steps suit all effects ``acting``, its own and those of the films besides it.
    """
    moves = acting & MOVING != 0
    most = _EXPONENTIAL_SUBSTEPS_MAX if exponential else _RK4_SUBSTEPS_MAX
    # ringing is in closed form, but not its turning points, on which hysteretic effects depend
    hysteretic = acting & HYSTERETIC
    watched = (
        exponential
        and QUICK <= fidelity <= ROUGH
        and hysteretic != 0
        and hysteretic & ~SOFTENS == 0
    )
    fine_only = watched or fidelity == CAREFUL or (fidelity == QUICK and hysteretic != 0)
    longest = 0.0
    if not fine_only:
        longest = _COARSE_STEP_MAX if fidelity == COARSE else _QUICK_STEP_MAX
    return Policy(
        own if own & MOVING else 0,
        exponential,
        acting & DRAGS != 0,
        fine_only,
        watched,
        fidelity == COARSE,
        EFFECT_SUBSTEPS_MAX if moves else most,
        longest,
        _ROUGH_PHASE_MAX if fidelity == ROUGH else _PHASE_MAX,
        _RINGING if fidelity == ROUGH else _CALM,
    )


@inlined
def _rk4_rate(springs: float, more: float, drag: float, fastest: float) -> float:
    """Steps of classical Runge-Kutta a second for these stiffnesses, this drag and this flow."""
    rate = max(max(math.sqrt(springs + more), fastest), _DRAG_PHASE * drag)
    return max(rate / _PHASE_MAX, 1.0 / _STEP_MAX)


@inlined
def _exponential_rate(
    springs: float, more: float, fastest: float, longest: float, phase_max: float
) -> float:
    """As ``_rk4_rate`` of the exponential method: drag and nearly all of the springs cost nothing.

    With a ``longest`` of 0 the steps resolve the ringing.
    """
    if longest > 0.0:
        return max(max(math.sqrt(more), fastest) / phase_max, 1.0 / longest)
    return _rk4_rate(springs, more, 0.0, fastest)


@jit
def stiffness_at(
    policy: Policy, acting: int, c: np.ndarray, y: np.ndarray, t: float, branches: np.ndarray
) -> Stiffness:
    """Return what limits the steps at ``y``, ``t`` s; ``branches`` is filled, see ``motion``."""
    springs, fastest = network_stiffness(c, y, branches)
    more, drag = stiffness_and_drag(acting, c, y, math.inf)
    phase_max = policy.phase_max
    return Stiffness(
        springs,
        math.sqrt(springs + more),
        drag,
        _rk4_rate(springs, more, drag, fastest),
        _exponential_rate(springs, more, fastest, policy.longest, phase_max),
        _exponential_rate(springs, more, fastest, _QUICK_STEP_MAX, phase_max),
        policy.watched and softening_stiffness(acting, c, y, t) > _STEEP * springs,
    )


@jit
def pace_of(policy: Policy, film: Stiffness, dt: float) -> Pace:
    """Return how intervals of ``dt`` s are crossed by a film that is so stiff."""
    moves = policy.acting != 0
    by_exponential = policy.exponential and moves
    wanted = dt * (film.exponential_rate if by_exponential else film.rk4_rate) - 1e-6
    most = policy.substeps_max
    # a rate that is not finite does not pass either
    explicit = wanted <= max(most, most * dt / _STEP_MAX)
    if policy.exponential:
        wanted = dt * film.exponential_rate - 1e-6
    steps = max(math.ceil(wanted), 1) if explicit else 1
    calm_steps = steps
    if policy.watched and explicit and not film.steep:
        calm_steps = max(math.ceil(dt * film.calm_rate - 1e-6), 1)
        steps = calm_steps * math.ceil(steps / calm_steps)
    step = dt / steps
    phase = max(film.omega * step, 1e-6)
    # a step of phase p errs by p^5/120 of an oscillation's amplitude: once after a jump, and at
    # each step while the film rings on
    return Pace(
        explicit,
        steps,
        calm_steps,
        phase**3 * step**2 / 120.0 / _JUMP_ERROR,
        phase**2 * step**2 / 120.0 / _RINGING_ERROR,
        1.0 / (1.0 + 0.25 * film.omega * dt),
        (calm_steps / (steps * phase)) ** 2,
    )


@inlined
def stiffness_changed(lam: float, lam_seen: float) -> bool:
    """Whether the stretch ``lam`` is far from that at which the stiffness was computed."""
    return abs(lam - lam_seen) > _MOVED * lam_seen


@inlined
def too_stiff(film: Stiffness, before: Stiffness) -> bool:
    """Whether the last step was too long for what the film's stiffness has become."""
    return not film.rk4_rate <= _STIFFER * before.rk4_rate


@inlined
def refinement(pace: Pace, jump: float, ringing: float) -> int:
    """How many times finer steps must be after a ``jump`` of the acceleration, and while it rings.

    Both are in 1/s^2.
    """
    jumped, rings = pace.jump_gain * abs(jump), pace.ringing_gain * ringing
    refine = 1
    if jumped > 1.0 or rings > 1.0:
        more = max(jumped**0.2, math.sqrt(math.sqrt(rings)))
        refine = math.ceil(min(more, _REFINEMENT_MAX))
    return refine


@inlined
def drag_between(
    acting: int, c: np.ndarray, y: np.ndarray, slow: float, fast: float, dt: float, hasty: bool
) -> tuple[float, float]:
    """Return the drag for the closed form, 1/s, and the steps a sample of ``dt`` s takes for it.

    The rate of stretch lies between ``slow`` and ``fast``. The steps follow from how much the drag
    changes between them.
    """
    most, least = drag_at(acting, c, y, fast), drag_at(acting, c, y, slow)
    near = _NEAR_QUICK if hasty else _NEAR
    moved = max(fast * min(dt, _TAKEN_UP / most), near)
    allowed = max(_DRAG_CHANGE * math.sqrt(math.sqrt(near / moved)), _DRAG_CHANGE_LEAST)
    return _DRAG_HIGH * most + (1.0 - _DRAG_HIGH) * least, (most - least) * dt / allowed


@inlined
def steps_by_ringing(
    policy: Policy,
    film: Stiffness,
    pace: Pace,
    dt: float,
    jump: float,
    ringing: float,
    hasty: bool,
) -> int:
    """Return how many exponential steps an interval takes, so that they resolve what must be."""
    fine = pace.steps
    if policy.fine_only:
        fine = pace.calm_steps if hasty else pace.steps * refinement(pace, jump, ringing)
    elif not policy.coarse and max(ringing * pace.fading, abs(jump)) > _RINGING * film.springs:
        finer = film.omega * dt / policy.phase_max
        fine = max(fine, math.ceil(min(finer - 1e-6, EFFECT_SUBSTEPS_MAX)))
    return fine
