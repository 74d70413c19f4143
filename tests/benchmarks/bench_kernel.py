"""Time the compiled kernel on the thesis's record against general-purpose solvers.

Run as ``python -m tests.benchmarks.bench_kernel``. The record is two periods of eq. 49 (22.8 s)
with Table 3's film. Every solver gets the same compiled right-hand side. The general ones get the
loosest tolerance at which their error against a 1e-10 reference stays below 0.1 um. SciPy has LSODA
twice: stepped from Python (solve_ivp) and all in Fortran (odeint). A second table has the cost of
effects of ``dearig.model.effects``, a third what rough and coarse steps save. Medians over repeats
in one run: compare the ratios, the milliseconds belong to this machine.
"""

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numba
import numpy as np
from scipy.integrate import odeint, solve_ivp
from sksundae.cvode import CVODE

from dearig.model import kernel
from dearig.model.coefficients import REST
from dearig.model.effects import EFFECTS, EffectValues
from dearig.model.film.material import (
    STANDARD_GRAVITY,
    TABLE_3,
    THESIS_FILM,
    THESIS_LOAD,
    VACUUM_PERMITTIVITY,
)
from dearig.model.fitting.coarse_drive import coarse_drive_of
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator, Drive, at_rest, initial_state, reading_of
from dearig.model.simulation.excitation import Sequence
from tests.tools.engine import NOISE, posed, typical

STAIRCASE = 200.0  # the same of a record that is diagnosed
RATE = 400.0  # samples a second: with them the kernel stays below 0.1 um
ENOUGH = 0.1e-6  # m
TOLERANCES = tuple(a * 10.0**-b for b in range(4, 10) for a in (5.0, 2.0, 1.0))

AMPLITUDES = np.array([6.0e3, 6.5e3, 7.0e3, 7.5e3, 8.0e3])
FREQUENCIES = np.array([0.2, 0.4, 0.6, 0.8, 1.0])
EDGES = np.concatenate([[0.0], np.cumsum(1.0 / FREQUENCIES)])
MODULI = np.array([s.modulus for s in TABLE_3.springs])
LIMITS = np.array([s.limit for s in TABLE_3.springs])
TIMES = np.array(TABLE_3.times)
LOAD = THESIS_LOAD.mass * STANDARD_GRAVITY / (THESIS_FILM.width * THESIS_FILM.thickness)
ELECTRIC = VACUUM_PERMITTIVITY * THESIS_FILM.permittivity / THESIS_FILM.thickness**2
INERTIA = THESIS_FILM.density * THESIS_FILM.length**2 / 3.0


@numba.njit(error_model="numpy", fastmath=True)
def rates(t: float, y: np.ndarray, dy: np.ndarray) -> None:
    """Eq. 48, the lobes of eq. 49 as a function of exact time."""
    within = t % EDGES[-1]
    lobe = 0
    while lobe < 4 and within >= EDGES[lobe + 1]:
        lobe += 1
    v = AMPLITUDES[lobe] * math.sin(math.pi * FREQUENCIES[lobe] * (within - EDGES[lobe]))
    lam = y[0]
    s = lam * lam
    inverse = 1.0 / s
    stress = MODULI[0] * (s - inverse) / (1.0 - (s + inverse - 2.0) / LIMITS[0])
    for i in range(1, 4):
        inner = y[1 + i] * y[1 + i]
        up, down = s / inner, inner * inverse
        pull = (up - down) / (1.0 - (up + down - 2.0) / LIMITS[i])
        stress += MODULI[i] * pull
        dy[1 + i] = pull / TIMES[i - 1]
    dy[0] = y[1]
    dy[1] = (LOAD + ELECTRIC * v * v * lam - stress / lam) / INERTIA


@numba.njit
def rates_of(t: float, y: np.ndarray) -> np.ndarray:
    dy = np.empty(5)
    rates(t, y, dy)
    return dy


def timed(run: Callable[[], np.ndarray], repeats: int) -> tuple[float, np.ndarray]:
    """Median seconds of ``repeats`` runs after one that compiles, and the result."""
    result = run()
    spent = []
    for _ in range(repeats):
        before = time.perf_counter()
        run()
        spent.append(time.perf_counter() - before)
    return statistics.median(spent), result


def simulated(c: np.ndarray, drive: Drive, fidelity: int = kernel.CAREFUL) -> np.ndarray:
    """Simulate the stretch (N,) from rest at a ``fidelity``."""
    y = initial_state(c, c[REST])
    stretch, rate = np.empty(drive.time.size), np.empty(drive.time.size)
    kernel.drive_by_voltage(
        c, drive.time, drive.voltage, drive.ends, drive.air, y, stretch, rate, fidelity
    )
    return stretch


def at_neutral(name: str) -> EffectValues:
    """Return the effect with neutral amplitudes and typical shape parameters."""
    neutral = {p.name: p.neutral for p in EFFECTS[name].amplitudes}
    return ((name, tuple((n, neutral.get(n, value)) for n, value in typical(name)[1])),)


def print_cost_of_effects(actuator: Actuator, drive: Drive) -> None:
    """Print the times of the kernel with effects, relative to itself without any."""
    cases: list[tuple[str, EffectValues]] = [("no effect", ())]
    voltage_effects = [e.name for e in EFFECTS.values() if "voltage" in e.drives]
    neutral = tuple(values for n in voltage_effects for values in at_neutral(n))
    cases.append((f"all {len(neutral)} effects, neutral", neutral))
    active = ("linear drag", "electrode resistance", "dry friction", "load inertia")
    cases += [(name, (typical(name),)) for name in active]
    rows = []
    for _, effects in cases:
        c = replace(actuator, effects=effects).coefficients()
        at_rest(c)
        rows.append(c)
        simulated(c, drive)
    spent: list[list[float]] = [[] for _ in rows]
    for _ in range(21):  # in turn, so that the machine's other work falls on all alike
        for c, times in zip(rows, spent, strict=True):
            before = time.perf_counter()
            simulated(c, drive)
            times.append(time.perf_counter() - before)
    base = statistics.median(spent[0])
    print(f"{'this kernel with':<44}{'ms':>10}{'ratio':>9}")
    for (label, _), times in zip(cases, spent, strict=True):
        middle = statistics.median(times)
        print(f"{label:<44}{middle * 1e3:>10.3f}{middle / base:>8.2f}x")


def print_savings_of_rough_steps(actuator: Actuator, sequence: Sequence) -> None:
    """Print careful against rough and coarse steps on a staircase, where the film rings.

    Rough steps are those of a search's first fits. A coarse drive gives derivatives with respect to
    parameters, with the reading at each sample: its errors are nearly the same for neighbouring
    parameters and cancel in the difference. The last column is the worst error of any derivative,
    relative to that derivative.
    """
    t = np.arange(math.ceil(sequence.segments[0].duration * STAIRCASE)) / STAIRCASE
    drive = Drive(t, sequence.segments[0].voltage(t), hold=True)
    record = ActuatorRecord("staircase", drive, np.zeros(t.size), NOISE)
    coarse = coarse_drive_of(record, actuator)
    assert coarse is not None
    print(
        f"{'staircase of 200 Hz':<28}{'careful ms':>11}{'rough ms':>10}{'ratio':>8}{'um':>8}"
        f"{'coarse ms':>11}{'ratio':>8}{'um':>8}{'worst':>8}"
    )
    for name in ("", "linear drag", "electrode resistance", "Mullins softening", "dry friction"):
        effects = (typical(name),) if name else ()
        model = replace(actuator, effects=effects)
        c = model.coefficients()
        at_rest(c)
        careful, expected = timed(partial(simulated, c, drive), 21)
        quick, found = timed(partial(simulated, c, drive, kernel.ROUGH), 21)
        moved = (expected - expected[0]) * THESIS_FILM.length
        spent, shown = timed(partial(at_samples, c, coarse, t), 21)
        print(
            f"{name or 'no effect':<28}{careful * 1e3:>11.3f}{quick * 1e3:>10.3f}"
            f"{quick / careful:>7.2f}x{_rms_um((found - expected) * THESIS_FILM.length):>8.3f}"
            f"{spent * 1e3:>11.3f}{spent / careful:>7.2f}x{_rms_um(shown - moved):>8.3f}"
            f"{100.0 * worst_derivative(model, replace(record, coarse_drive=coarse)):>7.1f}%"
        )


def at_samples(c: np.ndarray, coarse: Drive, times: np.ndarray) -> np.ndarray:
    """Simulate readings (N,) at ``times`` with a coarse drive."""
    return reading_of(c, THESIS_FILM.length, coarse, 0.0, kernel.COARSE, times)[0]


def worst_derivative(model: Actuator, record: ActuatorRecord) -> float:
    """Return the worst relative error of a derivative by the coarse drive of ``record``."""
    problem, x, free = posed(model, record, kernel.ROUGH)
    residuals = problem.residuals(x)
    whole = problem.jacobian(x, free, residuals)
    problem.coarse_columns = free
    off = problem.jacobian(x, free, residuals, coarse=True) - whole
    return float(np.max(np.linalg.norm(off, axis=0) / np.linalg.norm(whole, axis=0)))


def _rms_um(off: np.ndarray) -> float:
    return float(np.sqrt(np.mean(off**2))) * 1e6


def main() -> None:
    actuator = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    sequence = Sequence.thesis()
    duration = sequence.segments[0].duration
    t = np.arange(math.ceil(duration * RATE)) / RATE
    drive = Drive(t, sequence.segments[0].voltage(t))
    c = actuator.coefficients()
    _, rest = at_rest(c)
    start = initial_state(c, rest)[:5]
    atol_weights = np.array([1.0, 100.0, 1.0, 1.0, 1.0])  # the rate may err more than the stretch

    def ours() -> np.ndarray:
        return simulated(c, drive)

    def lsoda(tolerance: float) -> np.ndarray:
        return solve_ivp(
            rates_of, (0.0, t[-1]), start, method="LSODA", t_eval=t, rtol=tolerance,
            atol=tolerance * atol_weights,
        ).y[0]  # fmt: skip

    def lsoda_in_fortran(tolerance: float) -> np.ndarray:
        return odeint(
            rates_of, start, t, tfirst=True, rtol=tolerance, atol=tolerance * atol_weights,
            mxstep=100_000,
        )[:, 0]  # fmt: skip

    def cvode(tolerance: float) -> np.ndarray:
        solver = CVODE(
            rates, method="Adams", rtol=tolerance, atol=tolerance * atol_weights,
            max_num_steps=100_000,
        )  # fmt: skip
        return solver.solve(t, start).y[:, 0]

    reference = solve_ivp(
        rates_of, (0.0, t[-1]), start, method="DOP853", t_eval=t, rtol=1e-10,
        atol=1e-13 * atol_weights, max_step=2e-3,
    ).y[0]  # fmt: skip

    def error(stretch: np.ndarray) -> float:
        return float(np.max(np.abs(stretch - reference))) * THESIS_FILM.length

    base, stretch = timed(ours, 51)
    print(f"thesis record, two periods, {duration:.1f} s, {t.size} samples at {RATE:g} Hz")
    print(f"{'solver':<44}{'ms':>10}{'error um':>11}{'ratio':>9}{'target':>9}")
    name = "this kernel (exponential Runge-Kutta)"
    print(f"{name:<44}{base * 1e3:>10.3f}{error(stretch) * 1e6:>11.4f}{'1x':>9}")
    for name, run, target in (
        ("SciPy LSODA, solve_ivp", lsoda, "150x"),
        ("SciPy LSODA, odeint", lsoda_in_fortran, ""),
        ("SUNDIALS CVODE Adams", cvode, "60x"),
    ):
        tolerance = next((x for x in TOLERANCES if error(run(x)) <= ENOUGH), TOLERANCES[-1])
        spent, stretch = timed(partial(run, tolerance), 7)
        label = f"{name}, rtol = atol = {tolerance:.0e}"
        print(
            f"{label:<44}{spent * 1e3:>10.3f}{error(stretch) * 1e6:>11.4f}"
            f"{spent / base:>8.0f}x{target:>9}"
        )
    print()
    print_cost_of_effects(actuator, drive)
    print()
    print_savings_of_rough_steps(actuator, sequence)


if __name__ == "__main__":
    main()
