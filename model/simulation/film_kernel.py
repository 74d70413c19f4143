"""Integrate the branches of a film whose stretch is imposed, compiled.

With the stretch given there is no equation of motion: each branch is one scalar equation,
dxi/dt = (1/T) P(lam(t)/xi) (eq. 40). It is solved from sample to sample; the stretch is linear in
between. The method is RODAS, as for the stiff actuator, with steps by its error estimate. It is
L-stable: a relaxation of milliseconds within a sample of a second is not a difficulty.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.coefficients import HELD, KIND, LOCKING, RATE, WIDTH
from dearig.model.compiled.jit import allocating, jit
from dearig.model.effects import assembly
from dearig.model.film.network import (
    HEAD,
    branch_count,
    nominal_pull,
    nominal_pull_slope,
    shape_at,
    true_pull,
)
from dearig.model.kernel import BAD_INPUT, LOCKED, NOT_CONVERGED, OK
from dearig.model.kernel.rodas_coefficients import ALPHA, GAMMA, A, C, D
from dearig.model.kinematics import strain_and_pull
from dearig.model.springs import Shape

__all__ = ["add_effects", "drive_by_stretch"]

_TOLERANCE = 1e-7  # relative, in the inner stretch: 0.01 Pa on a modulus of 100 kPa
_NOT_STIFF = 0.1  # relaxation within one interval below which a branch is not stiff
_SMALLEST_PART = 1e-9  # of a sample interval

_soften, _stress = assembly.soften, assembly.stress
_commit, _felt, _acting = assembly.commit, assembly.measured_stress, assembly.active


@jit
def _flow(held: int, kind: int, shape: Shape, rate: float, lam: float, xi: float) -> float:
    """Flow of a branch d(xi)/dt in 1/s at stretch ``lam`` and inner stretch ``xi``."""
    s = (lam / xi) ** 2
    return rate * true_pull(held, kind, shape, s, 1.0 / s)


@jit
def _cross(
    held: int,
    kind: int,
    shape: Shape,
    locking: float,
    rate: float,
    xi: float,
    lam0: float,
    lam1: float,
    dt: float,
    first: float,
    u: np.ndarray,
) -> tuple[int, float, float]:
    """Carry one branch across one interval; ``first`` is the part of it to try first.

    Returns (status, xi, part of the next interval to try).
    """
    farthest, _ = strain_and_pull(held, (lam1 / xi) ** 2, (xi / lam1) ** 2)
    slow = rate * nominal_pull_slope(held, kind, shape, locking, lam0 / xi) * dt < _NOT_STIFF
    if slow and farthest < 0.5 * locking:
        # slow against the interval: one Runge-Kutta step is exact enough, and four times as quick
        middle = 0.5 * (lam0 + lam1)
        k1 = _flow(held, kind, shape, rate, lam0, xi)
        k2 = _flow(held, kind, shape, rate, middle, xi + 0.5 * dt * k1)
        k3 = _flow(held, kind, shape, rate, middle, xi + 0.5 * dt * k2)
        k4 = _flow(held, kind, shape, rate, lam1, xi + dt * k3)
        stepped = xi + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        if stepped > 0.0 and math.isfinite(stepped):
            return OK, stepped, first
    done = 0.0
    part = min(first, 1.0)
    while done < 1.0:
        last = done + part >= 1.0 - 1e-12
        step = 1.0 - done if last else part
        h = step * dt
        lam = lam0 + (lam1 - lam0) * done
        e = lam / xi
        bend = nominal_pull_slope(held, kind, shape, locking, e)
        both = nominal_pull(held, kind, shape, locking, e) + e * bend
        slope_lam = rate * both / xi
        slope_xi = -e * slope_lam
        ramp = slope_lam * (lam1 - lam0) / dt
        inverse = 1.0 / (1.0 / (h * GAMMA) - slope_xi)
        z = xi
        good = math.isfinite(inverse)
        for stage in range(6):
            if stage < 5:
                z = xi
                for m in range(stage):
                    z += A[stage, m] * u[m]
            else:
                z += u[4]
            there = lam + (lam1 - lam0) * step * ALPHA[stage]
            good = good and z > 0.0
            if good:
                s = (there / z) ** 2
                strain, _ = strain_and_pull(held, s, 1.0 / s)
                good = strain < locking
            if not good:
                break
            f = _flow(held, kind, shape, rate, there, z) + h * D[stage] * ramp
            for m in range(stage):
                f += C[stage, m] / h * u[m]
            u[stage] = f * inverse
        error = abs(u[5]) / (_TOLERANCE * xi) if good else np.inf
        if good and error <= 1.0 and z + u[5] > 0.0:
            xi = z + u[5]
            done += step
            grow = min(max(0.9 * max(error, 1e-4) ** -0.25, 0.3), 5.0)
            part = max(part, step * grow) if last else step * grow
        else:
            part = step * (max(0.2, 0.9 * error**-0.25) if math.isfinite(error) else 0.2)
            if part < _SMALLEST_PART:
                return NOT_CONVERGED, xi, part
    return OK, xi, part


@allocating
def drive_by_stretch(
    c: np.ndarray, time: np.ndarray, stretch: np.ndarray, xi: np.ndarray, parts: np.ndarray
) -> tuple[int, int]:
    """Compute the nominal stress of each spring over its modulus under a ``stretch`` (N,).

    ``time`` (N,) s increases, not necessarily evenly. ``parts`` (1 + n, N) is filled: the nominal
    stress of the film is the moduli times it. ``xi`` (n,) are the inner stretches at the first
    sample, carried along in place. Returns ``(status, reached)``; from ``reached`` on the last
    column is repeated, never NaN.
    """
    held = int(c[HELD])
    samples = time.shape[0]
    springs = branch_count(c) + 1
    u = np.zeros(6)
    part = np.ones(springs)
    status, reached = OK, samples
    for k in range(samples):
        lam = stretch[k]
        dt = time[k] - time[k - 1] if k else 1.0
        if not (0.0 < lam < 1e3 and dt > 0.0 and math.isfinite(dt)):
            status, reached = BAD_INPUT, k
            break
        for i in range(springs):
            j = HEAD + WIDTH * i
            kind, shape, locking = int(c[j + KIND]), shape_at(c, j), c[j + LOCKING]
            e = lam
            if i:
                if k:
                    status, xi[i - 1], part[i] = _cross(
                        held, kind, shape, locking, c[j + RATE],
                        xi[i - 1], stretch[k - 1], lam, dt, part[i], u,
                    )  # fmt: skip
                e = lam / xi[i - 1]
            s = e * e
            strain, _ = strain_and_pull(held, s, 1.0 / s)
            if status == OK and not strain < locking:
                status = LOCKED
            if status != OK:
                break
            parts[i, k] = true_pull(held, kind, shape, s, 1.0 / s) / lam
        if status != OK:
            reached = k
            break
    for k in range(reached, samples):
        for i in range(springs):
            parts[i, k] = parts[i, reached - 1] if reached > 0 else 0.0
    return status, reached


@jit
def add_effects(
    c: np.ndarray, time: np.ndarray, stretch: np.ndarray, memory: np.ndarray, stress: np.ndarray
) -> None:
    """Turn the network's nominal ``stress`` (N,) Pa, in place, into that of a film with effects.

    ``memory`` (MEMORY,) is carried along; ``c`` must know the stretch at rest.
    """
    acting = _acting(c)
    for k in range(time.shape[0]):
        before, dt, rate = stretch[k], 0.0, 0.0
        t = time[k]
        if k:
            before, dt = stretch[k - 1], time[k] - time[k - 1]
            rate, t = (stretch[k] - before) / dt, time[k - 1]
        total = stress[k] * _soften(acting, c, memory, stretch[k], dt, t, 0.0)
        total += _stress(acting, c, memory, stretch[k], rate, before, dt, t)
        if k:
            _commit(acting, c, memory, stretch[k], rate, before, dt, t)
        stress[k] = _felt(acting, c, memory, total)
