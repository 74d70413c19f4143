"""The balance of stresses along a measured stretch, without integration.

The equation of motion, read with the stretch given, says which stress the springs must carry:

    sum_i mu_i p_i(lam) = [F + pull(V, lam) - sigma(lam, lam') - (m + m_e) lam''] / s

with the stress sigma, the inertia m_e, the pull and the softening s of the effects in the model.
The right-hand side is linear in nothing, but it needs no moduli: ``dearig.model.diagnosis``
regresses it on the stresses p_i of springs per unit modulus.
"""

from __future__ import annotations

import numpy as np

from dearig.model.coefficients import ELECTRIC, FORCE, HELD, INERTIA
from dearig.model.compiled.jit import allocating, jit
from dearig.model.effects import MEMORY, assembly
from dearig.model.kinematics import electric

__all__ = ["carried_stress", "effect_inertia"]

_supply, _polarise, _permittivity = assembly.supply, assembly.polarise, assembly.permittivity
_soften, _stress, _commit = assembly.soften, assembly.stress, assembly.commit
_inertia, _active, _breathe = assembly.inertia, assembly.active, assembly.breathe

_NEARBY = 1e-6  # of the stretch, over which the slope of the effects' stress is taken


@jit
def effect_inertia(c: np.ndarray, m: np.ndarray) -> float:
    """Return the coefficient of lam'' in kg/m, that of the effects in ``c`` included."""
    return float(c[INERTIA] + _inertia(_active(c), c, m))


@allocating
def carried_stress(
    c: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    motion: np.ndarray,
    carried: np.ndarray,
    slope: np.ndarray,
) -> None:
    """Fill ``carried`` (N,) with the nominal stress in Pa that the springs must carry.

    ``time`` s, ``voltage`` and ``ends`` V are (N,), ``air`` is (2, N) or (2, 0), all as in
    ``drive_by_voltage``. ``motion`` (3, N) is the stretch, its rate in 1/s and its acceleration in
    1/s^2. ``c`` must know the stretch at rest. ``slope`` (N,) is filled with the derivative in Pa
    of the effects' stress with respect to the stretch; it may be (0,) where it is not needed.
    """
    held, acting = int(c[HELD]), _active(c)
    m = np.zeros(MEMORY)
    inertia = c[INERTIA] + _inertia(acting, c, m)
    warm, sloped = air.shape[1] == time.shape[0], slope.shape[0] == time.shape[0]
    before, speed, t, h = motion[0, 0], motion[1, 0], time[0], 0.0
    last, end, now = voltage[0], voltage[0], 0.0
    for k in range(time.shape[0]):
        lam, rate = motion[0, k], motion[1, k]
        if k:
            t, h = time[k - 1], time[k] - time[k - 1]
            last, end = voltage[k - 1], ends[k - 1]
            if warm and acting:
                _breathe(acting, c, m, air[0, k - 1], air[1, k - 1], h)
        if acting == 0:
            field2 = voltage[k] * voltage[k] if k == 0 else end * end
        else:
            now, _ = _supply(acting, c, m, t, last, last, 0.0, before, speed)
            middle, mean = 0.5 * (before + lam), 0.5 * (speed + rate)
            _, end = _supply(acting, c, m, t, last, end, h, middle, mean)
            _, more = _polarise(acting, c, m, now, end, h)
            field2 = end * end + more
        pull = c[ELECTRIC] * field2 * electric(held, lam)
        pull *= _permittivity(acting, c, m, lam, field2)
        stress = _stress(acting, c, m, lam, rate, before, h, t)
        if sloped:
            d = _NEARBY * lam
            up = _stress(acting, c, m, lam + d, rate, before, h, t)
            down = _stress(acting, c, m, lam - d, rate, before, h, t)
            slope[k] = 0.5 * (up - down) / d
        soft = _soften(acting, c, m, lam, h, t, air[0, k] if warm else 0.0)
        carried[k] = (c[FORCE] + pull - inertia * motion[2, k] - stress) / soft
        if k:
            _commit(acting, c, m, lam, rate, before, h, t)
        before, speed = lam, rate
