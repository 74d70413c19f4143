"""RODAS on the film: an L-stable Rosenbrock method of order 4 with an error estimate.

Hairer and Wanner, Solving ODEs II, IV.7. The Jacobian is an arrow (each branch knows only lam and
itself), so that a step costs O(n).
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.coefficients import (
    ELECTRIC,
    HELD,
    INERTIA,
    KIND,
    LOCKING,
    MODULUS,
    RATE,
    UNIFORM,
    WIDTH,
)
from dearig.model.compiled.by_name import MATRIX, VECTOR, by_name
from dearig.model.compiled.jit import jit
from dearig.model.film.network import HEAD, branch_count, nominal_pull, nominal_pull_slope, shape_at
from dearig.model.kernel.motion import admissible, rates
from dearig.model.kernel.rodas_coefficients import ALPHA, GAMMA, A, C, D
from dearig.model.kernel.status import NOT_CONVERGED, OK
from dearig.model.kinematics import electric, electric_slope

__all__ = ["LONGEST", "STEPS_OF_RODAS", "cross_by_rodas", "rodas_step"]

LONGEST = 2e-2  #: s, of a step; below that the error estimate rules
STEPS_OF_RODAS = 10  #: explicit steps that take as long as a sample by this method, at least
_TOLERANCE = 5e-9  # in stretch, a step: 0.4 nm on 75 mm
_HALVINGS = 2.0**-17  # of the longest step: a shorter one has not converged


@jit
def _jacobian(
    c: np.ndarray,
    y: np.ndarray,
    v0: float,
    dv_dt: float,
    s: float,
    jvx: np.ndarray,
    jxl: np.ndarray,
    dinv: np.ndarray,
) -> tuple[float, float]:
    """Return d(lam'')/d(lam) in 1/s^2 and d(lam'')/dt in 1/s^3 at ``y`` and voltage ``v0``.

    Filled for each branch: ``jvx`` = d(lam'')/d(xi), ``jxl`` = d(xi')/d(lam), and ``dinv`` =
    1/(``s`` - d(xi')/d(xi)).
    """
    held, lam, mass = int(c[HELD]), y[0], c[INERTIA]
    jvl = c[ELECTRIC] * v0 * v0 * electric_slope(held, lam)
    jvl -= c[HEAD + MODULUS] * nominal_pull_slope(
        held, int(c[HEAD + KIND]), shape_at(c, HEAD), c[HEAD + LOCKING], lam
    )
    for i in range(branch_count(c)):
        k = HEAD + WIDTH * (i + 1)
        inner = 1.0 / y[2 + i]
        e = lam * inner
        kind, shape, locking = int(c[k + KIND]), shape_at(c, k), c[k + LOCKING]
        pull = nominal_pull(held, kind, shape, locking, e)
        bend = nominal_pull_slope(held, kind, shape, locking, e)
        both = pull + e * bend
        jvl -= c[k + MODULUS] * bend * inner * inner
        jvx[i] = c[k + MODULUS] * both * inner * inner / mass
        jxl[i] = c[k + RATE] * both * inner
        dinv[i] = 1.0 / (s + e * jxl[i])
    return jvl / mass, 2.0 * v0 * dv_dt * c[ELECTRIC] * electric(held, lam) / mass


@jit
def rodas_step(
    c: np.ndarray,
    springs: np.ndarray,
    y: np.ndarray,
    v0: float,
    dv: float,
    h: float,
    work: np.ndarray,
    out: np.ndarray,
) -> float:
    """Take one step of ``h`` s from ``y`` into ``out``, the voltage going from ``v0`` by ``dv`` V.

    Returns the error estimate over its tolerance; inf where a stage left the admissible region.
    """
    n = 1 + springs.shape[1]
    branches = n - 2
    s = 1.0 / (h * GAMMA)
    jvx, jxl, dinv = work[12], work[13], work[14]
    jvl, ramp = _jacobian(c, y, v0, dv / h, s, jvx, jxl, dinv)
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
        if not admissible(springs, z):
            return np.inf
        v = v0 + dv * ALPHA[stage]
        rates(int(c[HELD]), int(c[UNIFORM]), c, springs, z, v * v, f)
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
    if not admissible(springs, out):
        return np.inf
    # the rate counts as the stretch it makes within one period of the film
    swing = math.sqrt(max(-jvl, 1.0))
    error = max(abs(last[0]), abs(last[1]) / swing)
    for i in range(branches):
        error = max(error, 0.1 * abs(last[2 + i]))
    return float(error / _TOLERANCE)


@by_name(f"Tuple((int64, float64))({VECTOR}, {MATRIX}, {VECTOR}, {'float64, ' * 4}{MATRIX})")
def cross_by_rodas(
    c: np.ndarray,
    springs: np.ndarray,
    y: np.ndarray,
    v0: float,
    v1: float,
    dt: float,
    h: float,
    work: np.ndarray,
) -> tuple[int, float]:
    """Cross one sample interval ``dt`` in place, starting with step ``h``.

    Returns ``(status, step to try next)``.
    """
    out = work[9]
    done = 0.0
    while done < dt:
        last = done + h >= dt * (1.0 - 1e-12)
        step = dt - done if last else h
        va = v0 + (v1 - v0) * (done / dt)
        error = rodas_step(c, springs, y, va, (v1 - v0) * (step / dt), step, work, out)
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
            if h < LONGEST * _HALVINGS:
                return NOT_CONVERGED, h
    return OK, min(h, LONGEST)
