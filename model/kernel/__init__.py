"""Integrate the motion of the film under voltage (thesis eq. 48), compiled.

State ``y`` = [lam, dlam/dt, xi_1 .. xi_n], then the memory of the effects. The kernel steps from
sample to sample of the record, so that its grid and the record's agree exactly. Within one sample
interval it takes as many equal steps as the accuracy needs. There are three methods:

* ``exponential_rk``: exponential Runge-Kutta of order 4 for the thesis's film (width held, Gent or
  neo-Hookean springs, three branches at most). The linear part of the motion is in closed form: the
  film's oscillation, the relaxation of the branches and a drag. A drag may be as strong as it
  likes; only what is nonlinear limits the step. ``EXPONENTIAL.md`` next to this package derives it.
* ``rk4``: classical Runge-Kutta of order 4 for other films that are not stiff for the record's
  sample interval.
* ``rodas``: RODAS, an L-stable Rosenbrock method of order 4 with an error estimate, for stiff
  films: moduli of MPa, relaxation times of microseconds, springs near locking.

The first two take finer steps while the film rings after a jump of the voltage. Its free
oscillation at 70 Hz lasts for tens of cycles, and every step adds to the error of its phase.

Effects of ``dearig.model.effects`` take part through the hooks of ``effects.assembly``. Their
internal states (a voltage behind a resistance, the strain of a yielding element) advance from step
to step in closed form, so that no effect makes the film stiffer than its own stress does.

The method and the steps follow from the film's stiffness, its effects and the drive, never from
measured data: a fit sees a smooth function of the parameters. Nothing here raises an exception:
every outcome is a status.
"""

from __future__ import annotations

from dearig.model.kernel.drive import drive_by_voltage
from dearig.model.kernel.exponential_rk import is_swift
from dearig.model.kernel.population import read_members, read_population
from dearig.model.kernel.rest import rest_stretch
from dearig.model.kernel.sensor import read_sensor
from dearig.model.kernel.status import (
    BAD_INPUT,
    CAREFUL,
    COARSE,
    LOCKED,
    NO_REST,
    NOT_CONVERGED,
    OK,
    PULL_IN,
    QUICK,
    ROUGH,
)

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
    "read_members",
    "read_population",
    "read_sensor",
    "rest_stretch",
]
