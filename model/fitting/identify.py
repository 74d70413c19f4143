"""Identify a model from records by one of two methods, with 95 % intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.actuator import Actuator
from dearig.model.errors import ModelError
from dearig.model.film import Strip
from dearig.model.fitting.intervals import CHI2_95, correlation_time, covariance, profile
from dearig.model.fitting.levenberg import LocalFit, descend
from dearig.model.fitting.parameters import Estimate, Layout, require_free
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.search import Progress, algorithm_1, film_starts, voltage_starts
from dearig.model.fitting.thinning import thinned
from dearig.model.material import Network
from dearig.model.records import ActuatorRecord, FilmRecord, Record

__all__ = [
    "METHODS",
    "Identification",
    "add_intervals",
    "fit_globally",
    "identify",
    "is_determined",
    "is_worth_freeing",
]

METHODS = ("hybrid", "de")

_COARSE_RATE = 125.0  # Hz: resolves relaxation times of tens of milliseconds
_COARSE_SAMPLES = 1500  # of a film record
_SCOUT_ITERATIONS = 10  # of each start, before the worse ones are dropped
_DETERMINED_RATIO = 5.0  # ratio of the ends of an interval, above which a value is not quoted
_J_WORDS = "no spring stiffens measurably at these stretches: only a lower bound"


@dataclass(frozen=True)
class Identification:
    """Result of a fit.

    ``model`` is the fitted actuator or strip, ``estimates`` its parameters with 95 % intervals,
    ``covariance`` (f, f) that of ``covariance_names``, in SI units. ``cost`` is the mean square of
    the residuals over the noise (1 when only noise is left); ``correlation`` the correlation
    time of the residuals in samples, by which the intervals are widened. ``held_limits`` names the
    locking limits that were held because the data do not determine them. ``warnings``
    are sentences for the operator.
    """

    method: str
    model: Actuator | Strip
    estimates: tuple[Estimate, ...]
    covariance_names: tuple[str, ...]
    covariance: np.ndarray
    cost: float
    correlation: float
    simulations: int
    converged: bool
    warnings: tuple[str, ...]
    held_limits: tuple[str, ...] = ()

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters that these data do not determine."""
        return tuple(e.name for e in self.estimates if not e.determined)


def _quiet(stage: str, fraction: float) -> None:
    """Progress that is not shown."""


def identify(
    records: Sequence[Record],
    base: Actuator | Strip,
    method: str = "hybrid",
    seed: int = 0,
    intervals: bool = True,
    nested: Network | None = None,
    workers: int = 2,
    progress: Progress = _quiet,
) -> Identification:
    """Fit ``base`` to ``records``: all its moduli, locking limits and relaxation times are free.

    ``base`` is an ``Actuator`` for records driven by voltage (its film and load are kept), a
    ``Strip`` for films driven by stretch. The values of its springs are not used as a start, only
    the number of branches and the kinds of spring; the parameters of its effects are. ``seed`` is
    used by "de" only. ``nested`` is a fit with fewer branches, from which one more descent starts,
    so that more branches never fit worse. ``progress(stage, fraction)`` is called repeatedly.
    Raises ``ModelError`` for records and models that do not fit together.
    """
    if method not in METHODS:
        raise ModelError(f"method {method!r} is not one of {', '.join(METHODS)}")
    layout = Layout(base)
    # the algorithm as printed takes the zero of displacement for exact
    problem = Problem(records, layout, workers, exact_zero=method == "de")
    require_free(layout, problem.samples)
    if method == "de":
        found = algorithm_1(problem, seed, progress)
        fit = descend(problem, layout.coordinates(found), iterations=0)
        return _result(problem, method, fit, found, "Algorithm 1 gives no interval", ())
    fit, held_limits = fit_globally(problem, nested, progress)
    limits = tuple(n for n, h in zip(layout.names, held_limits, strict=True) if h)
    words = "no interval was asked for"
    result = _result(problem, method, fit, layout.values(fit.x), words, limits)
    return add_intervals(records, result, workers, progress) if intervals else result


def add_intervals(
    records: Sequence[Record],
    fitted: Identification,
    workers: int = 2,
    progress: Progress = _quiet,
) -> Identification:
    """Return ``fitted`` with 95 % intervals; ``records`` are its training records."""
    layout = Layout(fitted.model)
    problem = Problem(records, layout, workers)
    held = np.array([name in fitted.held_limits for name in layout.names])
    estimates, names, cov = _intervals(problem, layout.initial(), held, progress)
    return replace(
        fitted,
        estimates=(*(e for e in fitted.estimates if not e.free), *estimates),
        covariance_names=names,
        covariance=cov,
        simulations=fitted.simulations + problem.simulations,
    )


def _result(
    problem: Problem,
    method: str,
    fit: LocalFit,
    found: np.ndarray,
    words: str,
    held_limits: tuple[str, ...],
) -> Identification:
    """Return the result at natural values ``found`` (d,); ``words`` say why it has no interval."""
    layout = problem.layout
    values = layout.by_relaxation_time(found)
    model = layout.model(values)
    base = layout.base
    estimates = [
        Estimate(q.name, q.unit, float(v), 0.0, math.inf, False, words)
        for q, v in zip(layout.quantities, values, strict=True)
    ]
    if isinstance(base, Actuator) and base.load.rest_length is not None:
        modulus = layout.build(values).equilibrium.modulus
        estimates.insert(
            0,
            Estimate(
                "mu_0", "Pa", modulus, modulus, modulus, True,
                "follows from the measured rest length and the weight", free=False,
            ),
        )  # fmt: skip
    correlation = correlation_time(fit.residuals)
    warnings = []
    if fit.cost > 1.5 and method == "hybrid":
        warnings.append(
            "the residual is above the noise: the model lacks something, and the intervals "
            "(widened by the residual's size and correlation) are a rough guide"
        )
    if method == "hybrid" and not fit.converged:
        warnings.append("the fit stopped before it converged")
    return Identification(
        method=method,
        model=model,
        estimates=tuple(estimates),
        covariance_names=(),
        covariance=np.empty((0, 0)),
        held_limits=held_limits,
        cost=fit.cost,
        correlation=correlation,
        simulations=problem.simulations,
        converged=fit.converged,
        warnings=tuple(warnings),
    )


def _coarse(problem: Problem) -> Problem:
    """Return the problem on means of neighbouring samples where records are denser than needed."""
    base = problem.layout.base
    records = [
        r.coarse(_COARSE_SAMPLES)
        if isinstance(r, FilmRecord) or not isinstance(base, Actuator)
        else thinned(r, _COARSE_RATE, base)
        for r in problem.records
    ]
    return Problem(records, problem.layout, problem.workers)


def _coarse_about(problem: Problem, values: np.ndarray) -> Problem:
    """Return the coarse problem with its optimum at that of the full one.

    Averaging shifts a curve, and intervals can be narrower than the shift. So the coarse
    measurement is the coarse model at the optimum plus the averaged residual of the full problem.
    """
    coarse = _coarse(problem)
    full, _ = problem.predict(values)
    thin, _ = coarse.predict(values)
    edges_full = np.cumsum([0, *(r.measured.size for r in problem.records)])
    edges_thin = np.cumsum([0, *(r.measured.size for r in coarse.records)])
    for i, record in enumerate(problem.records):
        model = full[0, edges_full[i] : edges_full[i + 1]]
        part = slice(edges_thin[i], edges_thin[i + 1])
        thinner = coarse.records[i]
        if isinstance(record, ActuatorRecord) and isinstance(thinner, ActuatorRecord):
            moved = replace(record, displacement=record.displacement - model)
            left = moved.in_means(thinner.means_of // record.means_of).measured
        elif isinstance(record, FilmRecord):
            pulled = replace(record, stress=record.stress - model)
            left = pulled.coarse(_COARSE_SAMPLES).measured
        coarse.measured[part] = thin[0, part] + left
    return coarse


def fit_globally(
    problem: Problem, nested: Network | None, progress: Progress, stiffening: bool = True
) -> tuple[LocalFit, np.ndarray]:
    """Fit by global search, descents, then the limits; return the fit and what is held (d,).

    The locking limits of an actuator are first held where springs do not stiffen: at a few per cent
    of strain they are undetermined and distort the relaxation times. They are freed at the end, and
    stay free only if that lowers chi-square significantly. Those of a film are free
    unless ``stiffening`` is False.
    """
    layout = problem.layout
    limits = np.zeros(layout.size, dtype=bool)
    limits[layout.column("J")] = True
    driven_by_voltage = isinstance(layout.base, Actuator)
    first = limits if driven_by_voltage or not stiffening else np.zeros_like(limits)
    coarse = _coarse(problem)
    starts = (
        voltage_starts(coarse, progress)
        if driven_by_voltage
        else film_starts(coarse, progress, stiffening)
    )
    if nested is not None:
        starts = np.vstack([starts, layout.padded(nested)])
    steps = len(starts) + 4
    fits = []
    for n, start in enumerate(starts):
        fits.append(descend(coarse, start, first, iterations=_SCOUT_ITERATIONS))
        progress("descents", (n + 1) / steps)
    # two, because the best after a few steps is not always the best at the end
    leaders = sorted(fits, key=lambda f: f.cost)[:2]
    best = min((descend(coarse, f.x, first) for f in leaders), key=lambda f: f.cost)
    progress("descents", (len(starts) + 2) / steps)
    if driven_by_voltage and limits.any():
        freed = descend(coarse, best.x, iterations=20)
        if is_worth_freeing(coarse, best.cost, freed, int(limits.sum())):
            best, first = freed, np.zeros_like(limits)
    progress("descents", (len(starts) + 3) / steps)
    fit = descend(problem, best.x, first, damping=1e-4)
    progress("descents", 1.0)
    problem.simulations += coarse.simulations
    return fit, first


def is_worth_freeing(problem: Problem, cost: float, freed: LocalFit, numbers: int) -> bool:
    """Whether ``freed``, with so many more parameters, is significantly better than ``cost``.

    Correlated residuals count as fewer independent readings.
    """
    inflation = max(1.0, freed.cost) * max(1.0, correlation_time(freed.residuals))
    return (cost - freed.cost) * problem.samples / inflation > CHI2_95 * numbers


def _intervals(
    problem: Problem, values: np.ndarray, held: np.ndarray, progress: Progress
) -> tuple[list[Estimate], tuple[str, ...], np.ndarray]:
    """Return estimates with profile-likelihood intervals; ``held`` (d,) limits are undetermined."""
    layout = problem.layout
    coarse = _coarse_about(problem, values)
    centre = descend(coarse, layout.coordinates(values), held, iterations=10)
    free = ~held
    residuals = centre.residuals
    inflation = max(1.0, centre.cost) * max(1.0, correlation_time(residuals))
    jac = coarse.jacobian(centre.x, free)
    cov = covariance(jac.T @ jac, inflation)
    # a held limit is freed alone for its own profile; the others stay practically neo-Hookean
    estimates = []
    done = 0

    def tick() -> None:
        nonlocal done
        done += 1
        progress("intervals", 1.0 - 0.5 ** (done / (3.0 * layout.size)))

    chi2 = centre.cost * coarse.samples
    for j, q in enumerate(layout.quantities):
        sides = (-1.0,) if held[j] else (-1.0, 1.0)  # a held limit is already at its upper end
        low, high = profile(coarse, centre.x, chi2, j, jac, inflation, held, tick, sides)
        value = float(values[j])
        if q.logarithmic:
            low, high = math.exp(low), math.exp(high)
        if q.kind != "effect":
            low = max(low, 0.0)
        low, high = float(min(low, value)), float(max(high, value))
        determined = is_determined(low, high)
        note = "" if determined else _open_words(low, high)
        if held[j]:
            note = _J_WORDS if low > 0.0 else "not determined by these data"
        estimates.append(Estimate(q.name, q.unit, value, low, high, determined, note))
    progress("intervals", 1.0)
    problem.simulations += coarse.simulations
    names = tuple(n for n, f in zip(layout.names, free, strict=True) if f)
    natural = np.where([q.logarithmic for q in layout.quantities], values, 1.0)[free]
    return estimates, names, cov * np.outer(natural, natural)


def is_determined(low: float, high: float) -> bool:
    """Whether an interval is narrow enough for its value to be quoted, and excludes 0."""
    near, far = sorted((abs(low), abs(high)))
    return low * high > 0.0 and far < math.inf and far / near <= _DETERMINED_RATIO


def _open_words(low: float, high: float) -> str:
    if low < 0.0 < high:
        return "not distinguishable from 0 with these data"
    if low == 0.0 and math.isinf(high):
        return "not determined by these data"
    if math.isinf(high):
        return "only a lower bound"
    if low == 0.0:
        return "only an upper bound"
    return f"known only within a factor of {high / low:.3g}"
