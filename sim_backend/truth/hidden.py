"""Parameters of the hidden effects within the equation of motion."""

from __future__ import annotations

import math
from typing import NamedTuple

from dearig.sim_backend.truth import generator_b_laws

__all__ = ["Hidden"]


class Hidden(NamedTuple):
    """Parameters of the effects within the equation of motion; the defaults have no influence.

    The files of ``effects`` give formulas and sources. Lengths are given as stretches (of L1),
    forces as nominal stresses.
    """

    # drag: (linear + quadratic |r| + power |r|^1/2) r for the rate r = lam'; Pa s, Pa s^2, Pa s^1.5
    drag: float = 0.0
    drag_quadratic: float = 0.0
    drag_power: float = 0.0
    # friction of bristles: Coulomb and static stress Pa, Stribeck rate 1/s and power (0: as a
    # contact in oil eases), the bristles' reach, their damping Pa s, and the share of the reach
    # within which they do not slip
    friction: float = 0.0
    friction_static: float = 0.0
    friction_stribeck: float = 1.0
    friction_easing: float = 2.0
    friction_reach: float = 1.0
    friction_damping: float = 0.0
    friction_elastic: float = 0.0
    # Bouc-Wen: saturated stress Pa, reach, exponent, share of what opens the loop
    bouc: float = 0.0
    bouc_reach: float = 1.0
    bouc_exponent: float = 1.0
    bouc_share: float = 0.5
    # electrode: resistances of two sections in ohm (one if the second is 0), growth with stretch
    ladder_1: float = 0.0
    ladder_2: float = 0.0
    ladder_gauge: float = 0.0
    # leakage behind a series resistance in ohm: conductance S; exponent of Poole and Frenkel
    # in V^-1/2 or, when above 0, of hopping in 1/V, the voltage of space charge, or that of
    # tunnelling
    leak_series: float = 0.0
    leak_conductance: float = 0.0
    leak_frenkel: float = 0.0
    leak_hopping: float = 0.0
    leak_space: float = 0.0
    leak_tunnel: float = 0.0
    # permittivity: share gained at large strain, reach; inverse square of a voltage
    permittivity_strain: float = 0.0
    permittivity_reach: float = 1.0
    permittivity_field: float = 0.0
    # softening: share lost to the largest stretch so far, reach, exponent; to the path, reach
    damage: float = 0.0
    damage_reach: float = 1.0
    damage_exponent: float = 1.0
    ageing: float = 0.0
    ageing_reach: float = 1.0
    # self-heating: K/s for each V^2, time constant s, share of the second body and its time
    # constant s, relative change of moduli per K
    heat: float = 0.0
    heat_time: float = 1.0
    heat_share: float = 0.0
    heat_time_2: float = 1.0
    heat_stiffness: float = 0.0
    # end stop: travel beyond rest, Pa at a depth of 1, damping s
    stop_travel: float = math.inf
    stop_stiffness: float = 0.0
    stop_damping: float = 0.0
    # mass on a spring: kg/m as the film's inertia, angular frequency 1/s, damping ratio
    second_inertia: float = 0.0
    second_frequency: float = 0.0
    second_damping: float = 0.0
    # laws of generator B
    further: generator_b_laws.Second = generator_b_laws.NOTHING
