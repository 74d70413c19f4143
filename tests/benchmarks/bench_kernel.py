"""How much faster the model's kernel follows the thesis's record than general-purpose solvers do.

Run as ``python -m tests.benchmarks.bench_kernel``. One thesis record is two periods of eq. 49
(22.8 s) with Table 3's film. The same right-hand side, compiled, goes to every solver; the general
ones are set as loosely as their error against a 1e-10 reference stays below 0.1 um. SciPy has LSODA
twice: stepped from Python (solve_ivp) and all in Fortran (odeint). A second table has what effects
of ``dearig.model.effects`` cost, a third what the quick steps of a search save. Medians of repeats
in one run: compare the ratios, the milliseconds belong to this machine and its load.
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
from dearig.model.actuator import Actuator, Drive, at_rest, initial_state, reading_of
from dearig.model.coefficients import REST
from dearig.model.effects import EFFECTS, EffectValues
from dearig.model.excitation import Sequence
from dearig.model.fitting.coarse_drive import coarse_drive_of
from dearig.model.material import (
    STANDARD_GRAVITY,
    TABLE_3,
    THESIS_FILM,
    THESIS_LOAD,
    VACUUM_PERMITTIVITY,
)
from dearig.model.records import ActuatorRecord
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
def returned(t: float, y: np.ndarray) -> np.ndarray:
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


def followed(c: np.ndarray, drive: Drive, fidelity: int = kernel.CAREFUL) -> np.ndarray:
    """Stretch (N,) from rest, as a fit would have it, or in ``fidelity`` as a search would."""
    y = initial_state(c, c[REST])
    stretch, rate = np.empty(drive.time.size), np.empty(drive.time.size)
    kernel.drive_by_voltage(
        c, drive.time, drive.voltage, drive.ends, drive.temperature, y, stretch, rate, fidelity
    )
    return stretch


def at_neutral(name: str) -> EffectValues:
    """The effect with its sizes neutral, and its shapes typical."""
    neutral = {p.name: p.neutral for p in EFFECTS[name].amplitudes}
    return ((name, tuple((n, neutral.get(n, value)) for n, value in typical(name)[1])),)


def what_effects_cost(actuator: Actuator, drive: Drive) -> None:
    """Print how long the kernel takes with effects, relative to itself without any."""
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
        followed(c, drive)
    spent: list[list[float]] = [[] for _ in rows]
    for _ in range(21):  # in turn, so that the machine's other work falls on all alike
        for c, times in zip(rows, spent, strict=True):
            before = time.perf_counter()
            followed(c, drive)
            times.append(time.perf_counter() - before)
    base = statistics.median(spent[0])
    print(f"{'this kernel with':<44}{'ms':>10}{'ratio':>9}")
    for (label, _), times in zip(cases, spent, strict=True):
        middle = statistics.median(times)
        print(f"{label:<44}{middle * 1e3:>10.3f}{middle / base:>8.2f}x")


def what_quick_steps_save(actuator: Actuator, sequence: Sequence) -> None:
    """Print careful against hasty steps on a converter's staircase, under which the film rings.

    Hasty are those of a search, and, of what follows the path, those of its first look. Sketched
    are those by which a search is told what a number of the model does, with the reading at each
    sample; what they get wrong is nearly the same of neighbours, and gone in their difference but
    for the last column: the worst of any number, relative to what it does.
    """
    t = np.arange(math.ceil(sequence.segments[0].duration * STAIRCASE)) / STAIRCASE
    drive = Drive(t, sequence.segments[0].voltage(t), hold=True)
    record = ActuatorRecord("staircase", drive, np.zeros(t.size), NOISE)
    sketch = coarse_drive_of(record, actuator)
    assert sketch is not None
    print(
        f"{'staircase of 200 Hz':<28}{'careful ms':>11}{'hasty ms':>10}{'ratio':>8}{'um':>8}"
        f"{'sketch ms':>11}{'ratio':>8}{'um':>8}{'worst':>8}"
    )
    for name in ("", "linear drag", "electrode resistance", "Mullins softening", "dry friction"):
        effects = (typical(name),) if name else ()
        model = replace(actuator, effects=effects)
        c = model.coefficients()
        at_rest(c)
        careful, expected = timed(partial(followed, c, drive), 21)
        quick, found = timed(partial(followed, c, drive, kernel.ROUGH), 21)
        moved = (expected - expected[0]) * THESIS_FILM.length
        drawn, shown = timed(partial(drawn_up, c, sketch, t), 21)
        print(
            f"{name or 'no effect':<28}{careful * 1e3:>11.3f}{quick * 1e3:>10.3f}"
            f"{quick / careful:>7.2f}x{_rms_um((found - expected) * THESIS_FILM.length):>8.3f}"
            f"{drawn * 1e3:>11.3f}{drawn / careful:>7.2f}x{_rms_um(shown - moved):>8.3f}"
            f"{100.0 * missed_by(model, replace(record, coarse_drive=sketch)):>7.1f}%"
        )


def drawn_up(c: np.ndarray, sketch: Drive, times: np.ndarray) -> np.ndarray:
    """Readings (N,) at ``times`` by a sketch."""
    return reading_of(c, THESIS_FILM.length, sketch, 0.0, kernel.COARSE, times)[0]


def missed_by(model: Actuator, record: ActuatorRecord) -> float:
    """How far the sketch of ``record`` is from telling what a number does, at worst, of 1."""
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
        return followed(c, drive)

    def lsoda(tolerance: float) -> np.ndarray:
        return solve_ivp(
            returned, (0.0, t[-1]), start, method="LSODA", t_eval=t, rtol=tolerance,
            atol=tolerance * atol_weights,
        ).y[0]  # fmt: skip

    def lsoda_in_fortran(tolerance: float) -> np.ndarray:
        return odeint(
            returned, start, t, tfirst=True, rtol=tolerance, atol=tolerance * atol_weights,
            mxstep=100_000,
        )[:, 0]  # fmt: skip

    def cvode(tolerance: float) -> np.ndarray:
        solver = CVODE(
            rates, method="Adams", rtol=tolerance, atol=tolerance * atol_weights,
            max_num_steps=100_000,
        )  # fmt: skip
        return solver.solve(t, start).y[:, 0]

    reference = solve_ivp(
        returned, (0.0, t[-1]), start, method="DOP853", t_eval=t, rtol=1e-10,
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
        ("SUNDIALS CVODE Adams", cvode, "40x"),
    ):
        tolerance = next((x for x in TOLERANCES if error(run(x)) <= ENOUGH), TOLERANCES[-1])
        spent, stretch = timed(partial(run, tolerance), 7)
        label = f"{name}, rtol = atol = {tolerance:.0e}"
        print(
            f"{label:<44}{spent * 1e3:>10.3f}{error(stretch) * 1e6:>11.4f}"
            f"{spent / base:>8.0f}x{target:>9}"
        )
    print()
    what_effects_cost(actuator, drive)
    print()
    what_quick_steps_save(actuator, sequence)


if __name__ == "__main__":
    main()
