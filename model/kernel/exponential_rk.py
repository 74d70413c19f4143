"""Exponential Runge-Kutta of order 4 for the thesis's film, with effects or without.

The method of Cox and Matthews (J. Comput. Phys. 176, 2002) on the motion split as ``propagator``
has it. ``EXPONENTIAL.md`` next to this package derives every line; its names are used here.
"""

from __future__ import annotations

import numpy as np

from dearig.model.coefficients import (
    ELECTRIC,
    FORCE,
    HELD,
    INERTIA,
    KIND,
    MODULUS,
    RATE,
    WIDTH,
)
from dearig.model.compiled.by_name import MATRIX, VECTOR, by_name
from dearig.model.compiled.jit import allocating, inlined, jit
from dearig.model.compiled.packs import first as first_film
from dearig.model.compiled.packs import larger, spread
from dearig.model.effects import MEMORY
from dearig.model.film.network import HEAD, branch_count
from dearig.model.kernel.effect_forces import COMMIT
from dearig.model.kernel.lane_forces import affected, commit, supplied, supplied_at_start
from dearig.model.kernel.motion import STIFFENING
from dearig.model.kernel.propagator import (
    COUPLING,
    DRAG,
    FADED,
    FADED_HALF,
    INVERSE_COUPLING,
    INVERSE_RELAXATION,
    RELAXATION,
    STIFFNESS,
)
from dearig.model.springs import SPRINGS

__all__ = [
    "BRANCHES_MAX",
    "TABLE",
    "exponential_steps",
    "film_steps",
    "film_table",
    "is_swift",
]

_GENT = SPRINGS.index("gent")  # the neo-Hookean spring comes before it
BRANCHES_MAX = 3  #: written out in the step
_INERTIA_AT = 2 + 3 * (1 + BRANCHES_MAX)  # in the film table
TABLE = _INERTIA_AT + 1  #: numbers of the film table


@jit
def is_swift(c: np.ndarray) -> bool:
    """Whether the film's oscillation is integrated in closed form, in steps beyond its period.

    So it is of films like the thesis's: width held, Gent or neo-Hookean springs, at most three
    branches.
    """
    count = branch_count(c) + 1
    swift = int(c[HELD]) == 0 and count <= 1 + BRANCHES_MAX
    for i in range(count):
        swift = swift and c[HEAD + WIDTH * i + KIND] <= _GENT
    return swift


@allocating
def film_table(c: np.ndarray, springs: np.ndarray) -> np.ndarray:
    """Return what ``exponential_steps`` reads of the film: (15,).

    Load and field over the inertia, then for each spring its modulus over the inertia, 1/J and 1/T
    (zeros for springs that are missing), then the inertia.
    """
    table = np.zeros(TABLE)
    table[_INERTIA_AT] = c[INERTIA]
    table[0], table[1] = c[FORCE] / c[INERTIA], c[ELECTRIC] / c[INERTIA]
    for i in range(springs.shape[1]):
        table[2 + 3 * i] = springs[MODULUS, i] / c[INERTIA]
        table[3 + 3 * i] = springs[STIFFENING, i]
        table[4 + 3 * i] = springs[RATE, i]
    return table


@jit
def _pull(p: float, q: float, stiffening: float, modulus: float) -> float:
    """True stress over the modulus of a Gent spring, held in width, of squared stretch ``p/q``.

    ``stiffening`` is 1/J, 0 for a neo-Hookean spring. The same as ``true_pull``, multiplied by pq
    above and below: one division in place of three, and no difference of nearly equal numbers.
    """
    d = p - q
    return modulus * d * (p + q) / (p * q - stiffening * d * d)


@inlined
def film_steps(
    acting: int,
    c: np.ndarray,
    memory: np.ndarray,
    table: np.ndarray,
    gives: np.ndarray,
    flows: np.ndarray,
    propagator: np.ndarray,
    y: np.ndarray,
    origin: float,
    v0: float,
    v1: float,
    t0: float,
    warmth: float,
    h: float,
    steps: int,
    stride: int,
    trace: np.ndarray,
) -> None:
    """Take the steps of ``exponential_steps``: one compiled kernel, all of it in registers.

    ``gives`` and ``flows`` are the rows of ``branches``. It carries one film, or a pack of films
    (``dearig.model.compiled.packs``): then ``y``, ``table`` and ``trace`` are rows of packs, and
    ``c`` and ``memory`` are as ``lane_forces`` has them. The films of a pack share ``gives``,
    ``flows`` and ``propagator``, or have their own: rows of packs. The stretches in ``y``, of film
    and branches, are counted from ``origin``.
    """
    # One piece: the stages share some sixty numbers, which calls would send through memory.
    # Sections and names are those of EXPONENTIAL.md: (z, v, i) is u of section 2
    n = len(y) - 2
    load, electric_gain, over = table[0], table[1], table[14]
    m0, g0 = table[2], table[3]
    m1, g1, r1 = table[5], table[6], table[7]
    m2, g2, r2 = table[8], table[9], table[10]
    m3, g3, r3 = table[11], table[12], table[13]
    # section 4: E, (h/2) phi_1 and (h/2)^2 phi_2 over half a step; e^{Lh} on v; weights of N_1, of
    # N_2 + N_3 and of N_4; e^{Lh} on I
    e11, e12, e13 = propagator[0], propagator[1], propagator[2]
    e21, e22, e23 = propagator[3], propagator[4], propagator[5]
    e31, e32, e33 = propagator[6], propagator[7], propagator[8]
    p1, p2, p3 = propagator[9], propagator[10], propagator[11]
    q1, q2, q3 = propagator[12], propagator[13], propagator[14]
    w1, w2, w3 = propagator[15], propagator[16], propagator[17]
    a1, a2, a3 = propagator[18], propagator[19], propagator[20]
    b1, b2, b3 = propagator[21], propagator[22], propagator[23]
    c1, c2, c3 = propagator[24], propagator[25], propagator[26]
    w13, w23, w33 = propagator[27], propagator[28], propagator[29]
    k, d, w, relaxation = (
        propagator[STIFFNESS], propagator[DRAG], propagator[COUPLING], propagator[RELAXATION],
    )  # fmt: skip
    faded_half, faded = propagator[FADED_HALF], propagator[FADED]
    left_half, left = 1.0 - relaxation * faded_half, 1.0 - relaxation * faded
    s1, s2, s3 = flows[0], flows[1], flows[2]
    # I_0 of section 2: at the start of a step the mean of the pulls on the branches, so weighted
    per_mean = -1.0 * propagator[INVERSE_COUPLING] * propagator[INVERSE_RELAXATION]
    i1 = per_mean * gives[0] * r1
    i2 = per_mean * gives[1] * r2
    i3 = per_mean * gives[2] * r3
    l1, l2, l3 = s1 * relaxation, s2 * relaxation, s3 * relaxation
    s1p, s2p, s3p = s1 * p3, s2 * p3, s3 * p3
    # sums of small steps: counted from an origin nearby, they round less
    moved, speed = y[0], y[1]
    moved1 = y[2] if n > 0 else spread(1.0, moved) - origin
    moved2 = y[3] if n > 1 else spread(1.0, moved) - origin
    moved3 = y[4] if n > 2 else spread(1.0, moved) - origin
    lam, x1, x2, x3 = origin + moved, origin + moved1, origin + moved2, origin + moved3
    half, sixth = 0.5 * h, h / 6.0
    per_half = 1.0 / half
    dv = (v1 - v0) / steps
    last, last_but_one, bend = trace[0], trace[1], spread(0.0, moved)
    slow = fast = abs(first_film(speed))
    due = 0
    for m in range(steps):
        va = v0 + dv * m
        vm, vb = va + 0.5 * dv, va + dv
        fa, fm, fb = spread(va * va, lam), spread(vm * vm, lam), spread(vb * vb, lam)
        now, t = spread(va, lam), t0 + m * h
        if acting:
            now, fa = supplied_at_start(acting, c, memory, t, lam, speed, va)

        # stage 1, the start: N_1. Stages are written out: a loop would go through memory
        p = lam * lam
        t1, t2, t3 = (
            _pull(p, x1 * x1, g1, 1.0),
            _pull(p, x2 * x2, g2, 1.0),
            _pull(p, x3 * x3, g3, 1.0),
        )
        inverse = 1.0 / lam
        stress = _pull(p, 1.0, g0, m0 * inverse) + inverse * (m1 * t1 + m2 * t2 + m3 * t3)
        pull = electric_gain * fa * lam
        a = pull - stress
        if acting:
            a = affected(
                acting, c, memory, lam, speed, warmth, lam, 0.0, t, fa, pull, stress, over
            )  # fmt: skip
        a += load
        if m == due:
            due += stride
            bend = larger(bend, a - 2.0 * last + last_but_one)
            last_but_one, last = last, a
        inner = i1 * t1 + i2 * t2 + i3 * t3
        f1, f2, f3 = r1 * t1 + l1 * inner, r2 * t2 + l2 * inner, r3 * t3 + l3 * inner
        first = a + (d * speed - w * inner)

        # stage 2, the middle: u_2 = E u_0 + (h/2) phi_1 N_1 + (h/2)^2 phi_2 R/(h/2)
        bz = e12 * speed + e13 * inner
        bv = e22 * speed + e23 * inner
        bi = e32 * speed + e33 * inner
        if acting:
            grown, gained = bz + p1 * first, bv + p2 * first - speed
            fm, fb = supplied(
                acting, c, memory, t, half, lam, speed, grown, gained, now, va, vm, vb
            )  # fmt: skip
        em, eb = electric_gain * fm, electric_gain * fb
        rise, later = lam * (em - electric_gain * fa), lam * (eb - em)
        slope = rise * per_half
        bz, bv, bi = bz + q1 * slope, bv + q2 * slope, bi + q3 * slope
        change = bi - inner
        h1 = x1 + f1 * faded_half + s1 * change
        h2 = x2 + f2 * faded_half + s2 * change
        h3 = x3 + f3 * faded_half + s3 * change
        z, v, i = bz + p1 * first, bv + p2 * first, bi + p3 * first
        mid_z, mid_v, mid_i = z, v, i
        z1, z2, z3 = h1 + s1p * first, h2 + s2p * first, h3 + s3p * first
        there = (lam + bz) + p1 * first
        p = there * there
        t1, t2, t3 = (
            _pull(p, z1 * z1, g1, 1.0),
            _pull(p, z2 * z2, g2, 1.0),
            _pull(p, z3 * z3, g3, 1.0),
        )
        inverse = 1.0 / there
        stress = _pull(p, 1.0, g0, m0 * inverse) + inverse * (m1 * t1 + m2 * t2 + m3 * t3)
        pull = em * there
        a = pull - stress
        if acting:
            a = affected(
                acting, c, memory, there, v, warmth, lam, half, t, fm, pull, stress, over
            )  # fmt: skip
        second = a + (load + k * z + d * v - w * i)
        flow = z - relaxation * i
        o1 = r1 * t1 - (s1 * flow + f1 * left_half)
        o2 = r2 * t2 - (s2 * flow + f2 * left_half)
        o3 = r3 * t3 - (s3 * flow + f3 * left_half)
        sum_1, sum_2, sum_3 = 2.0 * o1, 2.0 * o2, 2.0 * o3

        # stage 3, the middle: u_3 = E u_0 + (h/2) phi_1 (N_2 - R) + (h/2)^2 phi_2 R/(h/2)
        push = second - rise
        z, v, i = bz + p1 * push, bv + p2 * push, bi + p3 * push
        z1 = (h1 + half * o1) + s1p * push
        z2 = (h2 + half * o2) + s2p * push
        z3 = (h3 + half * o3) + s3p * push
        there = (lam + bz) + p1 * push
        p = there * there
        t1, t2, t3 = (
            _pull(p, z1 * z1, g1, 1.0),
            _pull(p, z2 * z2, g2, 1.0),
            _pull(p, z3 * z3, g3, 1.0),
        )
        inverse = 1.0 / there
        stress = _pull(p, 1.0, g0, m0 * inverse) + inverse * (m1 * t1 + m2 * t2 + m3 * t3)
        pull = em * there
        a = pull - stress
        if acting:
            a = affected(
                acting, c, memory, there, v, warmth, lam, half, t, fm, pull, stress, over
            )  # fmt: skip
        third = a + (load + k * z + d * v - w * i)
        flow = z - relaxation * i
        o1 = r1 * t1 - (s1 * flow + f1 * left_half)
        o2 = r2 * t2 - (s2 * flow + f2 * left_half)
        o3 = r3 * t3 - (s3 * flow + f3 * left_half)
        sum_1, sum_2, sum_3 = sum_1 + 2.0 * o1, sum_2 + 2.0 * o2, sum_3 + 2.0 * o3

        # stage 4, the end: u_4 = E u_2 + (h/2) phi_1 (2 N_3 - N_1 - R) + (h/2)^2 phi_2 R'/(h/2)
        slope = later * per_half
        bz = e11 * mid_z + e12 * mid_v + e13 * mid_i + q1 * slope
        bv = e21 * mid_z + e22 * mid_v + e23 * mid_i + q2 * slope
        bi = e31 * mid_z + e32 * mid_v + e33 * mid_i + q3 * slope
        push = 2.0 * third - (first + rise)
        z, v, i = bz + p1 * push, bv + p2 * push, bi + p3 * push
        change = bi - inner
        z1 = (x1 + s1 * change + f1 * faded + h * o1) + s1p * push
        z2 = (x2 + s2 * change + f2 * faded + h * o2) + s2p * push
        z3 = (x3 + s3 * change + f3 * faded + h * o3) + s3p * push
        there = (lam + bz) + p1 * push
        p = there * there
        t1, t2, t3 = (
            _pull(p, z1 * z1, g1, 1.0),
            _pull(p, z2 * z2, g2, 1.0),
            _pull(p, z3 * z3, g3, 1.0),
        )
        inverse = 1.0 / there
        stress = _pull(p, 1.0, g0, m0 * inverse) + inverse * (m1 * t1 + m2 * t2 + m3 * t3)
        pull = eb * there
        a = pull - stress
        if acting:
            a = affected(
                acting, c, memory, there, v, warmth, lam, h, t, fb, pull, stress, over
            )  # fmt: skip
        fourth = a + (load + k * z + d * v - w * i)
        flow = z - relaxation * i

        # the step: e^{Lh} u_0 + h (weights of N_1, N_2 + N_3, N_4); section 5 for the branches
        lam0, both = lam, second + third
        moved += w1 * speed + w13 * inner + a1 * first + b1 * both + c1 * fourth
        lam = origin + moved
        change = w3 * speed + (w33 - 1.0) * inner + a3 * first + b3 * both + c3 * fourth
        speed = w2 * speed + w23 * inner + a2 * first + b2 * both + c2 * fourth
        if acting:
            rate = abs(first_film(speed))
            slow, fast = min(slow, rate), max(fast, rate)
        if acting & COMMIT:
            commit(acting, c, memory, lam, speed, lam0, h, t)
        moved1 += sixth * (sum_1 + r1 * t1 - (s1 * flow + f1 * left)) + s1 * change + f1 * faded
        moved2 += sixth * (sum_2 + r2 * t2 - (s2 * flow + f2 * left)) + s2 * change + f2 * faded
        moved3 += sixth * (sum_3 + r3 * t3 - (s3 * flow + f3 * left)) + s3 * change + f3 * faded
        x1, x2, x3 = origin + moved1, origin + moved2, origin + moved3
    trace[0], trace[1], trace[2] = last, last_but_one, bend
    trace[3], trace[4] = spread(slow, moved), spread(fast, moved)
    y[0], y[1] = moved, speed
    if n > 0:
        y[2] = moved1
    if n > 1:
        y[3] = moved2
    if n > 2:
        y[4] = moved3


@by_name(
    f"none(int64, {VECTOR}, {VECTOR}, {MATRIX}, {VECTOR}, {VECTOR}, "
    f"{'float64, ' * 5}int64, int64, {VECTOR})"
)
def _steps_with_effects(
    acting: int,
    c: np.ndarray,
    table: np.ndarray,
    branches: np.ndarray,
    propagator: np.ndarray,
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
    n = y.shape[0] - MEMORY
    film_steps(
        acting,
        c, y[n:], table, branches[0], branches[1], propagator, y[:n], 0.0, v0, v1, t0, warmth, h,
        steps, stride, trace,
    )  # fmt: skip


@inlined
def exponential_steps(
    acting: int,
    c: np.ndarray,
    table: np.ndarray,
    branches: np.ndarray,
    propagator: np.ndarray,
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
    """Carry ``y`` by ``steps`` steps of ``h`` s, in place.

    The voltage goes linearly from ``v0`` to ``v1``, ``t0`` s is the time at the beginning.
    ``table`` is ``film_table``'s, ``branches`` is ``network_stiffness``'s, ``propagator`` is of
    this ``h``. Effects are those in ``acting``. ``trace`` (5,) is as ``rk4_steps`` has it, then the
    least and the greatest speed that were met.
    """
    # without effects the step is compiled into its caller: a call would cost as much as a stage
    if acting:
        _steps_with_effects(
            acting,
            c, table, branches, propagator, y, v0, v1, t0, warmth, h, steps, stride, trace,
        )  # fmt: skip
    else:
        n = y.shape[0] - MEMORY
        film_steps(
            0,
            c, y[n:], table, branches[0], branches[1], propagator, y[:n], 0.0, v0, v1, t0, warmth,
            h, steps, stride, trace,
        )  # fmt: skip
