"""The film under voltage or stretch, written from thesis eq. 48 for SciPy: the tests' oracle.

Nothing here comes from the kernels: the springs' derivatives, the three kinematics and the motion
equation are written out again in their plainest form (compiled, because SciPy calls them some
hundred thousand times a test).
"""

import math

import numba
import numpy as np
from scipy.integrate import odeint
from scipy.optimize import brentq

from dearig.model.film.material import STANDARD_GRAVITY, VACUUM_PERMITTIVITY


def langevin_inverse(x):
    """Inverse Langevin function by bisection: slow, but certain."""
    low, high = 0.0, 1e9
    for _ in range(200):
        middle = 0.5 * (low + high)
        value = middle / 3.0 if middle < 1e-6 else 1.0 / math.tanh(middle) - 1.0 / middle
        low, high = (middle, high) if value < x else (low, middle)
    return 0.5 * (low + high)


def invariant(kinematics, e):
    """Return I1 of one spring at stretch ``e``."""
    return {
        "constrained-width": e**2 + 1.0 + e**-2,
        "uniaxial": e**2 + 2.0 / e,
        "equibiaxial": 2.0 * e**2 + e**-4,
    }[kinematics]


def invariant_slope(kinematics, e):
    return {
        "constrained-width": 2.0 * e - 2.0 * e**-3,
        "uniaxial": 2.0 * e - 2.0 / e**2,
        "equibiaxial": 4.0 * e - 4.0 * e**-5,
    }[kinematics]


def share(kinematics):
    """Return the share of dW/dlam that one direction carries."""
    return 0.5 if kinematics == "equibiaxial" else 1.0


def energy_slope(spring, i1):
    """Return dW/dI1 of eqs. 24 to 26."""
    if spring.kind == "neo-hookean":
        return spring.modulus / 2.0
    if spring.kind == "gent":
        return spring.modulus / 2.0 / (1.0 - (i1 - 3.0) / spring.limit)
    chain = math.sqrt(i1 / 3.0)
    root = math.sqrt(spring.limit)
    return spring.modulus * root * langevin_inverse(chain / root) / (6.0 * chain)


def spring_stress(spring, kinematics, e):
    """Return the nominal stress of a spring at its own stretch ``e``."""
    slope = energy_slope(spring, invariant(kinematics, e))
    return slope * invariant_slope(kinematics, e) * share(kinematics)


def maxwell_stress(kinematics, lam):
    """Return the nominal Maxwell stress over eps (phi/Z)^2."""
    return {"constrained-width": lam, "uniaxial": 0.5, "equibiaxial": lam**3}[kinematics]


def balance(actuator, lam, voltage):
    """Return load + field - spring in Pa at rest with relaxed branches: 0 in equilibrium."""
    film, load = actuator.film, actuator.load
    permittivity = VACUUM_PERMITTIVITY * film.permittivity
    return (
        load.mass * STANDARD_GRAVITY / (film.width * film.thickness)
        + permittivity * (voltage / film.thickness) ** 2 * maxwell_stress(film.kinematics, lam)
        - spring_stress(actuator.network.equilibrium, film.kinematics, lam)
    )


@numba.njit(error_model="numpy")
def _geometry(kinematics, e):
    """(I1, half its derivative that one direction carries, Maxwell stress over eps (phi/Z)^2)."""
    if kinematics == 0:
        return e**2 + 1.0 + e**-2, e - e**-3, e
    if kinematics == 1:
        return e**2 + 2.0 / e, e - 1.0 / e**2, 0.5
    return 2.0 * e**2 + e**-4, e - e**-5, e**3


@numba.njit(error_model="numpy")
def _stress(kinematics, kind, modulus, limit, e):
    i1, half, _ = _geometry(kinematics, e)
    if kind == 0:
        return modulus * half
    if kind == 1:
        return modulus * half / (1.0 - (i1 - 3.0) / limit)
    chain, root = math.sqrt(i1 / 3.0), math.sqrt(limit)
    low, high = 0.0, 1e6
    for _ in range(90):
        middle = 0.5 * (low + high)
        value = middle / 3.0 if middle < 1e-6 else 1.0 / math.tanh(middle) - 1.0 / middle
        if value < chain / root:
            low = middle
        else:
            high = middle
    return modulus * root * low / (3.0 * chain) * half


@numba.njit(error_model="numpy")
def _rates(y, t, drive, head, springs):
    """Eq. 48. ``drive`` = [t0, dt, v0, v1]; ``springs`` rows are kind, modulus, limit, T."""
    kinematics, inertia, force, permittivity = int(head[0]), head[1], head[2], head[3]
    v = drive[2] + (drive[3] - drive[2]) * (t - drive[0]) / drive[1]
    lam = y[0]
    stress = force + permittivity * v**2 * _geometry(kinematics, lam)[2]
    dy = np.zeros(y.size)
    for i in range(springs.shape[0]):
        kind, modulus, limit = int(springs[i, 0]), springs[i, 1], springs[i, 2]
        if i == 0:
            stress -= _stress(kinematics, kind, modulus, limit, lam)
        else:
            xi = y[1 + i]
            unit = _stress(kinematics, kind, 1.0, limit, lam / xi)
            stress -= modulus * unit / xi
            dy[1 + i] = unit * (lam / xi) / springs[i, 3]
    dy[0] = y[1]
    dy[1] = stress / inertia
    return dy


def solve(actuator, time, voltage, hold=False, tolerance=1e-10):
    """Solve for the stretch (N,) at ``time`` under ``voltage``, by LSODA from sample to sample.

    Every sample is a corner of the drive, so the solver restarts at each. Branches of relaxation
    time 0 carry nothing and are left out.
    """
    film = actuator.film
    inertia = film.density * film.length**2 / 3.0
    for name, values in actuator.effects:
        if name == "load inertia":
            mass = dict(values)["moving_mass"]
            inertia += mass * film.length / (film.width * film.thickness)
    section = film.width * film.thickness
    head = np.array(
        [
            ("constrained-width", "uniaxial", "equibiaxial").index(film.kinematics),
            inertia,
            actuator.load.mass * STANDARD_GRAVITY / section,
            VACUUM_PERMITTIVITY * film.permittivity / film.thickness**2,
        ]
    )
    names = ("neo-hookean", "gent", "arruda-boyce")
    network = actuator.network
    rows = [(network.equilibrium, math.nan)]
    rows += [(b.spring, b.relaxation_time) for b in network.branches if b.relaxation_time > 0.0]
    springs = np.array([(names.index(s.kind), s.modulus, s.limit, t) for s, t in rows])
    rest = brentq(lambda lam: -balance(actuator, lam, 0.0), 1.0, rest_bracket(actuator), xtol=1e-15)
    y = np.array([rest, 0.0, *([rest] * (len(rows) - 1))])
    out = [rest]
    for k in range(time.size - 1):
        ends = (time[k], time[k + 1])
        drive = np.array([ends[0], ends[1] - ends[0], voltage[k], voltage[k + (not hold)]])
        y = odeint(
            _rates, y, ends, args=(drive, head, springs), rtol=tolerance, atol=1e-12, mxstep=200_000
        )[1]
        out.append(y[0])
    return np.array(out)


def rest_bracket(actuator):
    """Return a stretch short of locking where the equilibrium spring pulls more than the load."""
    lam = 1.0
    while balance(actuator, lam, 0.0) >= 0.0:
        lam *= 1.002
    return lam
