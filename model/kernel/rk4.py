"""Classical Runge-Kutta of order 4, with effects or without."""

from __future__ import annotations

import numpy as np

from dearig.model.coefficients import ELECTRIC, FORCE, HELD, INERTIA, UNIFORM
from dearig.model.compiled.by_name import MATRIX, VECTOR, by_name
from dearig.model.compiled.jit import inlined
from dearig.model.kernel.effect_forces import (
    COMMIT,
    affected,
    commit,
    supplied,
    supplied_at_start,
)
from dearig.model.kernel.motion import rates
from dearig.model.kinematics import electric

__all__ = ["rk4_steps"]

_PLAIN = f"{VECTOR}, {MATRIX}, {VECTOR}, {'float64, ' * 5}int64, int64, {MATRIX}, {VECTOR}"


@inlined
def _slopes(
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
    """As ``motion.rates`` with effects, ``since`` s after the step began at ``t``, ``lam0``."""
    held = int(c[HELD])
    rates(held, int(c[UNIFORM]), c, springs, y, 0.0 if acting else field2, dy)
    if acting:
        maxwell = c[ELECTRIC] * field2 * electric(held, y[0])
        held_back = c[FORCE] - dy[1] * c[INERTIA]
        net = affected(
            acting, c, m, y[0], y[1], warmth, lam0, since, t, field2, maxwell, held_back, 1.0
        )
        dy[1] = (c[FORCE] + net) / c[INERTIA]


@inlined
def _steps(
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
    """Take the steps of ``rk4_steps``."""
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
        lam0, now, ea, em, eb = y[0], va, va * va, vm * vm, vb * vb
        if acting:
            now, ea = supplied_at_start(acting, c, m, t, lam0, y[1], va)
        _slopes(acting, c, springs, y, m, ea, warmth, lam0, 0.0, t, k1)
        if acting:
            grown, gained = half * y[1], half * k1[1]
            em, eb = supplied(acting, c, m, t, half, lam0, y[1], grown, gained, now, va, vm, vb)
        if step % stride == 0:
            trace[2] = max(trace[2], abs(k1[1] - 2.0 * trace[0] + trace[1]))
            trace[1] = trace[0]
            trace[0] = k1[1]
        for j in range(n):
            z[j] = y[j] + half * k1[j]
        _slopes(acting, c, springs, z, m, em, warmth, lam0, half, t, k2)
        for j in range(n):
            z[j] = y[j] + half * k2[j]
        _slopes(acting, c, springs, z, m, em, warmth, lam0, half, t, k3)
        for j in range(n):
            z[j] = y[j] + h * k3[j]
        _slopes(acting, c, springs, z, m, eb, warmth, lam0, h, t, k4)
        for j in range(n):
            y[j] += h / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j])
        if acting & COMMIT:
            commit(acting, c, m, y[0], y[1], lam0, h, t)


@by_name(f"none({_PLAIN})")
def _steps_without_effects(
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
    _steps(0, c, springs, y, v0, v1, t0, warmth, h, steps, stride, work, trace)


@by_name(f"none(int64, {_PLAIN})")
def _steps_with_effects(
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
    _steps(acting, c, springs, y, v0, v1, t0, warmth, h, steps, stride, work, trace)


@inlined
def rk4_steps(
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
    """Carry ``y`` in place by ``steps`` steps of ``h`` s, the voltage going linearly v0 to v1.

    ``t0`` s is the time at the beginning. ``trace`` carries the acceleration at the last two of
    every ``stride`` steps; its third number becomes the largest second difference of these
    accelerations.
    """
    if acting:
        _steps_with_effects(
            acting, c, springs, y, v0, v1, t0, warmth, h, steps, stride, work, trace
        )
    else:
        _steps_without_effects(c, springs, y, v0, v1, t0, warmth, h, steps, stride, work, trace)
