"""Identify a model from records by one of two methods, with 95 % intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.actuator import Actuator
from dearig.model.errors import ModelError
from dearig.model.film import Strip
from dearig.model.fitting.estimates import (
    AT_BOUND,
    at_bound,
    estimates_with_intervals,
    recentre,
)
from dearig.model.fitting.intervals import CHI2_95, correlation_time
from dearig.model.fitting.levenberg import LocalFit, descend
from dearig.model.fitting.parameters import Contribution, Estimate, Layout, require_free
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.search import Progress, algorithm_1, film_starts, voltage_starts
from dearig.model.fitting.thinning import thinned
from dearig.model.material import Network
from dearig.model.records import FilmRecord, Record

__all__ = [
    "METHODS",
    "Identification",
    "add_intervals",
    "coarse_problem",
    "fit_globally",
    "identify",
    "is_worth_freeing",
]

METHODS = ("hybrid", "de")

# Hz: resolves relaxation times of tens of milliseconds; thinning raises it where means would not do
_COARSE_RATE = 50.0
_POPULATIONS = 20.0  # simulated until a descent counts as half done
_COARSE_SAMPLES = 1500  # of a film record
_SCOUT_ITERATIONS = 10  # of each start, before the worse ones are dropped


@dataclass(frozen=True)
class Identification:
    """Result of a fit.

    ``model`` is the fitted actuator or strip, ``estimates`` its parameters with 95 % intervals,
    ``covariance`` (f, f) that of ``covariance_names``, in SI units. ``cost`` is the mean square of
    the residuals over the noise (1 when only noise is left); ``correlation`` the correlation
    time of the residuals in samples, by which the intervals are widened. ``held_limits`` names the
    locking limits that were held because the data do not determine them. ``warnings``
    are sentences for the operator. ``budget`` are the contributions of given values to the
    uncertainty (``dearig.model.fitting.budget``).
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
    budget: tuple[Contribution, ...] = ()

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
        Estimate(
            q.name, q.unit, float(v), 0.0, math.inf, False, AT_BOUND if end else words,
            at_bound=bool(end),
        )
        for q, v, end in zip(
            layout.quantities, values, at_bound(layout, layout.coordinates(values)), strict=True
        )
    ]  # fmt: skip
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
    warnings += [
        f"{e.name} is {AT_BOUND}: the data may ask for a value beyond it"
        for e in estimates
        if e.at_bound
    ]
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


def coarse_problem(problem: Problem) -> Problem:
    """Return the problem on means of neighbouring samples where records are denser than needed."""
    base = problem.layout.base
    records = [
        r.coarse(_COARSE_SAMPLES)
        if isinstance(r, FilmRecord) or not isinstance(base, Actuator)
        else thinned(r, _COARSE_RATE, base)
        for r in problem.records
    ]
    return Problem(records, problem.layout, problem.workers)


class _Descents:
    """Progress of so many descents, shown at each population that one of them simulates."""

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress, self._total = progress, total
        self._ended = self._populations = 0

    def simulated(self, _count: int, _cost: float) -> None:
        """Count a population; how many a descent takes is not known."""
        self._populations += 1
        part = 1.0 - 0.5 ** (self._populations / _POPULATIONS)
        self._progress("descents", min((self._ended + part) / self._total, 1.0))

    def ended(self) -> None:
        """Count the end of a descent."""
        self._ended, self._populations = self._ended + 1, 0
        self._progress("descents", min(self._ended / self._total, 1.0))


def fit_globally(
    problem: Problem, nested: Network | None, progress: Progress, stiffening: bool = True
) -> tuple[LocalFit, np.ndarray]:
    """Fit by global search, descents, then the limits; return the fit and what is held (d,).

    The limits and shapes of the strain energies of an actuator are first held where springs are
    neo-Hookean: at a few per cent of strain they are undetermined and distort the relaxation times.
    They are freed at the end, and stay free only if that lowers chi-square significantly. Those of
    a film are free unless ``stiffening`` is False.
    """
    layout = problem.layout
    limits = layout.shapes
    driven_by_voltage = isinstance(layout.base, Actuator)
    first = limits if driven_by_voltage or not stiffening else np.zeros_like(limits)
    progress("global search", 0.0)
    coarse = coarse_problem(problem)
    starts = (
        voltage_starts(coarse, progress)
        if driven_by_voltage
        else film_starts(coarse, progress, stiffening)
    )
    if nested is not None:
        starts = np.vstack([starts, layout.padded(nested)])
    descents = _Descents(progress, len(starts) + 4)
    coarse.on_simulations = descents.simulated
    fits = []
    for start in starts:
        fits.append(descend(coarse, start, first, iterations=_SCOUT_ITERATIONS))
        descents.ended()
    # two, because the best after a few steps is not always the best at the end
    leaders = sorted(fits, key=lambda f: f.cost)[:2]
    ends = []
    for leader in leaders:
        ends.append(descend(coarse, leader.x, first))
        descents.ended()
    best = min(ends, key=lambda f: f.cost)
    if driven_by_voltage and limits.any():
        freed = descend(coarse, best.x, iterations=20)
        if is_worth_freeing(coarse, best.cost, freed, int(limits.sum())):
            best, first = freed, np.zeros_like(limits)
    descents.ended()
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
    coarse = coarse_problem(problem)
    recentre(coarse, problem, values)
    found = estimates_with_intervals(coarse, values, held, lambda part: progress("intervals", part))
    progress("intervals", 1.0)
    problem.simulations += coarse.simulations
    return found
