"""Film with hidden effects: an equation of motion and integrator independent of the model's.

The network of Gent springs is written in the logarithmic elastic stretch z_i = ln(lam/xi_i) of each
branch, in which the flow reads z_i' = lam'/lam - e pull(e)/(T_i lam) with e = exp(z_i). It is
integrated by the fifth-order Runge-Kutta formula of Dormand and Prince in fixed steps. Effects are
numbers whose defaults have no influence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from dearig.model.compiled.jit import allocating, jit
from dearig.model.film.material import STANDARD_GRAVITY, VACUUM_PERMITTIVITY, Film, Load, Network
from dearig.sim_backend.truth import generator_b_laws
from dearig.sim_backend.truth.circuit import behind_leak, permittivity
from dearig.sim_backend.truth.generator_b_laws import (
    added_stress,
    electrode_charging,
    fastest_decay,
    healed,
    warming,
    wholeness,
)
from dearig.sim_backend.truth.hidden import Hidden

__all__ = [
    "COURSE_AREA",
    "COURSE_ELECTRIC",
    "COURSE_HEATING",
    "COURSE_PULL",
    "COURSE_STIFFNESS",
    "LOST",
    "NO_COURSE",
    "FilmNumbers",
    "FilmState",
    "Hidden",
    "follow",
    "rest_stretch",
]

LOST = 1  #: status: the stretch diverged or a spring locked

#: Rows of a course: factors on the load, on the permittivity and on all moduli, the room's warming
#: in K (for a thermometer; its influence on the moduli is in their row), and the part of the
#: electrode that is still connected.
COURSE_PULL, COURSE_ELECTRIC, COURSE_STIFFNESS, COURSE_HEATING, COURSE_AREA = range(5)
NO_COURSE = (1.0, 1.0, 1.0, 0.0, 1.0)

_STRETCH_MAX = 20.0
_STABLE = 1.0  # maximum of step times fastest decay rate; the formula is stable up to 3.3
_STEPS_MAX = 1e4  # in an interval; limits the work on a diverging film
_COUNT_MAX = 1e18  # near the largest whole number

# fifth-order solution of RK5(4)7M, Dormand and Prince, J. Comp. Appl. Math. 6 (1980)
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


_NOTHING = Hidden()


class _Body(NamedTuple):
    """Parameters of the film for the compiled equation."""

    inertia: float
    pull: float
    electric: float
    capacitance: float
    rest: float


@dataclass(frozen=True)
class FilmState:
    """State ``y``: stretch, rate, places from ``_BRISTLE`` on, z_1..n; ``memory``: see there."""

    y: np.ndarray
    memory: np.ndarray


@dataclass(frozen=True)
class FilmNumbers:
    """Parameters of the equation of motion in SI units; an effect returns a changed copy.

    ``moduli`` mu_0..n Pa, ``limits`` J_0..n, ``times`` T_1..n s. ``inertia`` kg/m multiplies
    lam'', ``pull`` Pa is the load's nominal stress, ``electric`` Pa/V^2 times phi^2 lam the nominal
    Maxwell stress. ``length`` L1 m and ``section`` L2 Z m^2 turn stretch into travel and stress
    into force; ``capacitance`` F is the unstretched film's. ``stops`` are pairs of reach and
    stiffness Pa of elements that slip. ``step`` s is the longest integration step: it resolves the
    70 Hz of a film without a moving load to a nanometre; a stiff effect needs a shorter one.
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
    hidden: Hidden = _NOTHING
    stops: tuple[tuple[float, float], ...] = ()
    step: float = 5e-4

    @classmethod
    def of(cls, film: Film, load: Load, network: Network) -> FilmNumbers:
        """Return the thesis's film without hidden effects.

        Raises ``ValueError`` for a film or network that this plant cannot simulate.
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

    def hiding(self, **numbers: float) -> FilmNumbers:
        """Return the film with some parameters of ``Hidden`` set."""
        changed: dict[str, Any] = dict(numbers)  # none of them is ``further``
        return replace(self, hidden=self.hidden._replace(**changed))

    def obeying(self, **numbers: float) -> FilmNumbers:
        """Return the film with some parameters of generator B's laws set."""
        return replace(
            self, hidden=self.hidden._replace(further=self.hidden.further._replace(**numbers))
        )

    def stiffened(self, factor: float) -> FilmNumbers:
        """Return the film with all moduli multiplied by ``factor``."""
        return replace(self, moduli=tuple(factor * modulus for modulus in self.moduli))

    def permitting(self, factor: float) -> FilmNumbers:
        """Return the film with its permittivity multiplied by ``factor``."""
        return replace(self, electric=factor * self.electric, capacitance=factor * self.capacitance)

    def stepping(self, step: float) -> FilmNumbers:
        """Return the film with integration steps of at most ``step`` s."""
        return replace(self, step=min(self.step, step))

    def body(self, rest: float) -> _Body:
        """Return the film's parameters for ``follow``, with the rest stretch."""
        return _Body(self.inertia, self.pull, self.electric, self.capacitance, rest)

    def springs(self) -> np.ndarray:
        """Return rows (3, 1 + n): moduli, limits, times; the equilibrium spring never relaxes."""
        return np.array([self.moduli, self.limits, (math.inf, *self.times)])

    def slipping(self) -> np.ndarray:
        """Return rows (2, m) of reaches and stiffnesses of ``stops``."""
        return np.array(self.stops, dtype=float).reshape(-1, 2).T.copy()

    def at_rest(self, rest: float) -> FilmState:
        """Return the state at stretch ``rest``; in relaxed branches z_i = 0."""
        more = 0 if self.hidden.further == generator_b_laws.NOTHING else generator_b_laws.STATES
        y = np.zeros(_BRANCH + len(self.times) + more)
        memory = np.zeros(_SLIPPED + len(self.stops))
        y[0] = memory[_START] = memory[_LARGEST] = rest
        return FilmState(y, memory)


# Places in y after stretch and rate: the bristles, Bouc and Wen's variable, voltages of the
# electrode's sections, warming of film and surroundings, path travelled, the second mass
_BRISTLE, _BOUC, _SECTION_1, _SECTION_2, _WARM_1, _WARM_2, _PATH, _SECOND, _SECOND_RATE = range(
    2, 11
)
_BRANCH = 11  # z_1, z_2, ...; then the states of generator B's laws, if it has any
# Memory changes at the end of a step only: stretch there, largest stretch, slipped elements
_START, _LARGEST, _SLIPPED = 0, 1, 2


@jit
def _gent(modulus: float, limit: float, e: float) -> float:
    """Return the nominal stress in Pa of a Gent spring at stretch ``e``, with the width held."""
    squared = e * e
    strain = squared + 1.0 / squared - 2.0
    return modulus * (e - 1.0 / (squared * e)) / (1.0 - strain / limit)


@jit
def _slipped(start: float, reach: float, moved: float) -> float:
    """Return the strain of an element that slips beyond ``reach``."""
    return min(max(start + moved, -reach), reach)


@jit
def _bristles(h: Hidden, x: float, rate: float) -> tuple[float, float]:
    """Return the friction stress in Pa and the rate of the bristles' deflection ``x``."""
    ratio = abs(rate) / h.friction_stribeck
    if h.friction_easing > 0.0:
        eased = math.exp(-(ratio**h.friction_easing))
    else:
        eased = 1.0 / (1.0 + ratio**2)
    level = h.friction + (h.friction_static - h.friction) * eased
    stiffness = h.friction / h.friction_reach
    steady = level / stiffness
    slip = 1.0
    if h.friction_elastic > 0.0:
        least = h.friction_elastic * steady
        if x * rate <= 0.0 or abs(x) <= least:
            slip = 0.0
        elif abs(x) < steady:
            slip = 0.5 - 0.5 * math.cos(math.pi * (abs(x) - least) / (steady - least))
    speed = rate - slip * abs(rate) * x / steady
    return stiffness * x + h.friction_damping * speed, speed


@jit
def _derivative(
    body: _Body,
    h: Hidden,
    springs: np.ndarray,
    slipping: np.ndarray,
    memory: np.ndarray,
    y: np.ndarray,
    voltage: float,
    pull: float,
    electric: float,
    stiffness: float,
    dy: np.ndarray,
) -> None:
    """Return dy/dt at the factors of the course. One piece: the equation, term by term."""
    lam, rate = y[0], y[1]
    away = lam - body.rest
    for j in range(2, _BRANCH):
        dy[j] = 0.0

    v = voltage
    if h.leak_conductance > 0.0:
        v = behind_leak(h, voltage, lam)
    square = v * v
    if h.heat > 0.0:
        exchange = (y[_WARM_1] - y[_WARM_2]) / h.heat_time
        dy[_WARM_1] = h.heat * square - exchange
        dy[_WARM_2] = h.heat_share * exchange - y[_WARM_2] / h.heat_time_2
        stiffness *= 1.0 + h.heat_stiffness * y[_WARM_1]
    if h.ladder_1 > 0.0:
        grown = math.exp(h.ladder_gauge * away)
        capacitance = body.capacitance * lam * lam
        v1, v2, growth = y[_SECTION_1], y[_SECTION_2], 2.0 * rate / lam
        into = (v - v1) / (h.ladder_1 * grown)
        if h.ladder_2 > 0.0:
            on = (v1 - v2) / (h.ladder_2 * grown)
            dy[_SECTION_1] = 2.0 * (into - on) / capacitance - growth * v1
            dy[_SECTION_2] = 2.0 * on / capacitance - growth * v2
            square = 0.5 * (v1 * v1 + v2 * v2)
        else:
            dy[_SECTION_1] = into / capacitance - growth * v1
            square = v1 * v1
    second = _BRANCH + springs.shape[1] - 1
    has_second = y.shape[0] > second
    if has_second:
        if h.further.convection_heat > 0.0:
            dy[_WARM_1] = warming(h.further, square, y[_WARM_1])
            stiffness *= 1.0 + h.further.convection_stiffness * y[_WARM_1]
        if h.further.contact > 0.0:
            current = electrode_charging(h.further, v - y[_SECTION_1], away)
            into = current / (body.capacitance * lam * lam)
            dy[_SECTION_1] = into - 2.0 * rate / lam * y[_SECTION_1]
            square = y[_SECTION_1] * y[_SECTION_1]
    electric *= body.electric * permittivity(h, square, lam, body.rest)

    stress = pull * body.pull + electric * square * lam
    speed = abs(rate)
    stress -= (h.drag + h.drag_quadratic * speed + h.drag_power * math.sqrt(speed)) * rate
    if h.friction > 0.0:
        held, dy[_BRISTLE] = _bristles(h, y[_BRISTLE], rate)
        stress -= held
    if h.bouc > 0.0:
        b = y[_BOUC]
        opening = h.bouc_share * math.copysign(1.0, rate * b) + 1.0 - h.bouc_share
        dy[_BOUC] = rate / h.bouc_reach * (1.0 - abs(b) ** h.bouc_exponent * opening)
        stress -= h.bouc * b
    for i in range(slipping.shape[1]):
        strain = _slipped(memory[_SLIPPED + i], slipping[0, i], lam - memory[_START])
        stress -= slipping[1, i] * strain
    if away > h.stop_travel:
        depth = away - h.stop_travel
        stress -= h.stop_stiffness * depth**1.5 * max(1.0 + h.stop_damping * rate, 0.0)

    whole, inertia = 1.0, body.inertia
    if has_second:
        stress -= added_stress(h.further, y, second, lam, rate, body.rest, dy)
        stress -= 0.5 * inertia * h.further.lever * rate * rate
        inertia *= 1.0 + h.further.lever * away
        whole = wholeness(h.further, memory[_LARGEST], lam, body.rest)
    if h.damage > 0.0:
        farthest = (max(memory[_LARGEST], lam) - body.rest) / h.damage_reach
        damage = farthest**h.damage_exponent
        whole -= h.damage * damage / (1.0 + damage)
    if h.ageing > 0.0:
        dy[_PATH] = speed
        whole -= h.ageing * math.log1p(y[_PATH] / h.ageing_reach)
    stress -= stiffness * whole * _gent(springs[0, 0], springs[1, 0], lam)
    for i in range(1, springs.shape[1]):
        e = math.exp(y[_BRANCH - 1 + i])
        squared = e * e
        stretched = 1.0 - (squared + 1.0 / squared - 2.0) / springs[1, i]
        flow = (squared - 1.0 / squared) / stretched / springs[2, i]
        stress -= stiffness * springs[0, i] * (squared - 1.0 / squared) / stretched / lam
        dy[_BRANCH - 1 + i] = rate / lam - flow * e / lam
    if h.second_inertia > 0.0:
        back = h.second_frequency * y[_SECOND] + 2.0 * h.second_damping * y[_SECOND_RATE]
        back *= h.second_frequency
        stress += h.second_inertia * back
        dy[_SECOND] = y[_SECOND_RATE]
        dy[_SECOND_RATE] = -back - stress / body.inertia
    dy[0] = rate
    dy[1] = stress / inertia


@jit
def _fastest(body: _Body, h: Hidden, rate: float) -> float:
    """Return the fastest decay rate in 1/s of drag and friction at ``rate``; it limits the step.

    Slip of the bristles sets in at a corner, so a step bends them by a quarter of their reach at
    most.
    """
    slope = h.drag + 2.0 * h.drag_quadratic * rate + 1.5 * h.drag_power * math.sqrt(rate)
    slope += fastest_decay(h.further, rate)
    bending = 4.0 * rate / h.friction_reach if h.friction > 0.0 else 0.0
    return slope / body.inertia + bending


@jit
def _charging_rate(body: _Body, h: Hidden, gap: float, lam: float) -> float:
    """Return the rate in 1/s at which the charge follows across ``gap`` V of the electrode.

    Contacts conduct better under a larger voltage: after a step of kilovolts in nanoseconds, which
    a step of the integration must not pass over.
    """
    away, most = lam - body.rest, abs(gap)
    slope = electrode_charging(h.further, most + 0.5, away)  # over a volt
    slope -= electrode_charging(h.further, most - 0.5, away)
    return slope / (body.capacitance * lam * lam)


@jit
def _intact(springs: np.ndarray, y: np.ndarray) -> bool:
    """Return True while the film is intact: finite, not diverging, no spring locked."""
    if not (0.0 < y[0] < _STRETCH_MAX and math.isfinite(y[1])):
        return False
    for i in range(springs.shape[1]):
        e = y[0] if i == 0 else math.exp(y[_BRANCH - 1 + i])
        if not e * e + 1.0 / (e * e) - 2.0 < springs[1, i]:
            return False
    return True


@allocating
def follow(
    body: _Body,
    h: Hidden,
    springs: np.ndarray,
    slipping: np.ndarray,
    step_max: float,
    time: np.ndarray,
    voltage: np.ndarray,
    courses: np.ndarray,
    hold: bool,
    y: np.ndarray,
    memory: np.ndarray,
    rows: np.ndarray,
) -> tuple[int, int]:
    """Integrate ``y`` and ``memory`` in place under ``voltage`` (N,) V at ``time`` (N,) s.

    ``courses`` (3, N) hold from node to node: factors on load, Maxwell stress and moduli. Fills
    ``rows`` (5, N): stretch, its rate in 1/s, the film's warming in K, the voltages in V of the
    electrode's sections. Returns ``(status, reached)``: 0, or ``LOST`` with the node from which the
    rows repeat the last valid stretch.
    """
    n = y.shape[0]
    nodes = time.shape[0]
    slopes = np.empty((6, n))
    trial = np.empty(n)
    damped = _fastest(body, h, 1.0) > 0.0 or h.further.contact > 0.0
    for k in range(nodes):
        rows[0, k], rows[1, k], rows[2, k] = y[0], y[1], y[_WARM_1]
        rows[3, k], rows[4, k] = y[_SECTION_1], y[_SECTION_2]
        if k == nodes - 1:
            break
        interval = time[k + 1] - time[k]
        change = 0.0 if hold else voltage[k + 1] - voltage[k]
        elapsed, steps = 0.0, 2
        while steps > 1:
            left = interval - elapsed
            steps = max(1, math.ceil(left / step_max - 1e-9))
            if damped:
                _derivative(
                    body,
                    h,
                    springs,
                    slipping,
                    memory,
                    y,
                    voltage[k] + change * elapsed / interval,
                    courses[0, k],
                    courses[1, k],
                    courses[2, k],
                    slopes[0],
                )
                ahead = abs(y[1]) + abs(slopes[0, 1]) * left / steps
                wanted = min(left * _fastest(body, h, ahead) / _STABLE, _STEPS_MAX)
                if h.further.contact > 0.0:
                    # few steps are so short: the current falls with the voltage that drives it
                    gap = voltage[k] + change * elapsed / interval - y[_SECTION_1]
                    charging = left * _charging_rate(body, h, gap, y[0]) / _STABLE
                    wanted = max(wanted, min(charging, _COUNT_MAX))
                steps = max(steps, math.ceil(wanted))
            h_step = left / steps
            for stage in range(6):
                fraction = 0.0  # of the step: a stage's time is the sum of its row
                for j in range(n):
                    trial[j] = y[j]
                for m in range(stage):
                    fraction += _STAGES[stage, m]
                    for j in range(n):
                        trial[j] += h_step * _STAGES[stage, m] * slopes[m, j]
                v = voltage[k] + change * (elapsed + fraction * h_step) / interval
                _derivative(
                    body,
                    h,
                    springs,
                    slipping,
                    memory,
                    trial,
                    v,
                    courses[0, k],
                    courses[1, k],
                    courses[2, k],
                    slopes[stage],
                )
            for j in range(n):
                for stage in range(6):
                    y[j] += h_step * _WEIGHTS[stage] * slopes[stage, j]
            moved = y[0] - memory[_START]
            for i in range(slipping.shape[1]):
                memory[_SLIPPED + i] = _slipped(memory[_SLIPPED + i], slipping[0, i], moved)
            memory[_START] = y[0]
            memory[_LARGEST] = healed(h.further, memory[_LARGEST], y[0], h_step)
            elapsed += h_step
        if not _intact(springs, y):
            for late in range(k + 1, nodes):
                for i in range(rows.shape[0]):
                    rows[i, late] = rows[i, k] if i != 1 else 0.0
            return LOST, k + 1
    return 0, nodes


def rest_stretch(numbers: FilmNumbers) -> float:
    """Return the stretch at which the equilibrium spring carries the load, by bisection.

    Raises ``ValueError`` where there is none.
    """
    modulus, limit = numbers.moduli[0], numbers.limits[0]
    low, high = 1.0, 1.0
    # the spring locks where (e - 1/e)^2 reaches J; below that its stress has no bound
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
