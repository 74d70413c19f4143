"""Circuit of the film: the hidden electrical laws, and voltage, charge and current by them.

The laws that pull the film are here too, so that the currents follow from the same ones. In series
from the amplifier to the film: a resistance behind which the film leaks, the electrode, the film.
With the stretch lam, the charge of a film of constrained width is C_0 lam^2 eps V, in which eps is
the factor on the permittivity; where the polarisation lags, V is replaced by what is polarised.

The electrode's law charges the film without this factor, so an electrode of resistance R in a film
whose permittivity changes by it acts as one of R/eps.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.compiled.jit import jit
from dearig.sim_backend.truth.generator_b_laws import (
    electrode_charging,
    permittivity_factor,
    trap_leak,
)
from dearig.sim_backend.truth.hidden import Hidden

__all__ = ["behind_leak", "electricity", "leak", "permittivity"]


@jit
def leak(h: Hidden, v: float, lam: float) -> tuple[float, float]:
    """Return the current in A through the film under ``v`` >= 0 V, and its slope in S."""
    if h.leak_hopping > 0.0:
        k = h.leak_hopping * lam
        return h.leak_conductance / k * math.sinh(k * v), h.leak_conductance * math.cosh(k * v)
    if h.leak_space > 0.0:
        slope = h.leak_conductance * lam**4 / h.leak_space
        return slope * v * v, 2.0 * slope * v
    if h.further.trap_voltage > 0.0:
        return trap_leak(h.further, h.leak_conductance, v, lam)
    if h.leak_tunnel > 0.0:
        if v <= 0.0:
            return 0.0, 0.0
        barrier = h.leak_tunnel / (v * lam)
        current = h.leak_conductance * v * v / h.leak_tunnel * math.exp(-barrier)
        return current, current * (2.0 + barrier) / v
    root = h.leak_frenkel * math.sqrt(v * lam)
    conductance = h.leak_conductance * math.exp(root)
    return conductance * v, conductance * (1.0 + 0.5 * root)


@jit
def behind_leak(h: Hidden, voltage: float, lam: float) -> float:
    """Return the voltage at the film behind the series resistance, under ``voltage``."""
    source = abs(voltage)
    v = source
    for _ in range(30):  # the current is convex: Newton's steps decrease without overshoot
        current, slope = leak(h, v, lam)
        change = (v + h.leak_series * current - source) / (1.0 + h.leak_series * slope)
        v = max(v - change, 0.0)
        if abs(change) < 1e-9 * source:
            break
    return math.copysign(v, voltage)


@jit
def permittivity(h: Hidden, square: float, lam: float, rest: float) -> float:
    """Return the factor on the permittivity under a voltage whose square is ``square`` V^2."""
    factor = permittivity_factor(h.further, square, lam, rest)
    if h.permittivity_strain != 0.0:
        u = (lam - rest) / h.permittivity_reach
        factor *= 1.0 + h.permittivity_strain * u / math.sqrt(1.0 + u * u)
    return factor / (1.0 + h.permittivity_field * square * lam * lam)


@jit
def _effective(voltage: float, bound: float) -> float:
    """Return the V of the Maxwell stress, whose square is ``voltage`` times ``bound``."""
    if voltage == bound:
        return voltage
    return math.copysign(math.sqrt(max(voltage * bound, 0.0)), voltage)


@jit
def _into_electrode(h: Hidden, gap: float, away: float) -> float:
    """Return the current in A into the electrode's first section across ``gap`` V."""
    if h.further.contact > 0.0:
        return electrode_charging(h.further, gap, away)
    return gap / (h.ladder_1 * math.exp(h.ladder_gauge * away))


@jit
def _slowness(h: Hidden, capacitance: float, away: float) -> float:
    """Return the mean delay in s with which charge reaches the film through the electrode."""
    beyond = 0.25 * h.ladder_2 * math.exp(h.ladder_gauge * away)  # half of the charge, half as far
    return capacitance * (1.0 / _into_electrode(h, 1.0, away) + beyond)


@jit
def electricity(
    h: Hidden,
    capacitance: float,
    rest: float,
    time: np.ndarray,
    rows: np.ndarray,
    supply: np.ndarray,
    joined: np.ndarray,
    electric: np.ndarray,
    area: np.ndarray,
    state: np.ndarray,
    ends: np.ndarray,
    step: np.ndarray,
) -> None:
    """Compute the circuit along a motion in the N - 1 intervals between ``time`` (N,) s.

    ``capacitance`` F is that of the unstretched film, ``rest`` the stretch at rest. ``rows`` (5, N)
    are those of ``film.follow``. ``supply`` (6, N) are first, last, bound (2) and creep (2) of
    ``Supply``, ``joined`` (N,) is its. ``electric`` and ``area`` (N,) are factors of a course.
    ``state`` (2,) has the charge in C at node 0 on an electrode of full area, and the V by which
    the polarisation behind an electrode differs from its voltage; it is updated in place. Fills
    ``ends`` (4, 2, N - 1): voltage, charge, charging current, conduction, at both ends; and
    ``step`` (N - 1,); see ``plant.Electricity``.
    """
    # One piece: both ends of an interval share the terms of the circuit
    has_electrode = h.ladder_1 > 0.0 or h.further.contact > 0.0
    leaks = h.leak_conductance > 0.0
    before, excess = state[0], state[1]
    for k in range(time.shape[0] - 1):
        elapsed = time[k + 1] - time[k]
        apart = 0.0
        for end in range(2):
            lam = rows[0, k + end]
            c = capacitance * lam * lam
            growth = 2.0 * rows[1, k + end] / lam
            voltage, bound = supply[end, k], supply[2 + end, k]
            drive = _effective(voltage, bound)
            behind, lost, conduction = drive, 1.0, 0.0
            if leaks:
                behind = behind_leak(h, drive, lam)
                if drive != 0.0:
                    lost = behind / drive
                conduction = math.copysign(leak(h, abs(behind), lam)[0], behind)
            weight = electric[k] * area[k]
            if has_electrode:
                first, second = rows[3, k + end], rows[4, k + end]
                there, square = first, first * first
                if h.ladder_2 > 0.0:
                    there, square = 0.5 * (first + second), 0.5 * (square + second * second)
                weight *= permittivity(h, square, lam, rest)
                if bound != voltage:
                    # to first order: what the dielectric binds beyond the voltage lags alike
                    if end == 1:
                        wanted = 0.5 * (apart + bound - drive)
                        left = math.exp(-elapsed / _slowness(h, c, lam - rest))
                        excess = wanted + (excess - wanted) * left
                    apart = bound - drive
                else:
                    excess = 0.0
                charge = c * weight * (there + excess)
                ends[0, end, k] = there
                ends[2, end, k] = weight * _into_electrode(h, behind - first, lam - rest)
            else:
                weight *= permittivity(h, behind * behind, lam, rest) * lost
                charge = c * weight * bound
                ends[0, end, k] = voltage * lost
                ends[2, end, k] = c * weight * (supply[4 + end, k] + growth * bound)
            ends[1, end, k] = charge
            ends[3, end, k] = conduction
            if end == 0:
                step[k] = charge - before * area[k] if joined[k] else 0.0
                start = weight
            else:
                before = charge / area[k]
                change = (weight - start) / elapsed
                for at in range(2):
                    ends[2, at, k] += ends[1, at, k] * change / weight
    state[0], state[1] = before, excess
