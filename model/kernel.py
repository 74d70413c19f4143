"""Fixed-step integration of the film under voltage: thesis eq. 48, compiled.

State ``y`` = [lam, dlam/dt, xi_1 .. xi_n]. The kernel steps from sample to sample of the record, so
that its grid and the record's line up exactly; inside one sample interval it takes as many equal
steps as accuracy asks for. Three methods:

* exponential Runge-Kutta of order 4 in the thesis's case (width held, Gent springs, three branches
  at most): the film's swinging, how branches give way to it, and its drag are in closed form, so
  that a drag may be as strong as it likes, and only what changes meanwhile asks for short steps;
* classical Runge-Kutta of order 4 elsewhere, where the film is not stiff for the record's interval;
  either in finer steps while the film rings after an edge of the drive (its bare ringing at 70 Hz
  lasts for tens of cycles, and every step adds to the error of its phase);
* RODAS (Hairer and Wanner, Solving ODEs II, IV.7), an L-stable Rosenbrock method of order 4 with
  an error estimate, where it is: moduli of MPa, relaxation times of microseconds, springs near
  locking. Its Jacobian is an arrow (each branch knows only lam and itself), so a step costs O(n).

Where effects of ``dearig.model.effects`` change the motion, Runge-Kutta runs with their hooks in
it; what they remember (a voltage behind a resistance, the strain of a yielding element) goes from
step to step in closed form, so that no effect makes the film stiffer than its own stress does.
Their numbers stand in the state behind the branches.

Which one runs follows from the film's own stiffness and the sample interval, never from measured
data, so a fit sees a smooth function. Nothing here raises: every outcome is a status.
"""

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
    UNIFORM,
    WIDTH,
)
from dearig.model.effects import MEMORY, assembly
from dearig.model.jit import allocating, inlined, jit
from dearig.model.kinematics import electric, electric_slope, strain_and_pull
from dearig.model.network import HEAD, branch_count, nominal_pull, nominal_pull_slope, true_pull
from dearig.model.rodas import ALPHA, GAMMA, A, C, D
from dearig.model.springs import SPRINGS, gent, neo_hookean

__all__ = [
    "BAD_INPUT",
    "CAREFUL",
    "COARSE",
    "LOCKED",
    "NOT_CONVERGED",
    "NO_REST",
    "OK",
    "PULL_IN",
    "QUICK",
    "ROUGH",
    "drive_by_voltage",
    "is_swift",
    "read_sensor",
    "rest_stretch",
]

OK = 0
PULL_IN = 1  #: the field outgrew the stiffness: the stretch ran away
LOCKED = 2  #: a spring reached its locking stretch
NOT_CONVERGED = 3  #: the step had to become too small
NO_REST = 4  #: no rest state under the load
BAD_INPUT = 5  #: not finite, or time that does not increase

CAREFUL = 0  #: good to some hundredths of a micrometre
QUICK = 1  #: to a tenth (some tenths on a step of 8 kV); careful where a force follows the path
ROUGH = 2  #: nor careful there: to a tenth of what such an effect does, or some while it rings
#: As rough, in steps from sample to sample, however far: ``model.fitting.coarse_drive``.
COARSE = 3


_STRETCH_MAX = 100.0  # beyond any elastomer: a runaway, whatever the springs say
_RK4_STEP_MAX = 2.5e-3  # s; a thesis record is then good to 0.03 um
_QUICK_STEP_MAX = 5e-3  # s; where quick is what matters
_SKETCH_STEP_MAX = 5e-2  # s; where it was looked at first how long they may be
_RK4_PHASE_MAX = 1.20  # (angular frequency or flow rate) times step
_ROUGH_PHASE_MAX = 2.0  # the same of what effects add to the springs, in a first look
_RK4_KICK = 5e-8  # in stretch: the error allowed in following one kick of the drive
_RK4_RINGING = 5e-9  # in stretch a radian of ringing, which lasts for some hundred radians
_RK4_REFINE_MAX = 20.0
_MOVED = 5e-3  # of the stretch: then the stiffness is looked at again
_STIFFER = 1.25  # growth of the number of steps that a sample may meet on its way
_RK4_SUBSTEPS_MAX = 2  # beyond that, one RODAS step is cheaper
_LEAN_SUBSTEPS_MAX = 4  # the same for the quicker form
# in the longest step; with effects there is no other method, and what is stiffer than that, such as
# friction that builds up within a nanometre, is given up: no record could tell it apart
_EFFECT_SUBSTEPS_MAX = 25
_DRAG_SUBSTEPS_MAX = 4 * _EFFECT_SUBSTEPS_MAX
# Change of a drag over a step, as a phase: that part is not in closed form. The fourth root less
# where the film moves further than this stretch until the drag takes it up, or in a sample.
_GROWN = 20.0
_NEAR, _NEAR_QUICK = 1e-8, 5e-7
_GROWN_LEAST = 1.0
_TAKEN_UP = 3.0  # times that in which a drag alone would slow the film to 1/e
_FORESEEN = 1.5  # of that change, if more was met on the way, is still let pass
_RINGING = 1e-4  # in stretch, from which on steps must see it: 7.5 um on 75 mm
_CALM = 2e-5  # in stretch, up to which what softens on the way need not see it
_STEEP = 0.05  # of the stiffness: what softens by so much where the film is must be seen anyway
# numbers in closed form need not be quite the film's own: what they lack is integrated
_STIFFNESS_NEAR = 0.005
_DRAG_NEAR = 0.2
# between the least drag of a sample and the most, where closed forms of it are the most accurate
_DRAG_HIGH = 0.7
_DRAG_MIN = 1e-2  # 1/s; less is none
_COURSES = 256  # of these forms that are kept
_SWING = 40  # numbers that say how the film goes on
_K, _D, _W, _H, _KIND, _FADING = 30, 31, 32, 33, 34, 35  # where those that it follows from stand
_RODAS_TOLERANCE = 5e-9  # in stretch, a step: 0.4 nm on 75 mm
_RODAS_STEP_MAX = 2e-2  # s; the error estimate rules below that
_RODAS_HALVINGS = 2.0**-17
_RODAS_WORTH = 10  # explicit steps that a sample by it takes as long as, at least

_inertia, _supply, _polarise = assembly.inertia, assembly.supply, assembly.polarise
_permittivity, _soften, _stress = assembly.permittivity, assembly.soften, assembly.stress
_stiffness, _commit, _sense = assembly.stiffness, assembly.commit, assembly.sense
_acting, _sensing = assembly.active, assembly.active_sensors
_SUPPLY, _POLARISE = assembly.HOOK_BITS["supply"], assembly.HOOK_BITS["polarise"]
_PERMITTIVITY, _SOFTEN = assembly.HOOK_BITS["permittivity"], assembly.HOOK_BITS["soften"]
_STRESS, _COMMIT = assembly.HOOK_BITS["stress"], assembly.HOOK_BITS["commit"]
_STIFFNESS, _TURNS = assembly.HOOK_BITS["stiffness"], assembly.HYSTERETIC
_MOVING = _SUPPLY | _POLARISE | _PERMITTIVITY | _SOFTEN | _STRESS

_NEO_HOOKEAN, _GENT = SPRINGS.index(neo_hookean.NAME), SPRINGS.index(gent.NAME)

_SHORTEST = WIDTH
_LONGEST = WIDTH + 1
_STIFFENING = WIDTH + 2


@jit
def _strain(held: int, e: float) -> float:
    """I1 - 3 at stretch ``e``."""
    strain, _ = strain_and_pull(held, e * e, 1.0 / (e * e))
    return strain


@inlined
def _rates(
    held: int,
    uniform: int,
    c: np.ndarray,
    springs: np.ndarray,
    y: np.ndarray,
    field2: float,
    dy: np.ndarray,
) -> None:
    """Right-hand side of eq. 48 at voltage squared ``field2``, written into ``dy``.

    ``uniform`` is the code of the strain energy when all springs share it, else -1.
    """
    lam = y[0]
    s = lam * lam
    inverse = 1.0 / s
    kind = uniform if uniform >= 0 else int(springs[KIND, 0])
    stress = springs[MODULUS, 0] * true_pull(held, kind, springs[LIMIT, 0], s, inverse)
    for i in range(1, springs.shape[1]):
        inner = y[1 + i] * y[1 + i]
        kind = uniform if uniform >= 0 else int(springs[KIND, i])
        pull = true_pull(held, kind, springs[LIMIT, i], s / inner, inner * inverse)
        stress += springs[MODULUS, i] * pull
        dy[1 + i] = springs[RATE, i] * pull
    dy[0] = y[1]
    load = c[FORCE] + c[ELECTRIC] * field2 * electric(held, lam)
    dy[1] = (load - stress / lam) / c[INERTIA]


@jit
def rest_stretch(c: np.ndarray, field2: float) -> tuple[int, float]:
    """Relaxed equilibrium stretch under the load and a constant voltage squared ``field2``.

    The branches carry nothing there, so only the equilibrium spring counts. Bisection between the
    undeformed film and its first upper turning point, then the stable (first) root. Returns
    ``(status, stretch)``: ``NO_REST`` without a load-bearing spring, ``PULL_IN`` when the field
    leaves no stable stretch.
    """
    held = int(c[HELD])
    kind, modulus = int(c[HEAD + KIND]), c[HEAD + MODULUS]
    limit, locking = c[HEAD + LIMIT], c[HEAD + LOCKING]
    if not (modulus > 0.0 and c[FORCE] >= 0.0 and field2 >= 0.0):
        return NO_REST, 1.0
    drive = c[ELECTRIC] * field2
    # march outwards until the springs hold the load, in steps that cannot jump over the first root
    low, high = 1.0, 1.0
    for _ in range(4000):
        high = low * 1.01
        if _strain(held, high) >= locking:
            # the pull is infinite at the locking stretch: the root lies before it
            break
        balance = modulus * nominal_pull(held, kind, limit, locking, high)
        if balance >= c[FORCE] + drive * electric(held, high):
            break
        low = high
        if low > _STRETCH_MAX:
            return (PULL_IN if drive > 0.0 else NO_REST), low
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        balance = modulus * nominal_pull(held, kind, limit, locking, middle)
        if balance >= c[FORCE] + drive * electric(held, middle):
            high = middle
        else:
            low = middle
    return OK, 0.5 * (low + high)


@jit
def _speeds(
    acting: int, c: np.ndarray, y: np.ndarray, branches: np.ndarray
) -> tuple[float, float, float, float]:
    """What limits a step at ``y``: (1/s^2, 1/s^2, 1/s, 1/s), all over the inertia.

    The stiffness of the springs, what effects may add to it, their drag, and the fastest flow of a
    branch. ``branches`` (2, 3 or more) is filled with the stiffness of each branch, 1/s^2, and with
    how fast it flows, 1/s.
    """
    held = int(c[HELD])
    lam = y[0]
    stiffness = c[HEAD + MODULUS] * nominal_pull_slope(
        held, int(c[HEAD + KIND]), c[HEAD + LIMIT], c[HEAD + LOCKING], lam
    )
    fastest = 0.0
    for i in range(branch_count(c)):
        k = HEAD + WIDTH * (i + 1)
        e = lam / y[2 + i]
        bend = nominal_pull_slope(held, int(c[k + KIND]), c[k + LIMIT], c[k + LOCKING], e)
        branches[0, i] = c[k + MODULUS] * bend / (y[2 + i] * y[2 + i]) / c[INERTIA]
        branches[1, i] = c[k + RATE] * bend * e / y[2 + i]
        stiffness += branches[0, i] * c[INERTIA]
        fastest = max(fastest, branches[1, i])
    more, drag = _stiffness(acting, c, y[2 + branch_count(c) :], lam, math.inf)
    inertia = c[INERTIA]
    return max(stiffness, 0.0) / inertia, more / inertia, drag / inertia, fastest


@inlined
def _bound(springy: float, more: float, drag: float, fastest: float) -> float:
    """Classical Runge-Kutta steps that these take a second."""
    # a motion that drag kills at once need only stay stable: to 2.8 for this method, kept below 2.2
    rate = max(max(math.sqrt(springy + more), fastest), 0.55 * drag)
    return max(rate / _RK4_PHASE_MAX, 1.0 / _RK4_STEP_MAX)


@inlined
def _lean_bound(
    springy: float, more: float, fastest: float, longest: float, phase_max: float
) -> float:
    """Exponential steps that the same take a second; a drag is in closed form, springs nearly.

    With a ``longest`` of 0 as many as it takes to see each radian of ringing.
    """
    if longest > 0.0:
        return max(max(math.sqrt(more), fastest) / phase_max, 1.0 / longest)
    return _bound(springy, more, 0.0, fastest)


@jit
def _drag(acting: int, c: np.ndarray, y: np.ndarray, rate: float) -> float:
    """Drag of the effects over the inertia, 1/s, at a rate of stretch."""
    _, drag = _stiffness(acting, c, y[2 + branch_count(c) :], y[0], rate)
    return drag / c[INERTIA]


@inlined
def _drag_between(
    acting: int, c: np.ndarray, y: np.ndarray, slow: float, fast: float, dt: float, hasty: bool
) -> tuple[float, float]:
    """Drag for the closed form, 1/s, at rates from ``slow`` to ``fast``, and what else it takes.

    That is how many steps a sample of ``dt`` s asks for, of what a drag changes between them.
    """
    most, least = _drag(acting, c, y, fast), _drag(acting, c, y, slow)
    near = _NEAR_QUICK if hasty else _NEAR
    moved = max(fast * min(dt, _TAKEN_UP / most), near)
    allowed = max(_GROWN * math.sqrt(math.sqrt(near / moved)), _GROWN_LEAST)
    return _DRAG_HIGH * most + (1.0 - _DRAG_HIGH) * least, (most - least) * dt / allowed


@jit
def _softening(acting: int, c: np.ndarray, y: np.ndarray, t: float) -> float:
    """Stiffness over the inertia, 1/s^2, that effects which soften add to the springs' or take.

    The larger of those upwards and downwards: where the film turns they change.
    """
    m, lam, near = y[2 + branch_count(c) :], y[0], 1e-4 * y[0]
    here = _soften(acting, c, m, lam, 0.0, t, 0.0)
    up = abs(_soften(acting, c, m, lam + near, 0.0, t, 0.0) - here)
    down = abs(_soften(acting, c, m, lam - near, 0.0, t, 0.0) - here)
    return max(up, down) / near * c[FORCE] / c[INERTIA]


@jit
def _runaway(c: np.ndarray, y: np.ndarray, field2: float) -> int:
    """Why the film could not leave state ``y`` in the ordinary way.

    Pull-in when the tangent stiffness of springs and field together is not positive any more;
    locked when a spring has used up nearly all of its strain; otherwise not converged.
    """
    held = int(c[HELD])
    lam = y[0]
    stiffness = c[HEAD + MODULUS] * nominal_pull_slope(
        held, int(c[HEAD + KIND]), c[HEAD + LIMIT], c[HEAD + LOCKING], lam
    )
    used = _strain(held, lam) / c[HEAD + LOCKING]
    for i in range(branch_count(c)):
        k = HEAD + WIDTH * (i + 1)
        e = lam / y[2 + i]
        bend = nominal_pull_slope(held, int(c[k + KIND]), c[k + LIMIT], c[k + LOCKING], e)
        stiffness += c[k + MODULUS] * bend / (y[2 + i] * y[2 + i])
        used = max(used, _strain(held, e) / c[k + LOCKING])
    if lam > 0.5 * _STRETCH_MAX or stiffness <= c[ELECTRIC] * field2 * electric_slope(held, lam):
        return PULL_IN if field2 > 0.0 else NOT_CONVERGED
    return LOCKED if used > 0.9 else NOT_CONVERGED


@jit
def _locking_stretch(held: int, locking: float, sign: float) -> float:
    """Stretch above (``sign`` 1) or below (-1) 1 at which I1 - 3 reaches ``locking``."""
    near, far = 1.0, _STRETCH_MAX**sign
    if _strain(held, far) < locking:
        return far
    for _ in range(60):
        middle = 0.5 * (near + far)
        if _strain(held, middle) < locking:
            near = middle
        else:
            far = middle
    return near


@allocating
def _spring_table(c: np.ndarray) -> np.ndarray:
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
        table[_SHORTEST, i] = _locking_stretch(held, c[k + LOCKING], -1.0)
        table[_LONGEST, i] = _locking_stretch(held, c[k + LOCKING], 1.0)
        table[_STIFFENING, i] = 0.0 if c[k + KIND] == _NEO_HOOKEAN else 1.0 / c[k + LIMIT]
    return table


@inlined
def _admissible(springs: np.ndarray, y: np.ndarray) -> bool:
    """True when every stretch is positive and finite and no spring is locked."""
    lam = y[0]
    good = springs[_SHORTEST, 0] < lam < springs[_LONGEST, 0] and math.isfinite(y[1])
    for i in range(1, springs.shape[1]):
        xi = y[1 + i]
        good = good and springs[_SHORTEST, i] * xi < lam < springs[_LONGEST, i] * xi
    return good


@inlined
def _rk4_steps(
    held: int,
    uniform: int,
    c: np.ndarray,
    springs: np.ndarray,
    y: np.ndarray,
    v0: float,
    v1: float,
    h: float,
    steps: int,
    stride: int,
    work: np.ndarray,
    trace: np.ndarray,
) -> None:
    """``steps`` Runge-Kutta steps of length ``h`` from ``y`` in place, voltage v0 to v1 linearly.

    ``trace`` carries the acceleration at the last two of every ``stride`` steps; its last number
    becomes the largest second difference of these accelerations met on the way.
    """
    n = 1 + springs.shape[1]
    k1, k2, k3, k4, z = work[0], work[1], work[2], work[3], work[4]
    trace[2] = 0.0
    for m in range(steps):
        va = v0 + (v1 - v0) * (m / steps)
        vm = v0 + (v1 - v0) * ((m + 0.5) / steps)
        vb = v0 + (v1 - v0) * ((m + 1.0) / steps)
        _rates(held, uniform, c, springs, y, va * va, k1)
        if m % stride == 0:
            trace[2] = max(trace[2], abs(k1[1] - 2.0 * trace[0] + trace[1]))
            trace[1] = trace[0]
            trace[0] = k1[1]
        for j in range(n):
            z[j] = y[j] + 0.5 * h * k1[j]
        _rates(held, uniform, c, springs, z, vm * vm, k2)
        for j in range(n):
            z[j] = y[j] + 0.5 * h * k2[j]
        _rates(held, uniform, c, springs, z, vm * vm, k3)
        for j in range(n):
            z[j] = y[j] + h * k3[j]
        _rates(held, uniform, c, springs, z, vb * vb, k4)
        for j in range(n):
            y[j] += h / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j])


@inlined
def _lean_pull(p: float, q: float, stiffening: float) -> float:
    """True stress over the modulus of a Gent spring, held in width, of squared stretch ``p/q``.

    ``stiffening`` is 1/J, 0 for a neo-Hookean spring. The same as ``true_pull`` times pq over
    itself: one division in place of three, and no difference of nearly equal numbers.
    """
    d = p - q
    return d * (p + q) / (p * q - d * d * stiffening)


@inlined
def _affected(
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
    """Maxwell stress less the network's, with the effects in both, ``since`` s after ``t``.

    ``acting`` says which hooks have anything to do; all stresses are divided by ``over``.
    """
    if acting & _PERMITTIVITY:
        pull *= _permittivity(acting, c, m, lam, field2)
    if acting & _SOFTEN:
        held_back *= _soften(acting, c, m, lam, since, t, warmth)
    if acting & _STRESS:
        held_back += _stress(acting, c, m, lam, rate, lam0, since, t) / over
    return pull - held_back


@inlined
def _supplied_now(
    acting: int, c: np.ndarray, m: np.ndarray, t: float, lam: float, speed: float, va: float
) -> tuple[float, float]:
    """Voltage at the film when a step begins, and the voltage squared that pulls on it."""
    if acting & _SUPPLY:
        va, _ = _supply(acting, c, m, t, va, va, 0.0, lam, speed)
    ea = va * va
    if acting & _POLARISE:
        pa, _ = _polarise(acting, c, m, va, va, 0.0)
        ea += pa
    return va, ea


@inlined
def _supplied(
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
    """Voltage squared that pulls on the film amid and after a step of 2 ``half`` s.

    ``now`` V is at the film when the step begins. What reaches it follows from how it goes on: in
    half of the step it grows by ``grown`` and gains ``gained`` of speed, by what is known when it
    begins. A film that grows lowers its own voltage.
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


@inlined
def _pull(
    acting: int,
    c: np.ndarray,
    springs: np.ndarray,
    y: np.ndarray,
    m: np.ndarray,
    field2: float,
    warmth: float,
    lam0: float,
    since: float,
    t: float,
    dy: np.ndarray,
) -> None:
    """As ``_rates`` with the effects in it, ``since`` s after the step began at ``t`` and lam0."""
    held = int(c[HELD])
    _rates(held, int(c[UNIFORM]), c, springs, y, 0.0, dy)
    maxwell = c[ELECTRIC] * field2 * electric(held, y[0])
    held_back = c[FORCE] - dy[1] * c[INERTIA]
    dy[1] = _affected(
        acting, c, m, y[0], y[1], warmth, lam0, since, t, field2, maxwell, held_back, 1.0
    )
    dy[1] = (c[FORCE] + dy[1]) / c[INERTIA]


@jit
def _effect_steps(
    acting: int,
    c: np.ndarray,
    springs: np.ndarray,
    y: np.ndarray,
    v0: float,
    v1: float,
    t0: float,
    warmth: float,
    h: float,
    steps: int,
    stride: int,
    work: np.ndarray,
    trace: np.ndarray,
) -> None:
    """As ``_rk4_steps``, with effects in the motion; ``t0`` s is the time at the beginning."""
    n = 1 + springs.shape[1]
    m = y[n:]
    k1, k2, k3, k4, z = work[0], work[1], work[2], work[3], work[4]
    trace[2] = 0.0
    half = 0.5 * h
    for step in range(steps):
        t = t0 + step * h
        va = v0 + (v1 - v0) * (step / steps)
        vm = v0 + (v1 - v0) * ((step + 0.5) / steps)
        vb = v0 + (v1 - v0) * ((step + 1.0) / steps)
        lam0 = y[0]
        now, ea = _supplied_now(acting, c, m, t, lam0, y[1], va)
        _pull(acting, c, springs, y, m, ea, warmth, lam0, 0.0, t, k1)
        grown, gained = half * y[1], half * k1[1]
        em, eb = _supplied(acting, c, m, t, half, lam0, y[1], grown, gained, now, va, vm, vb)
        if step % stride == 0:
            trace[2] = max(trace[2], abs(k1[1] - 2.0 * trace[0] + trace[1]))
            trace[1] = trace[0]
            trace[0] = k1[1]
        for j in range(n):
            z[j] = y[j] + half * k1[j]
        _pull(acting, c, springs, z, m, em, warmth, lam0, half, t, k2)
        for j in range(n):
            z[j] = y[j] + half * k2[j]
        _pull(acting, c, springs, z, m, em, warmth, lam0, half, t, k3)
        for j in range(n):
            z[j] = y[j] + h * k3[j]
        _pull(acting, c, springs, z, m, eb, warmth, lam0, h, t, k4)
        for j in range(n):
            y[j] += h / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j])
        if acting & _COMMIT:
            _commit(acting, c, m, y[0], y[1], lam0, h, t)


@allocating
def _lean_table(c: np.ndarray, springs: np.ndarray) -> np.ndarray:
    """What ``_lean_steps`` reads: load and field over the inertia, then three numbers a spring.

    Those are modulus over inertia, 1/J and 1/T; springs that are missing are there as zeros. Then
    the inertia.
    """
    table = np.zeros(15)
    table[14] = c[INERTIA]
    table[0], table[1] = c[FORCE] / c[INERTIA], c[ELECTRIC] / c[INERTIA]
    for i in range(springs.shape[1]):
        table[2 + 3 * i] = springs[MODULUS, i] / c[INERTIA]
        table[3 + 3 * i] = springs[_STIFFENING, i]
        table[4 + 3 * i] = springs[RATE, i]
    return table


@jit
def _times(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """The product of two 3 by 3 matrices, into ``out``."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@jit
def _doubled(phi: np.ndarray, room: np.ndarray) -> None:
    """From exp and phi_1 .. phi_3 of a matrix (4, 3, 3) those of its double, in place.

    Hochbruck and Ostermann, Acta Numerica 19, 2010. ``room`` is (3, 3).
    """
    half = 0.125
    for j in range(3, -1, -1):
        _times(phi[0], phi[j], room)
        weight = 1.0
        for i in range(j, 0, -1):
            for m in range(3):
                for n in range(3):
                    room[m, n] += weight * phi[i, m, n]
            weight /= j - i + 1
        for m in range(3):
            for n in range(3):
                phi[j, m, n] = room[m, n] * half
        half *= 2.0


@jit
def _phis(a: np.ndarray, doublings: int, room: np.ndarray, phi: np.ndarray) -> None:
    """Fill ``phi`` (4, 3, 3) with exp and phi_1 .. phi_3 of ``a`` (3, 3) times 2^``doublings``.

    Taylor's series, which converges at once for a small ``a``, then doubled. ``room`` (2, 3, 3).
    """
    power, product = room[0], room[1]
    phi[:] = 0.0
    power[:] = 0.0
    power[0, 0] = power[1, 1] = power[2, 2] = 1.0
    # x^n/(n + j)! adds up to phi_j
    factorial = 1.0
    for n in range(12):
        below = factorial
        for j in range(4):
            part = 1.0 / below
            for m in range(3):
                for i in range(3):
                    phi[j, m, i] += power[m, i] * part
            below *= n + j + 1
        _times(power, a, product)
        for m in range(3):
            for i in range(3):
                power[m, i] = product[m, i]
        factorial *= n + 1
    for _ in range(doublings):
        _doubled(phi, product)


@inlined
def _kind_of_drag(drag: float) -> int:
    """One number for drags that may share a closed form; 0 for none."""
    if drag < _DRAG_MIN:
        return 0
    return 1 + int(math.log(drag / _DRAG_MIN) / math.log(1.0 + _DRAG_NEAR))


@jit
def _swings(
    k: float, d: float, branches: np.ndarray, h: float, room: np.ndarray, swing: np.ndarray
) -> None:
    """What ``_lean_steps`` reads: how a film of stiffness k and drag d goes on over ``h`` s.

    ``swing`` (_SWING,) is filled: the matrices of Cox and Matthews's method for z'' = -k z - d z'
    + w I + rest, I' = z - f I, of which only the columns are needed that act on a rate, on an
    acceleration or on I: z is how far the film has moved, I what of it the branches have given way
    to, as one branch would that flows as they do in the mean, at f 1/s. Then what a force does that
    grows evenly over the first half, k, d, w and h themselves, the kind of drag, f, and how much of
    a flow that fades so has gone by, in s, after half of the step and after all of it.
    ``branches`` (2, 3) is ``_speeds``'s, ``room`` (7, 3, 3).
    """
    w = fades = 0.0
    for i in range(branches.shape[1]):
        w += branches[0, i] * branches[1, i]
        fades += branches[0, i] * branches[1, i] ** 2
    fades = fades / w if w > 0.0 else 1.0
    doublings, part, fastest = 0, 0.5 * h, max(max(math.sqrt(k), d), max(w ** (1.0 / 3.0), fades))
    while part * fastest > 0.5:
        part *= 0.5
        doublings += 1
    a, phi = room[0], room[1:5]
    a[:] = 0.0
    a[0, 1] = a[2, 0] = part
    a[1, 0], a[1, 1], a[1, 2], a[2, 2] = -part * k, -part * d, part * w, -part * fades
    _phis(a, doublings, room[5:], phi)
    for i in range(3):
        for j in range(3):
            swing[3 * i + j] = phi[0, i, j]
        swing[9 + i] = 0.5 * h * phi[1, i, 1]
        swing[12 + i] = 0.25 * h * h * phi[2, i, 1]
    _doubled(phi, room[5])
    for i in range(3):
        first, second, third = phi[1, i, 1], phi[2, i, 1], phi[3, i, 1]
        swing[15 + i] = phi[0, i, 1]
        swing[18 + i] = h * (first - 3.0 * second + 4.0 * third)
        swing[21 + i] = h * (2.0 * second - 4.0 * third)
        swing[24 + i] = h * (4.0 * third - second)
        swing[27 + i] = phi[0, i, 2]
    swing[_K], swing[_D], swing[_W], swing[_H], swing[_KIND] = k, d, w, h, _kind_of_drag(d)
    swing[_FADING] = fades
    swing[_FADING + 1] = -math.expm1(-0.5 * fades * h) / fades
    swing[_FADING + 2] = -math.expm1(-fades * h) / fades


@inlined
def _fits(swing: np.ndarray, k: float, near: float, kind: int, h: float) -> bool:
    """True where ``swing`` is of a stiffness so ``near`` to k, of that drag and that step."""
    return abs(k - swing[_K]) <= near and kind == swing[_KIND] and abs(h - swing[_H]) <= 1e-6 * h


@jit
def _lean_steps(
    acting: int,
    c: np.ndarray,
    table: np.ndarray,
    branches: np.ndarray,
    swing: np.ndarray,
    y: np.ndarray,
    v0: float,
    v1: float,
    t0: float,
    warmth: float,
    h: float,
    steps: int,
    stride: int,
    trace: np.ndarray,
) -> None:
    """``steps`` steps of ``h`` s for the thesis's case: width held, springs of Gent's kind, n <= 3.

    Exponential Runge-Kutta of order 4 (Cox and Matthews, J. Comput. Phys. 176, 2002): the film's
    own swinging, how branches flow and give way meanwhile, and a drag are in closed form; what is
    left of the forces is slow. So neither ringing nor drag ask for short steps. Branches flow as
    one does that fades as they do in the mean; by what each differs it goes as in classical
    Runge-Kutta, which is the same method for what has no linear part. Nothing leaves the registers
    on the way. ``table`` is ``_lean_table``'s, ``branches`` is ``_speeds``'s, ``swing`` is
    ``_swings``'s. Where effects are ``acting`` it does what ``_effect_steps`` does. ``trace`` is
    ``_rk4_steps``'s, and then the least and the greatest speed that were met.
    """
    n = y.shape[0] - 2 - MEMORY
    memory = y[2 + n :]
    over = table[14]
    load, electric_gain = table[0], table[1]
    m0, g0 = table[2], table[3]
    m1, g1, r1 = table[5], table[6], table[7]
    m2, g2, r2 = table[8], table[9], table[10]
    m3, g3, r3 = table[11], table[12], table[13]
    e11, e12, e13 = swing[0], swing[1], swing[2]
    e21, e22, e23 = swing[3], swing[4], swing[5]
    e31, e32, e33 = swing[6], swing[7], swing[8]
    p1, p2, p3, q1, q2, q3 = swing[9], swing[10], swing[11], swing[12], swing[13], swing[14]
    w1, w2, w3, a1, a2, a3 = swing[15], swing[16], swing[17], swing[18], swing[19], swing[20]
    b1, b2, b3, c1, c2, c3 = swing[21], swing[22], swing[23], swing[24], swing[25], swing[26]
    w13, w23, w33 = swing[27], swing[28], swing[29]
    k, d, w, fades = swing[_K], swing[_D], swing[_W], swing[_FADING]
    gone_half, gone = swing[_FADING + 1], swing[_FADING + 2]
    left_half, left = 1.0 - fades * gone_half, 1.0 - fades * gone
    per_w = 1.0 / w if w > 0.0 else 0.0
    k1, k2, k3 = branches[0, 0], branches[0, 1], branches[0, 2]
    s1, s2, s3 = branches[1, 0], branches[1, 1], branches[1, 2]
    x1 = y[2] if n > 0 else 1.0
    x2 = y[3] if n > 1 else 1.0
    x3 = y[4] if n > 2 else 1.0
    lam, speed = y[0], y[1]
    half, sixth = 0.5 * h, h / 6.0
    dv = (v1 - v0) / steps
    last, last_but_one, bend = trace[0], trace[1], 0.0
    slow = fast = abs(speed)
    for m in range(steps):
        va = v0 + dv * m
        vm, vb = va + 0.5 * dv, va + dv
        f0, fm, fb = va * va, vm * vm, vb * vb
        now, lam0, t = va, lam, t0 + m * h
        if acting:
            now, f0 = _supplied_now(acting, c, memory, t, lam, speed, va)
        # four times the same, written out: a loop over stages would go through memory
        p = lam * lam
        t1, t2 = _lean_pull(p, x1 * x1, g1), _lean_pull(p, x2 * x2, g2)
        t3 = _lean_pull(p, x3 * x3, g3)
        stress = (m0 * _lean_pull(p, 1.0, g0) + m1 * t1 + m2 * t2 + m3 * t3) / lam
        pull = electric_gain * f0 * lam
        a = pull - stress
        if acting:
            a = _affected(
                acting, c, memory, lam, speed, warmth, lam0, 0.0, t, f0, pull, stress, over
            )  # fmt: skip
        a += load
        if m % stride == 0:
            bend = max(bend, abs(a - 2.0 * last + last_but_one))
            last_but_one, last = last, a
        # branches flow already: as if all had been left behind by what one with their mean had, and
        # by what each differs from it (in the mean by nothing), which fades alike
        f1, f2, f3 = r1 * t1, r2 * t2, r3 * t3
        flow = per_w * (k1 * f1 + k2 * f2 + k3 * f3)
        f1, f2, f3 = f1 - s1 * flow, f2 - s2 * flow, f3 - s3 * flow
        before = -flow / fades
        push = a + d * speed - w * before
        z = e12 * speed + e13 * before + p1 * push
        v = e22 * speed + e23 * before + p2 * push
        seen = e32 * speed + e33 * before + p3 * push
        if acting:
            fm, fb = _supplied(
                acting, c, memory, t, half, lam, speed, z, v - speed, now, va, vm, vb
            )  # fmt: skip
        em, e1 = electric_gain * fm, electric_gain * fb
        # how the field grows is known ahead: no stage need take it as still
        rise, later = lam * (em - electric_gain * f0), lam * (e1 - em)
        slope = rise / half
        z, v, seen = z + q1 * slope, v + q2 * slope, seen + q3 * slope
        first = push
        sum_z = w1 * speed + w13 * before + a1 * push
        sum_v = w2 * speed + w23 * before + a2 * push
        sum_seen = w3 * speed + w33 * before + a3 * push
        there_z, there_v, there_seen = z, v, seen

        gave = seen - before
        z1, z2 = x1 + s1 * gave + f1 * gone_half, x2 + s2 * gave + f2 * gone_half
        z3 = x3 + s3 * gave + f3 * gone_half
        now = lam + z
        p = now * now
        t1, t2 = _lean_pull(p, z1 * z1, g1), _lean_pull(p, z2 * z2, g2)
        t3 = _lean_pull(p, z3 * z3, g3)
        stress = (m0 * _lean_pull(p, 1.0, g0) + m1 * t1 + m2 * t2 + m3 * t3) / now
        pull = em * now
        a = pull - stress
        if acting:
            a = _affected(
                acting, c, memory, now, v, warmth, lam0, half, t, fm, pull, stress, over
            )  # fmt: skip
        a += load
        push = a + k * z + d * v - w * seen
        less = push - rise
        went = z - fades * seen
        o1 = r1 * t1 - s1 * went - f1 * left_half
        o2 = r2 * t2 - s2 * went - f2 * left_half
        o3 = r3 * t3 - s3 * went - f3 * left_half
        z = e12 * speed + e13 * before + p1 * less + q1 * slope
        v = e22 * speed + e23 * before + p2 * less + q2 * slope
        seen = e32 * speed + e33 * before + p3 * less + q3 * slope
        sum_z, sum_v, sum_seen = sum_z + b1 * push, sum_v + b2 * push, sum_seen + b3 * push
        sum_1, sum_2, sum_3 = 2.0 * o1, 2.0 * o2, 2.0 * o3

        gave = seen - before
        z1 = x1 + s1 * gave + f1 * gone_half + half * o1
        z2 = x2 + s2 * gave + f2 * gone_half + half * o2
        z3 = x3 + s3 * gave + f3 * gone_half + half * o3
        now = lam + z
        p = now * now
        t1, t2 = _lean_pull(p, z1 * z1, g1), _lean_pull(p, z2 * z2, g2)
        t3 = _lean_pull(p, z3 * z3, g3)
        stress = (m0 * _lean_pull(p, 1.0, g0) + m1 * t1 + m2 * t2 + m3 * t3) / now
        pull = em * now
        a = pull - stress
        if acting:
            a = _affected(
                acting, c, memory, now, v, warmth, lam0, half, t, fm, pull, stress, over
            )  # fmt: skip
        a += load
        push = a + k * z + d * v - w * seen
        went = z - fades * seen
        o1 = r1 * t1 - s1 * went - f1 * left_half
        o2 = r2 * t2 - s2 * went - f2 * left_half
        o3 = r3 * t3 - s3 * went - f3 * left_half
        sum_z, sum_v, sum_seen = sum_z + b1 * push, sum_v + b2 * push, sum_seen + b3 * push
        push = 2.0 * push - first - rise
        slope = later / half
        z = e11 * there_z + e12 * there_v + e13 * there_seen + p1 * push + q1 * slope
        v = e21 * there_z + e22 * there_v + e23 * there_seen + p2 * push + q2 * slope
        seen = e31 * there_z + e32 * there_v + e33 * there_seen + p3 * push + q3 * slope
        sum_1, sum_2, sum_3 = sum_1 + 2.0 * o1, sum_2 + 2.0 * o2, sum_3 + 2.0 * o3

        gave = seen - before
        z1 = x1 + s1 * gave + f1 * gone + h * o1
        z2 = x2 + s2 * gave + f2 * gone + h * o2
        z3 = x3 + s3 * gave + f3 * gone + h * o3
        now = lam + z
        p = now * now
        t1, t2 = _lean_pull(p, z1 * z1, g1), _lean_pull(p, z2 * z2, g2)
        t3 = _lean_pull(p, z3 * z3, g3)
        stress = (m0 * _lean_pull(p, 1.0, g0) + m1 * t1 + m2 * t2 + m3 * t3) / now
        pull = e1 * now
        a = pull - stress
        if acting:
            a = _affected(
                acting, c, memory, now, v, warmth, lam0, h, t, fb, pull, stress, over
            )  # fmt: skip
        a += load
        push = a + k * z + d * v - w * seen
        went = z - fades * seen
        lam += sum_z + c1 * push
        speed = sum_v + c2 * push
        slow, fast = min(slow, abs(speed)), max(fast, abs(speed))
        gave = sum_seen + c3 * push - before
        if acting & _COMMIT:
            _commit(acting, c, memory, lam, speed, lam0, h, t)
        x1 += sixth * (sum_1 + r1 * t1 - s1 * went - f1 * left) + s1 * gave + f1 * gone
        x2 += sixth * (sum_2 + r2 * t2 - s2 * went - f2 * left) + s2 * gave + f2 * gone
        x3 += sixth * (sum_3 + r3 * t3 - s3 * went - f3 * left) + s3 * gave + f3 * gone
    trace[0], trace[1], trace[2] = last, last_but_one, bend
    trace[3], trace[4] = slow, fast
    y[0], y[1] = lam, speed
    if n > 0:
        y[2] = x1
    if n > 1:
        y[3] = x2
    if n > 2:
        y[4] = x3


@jit
def _rodas_step(
    c: np.ndarray,
    springs: np.ndarray,
    y: np.ndarray,
    v0: float,
    dv: float,
    h: float,
    work: np.ndarray,
    out: np.ndarray,
) -> float:
    """One RODAS step of length ``h`` from ``y`` into ``out``; voltage v0 + dv s over the step.

    Returns the error estimate over its tolerance; inf where a stage left the admissible region.
    """
    n = 1 + springs.shape[1]
    branches = n - 2
    held = int(c[HELD])
    lam = y[0]
    mass = c[INERTIA]
    s = 1.0 / (h * GAMMA)
    jvl = c[ELECTRIC] * v0 * v0 * electric_slope(held, lam)
    jvl -= c[HEAD + MODULUS] * nominal_pull_slope(
        held, int(c[HEAD + KIND]), c[HEAD + LIMIT], c[HEAD + LOCKING], lam
    )
    jvx, jxl, dinv = work[12], work[13], work[14]
    for i in range(branches):
        k = HEAD + WIDTH * (i + 1)
        inner = 1.0 / y[2 + i]
        e = lam * inner
        kind, limit, locking = int(c[k + KIND]), c[k + LIMIT], c[k + LOCKING]
        pull = nominal_pull(held, kind, limit, locking, e)
        bend = nominal_pull_slope(held, kind, limit, locking, e)
        both = pull + e * bend
        jvl -= c[k + MODULUS] * bend * inner * inner
        jvx[i] = c[k + MODULUS] * both * inner * inner / mass
        jxl[i] = c[k + RATE] * both * inner
        dinv[i] = 1.0 / (s + e * jxl[i])
    jvl /= mass
    ramp = 2.0 * v0 * dv / h * c[ELECTRIC] * electric(held, lam) / mass
    schur = s * s - jvl
    for i in range(branches):
        schur -= jvx[i] * jxl[i] * dinv[i]

    f, z, rhs = work[6], work[7], work[8]
    for stage in range(6):
        for j in range(n):
            if stage < 5:
                value = y[j]
                for m in range(stage):
                    value += A[stage, m] * work[m, j]
            else:
                value = z[j] + work[4, j]
            z[j] = value
        if not _admissible(springs, z):
            return np.inf
        v = v0 + dv * ALPHA[stage]
        _rates(held, int(c[UNIFORM]), c, springs, z, v * v, f)
        for j in range(n):
            value = f[j]
            for m in range(stage):
                value += C[stage, m] / h * work[m, j]
            rhs[j] = value
        rhs[1] += h * D[stage] * ramp
        a = rhs[1] + s * rhs[0]
        for i in range(branches):
            a += jvx[i] * rhs[2 + i] * dinv[i]
        a /= schur
        u = work[stage]
        u[0] = a
        u[1] = s * a - rhs[0]
        for i in range(branches):
            u[2 + i] = (rhs[2 + i] + jxl[i] * a) * dinv[i]
    last = work[5]
    for j in range(n):
        out[j] = z[j] + last[j]
    if not _admissible(springs, out):
        return np.inf
    # the rate counts as the stretch it makes within one period of the film
    swing = math.sqrt(max(-jvl, 1.0))
    error = max(abs(last[0]), abs(last[1]) / swing)
    for i in range(branches):
        error = max(error, 0.1 * abs(last[2 + i]))
    return error / _RODAS_TOLERANCE


@jit
def _rodas(
    c: np.ndarray,
    springs: np.ndarray,
    y: np.ndarray,
    v0: float,
    v1: float,
    dt: float,
    h: float,
    work: np.ndarray,
) -> tuple[int, float]:
    """Cross one sample interval ``dt`` with RODAS, starting with step ``h``; returns the next h."""
    out = work[9]
    done = 0.0
    while done < dt:
        last = done + h >= dt * (1.0 - 1e-12)
        step = dt - done if last else h
        va = v0 + (v1 - v0) * (done / dt)
        error = _rodas_step(c, springs, y, va, (v1 - v0) * (step / dt), step, work, out)
        if error <= 1.0:
            for j in range(1 + springs.shape[1]):
                y[j] = out[j]
            done += step
            grow = 0.9 * max(error, 1e-4) ** -0.25
            if not last or grow < 1.0:
                h = step * min(max(grow, 0.3), 4.0)
            elif grow > 1.0:
                h = max(h, step * min(grow, 4.0))
        else:
            h = step * (0.25 if not math.isfinite(error) else max(0.2, 0.9 * error**-0.25))
            if h < _RODAS_STEP_MAX * _RODAS_HALVINGS:
                return NOT_CONVERGED, h
    return OK, min(h, _RODAS_STEP_MAX)


@inlined
def _refined(
    kick_gain: float,
    ring_gain: float,
    kick: float,
    kick_before: float,
    ring: float,
    treads: bool,
    trace: np.ndarray,
) -> tuple[int, float]:
    """How many times finer steps must be while the film rings; and what is no ringing."""
    # a step of phase p gets an oscillation wrong by p^5/120 of its amplitude: once, where
    # the drive kicks the film, and again at each step while the film rings on
    kicked, ringing = kick_gain * abs(kick), ring_gain * ring
    refine, forced = 1, 0.0
    if kicked > 1.0 or ringing > 1.0:
        more = max(kicked**0.2, math.sqrt(math.sqrt(ringing)))
        refine = math.ceil(min(more, _RK4_REFINE_MAX))
    # a slow staircase rings within each of its long treads, but it does not ring on
    if treads:
        trace[0] += kick
        trace[1] += kick
        forced = 3.0 * min(abs(kick), kick_before)
    return refine, forced


@jit
def is_swift(c: np.ndarray) -> bool:
    """Whether the film is one whose swinging is in closed form: the thesis's case."""
    count = branch_count(c) + 1
    swift = int(c[HELD]) == 0 and count <= 4
    for i in range(count):
        swift = swift and c[HEAD + WIDTH * i + KIND] <= _GENT
    return swift


@allocating
def drive_by_voltage(
    c: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    warmth: np.ndarray,
    y: np.ndarray,
    stretch: np.ndarray,
    rate: np.ndarray,
    fidelity: int = CAREFUL,
) -> tuple[int, int, int]:
    """Carry state ``y`` (2 + n + MEMORY,) along a record; fill ``stretch`` and ``rate`` (N,).

    ``time`` s and ``voltage`` V are (N,), increasing and not necessarily even. From each sample to
    the next the voltage goes linearly to that in ``ends`` (N,), from where it may jump: of a
    converter's output, which stands until the next, that is ``voltage`` itself. ``warmth`` (N,) K
    is the temperature above that of the start, or (0,) where none was recorded. ``fidelity`` says
    how long steps may be: ``CAREFUL``, ``QUICK``, ``ROUGH``, ``COARSE``. Element 0 is the state as
    given, so a record can be cut and continued. ``c`` must know the stretch at rest
    (``dearig.model.actuator.at_rest``).

    Returns ``(status, reached, steps)``: on any status but ``OK`` the samples from ``reached`` on
    are filled with the last stretch that was reached, never with NaN; ``steps`` were taken, one
    sample by the stiff method counted for as many as take as long.
    """
    samples = time.shape[0]
    held, uniform = int(c[HELD]), int(c[UNIFORM])
    springs = _spring_table(c)
    c = c.copy()
    acting = _acting(c)
    c[INERTIA] += _inertia(acting, c, y)
    moves = acting & _MOVING != 0
    warm = warmth.shape[0] == samples
    lean = is_swift(c)
    table = _lean_table(c, springs) if lean else np.zeros(0)
    most = _LEAN_SUBSTEPS_MAX if lean else _RK4_SUBSTEPS_MAX
    if moves:
        most = _EFFECT_SUBSTEPS_MAX
    drags = acting & _STIFFNESS != 0
    # ringing is in closed form, but its turns are not, where a path is followed
    turning = acting & _TURNS
    # what softens on the way is content with quick steps as long as the film does not ring
    wary = lean and QUICK <= fidelity <= ROUGH and turning != 0 and turning & ~_SOFTEN == 0
    quick = not wary and (fidelity >= ROUGH or (fidelity == QUICK and turning == 0))
    calm_below = _RINGING if fidelity == ROUGH else _CALM
    phase_max = _ROUGH_PHASE_MAX if fidelity == ROUGH else _RK4_PHASE_MAX
    longest = 0.0
    if quick:
        longest = _SKETCH_STEP_MAX if fidelity == COARSE else _QUICK_STEP_MAX
    work = np.zeros((15, y.shape[0]))
    before = np.empty(y.shape[0])
    trace = np.zeros(5)
    branches = np.zeros((2, max(springs.shape[1] - 1, 3)))
    room, swings = np.empty((7, 3, 3)), np.zeros((_COURSES, _SWING))
    course, stiffness_step = swings[0], 0.0
    status = OK
    reached, taken = samples, 0
    h = _RODAS_STEP_MAX
    springy, swing, bound, steps, step_before, gentle = 0.0, 0.0, 0.0, 1, 0.0, True
    kick_gain, ring_gain, fading, per_phase2 = 0.0, 0.0, 1.0, 1.0
    ring, kick, lam_seen, rate_before, drag = 0.0, 0.0, y[0], y[1], 0.0
    fresh, steep = True, False
    last = last_begin = voltage[0]
    dt_before = 1.0
    for k in range(samples):
        stretch[k] = y[0]
        rate[k] = y[1]
        if k == samples - 1:
            break
        dt = time[k + 1] - time[k]
        v0 = voltage[k]
        v1 = ends[k]
        if not (dt > 0.0 and math.isfinite(v0) and math.isfinite(v1) and math.isfinite(dt)):
            status, reached = BAD_INPUT, k + 1
            break
        if fresh:
            _rates(held, uniform, c, springs, y, v0 * v0, work[0])
            trace[0] = trace[1] = work[0, 1]
            ring = abs(work[0, 1])
            fresh = False
        # the film's stiffness follows the stretch slowly, and time is mostly even
        if k % 64 == 0 or abs(dt - step_before) > 1e-6 * dt:
            if k % 64 == 0:
                springy, more, drag, fastest = _speeds(acting, c, y, branches)
                swing, bound = math.sqrt(springy + more), _bound(springy, more, drag, fastest)
                lean_bound = _lean_bound(springy, more, fastest, longest, phase_max)
                steep = wary and _softening(acting, c, y, time[k]) > _STEEP * springy
                lam_seen = y[0]
                if stiffness_step == 0.0:
                    stiffness_step = _STIFFNESS_NEAR * max(springy, 1.0)
            step_before = dt
            wanted = dt * (lean_bound if lean and moves else bound) - 1e-6
            # a bound that is not finite is not gentle either, and cannot be counted in steps
            gentle = wanted <= max(most, most * dt / _RK4_STEP_MAX)
            if lean:
                wanted = dt * lean_bound - 1e-6
            steps = max(math.ceil(wanted), 1) if gentle else 1
            looks = steps
            if wary and gentle and not steep:
                calmly = dt * _lean_bound(springy, more, fastest, _QUICK_STEP_MAX, phase_max)
                looks = max(math.ceil(calmly - 1e-6), 1)
                steps = looks * math.ceil(steps / looks)
            step = dt / steps
            phase = max(swing * step, 1e-6)
            kick_gain = phase**3 * step**2 / 120.0 / _RK4_KICK
            ring_gain = phase**2 * step**2 / 120.0 / _RK4_RINGING
            fading = 1.0 / (1.0 + 0.25 * swing * dt)
            per_phase2 = (looks / (steps * phase)) ** 2
        explicit = gentle
        if explicit:
            # how it jumps, and how its slope does
            sloped = (last * last - last_begin * last_begin) * (dt / dt_before)
            field2 = v1 * v1 - last * last - sloped
            kick_before, pushed = abs(kick), kick
            kick = c[ELECTRIC] * field2 * electric(held, y[0]) / c[INERTIA]
            for j in range(y.shape[0]):
                before[j] = y[j]
            theta = warmth[k] if warm else 0.0
        if explicit and lean:
            fine, refine = steps, 1
            forced = 0.0
            hasty = quick
            if wary and not steep:
                hasty = max(ring * fading, abs(kick - pushed)) < calm_below * springy
            if not quick:
                refine, forced = _refined(
                    kick_gain, ring_gain, kick, kick_before, ring, v0 != last and looks > 1, trace
                )
                fine = looks if hasty else steps * refine
            elif fidelity != COARSE and max(ring * fading, abs(kick)) > _RINGING * springy:
                finer = swing * dt / phase_max
                fine = max(fine, math.ceil(min(finer - 1e-6, _EFFECT_SUBSTEPS_MAX)))
            asked = 0.0
            if drags:
                # a kick cannot carry the film on faster than springs let it swing
                change = abs(y[1] - rate_before) + abs(kick) * min(dt, 1.0 / swing)
                slow, fast = max(abs(y[1]) - change, 0.0), abs(y[1]) + change
                drag, asked = _drag_between(acting, c, before, slow, fast, dt, hasty)
                rate_before = y[1]
                seen, seen_before = trace[0], trace[1]
            # a film that the field pulls on is softer by that
            pulling2 = 0.5 * (v0 * v0 + v1 * v1)
            softer = springy - c[ELECTRIC] * pulling2 / c[INERTIA]
            while True:
                # a drag may change with the rate: then in finer steps
                fine = max(fine, math.ceil(min(asked, _DRAG_SUBSTEPS_MAX)))
                h_fine, stiff = dt / fine, softer
                kind = _kind_of_drag(drag)
                if not _fits(course, stiff, 0.5 * stiffness_step, kind, h_fine):
                    level = max(math.floor(stiff / stiffness_step), 1.0)
                    stiff = (level + 0.5) * stiffness_step
                    course = swings[(int(level) + 37 * fine + 101 * kind) % _COURSES]
                    if not _fits(course, stiff, 0.0, kind, h_fine):
                        _swings(stiff, drag, branches, h_fine, room, course)
                _lean_steps(
                    acting if moves else 0, c, table, branches, course, y, v0, v1, time[k], theta,
                    h_fine, fine, max(fine // looks, 1), trace,
                )  # fmt: skip
                taken += fine
                if not drags or fine >= _DRAG_SUBSTEPS_MAX:
                    break
                # it was faster on the way, or slower, than was foreseen
                met, asked = _drag_between(acting, c, before, trace[3], trace[4], dt, hasty)
                if asked <= _FORESEEN * fine:
                    break
                drag, fine = met, fine + 1
                if not math.isfinite(asked):
                    drag, asked, fine = _drag(acting, c, before, 0.0), 0.0, _DRAG_SUBSTEPS_MAX
                trace[0], trace[1] = seen, seen_before
                for j in range(y.shape[0]):
                    y[j] = before[j]
            ring = max(ring * fading, trace[2] * per_phase2 - forced)
        elif explicit:
            refine, forced = _refined(
                kick_gain, ring_gain, kick, kick_before, ring, v0 != last and steps > 1, trace
            )
            fine = steps * refine
            h_fine = dt / fine
            taken += fine
            if moves:
                _effect_steps(
                    acting, c, springs, y, v0, v1, time[k], theta, h_fine, fine, refine, work, trace
                )
            else:
                _rk4_steps(held, uniform, c, springs, y, v0, v1, h_fine, fine, refine, work, trace)
            ring = max(ring * fading, trace[2] * per_phase2 - forced)
        if explicit:
            explicit = _admissible(springs, y)
            if explicit and abs(y[0] - lam_seen) > _MOVED * lam_seen:
                # far enough for springs to have stiffened: then this step was too long
                bound_before = bound
                springy, more, drag, fastest = _speeds(acting, c, y, branches)
                swing, bound = math.sqrt(springy + more), _bound(springy, more, drag, fastest)
                lean_bound = _lean_bound(springy, more, fastest, longest, phase_max)
                steep = wary and _softening(acting, c, y, time[k]) > _STEEP * springy
                lam_seen, step_before = y[0], 0.0
                explicit = moves or bound <= _STIFFER * bound_before
            if not explicit:
                for j in range(y.shape[0]):
                    y[j] = before[j]
        last, last_begin, dt_before = v1, v0, dt
        if not explicit:
            fresh = True
            taken += _RODAS_WORTH
            if moves:
                status = NOT_CONVERGED
            else:
                status, h = _rodas(c, springs, y, v0, v1, dt, h, work)
        if status != OK:
            status, reached = _runaway(c, y, max(v0 * v0, v1 * v1)), k + 1
            break
    if status != OK:
        for k in range(reached, samples):
            stretch[k] = stretch[reached - 1]
            rate[k] = 0.0
    return status, reached, taken


@jit
def read_sensor(
    c: np.ndarray,
    time: np.ndarray,
    displacement: np.ndarray,
    velocity: np.ndarray,
    memory: np.ndarray,
) -> None:
    """What the sensor makes of ``displacement`` (N,) m, in place, by the effects that act on it.

    ``velocity`` (N,) m/s is the film's; ``memory`` (SENSOR_MEMORY,) is carried along. Element
    0 is the last reading of the call before, or the first of the record.
    """
    sensing = _sensing(c)
    if not sensing:
        return
    for k in range(time.shape[0]):
        dt = time[k] - time[k - 1] if k else 0.0
        displacement[k] = _sense(sensing, c, memory, time[k], dt, displacement[k], velocity[k])
