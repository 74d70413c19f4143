"""Identify a model from records by one of two methods, with 95 % intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model import kernel
from dearig.model.errors import ModelError
from dearig.model.film.material import Network
from dearig.model.fitting.estimates import (
    MOVES_MAX,
    BetterPoint,
    Intervals,
    at_bound,
    end_text,
    estimates_with_intervals,
    fixed_estimate,
    recentre,
)
from dearig.model.fitting.intervals import (
    CHI2_95,
    correlation_time,
    covariance,
    firm_directions,
    linear_ends,
    linear_widths,
)
from dearig.model.fitting.levenberg import LocalFit, descend, gain_that_counts
from dearig.model.fitting.parameters import (
    Constraint,
    Contribution,
    Estimate,
    FitLayout,
    require_free,
)
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.rejection import ABOVE, DIAGNOSE, REJECTED, misfit_p, with_intervals
from dearig.model.fitting.search import Progress, algorithm_1, film_starts, voltage_starts
from dearig.model.fitting.spare import sums_text
from dearig.model.fitting.thinning import thinned
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.model.verdict import is_rejected, p_text, smallest_p

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
_LEADERS = 2  # starts that are followed to their ends
_POPULATIONS = 20.0  # simulated until a descent counts as half done
_COARSE_SAMPLES = 1500  # of a film record
_MISFIT = 1.5  # mean square over noise, where the readings at rest do not tell
_SCOUT_ITERATIONS = 10  # of each start, before the worse ones are dropped
_GAIN_LEFT = 0.1  # of the gain that counts: for it a fit that has converged goes on
_LAST_STEPS = 3  # at most: in a flat valley each gains a little
_RESOLVED = 0.2  # of a mean's interval: the shortest relaxation time of a search on means
_CORRECTIONS_MAX = 5  # of the means; each leaves some hundredths of the distance to the optimum
# Of an interval's width, which means and quicker steps may change: it changes a coverage of 95 %
# by a quarter of a per cent
_WIDTH_ERROR_MAX = 0.01
# Of a prior's variance, by which the data must narrow it to say anything of it
_PRIOR_INFORMED = 1e-6
# Of the rise of chi-square at the ends of linear intervals, which they may change
_RISE_ERROR_MAX = 0.05
# Hz and fidelity of the means for the intervals, the cheapest first
_LEVELS = (
    (0.5 * _COARSE_RATE, kernel.COARSE),
    (_COARSE_RATE, kernel.COARSE),
    (_COARSE_RATE, kernel.QUICK),
    (_COARSE_RATE, kernel.CAREFUL),
    (4.0 * _COARSE_RATE, kernel.QUICK),
)


@dataclass(frozen=True)
class Identification:
    """Result of a fit.

    ``model`` is the fitted actuator or strip, ``estimates`` its parameters with 95 % intervals,
    ``covariance`` (f, f) that of ``covariance_names``, in SI units. ``sums`` are estimates of sums
    of moduli of which the data do not determine the parts. ``cost`` is the mean square of
    the residuals over the noise (1 when only noise is left); ``correlation`` the correlation
    time of the residuals in samples, by which the intervals are widened. ``held_limits`` names the
    locking limits that were held because the data do not determine them. ``warnings`` are sentences
    for the operator. ``misfit_p`` is the probability that noise as that at rest leaves the residual
    of the training records, None where their rest does not tell. ``budget`` are the contributions
    of given values to the uncertainty (``dearig.model.fitting.budget``). ``constraints`` are what
    was stated of parameters, ``prior_chi2`` the chi-square of their priors, which ``cost`` leaves
    out, and ``prior_p`` the probability that priors are as far from what the data say (None
    without). ``starts`` are those of the global search, best first: the cost that each reached on
    means of the readings, and whether it was followed to its end; () without a search.
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
    sums: tuple[Estimate, ...] = ()
    misfit_p: float | None = None
    constraints: tuple[Constraint, ...] = ()
    prior_chi2: float = 0.0
    prior_p: float | None = None
    starts: tuple[tuple[float, bool], ...] = ()

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
    constraints: Sequence[Constraint] = (),
) -> Identification:
    """Fit ``base`` to ``records``: all its moduli, locking limits and relaxation times are free.

    But for ``constraints``: what is stated of parameters before the fit.

    ``base`` is an ``Actuator`` for records driven by voltage (its film and load are kept), a
    ``Strip`` for films driven by stretch. The values of its springs are not used as a start, only
    the number of branches and the kinds of spring; the parameters of its effects are. ``seed`` is
    used by "de" only. ``nested`` is a fit with fewer branches, from which one more descent starts,
    so that more branches never fit worse. ``progress(stage, fraction)`` is called repeatedly.
    Raises ``ModelError`` for records and models that do not fit together.
    """
    if method not in METHODS:
        raise ModelError(f"method {method!r} is not one of {', '.join(METHODS)}")
    layout = FitLayout(base, constraints=constraints)
    if method == "de" and layout.priors.size:
        raise ModelError("Algorithm 1 as printed weighs no residual, and so takes no prior")
    # the algorithm as printed takes the zero of displacement for exact
    problem = Problem(records, layout, workers, exact_zero=method == "de")
    require_free(layout, problem.samples)
    if method == "de":
        found = algorithm_1(problem, seed, progress)
        fit = descend(problem, layout.coordinates(found), layout.fixed, iterations=0)
        return _result(problem, method, fit, found, "Algorithm 1 gives no interval", ())
    fit, held_limits = fit_globally(problem, nested, progress)
    held_limits = held_limits & ~layout.fixed
    limits = tuple(n for n, h in zip(layout.names, held_limits, strict=True) if h)
    text = "no interval was asked for"
    result = _result(problem, method, fit, layout.values(fit.x), text, limits)
    return add_intervals(records, result, workers, progress) if intervals else result


def add_intervals(
    records: Sequence[Record],
    fitted: Identification,
    workers: int = 2,
    progress: Progress = _quiet,
    ended: Callable[[], bool] = lambda: False,
) -> Identification:
    """Return ``fitted`` with 95 % intervals; ``records`` are its training records.

    Where a profile comes to a better point, the fit moves there, and the intervals are about that.
    Once ``ended()`` is True, the intervals that are left come from the curvature at the optimum.
    """
    layout = FitLayout(fitted.model, constraints=fitted.constraints)
    problem = Problem(records, layout, workers)
    held = layout.fixed | np.isin(layout.names, fitted.held_limits)
    simulations = fitted.simulations
    found: Intervals | None = None
    gain: float | None = None
    for _ in range(MOVES_MAX):
        try:
            found = _intervals(problem, layout.initial(), held, progress, gain, ended)
        except BetterPoint as better:
            x = better.x
            if isinstance(layout.base, Actuator):
                means = coarse_problem(problem, corrected=True)
                x = _descend_on_means(problem, means, x, held)
                simulations += means.simulations
            fit = descend(problem, x, held, damping=1e-4)
            here = problem.costs(layout.coordinates(layout.initial())[None])[0]
            if fit.cost < here:
                fitted = _result(
                    problem, fitted.method, replace(fit, starts=fitted.starts),
                    layout.values(fit.x), "", fitted.held_limits,
                )  # fmt: skip
                layout = FitLayout(fitted.model, constraints=fitted.constraints)
                problem.layout = layout
            else:
                # so much is an error of the means
                gain = better.gained
        else:
            break
    if found is None:
        found = _intervals(problem, layout.initial(), held, progress, math.inf, ended)
    warnings = tuple(map(with_intervals, fitted.warnings))
    if found.sums:
        warnings = (*warnings, sums_text(found.sums))
    return replace(
        fitted,
        estimates=(*(e for e in fitted.estimates if not (e.free or e.is_fixed)), *found.estimates),
        sums=found.sums,
        covariance_names=found.names,
        covariance=found.covariance,
        warnings=warnings,
        simulations=simulations + problem.simulations,
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
        fixed_estimate(q)
        if q.is_fixed
        else Estimate(
            q.name, q.unit, float(v), 0.0, math.inf, False,
            end_text(q, float(v)) if end else words, at_bound=bool(end), constraint=q.constraint,
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
    left, rows = np.split(fit.residuals, [problem.measured.size])
    cost = float(left @ left) / problem.readings_fitted
    prior_p = _prior_p(problem, fit, held_limits)
    warnings = []
    p = _misfit_p(problem, left)
    if p is not None and is_rejected(p):
        warnings.append(
            f"{REJECTED}: noise as that at rest leaves such a residual with {p_text(p)}{DIAGNOSE}"
        )
    elif cost > _MISFIT and p is None and method == "hybrid":
        warnings.append(ABOVE)
    warnings += [
        f"{e.name} is {end_text(q, e.value)}: the data may ask for a value beyond it"
        for q, e in zip(layout.quantities, estimates[-layout.size :], strict=True)
        if e.at_bound
    ]
    if prior_p is not None and is_rejected(prior_p):
        warnings.append(
            f"the priors contradict the data ({p_text(prior_p)}); farthest from its prior is "
            f"{_farthest(layout, rows)}"
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
        cost=cost,
        correlation=correlation_time(left),
        simulations=problem.simulations,
        converged=fit.converged,
        warnings=tuple(warnings),
        misfit_p=p,
        constraints=layout.constraints,
        prior_chi2=float(rows @ rows),
        prior_p=prior_p,
        starts=fit.starts,
    )


def _prior_p(problem: Problem, fit: LocalFit, held_limits: Sequence[str]) -> float | None:
    """Return the probability that priors are as far from what the data alone say as here.

    None without priors. To first order the distances of the fit from the prior means have the
    covariance S - C, where S is that of the priors and C that of the fit: what the data say has the
    covariance that C^-1 - S^-1 gives, and its distance from the means has that plus S.
    """
    layout = problem.layout
    places = layout.priors
    if not places.size:
        return None
    held = layout.fixed | np.isin(layout.names, held_limits)
    jac = problem.jacobian(fit.x, ~held)
    left, rows = np.split(fit.residuals, [problem.measured.size])
    inflation = max(1.0, float(left @ left) / problem.readings_fitted) * max(
        1.0, correlation_time(left)
    )
    below = jac[left.size :]
    # of rows, which are in standard deviations of their priors
    weighed = np.vstack([jac[: left.size] / math.sqrt(inflation), below])
    rest = np.eye(places.size) - below @ covariance(weighed.T @ weighed, 1.0) @ below.T
    size, axes = np.linalg.eigh(rest)
    informed = size > _PRIOR_INFORMED
    far = (axes.T @ rows)[informed] ** 2 / size[informed]
    return (
        float(scipy.special.chdtrc(int(informed.sum()), float(far.sum())))
        if informed.any()
        else 1.0
    )


def _farthest(layout: FitLayout, rows: np.ndarray) -> str:
    """Return the parameter that is farthest from its prior, and by how much."""
    most = int(np.argmax(np.abs(rows)))
    far = float(abs(rows[most]))
    number = f"{far:.2g}" if far < 9.95 else f"{far:.0f}"  # "1.6e+02" is hard to read
    return f"{layout.names[layout.priors[most]]}, by {number} of its standard deviations"


def _misfit_p(problem: Problem, residuals: np.ndarray) -> float | None:
    """Return the probability that noise alone leaves ``residuals`` (N,), over the noise."""
    found, start = [], 0
    for record in problem.records:
        part = slice(start, start + record.measured.size)
        start = part.stop
        if isinstance(record, ActuatorRecord):
            good = np.isfinite(problem.sigma[part])
            left = np.where(good, residuals[part] * record.noise, np.nan)
            rest = record.displacement[: record.lead_in]
            found.append(misfit_p(left, rest, averaged=record.average > 1))
    return smallest_p(found)


def coarse_problem(
    problem: Problem, corrected: bool = False, rate: float = _COARSE_RATE
) -> Problem:
    """Return the problem on means of neighbouring samples where records are denser than needed.

    ``rate`` in Hz is that of an actuator's means, or more where accuracy asks for it. With
    ``corrected`` the caller takes off the difference that means and quicker steps make, by
    ``recentre``: fewer means and the quickest simulation of an actuator are then enough.
    """
    base = problem.layout.base
    records = [
        r.coarse(_COARSE_SAMPLES)
        if isinstance(r, FilmRecord) or not isinstance(base, Actuator)
        else thinned(r, rate, base, corrected)
        for r in problem.records
    ]
    fidelity = kernel.COARSE if corrected else kernel.CAREFUL
    return Problem(records, problem.layout, problem.workers, fidelity)


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
    first = first | layout.fixed
    progress("global search", 0.0)
    coarse = coarse_problem(problem, corrected=driven_by_voltage)
    starts = (
        voltage_starts(coarse, progress)
        if driven_by_voltage
        else film_starts(coarse, progress, stiffening)
    )
    if nested is not None:
        starts = np.vstack([starts, layout.padded(nested)])
    descents = _Descents(progress, len(starts) + 6)
    coarse.on_simulations = descents.simulated
    counted = problem.on_simulations

    def on_all_readings(count: int, cost: float) -> None:
        descents.simulated(count, cost)
        if counted is not None:
            counted(count, cost)

    problem.on_simulations = on_all_readings
    scouts = _of_resolved_times(coarse) if driven_by_voltage else coarse
    fits = []
    for start in starts:
        fits.append(descend(scouts, start, first, iterations=_SCOUT_ITERATIONS))
        descents.ended()
    # not one, because the best after a few steps is not always the best at the end
    ranked = sorted(fits, key=lambda f: f.cost)
    ends = []
    for leader in ranked[:_LEADERS]:
        ends.append(descend(scouts, leader.x, first))
        descents.ended()
    x = min(ends, key=lambda f: f.cost).x
    reached = [(f.cost, True) for f in ends] + [(f.cost, False) for f in ranked[_LEADERS:]]
    if driven_by_voltage:
        x = _descend_on_means(problem, coarse, x, first)
        descents.ended()
        freeable = int(np.count_nonzero(limits & ~layout.fixed))
        if freeable:
            # means that agree with all readings: what means add does not look like a limit
            freed = descend(coarse, x, layout.fixed, iterations=20)
            if is_worth_freeing(coarse, float(coarse.costs(x[None])[0]), freed, freeable):
                first = layout.fixed
                x = _descend_on_means(problem, coarse, freed.x, first)
    descents.ended()
    fit = descend(problem, x, first, damping=1e-4)
    enough = _GAIN_LEFT * gain_that_counts(fit.cost * problem.samples, problem.samples)
    last = descend(problem, fit.x, first, _LAST_STEPS, enough, 1e-4, known=fit.residuals)
    fit = replace(last, converged=fit.converged or last.converged)
    problem.on_simulations = counted
    progress("descents", 1.0)
    problem.simulations += coarse.simulations
    if scouts is not coarse:
        problem.simulations += scouts.simulations
    return replace(fit, starts=tuple(sorted(reached))), first


def _of_resolved_times(means: Problem) -> Problem:
    """Return the problem on ``means`` without relaxation times that they do not resolve.

    To means a branch so fast is a drag, with any time; and it makes the film stiff.
    """
    layout = copy(means.layout)
    layout.lower = layout.lower.copy()
    step = min(float(np.median(np.diff(r.time))) for r in means.records)
    times = layout.column("T")
    least = np.maximum(layout.lower[times], math.log(_RESOLVED * step))
    layout.lower[times] = np.minimum(least, layout.upper[times])
    found = copy(means)
    found.layout = layout
    return found


def _descend_on_means(
    problem: Problem, means: Problem, start: np.ndarray, held: np.ndarray
) -> np.ndarray:
    """Return coordinates (d,) near the optimum of ``problem``, by descents on its ``means``.

    Each descent begins with the readings of the means moved to where they agree with the full
    problem (space mapping, as in ``dearig.model.fitting.broyden``). It ends where the full
    cost no longer falls. ``held`` (d,) bool are parameters that are not fitted.
    """
    x, cost = start, float(problem.costs(start[None])[0])
    for _ in range(_CORRECTIONS_MAX):
        recentre(means, problem, problem.layout.values(x))
        moved = descend(means, x, held, damping=1e-4).x
        reached = float(problem.costs(moved[None])[0])
        gained = (cost - reached) * problem.samples
        if gained > 0.0:
            x, cost = moved, reached
        if gained < gain_that_counts(cost * problem.samples, problem.samples):
            break
    return x


def is_worth_freeing(problem: Problem, cost: float, freed: LocalFit, numbers: int) -> bool:
    """Whether ``freed``, with so many more parameters, is significantly better than ``cost``.

    Correlated residuals count as fewer independent readings.
    """
    left = problem.of_readings(freed.residuals)
    inflation = max(1.0, freed.cost) * max(1.0, correlation_time(left))
    return (cost - freed.cost) * problem.samples / inflation > CHI2_95 * numbers


def _intervals(
    problem: Problem,
    values: np.ndarray,
    held: np.ndarray,
    progress: Progress,
    gain: float | None,
    ended: Callable[[], bool],
) -> Intervals:
    """Return estimates with profile-likelihood intervals; ``held`` (d,) limits are undetermined."""
    if not isinstance(problem.layout.base, Actuator):
        means = coarse_problem(problem)
        recentre(means, problem, values)
        levels = [(means, np.ones(problem.layout.size, dtype=bool))]
    else:
        levels = _levels_of(problem, values, held)
    found = estimates_with_intervals(
        levels[0][0],
        values,
        held,
        lambda part: progress("intervals", min(part, 1.0)),
        ended=ended,
        gain=gain,
        finer=levels[1] if len(levels) > 1 else None,
    )
    problem.simulations += sum(means.simulations for means, _ in levels if means is not problem)
    progress("intervals", 1.0)
    return found


def _levels_of(
    problem: Problem, values: np.ndarray, held: np.ndarray
) -> list[tuple[Problem, np.ndarray]]:
    """Return problems with the optimum of ``problem``, each with its parameters (d,) bool.

    Each is the cheapest that gives the intervals of its parameters. ``values`` (d,) are the
    optimum, ``held`` (d,) bool the parameters that are not fitted. A profile refits the parameters
    some hundred times. The means of smooth readings determine them as well as all readings do, and
    so do quick steps. But where two branches hardly differ, the difference of their derivatives is
    as small as the error of the quickest steps: what they determine together is refitted in
    quick ones. And a relaxation time may be resolved by means where the fit is, but not where its
    interval ends: chi-square has to rise as much there as that of all readings does.
    """
    layout = problem.layout
    x, free = layout.coordinates(values), ~held
    exact = problem.jacobian(x, free)
    directions, bent = firm_directions(exact, values, layout, free)
    ends = linear_ends(layout, x, free, exact)
    rises = _rises(problem, x, ends)
    allowed = _RISE_ERROR_MAX * np.maximum(rises, CHI2_95)
    for rate, fidelity in _LEVELS:
        means = coarse_problem(problem, corrected=True, rate=rate)
        means.fidelity = fidelity
        widths = linear_widths(exact, means.jacobian(x, free), directions)
        if np.max(np.abs(widths - 1.0), initial=0.0) < _WIDTH_ERROR_MAX:
            recentre(means, problem, values)
            if np.all(np.abs(_rises(means, x, ends) - rises) < allowed):
                break
    else:
        means = problem
    found = [(means, ~bent)]
    if bent.any():
        finer = means if means is problem else copy(means)
        if finer.fidelity == kernel.COARSE:
            finer.fidelity = kernel.QUICK
        found.append((finer, bent))
    for each, _ in found:
        if each is not problem:
            recentre(each, problem, values)
    return found


def _rises(problem: Problem, x: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return by how much chi-square is larger at ``ends`` (P, d) than at ``x`` (d,)."""
    costs = problem.costs(np.vstack([x, ends]))
    return np.asarray((costs[1:] - costs[0]) * problem.samples)
