"""The film under voltage or stretch, written from thesis eq. 48 for SciPy: the tests' oracle.

Nothing here comes from the kernels: the springs' derivatives, the three kinematics and the motion
equation are written out once more, in the plainest form.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

from model.material import STANDARD_GRAVITY, VACUUM_PERMITTIVITY


def langevin_inverse(x):
    """By bisection: slow, and beyond doubt."""
    low, high = 0.0, 1e9
    for _ in range(200):
        middle = 0.5 * (low + high)
        value = middle / 3.0 if middle < 1e-6 else 1.0 / math.tanh(middle) - 1.0 / middle
        low, high = (middle, high) if value < x else (low, middle)
    return 0.5 * (low + high)


def invariant(kinematics, e):
    """I1 of one spring at stretch ``e``."""
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
    """Of dW/dlam, carried by one direction."""
    return 0.5 if kinematics == "equibiaxial" else 1.0


def energy_slope(spring, i1):
    """dW/dI1 of eqs. 24 to 26."""
    if spring.kind == "neo-hookean":
        return spring.modulus / 2.0
    if spring.kind == "gent":
        return spring.modulus / 2.0 / (1.0 - (i1 - 3.0) / spring.limit)
    chain = math.sqrt(i1 / 3.0)
    root = math.sqrt(spring.limit)
    return spring.modulus * root * langevin_inverse(chain / root) / (6.0 * chain)


def spring_stress(spring, kinematics, e):
    """Nominal stress of a spring at its own stretch ``e``."""
    slope = energy_slope(spring, invariant(kinematics, e))
    return slope * invariant_slope(kinematics, e) * share(kinematics)


def maxwell_stress(kinematics, lam):
    """Nominal, over eps (phi/Z)^2."""
    return {"constrained-width": lam, "uniaxial": 0.5, "equibiaxial": lam**3}[kinematics]


def balance(actuator, lam, voltage):
    """Stress (Pa) left over at rest with relaxed branches: load + field - spring."""
    film, load = actuator.film, actuator.load
    permittivity = VACUUM_PERMITTIVITY * film.permittivity
    return (
        load.mass * STANDARD_GRAVITY / (film.width * film.thickness)
        + permittivity * (voltage / film.thickness) ** 2 * maxwell_stress(film.kinematics, lam)
        - spring_stress(actuator.network.equilibrium, film.kinematics, lam)
    )


def equations(actuator, voltage):
    """Right-hand side f(t, y) of eq. 48; ``voltage`` is a function of time."""
    film, network = actuator.film, actuator.network
    inertia = film.density * film.length**2 / 3.0
    for name, values in actuator.effects:
        if name == "load inertia":
            mass = dict(values)["moving_mass"]
            inertia += mass * film.length / (film.width * film.thickness)

    def rates(t, y):
        lam, speed = y[0], y[1]
        stress = balance(actuator, lam, voltage(t))
        flows = []
        for branch, xi in zip(network.branches, y[2:], strict=True):
            pull = spring_stress(branch.spring, film.kinematics, lam / xi)
            stress -= pull / xi
            true = pull * lam / xi
            flows.append(true / branch.spring.modulus / branch.relaxation_time)
        return [speed, stress / inertia, *flows]

    return rates


def solve(actuator, time, voltage, hold=False, rtol=1e-10, method="DOP853", rest=None):
    """Stretch (N,) at ``time`` under samples of ``voltage``, from sample to sample.

    The solver is stopped at every sample where the drive has a corner, so that it never steps over
    one: at all of them for a held drive, else where the slope changes.
    """
    rest = actuator.rest() if rest is None else rest
    y = np.array([rest, 0.0, *([rest] * len(actuator.network.branches))])
    atol = np.full(y.size, 1e-12)
    atol[1] = 1e-9
    out = [rest]
    for k in range(time.size - 1):
        v0, v1 = voltage[k], voltage[k] if hold else voltage[k + 1]
        t0, dt = time[k], time[k + 1] - time[k]
        f = equations(actuator, lambda t, a=v0, b=v1, t0=t0, dt=dt: a + (b - a) * (t - t0) / dt)
        done = solve_ivp(f, (t0, time[k + 1]), y, method=method, rtol=rtol, atol=atol)
        if not done.success:
            raise RuntimeError(done.message)
        y = done.y[:, -1]
        out.append(y[0])
    return np.array(out)
