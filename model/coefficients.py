"""Layout of the coefficient vector that every kernel reads.

A parameter set is one row, so that a population is a matrix. It holds the numbers of the film and
its load, the values of all effects (neutral unless a model says otherwise), then ``WIDTH`` numbers
for each spring, the equilibrium spring first. ``dearig.model.film.network.HEAD`` is where these
begin.
"""

from __future__ import annotations

__all__ = [
    "AIR_HUMIDITY",
    "AIR_TEMPERATURE",
    "CAPACITANCE",
    "EFFECTS_AT",
    "ELECTRIC",
    "FORCE",
    "HELD",
    "INERTIA",
    "KIND",
    "LENGTH",
    "LIMIT",
    "LOCKING",
    "MODULUS",
    "RATE",
    "REST",
    "SECTION",
    "SHAPE",
    "THICKNESS",
    "UNIFORM",
    "WIDTH",
]

HELD = 0  #: code of the kinematics
INERTIA = 1  #: kg/m: the coefficient of lam'' in the motion equation (a stress per lam'')
FORCE = 2  #: Pa: nominal stress of the hanging load, F/(L2 Z)
ELECTRIC = 3  #: Pa/V^2: eps/Z^2
UNIFORM = 4  #: code of the strain energy that all springs share, or -1
LENGTH = 5  #: m: L1
SECTION = 6  #: m^2: L2 Z
THICKNESS = 7  #: m: Z
CAPACITANCE = 8  #: F: of the film before it is stretched
REST = 9  #: stretch at rest, from which effects count; filled in before a kernel starts
AIR_TEMPERATURE = 10  #: K: of the air as the record began, less ``environment.CELSIUS``; or 0
AIR_HUMIDITY = 11  #: relative humidity then, less ``environment.HUMIDITY``; 0 where not known
EFFECTS_AT = 12  #: where the values of the effects begin

# each spring
KIND = 0  #: code of the strain energy
MODULUS = 1  #: Pa
LIMIT = 2  #: J or n
LOCKING = 3  #: I1 - 3 where it locks
RATE = 4  #: 1/T in 1/s; of no meaning for the equilibrium spring
SHAPE = 5  #: further parameters of the strain energy, up to three
WIDTH = 8
