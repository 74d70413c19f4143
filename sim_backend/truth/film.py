"""The film of the truth: its own equation of motion with its own integrator.

The network of Gent springs is written in the logarithmic elastic stretch z_i = ln(lam/xi_i) of each
branch, in which the flow reads z_i' = lam'/lam - e pull(e)/(T_i lam) with e = exp(z_i), and it is
integrated by the fifth-order Runge-Kutta formula of Dormand and Prince in fixed steps. Effects come
in as numbers, so this is the one file of the truth that is compiled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from model.jit import jit
from model.material import STANDARD_GRAVITY, VACUUM_PERMITTIVITY, Film, Load, Network

__all__ = ["LOST", "FilmNumbers", "follow", "rest_stretch"]

LOST = 1  #: status: the stretch ran away or a spring locked

_STRETCH_MAX = 20.0

# Dormand and Prince's RK5(4)7M, J. Comp. Appl. Math. 6 (1980), the fifth-order solution
_STAGES = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0],
        [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0],
        [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0],
        [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0],
        [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    ]
)
_WEIGHTS = np.array(
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0]
)


@dataclass(frozen=True)
class FilmNumbers:
    """All numbers of the equation of motion, SI units; an effect hands back a changed copy.

    ``moduli`` mu_0..n Pa, ``limits`` J_0..n, ``times`` T_1..n s. ``inertia`` kg/m multiplies
    lam'', ``pull`` Pa is the load's nominal stress, ``electric`` Pa/V^2 times phi^2 lam the nominal
    Maxwell stress, ``drag`` Pa s times lam' that of a linear drag. ``length`` L1 m and ``section``
    L2 Z m^2 turn stretch into travel and stress into force; ``capacitance`` F is the unstretched
    film's. ``step`` s is the longest integration step: it carries the 7 Hz of a hung load to a
    picometre, and an effect with sharp corners asks for less.
    """

    moduli: tuple[float, ...]
    limits: tuple[float, ...]
    times: tuple[float, ...]
    inertia: float
    pull: float
    electric: float
    length: float
    section: float
    capacitance: float
    drag: float = 0.0
    step: float = 1e-3

    @classmethod
    def of(cls, film: Film, load: Load, network: Network) -> FilmNumbers:
        """The thesis's film: nothing hidden.

        Raises ``ValueError`` for a film or network that the truth cannot stand for.
        """
        if film.kinematics != "constrained-width":
            raise ValueError(
                f"the truth plant is an actuator of constrained width, not {film.kinematics}"
            )
        if {spring.kind for spring in network.springs} - {"gent", "neo-hookean"}:
            raise ValueError("the truth plant has Gent and neo-Hookean springs only")
        section = film.width * film.thickness
        permittivity = VACUUM_PERMITTIVITY * film.permittivity
        numbers = cls(
            moduli=tuple(spring.modulus for spring in network.springs),
            limits=tuple(spring.limit for spring in network.springs),
            times=network.times,
            inertia=film.density * film.length**2 / 3.0,
            pull=load.mass * STANDARD_GRAVITY / section,
            electric=permittivity / film.thickness**2,
            length=film.length,
            section=section,
            capacitance=permittivity * film.length * film.width / film.thickness,
        )
        if load.rest_length is None:
            return numbers
        stretch = load.rest_length / film.length
        modulus = numbers.pull / _gent(1.0, numbers.limits[0], stretch)
        return replace(numbers, moduli=(modulus, *numbers.moduli[1:]))

    def vector(self) -> np.ndarray:
        """The numbers as ``follow`` reads them: ``_HEAD`` of the film, then three a spring."""
        head = (self.inertia, self.pull, self.electric, self.drag)
        springs = zip(self.moduli, self.limits, (math.inf, *self.times), strict=True)
        return np.array([*head, *(number for spring in springs for number in spring)])


_HEAD = 4


@jit
def _gent(modulus: float, limit: float, e: float) -> float:
    """Nominal stress in Pa of a Gent spring at its own stretch ``e`` with the width held."""
    squared = e * e
    strain = squared + 1.0 / squared - 2.0
    return modulus * (e - 1.0 / (squared * e)) / (1.0 - strain / limit)


@jit
def _derivative(p: np.ndarray, y: np.ndarray, voltage: float, dy: np.ndarray) -> None:
    """dy/dt for y = [lam, lam', z_1 .. z_n] under ``voltage``."""
    lam, rate = y[0], y[1]
    stress = p[1] + p[2] * voltage * voltage * lam - p[3] * rate
    stress -= _gent(p[_HEAD], p[_HEAD + 1], lam)
    for i in range(y.shape[0] - 2):
        k = _HEAD + 3 * (i + 1)
        e = math.exp(y[2 + i])
        spring = _gent(p[k], p[k + 1], e)
        stress -= spring * e / lam
        strain = e * e + 1.0 / (e * e) - 2.0
        flow = (e * e - 1.0 / (e * e)) / (1.0 - strain / p[k + 1]) / p[k + 2]
        dy[2 + i] = rate / lam - flow * e / lam
    dy[0] = rate
    dy[1] = stress / p[0]


@jit
def _sound(p: np.ndarray, y: np.ndarray) -> bool:
    """True while the film is whole: finite, not run away, no spring at its locking strain."""
    if not (0.0 < y[0] < _STRETCH_MAX and math.isfinite(y[1])):
        return False
    for i in range(y.shape[0] - 1):
        e = y[0] if i == 0 else math.exp(y[1 + i])
        if not e * e + 1.0 / (e * e) - 2.0 < p[_HEAD + 3 * i + 1]:
            return False
    return True


@jit
def follow(
    p: np.ndarray,
    step_max: float,
    time: np.ndarray,
    voltage: np.ndarray,
    hold: bool,
    y: np.ndarray,
    stretch: np.ndarray,
    rate: np.ndarray,
) -> tuple[int, int]:
    """Carry ``y`` in place through ``voltage`` (N,) V on ``time`` (N,) s; fill the rows (N,).

    Returns ``(status, reached)``: 0, or ``LOST`` with the node from which the rows only repeat the
    last sound stretch.
    """
    n = y.shape[0]
    nodes = time.shape[0]
    slopes = np.empty((6, n))
    trial = np.empty(n)
    for k in range(nodes):
        stretch[k], rate[k] = y[0], y[1]
        if k == nodes - 1:
            break
        interval = time[k + 1] - time[k]
        change = 0.0 if hold else voltage[k + 1] - voltage[k]
        steps = max(1, math.ceil(interval / step_max - 1e-9))
        h = interval / steps
        for step in range(steps):
            for stage in range(6):
                fraction = 0.0  # of the step: a stage's time is the sum of its row
                for j in range(n):
                    trial[j] = y[j]
                for m in range(stage):
                    fraction += _STAGES[stage, m]
                    for j in range(n):
                        trial[j] += h * _STAGES[stage, m] * slopes[m, j]
                v = voltage[k] + change * (step + fraction) / steps
                _derivative(p, trial, v, slopes[stage])
            for j in range(n):
                for stage in range(6):
                    y[j] += h * _WEIGHTS[stage] * slopes[stage, j]
        if not _sound(p, y):
            for late in range(k + 1, nodes):
                stretch[late], rate[late] = stretch[k], 0.0
            return LOST, k + 1
    return 0, nodes


def rest_stretch(numbers: FilmNumbers) -> float:
    """Stretch at which the equilibrium spring carries the load, by bisection.

    Raises ``ValueError`` where none does.
    """
    modulus, limit = numbers.moduli[0], numbers.limits[0]
    low, high = 1.0, 1.0
    # the spring locks where (e - 1/e)^2 reaches J: short of that it carries anything
    locked = 0.5 * (math.sqrt(limit) + math.sqrt(limit + 4.0))
    while high < min(locked, _STRETCH_MAX) and _gent(modulus, limit, high) < numbers.pull:
        low, high = high, min(1.01 * high, _STRETCH_MAX, locked * (1.0 - 1e-12))
        if high == low:
            break
    if not _gent(modulus, limit, high) >= numbers.pull:
        raise ValueError(f"no rest state: {modulus:.4g} Pa do not carry {numbers.pull:.4g} Pa")
    for _ in range(100):
        middle = 0.5 * (low + high)
        if _gent(modulus, limit, middle) < numbers.pull:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
