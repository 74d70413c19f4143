"""Constitutive laws of generator B: compiled terms of the film's equation of motion.

These forms are published elsewhere and are in neither ``dearig.model.effects`` nor generator A.
The files of ``generator_b`` draw their numbers and give the sources. ``film`` calls the functions
here at the places where they act.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dearig.model.compiled.jit import jit

__all__ = [
    "NOTHING",
    "STATES",
    "Second",
    "added_stress",
    "electrode_charging",
    "fastest_decay",
    "healed",
    "permittivity_factor",
    "trap_leak",
    "warming",
    "wholeness",
]


class Second(NamedTuple):
    """Parameters of generator B's laws; the defaults have no influence.

    Lengths are given as stretches (of L1), forces as nominal stresses.
    """

    # viscoplastic element: spring Pa, yield stress Pa, strain rate 1/s at twice the yield stress
    # and its exponent (Perzyna); or, above 0, the limiting rate 1/s of Bodner and Partom
    flow_spring: float = 0.0
    flow_yield: float = 1.0
    flow_rate: float = 0.0
    flow_exponent: float = 1.0
    flow_limit: float = 0.0
    # Bergstrom and Boyce: spring Pa, strain rate 1/s at the stress Pa, exponent of the stress
    chain_spring: float = 0.0
    chain_rate: float = 0.0
    chain_stress: float = 1.0
    chain_exponent: float = 1.0
    # Coleman and Hodgdon: stress Pa, reach, slope share, level and width of its centre line
    duhem: float = 0.0
    duhem_reach: float = 1.0
    duhem_slope: float = 1.0
    duhem_level: float = 0.0
    duhem_width: float = 1.0
    # drag: Carreau (Pa s, rate 1/s, exponent) and Schiller and Naumann (Pa s, rate 1/s)
    carreau: float = 0.0
    carreau_rate: float = 1.0
    carreau_exponent: float = 1.0
    naumann: float = 0.0
    naumann_rate: float = 1.0
    # friction of Makkar: Coulomb stress Pa, rate 1/s of its rise, excess share and its rate 1/s
    makkar: float = 0.0
    makkar_rise: float = 1.0
    makkar_excess: float = 0.0
    makkar_fall: float = 1.0
    # softening by the largest stretch so far, which heals with a time in s (0: never): erf of Ogden
    # and Roxburgh (share, width), exponential of Simo (share, strain)
    heal_time: float = 0.0
    roxburgh: float = 0.0
    roxburgh_width: float = 1.0
    simo: float = 0.0
    simo_strain: float = 1.0
    # permittivity: Booth (share that saturates, 1/V^2), Johnson (1/V^2), slope and bend in stretch
    booth: float = 0.0
    booth_square: float = 1.0
    johnson: float = 0.0
    peak_slope: float = 0.0
    peak_bend: float = 0.0
    # self-heating with natural convection: K/s for each V^2, 1/s at 1 K, change of moduli per K
    convection_heat: float = 0.0
    convection_rate: float = 0.0
    convection_stiffness: float = 0.0
    # electrode: ohm, slope and bend in stretch, voltage of its contacts (0: ohmic)
    contact: float = 0.0
    contact_slope: float = 0.0
    contact_bend: float = 0.0
    contact_voltage: float = 0.0
    # leakage with traps (Mark and Helfrich): crossover voltage and exponent
    trap_voltage: float = 0.0
    trap_exponent: float = 1.0
    # inertia that changes by this share for a stretch of 1
    lever: float = 0.0
    # attracting magnet: nominal stress Pa at rest, gap
    magnet: float = 0.0
    magnet_gap: float = 1.0


NOTHING = Second()

#: State variables behind those of the film: elastic strains of the viscoplastic element and of the
#: nonlinear branch, the loop's variable.
STATES = 3
_FLOW, _CHAIN, _LOOP = range(STATES)

_CHAIN_FLOOR = 0.01  # keeps the first flow of Bergstrom and Boyce finite
_CONVECTION = 0.25  # laminar natural convection: heat flow grows with the power 1.25 (McAdams 1954)
_NAUMANN = (0.15, 0.687)  # Schiller and Naumann 1933
_LITTLE = 1e-4  # argument of Booth's function below which its series is exact


@jit
def _strain(lam: float) -> float:
    """Return the strain energy over the modulus of a neo-Hookean film with its width held."""
    return 0.5 * (lam * lam + 1.0 / (lam * lam)) - 1.0


@jit
def _flow(s: Second, stress: float) -> float:
    """Return the plastic strain rate in 1/s of the viscoplastic element under ``stress`` Pa."""
    size = abs(stress)
    if s.flow_limit > 0.0:
        if size < 0.02 * s.flow_yield:
            return 0.0
        resisted = (s.flow_yield / size) ** (2.0 * s.flow_exponent)
        return math.copysign(s.flow_limit * math.exp(-0.5 * resisted), stress)
    over = size / s.flow_yield - 1.0
    if over <= 0.0:
        return 0.0
    return math.copysign(s.flow_rate * over**s.flow_exponent, stress)


@jit
def added_stress(
    s: Second, y: np.ndarray, at: int, lam: float, rate: float, rest: float, dy: np.ndarray
) -> float:
    """Return the nominal stress in Pa against the motion; fills ``dy`` from ``at`` on."""
    for j in range(at, at + STATES):
        dy[j] = 0.0
    stress, away, strain_rate = 0.0, lam - rest, rate / lam
    if s.flow_spring > 0.0:
        held = s.flow_spring * y[at + _FLOW]
        stress += held / lam
        dy[at + _FLOW] = strain_rate - _flow(s, held)
    if s.chain_spring > 0.0:
        elastic = y[at + _CHAIN]
        held = s.chain_spring * math.sinh(2.0 * elastic)
        stress += held / lam
        inelastic = math.log(lam / rest) - elastic
        chain = math.sqrt((2.0 * math.cosh(2.0 * inelastic) + 1.0) / 3.0) - 1.0 + _CHAIN_FLOOR
        speed = s.chain_rate * (abs(held) / s.chain_stress) ** s.chain_exponent
        dy[at + _CHAIN] = strain_rate - math.copysign(speed * _CHAIN_FLOOR / chain, held)
    if s.duhem > 0.0:
        centre = s.duhem_level * math.tanh(away / s.duhem_width)
        towards = abs(rate) * (centre - y[at + _LOOP])
        dy[at + _LOOP] = (towards + s.duhem_slope * rate) / s.duhem_reach
        stress += s.duhem * y[at + _LOOP]
    if s.carreau > 0.0:
        ratio = rate / s.carreau_rate
        stress += s.carreau * (1.0 + ratio * ratio) ** (0.5 * (s.carreau_exponent - 1.0)) * rate
    if s.naumann > 0.0:
        stress += s.naumann * rate * (1.0 + _NAUMANN[0] * abs(rate / s.naumann_rate) ** _NAUMANN[1])
    if s.makkar > 0.0:
        rise = math.tanh(rate / s.makkar_rise)
        stress += s.makkar * (rise + s.makkar_excess * (rise - math.tanh(rate / s.makkar_fall)))
    if s.magnet > 0.0:
        nearer = 1.0 - away / s.magnet_gap
        stress -= s.magnet * (1.0 / (nearer * nearer) - 1.0)
    return stress


@jit
def healed(s: Second, largest: float, lam: float, elapsed: float) -> float:
    """Return the largest stretch after a step of ``elapsed`` s that ends at ``lam``."""
    if s.heal_time > 0.0 and largest > lam:
        return lam + (largest - lam) * math.exp(-elapsed / s.heal_time)
    return max(largest, lam)


@jit
def wholeness(s: Second, farthest: float, lam: float, rest: float) -> float:
    """Return the factor on the equilibrium spring after a largest stretch of ``farthest``."""
    if s.roxburgh == 0.0 and s.simo == 0.0:
        return 1.0
    now = max(_strain(lam) - _strain(rest), 0.0)
    largest = max(_strain(farthest) - _strain(rest), now)
    whole = 1.0
    if s.roxburgh > 0.0:
        whole -= s.roxburgh * math.erf((largest - now) / s.roxburgh_width)
    if s.simo > 0.0:
        whole += s.simo * math.expm1(-largest / s.simo_strain)
    return whole


@jit
def permittivity_factor(s: Second, square: float, lam: float, rest: float) -> float:
    """Return the factor on the permittivity under a voltage whose square is ``square`` V^2."""
    field2, away = square * lam * lam, lam - rest
    factor = 1.0 + s.peak_slope * away + s.peak_bend * away * away
    if s.booth > 0.0:
        u2 = field2 / s.booth_square
        if u2 < _LITTLE:
            part = 1.0 - u2 / 15.0
        else:
            u = math.sqrt(u2)
            part = 3.0 / u * (1.0 / math.tanh(u) - 1.0 / u)
        factor *= 1.0 - s.booth + s.booth * part
    if s.johnson > 0.0:
        factor *= (1.0 + 3.0 * s.johnson * field2) ** (-1.0 / 3.0)
    return factor


@jit
def warming(s: Second, square: float, warm: float) -> float:
    """Return the rate in K/s at which the film warms from ``warm`` K above the room."""
    lost: float = s.convection_rate * abs(warm) ** _CONVECTION * warm
    return s.convection_heat * square - lost


@jit
def electrode_charging(s: Second, gap: float, away: float) -> float:
    """Return the current in A through the electrode across which ``gap`` V lie."""
    resistance = s.contact * (1.0 + s.contact_slope * away + s.contact_bend * away * away)
    if s.contact_voltage > 0.0:
        return s.contact_voltage * math.sinh(gap / s.contact_voltage) / resistance
    return gap / resistance


@jit
def trap_leak(s: Second, conductance: float, v: float, lam: float) -> tuple[float, float]:
    """Return the current in A under ``v`` >= 0 V, and its slope in S."""
    filled = (v * lam / s.trap_voltage) ** s.trap_exponent
    return conductance * v * (1.0 + filled), conductance * (1.0 + (1.0 + s.trap_exponent) * filled)


@jit
def fastest_decay(s: Second, rate: float) -> float:
    """Return the largest slope in Pa s of drag and friction up to ``rate``; it limits the step."""
    slope: float = s.carreau + s.naumann * (
        1.0 + 2.0 * _NAUMANN[0] * (rate / s.naumann_rate) ** _NAUMANN[1]
    )
    return slope + s.makkar * (1.0 + s.makkar_excess) / s.makkar_rise
