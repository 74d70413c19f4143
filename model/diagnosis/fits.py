"""Output-error fits of candidates: values, and the fitter that makes them.

Numbers of equations are those of ``app/docs/explanation/diagnosis.md``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from threading import Lock
from typing import Any

import numpy as np

from dearig.model import kernel
from dearig.model.diagnosis.preparation import (
    prepared,
    with_model_error,
    without_spikes,
    without_tails,
)
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.effects import EFFECTS
from dearig.model.fitting.broyden import descend_broyden
from dearig.model.fitting.channels import Channels, JointProblem
from dearig.model.fitting.coarse_drive import coarse_drive_of
from dearig.model.fitting.estimates import recentre
from dearig.model.fitting.identify import fit_globally, is_worth_freeing
from dearig.model.fitting.intervals import correlation_time, is_flat
from dearig.model.fitting.levenberg import LocalFit, descend
from dearig.model.fitting.parallel import Job, Result, parallel_map
from dearig.model.fitting.parameters import Constraint, FitLayout
from dearig.model.fitting.search import voltage_starts
from dearig.model.fitting.slow_noise import (
    DriftSpace,
    WhitenedProblem,
    drift_basis,
    late_basis,
    pink_density,
)
from dearig.model.readings.records import ActuatorRecord, Record, counted
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = ["DRIFT", "Fit", "Fitter", "Work", "fit_of", "gain_that_ends", "with_effect"]

#: How the marginalised drift is named among the members of a fit.
DRIFT = "drift"

_GAIN = 0.5  # of chi-square: what is left to gain changes no choice, whose odds are 12
_GAIN_PART = 1e-3  # of chi-square: the same, where more than twice the noise's power is left
_POLISHED = 2.0  # mean square over noise: what leaves more only polishes a misfit
REPORTED_TOLERANCE = (
    0.01  # of chi-square: the error of a model without effects is said to half a per cent
)
_NO_WEIGHT = 1e-6  # of the typical one: what the bounds of a descent leave of a weight at 0
_AT_ONCE = 1e-3  # s: a branch that relaxes faster than any record shows
_BASELINE_STARTS = 5  # of the global search
_BASELINE_ITERATIONS = 20
_TO_THE_END = 200  # iterations, enough for the valley of two branches of nearly equal times


@dataclass(frozen=True)
class Fit:
    """A model fitted to the records: coordinates ``x`` (d,) in the layout of ``problem``.

    ``fixed`` (d,) bool were held. ``cost`` is the mean square of the whitened residuals (N,) of the
    displacement, in units of the noise, in which a prior counts as a reading; ``jacobian`` (N, f)
    is one near ``x``, or not finite. It has further rows where priors or electrical channels take
    part in the fit. ``unseen`` is an effect that no channel shows, "" where there is none;
    ``handicap`` is added to the criterion for it.
    """

    problem: WhitenedProblem
    x: np.ndarray
    fixed: np.ndarray
    cost: float
    residuals: np.ndarray
    jacobian: np.ndarray
    unseen: str = ""
    handicap: float = 0.0

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of its effects."""
        return tuple(name for name, _ in self.problem.layout.base.effects)

    @property
    def drift(self) -> float:
        """Variance of the drift that is part of its noise; 0 for white noise."""
        return self.problem.noise_drift.amplitude if self.problem.noise_drift else 0.0

    @property
    def members(self) -> frozenset[str]:
        """Its effects, and ``DRIFT`` where the noise contains drift."""
        return frozenset(self.effects) | (frozenset([DRIFT]) if self.drift else frozenset())

    @cached_property
    def model(self) -> Actuator | Strip:
        """The fitted model."""
        layout = self.problem.layout
        return layout.model(layout.values(self.x))

    @property
    def seen(self) -> Actuator | Strip:
        """The fitted model as the channels see it."""
        effects = tuple(e for e in self.model.effects if e[0] != self.unseen)
        return replace(self.model, effects=effects)

    def by_relaxation_time(self) -> Fit:
        """Return the same fit with its branches in order of relaxation time."""
        layout = self.problem.layout
        places = layout.order_by_relaxation_time(layout.values(self.x))
        free = places[~self.fixed[places]]
        columns = np.searchsorted(np.flatnonzero(~self.fixed), free)
        return replace(
            self, x=self.x[places], fixed=self.fixed[places], jacobian=self.jacobian[:, columns]
        )

    @property
    def free(self) -> int:
        """Number of fitted parameters; the drift's variance is one.

        Weights of a general law that end at nothing are none: the grid offers more than the law is
        made of.
        """
        used = ~self.fixed & ~self._is_without_weight
        return int(np.count_nonzero(used)) + bool(self.drift)

    @property
    def _is_without_weight(self) -> np.ndarray:
        """Return which parameters (d,) are weights of a general law that end at nothing."""
        layout = self.problem.layout
        values = layout.values(self.x)
        return np.array(
            [
                q.kind == "effect"
                and EFFECTS[q.effect].is_general
                and q.parameter.neutral is not None
                and abs(value - q.parameter.neutral) < _NO_WEIGHT * q.parameter.typical
                for q, value in zip(layout.quantities, values, strict=True)
            ]
        )

    @property
    def has_fastest_branch(self) -> bool:
        """Whether a branch has the shortest time of the search: it may imitate a faster effect."""
        layout = self.problem.layout
        # a time that is stated imitates nothing
        times = [j for j in layout.column("T") if layout.quantities[j].constraint is None]
        return bool(np.any(np.isclose(self.x[times], layout.lower[times])))

    @cached_property
    def correlation(self) -> float:
        """Correlation time of the residuals in samples, the mean over the records."""
        parts = self.by_record()
        times = [correlation_time(part) for part in parts]
        return float(np.average(times, weights=[part.size for part in parts]))

    def by_record(self) -> list[np.ndarray]:
        """Return the residuals of each record."""
        return [self.residuals[a:b] for a, b in pairwise(self.problem.edges)]

    @cached_property
    def is_flat(self) -> bool:
        """Whether the spectrum of each record's residuals is that of white noise."""
        return all(is_flat(part) for part in self.by_record())

    def plain_residuals(self) -> np.ndarray:
        """Return measured less model (N,), in noises, with the drift in it."""
        if self.problem.noise_drift is None:
            return -self.residuals
        return -self.problem.white().residuals(self.x)

    def mean_drift(self) -> np.ndarray:
        """Return the most probable drift (N,) in noises, as the records count displacement."""
        problem = self.problem
        if problem.noise_drift is None:
            return np.zeros(self.residuals.size)
        mean = problem.noise_drift.mean(self.plain_residuals())
        for record, (a, b) in zip(problem.records, pairwise(problem.edges), strict=True):
            if isinstance(record, ActuatorRecord):
                mean[a:b] = counted(mean[a:b], max(record.lead_in, 1))
        return mean


class Work:
    """Simulations of a search, and their cost in integration steps."""

    def __init__(self) -> None:
        self.simulations = 0
        self.effort = 0.0
        self._counting = Lock()

    def add(self, simulations: int, effort: float) -> None:
        """Count some more, from any thread."""
        with self._counting:
            self.simulations += simulations
            self.effort += effort


def with_effect(model: Actuator | Strip, name: str, values: Sequence[float]) -> Actuator | Strip:
    """Return ``model`` with effect ``name`` at ``values`` in the order of its parameters."""
    names = (p.name for p in EFFECTS[name].parameters)
    pairs = tuple(zip(names, map(float, values), strict=True))
    return replace(model, effects=(*model.effects, (name, pairs)))


class Fitter:
    """Training ``records``, ``full`` and as the search uses them, and the fits made to them.

    ``raw`` are the full ones without spikes, noise with heavy tails included. The readings at rest
    of ``others``, records of the same sensor, tell the colour of its noise.
    ``watched`` is called after each population of simulations, from any thread, and may raise to
    end the search. ``constraints`` are what is stated of parameters, of springs and of effects.
    """

    def __init__(
        self,
        records: Sequence[Record],
        base: Actuator | Strip,
        settings: DiagnosisSettings,
        workers: int = 2,
        watched: Callable[[], None] = lambda: None,
        others: Sequence[Record] = (),
        constraints: Sequence[Constraint] = (),
    ) -> None:
        self.base, self.settings, self.workers = base, settings, workers
        self.constraints = tuple(constraints)
        self.others = tuple(others)
        self._measured = tuple(records)
        self.full = self.raw = tuple(with_model_error(r) for r in records)
        self.records = self._prepared(base)
        self.work, self.watched = Work(), watched
        self._coarse: dict[tuple[str, ...], np.ndarray] = {}
        self._space: dict[bool, DriftSpace] = {}
        self._pink_density = 0.0
        self._limits = np.zeros(0, dtype=bool)
        #: electrical channels that count in fits, known once a baseline is
        self.channels: Channels | None = None

    # -- problems: records as the search reads them

    def _prepared(self, model: Actuator | Strip) -> tuple[Record, ...]:
        # what a model of a rubber gets wrong no averaging takes away
        return tuple(with_model_error(prepared(r, model)) for r in self._measured)

    @property
    def of_actuator(self) -> bool:
        """Whether the records are driven by voltage."""
        return isinstance(self.base, Actuator)

    @cached_property
    def times(self) -> tuple[float, float]:
        """Range of the branches' relaxation times, in s: of a film, from two samples on."""
        records = self._measured if self.of_actuator else self.records
        longest = max(float(r.time[-1] - r.time[0]) for r in records)
        shortest = self.settings.branch_time_min_s
        if not self.of_actuator:
            shortest = 2.0 * min(float(np.median(np.diff(r.time))) for r in records)
        return shortest, self.settings.branch_time_max * longest

    @property
    def has_tails(self) -> bool:
        """Whether the noise of a record at rest has heavier tails than a normal distribution."""
        return any(a is not b for a, b in zip(self.full, self.raw, strict=True))

    # -- noise: B and L of (6), pseudo-values (7), masks of spikes

    def space(self, full: bool = False) -> DriftSpace:
        """Return the directions in which the records may drift."""
        if full not in self._space:
            records = self.full if full else self.records
            modes = self.settings.drift_modes
            rigs = [r for r in records if isinstance(r, ActuatorRecord)]
            self._space[full] = DriftSpace(
                [drift_basis(r, modes) for r in rigs], self._pink(rigs, modes)
            )
        return self._space[full]

    def drifts_at_rest(self, residuals: np.ndarray) -> bool:
        """Whether what is slow in ``residuals`` (N,), in noises, may be a drift of the reading.

        A drift is there before the voltage too. It is none where something slow that begins with
        the voltage is more probable, by the odds that tell explanations apart.
        """
        here, modes = self.space(), self.settings.drift_modes
        rigs = [r for r in self.records if isinstance(r, ActuatorRecord)]
        late = DriftSpace([late_basis(r, modes) for r in rigs], self._pink(rigs, modes))
        at_rest, moving = (
            space.misfit(space.most_probable(residuals), residuals) for space in (here, late)
        )
        return at_rest - moving < self.settings.alike

    def read_noise(self, model: Actuator | Strip) -> None:
        """Read the noise at rest; later problems are without spikes, of its tails and its colour.

        ``model`` is fitted to the records. Springs are sought in white normal noise: in slow noise
        their likelihood has more valleys.
        """
        _, self.records = self._cleaned(self.records, model, kernel.QUICK)
        self.raw, self.full = self._cleaned(self.raw, model, kernel.CAREFUL)
        self.read_colour()
        if isinstance(model, Actuator):
            rigs = [r for r in self._measured if isinstance(r, ActuatorRecord)]
            self.channels = Channels([r.electric for r in rigs], model)

    def _cleaned(
        self, records: Sequence[Record], model: Actuator | Strip, fidelity: int
    ) -> tuple[tuple[Record, ...], tuple[Record, ...]]:
        """Return ``records`` without spikes, and without heavy tails as well."""
        layout = FitLayout(model)
        x = layout.coordinates(layout.initial())
        whole, normal = [], []
        for record in records:
            problem = WhitenedProblem([record], layout, workers=1, fidelity=fidelity)
            residual = -problem.residuals(x) * record.noise
            whole.append(without_spikes(record, residual))
            normal.append(without_tails(whole[-1], residual))
        return tuple(whole), tuple(normal)

    def read_colour(self) -> None:
        """Read the 1/f noise of all records at rest; the noise of later problems has it."""
        known = (*self.records, *self.others)
        self._pink_density = pink_density(known, self.settings.odds, self.settings.alike)
        self._space.clear()

    def _pink(self, records: Sequence[ActuatorRecord], modes: int) -> list[np.ndarray] | None:
        """Return the variances (K,) of each record's 1/f noise in its modes; None without any."""
        density = self._pink_density
        number = np.arange(1.0, modes + 1.0)
        # of a cosine of amplitude 1: the density at its frequency over the record's duration; the
        # modes are lower by j^-2
        return [2.0 * density * number**3 / r.noise**2 for r in records] if density else None

    # -- what is fitted: which numbers of a model are free, in which noise

    def problem(
        self,
        model: Actuator | Strip,
        drift: float = 0.0,
        fidelity: int = kernel.QUICK,
        full: bool = False,
        layout: FitLayout | None = None,
    ) -> WhitenedProblem:
        """Return the records with the numbers of ``model`` free, under a ``drift`` in the noise.

        Relaxation times are those of the search unless a ``layout`` is given.
        """
        times = self.times if self.of_actuator else None
        layout = layout or FitLayout(model, times, constraints=self.constraints)
        records = self.full if full else self.records
        noise = self.space(full).drift(drift) if self.of_actuator else None
        how: dict[str, Any] = {
            "workers": self.workers, "fidelity": fidelity, "on_simulations": self._count
        }  # fmt: skip
        channels = self.channels
        if channels is not None and channels.concern(name for name, _ in model.effects):
            problem: WhitenedProblem = JointProblem(records, layout, noise, channels, **how)
        else:
            problem = WhitenedProblem(records, layout, noise, **how)
        if not full:
            problem.coarse_columns = self._coarse_columns(problem)
        return problem

    def _count(self, simulations: int, effort: float) -> None:
        self.work.add(simulations, effort)
        self.watched()

    def fixed(self, layout: FitLayout) -> np.ndarray:
        """Return which parameters (d,) are held: the locking limits, unless the baseline asks.

        And the grids of general laws: with weights between their nodes there is nothing to move.
        """
        held = np.array(
            [
                q.kind == "effect"
                and EFFECTS[q.effect].is_general
                and q.parameter.neutral is None
                and q.parameter.name not in EFFECTS[q.effect].fitted_shapes
                for q in layout.quantities
            ]
        )
        held[layout.shapes] = True
        if self._limits.size:
            held[: self._limits.size] = self._limits
        return held | layout.fixed

    def _coarse_columns(self, problem: WhitenedProblem) -> np.ndarray | None:
        """Return which derivatives coarse drives give: asked once of each set of effects."""
        layout = problem.layout
        if not any(isinstance(r, ActuatorRecord) and r.coarse_drive for r in problem.records):
            return None
        if layout.names not in self._coarse:
            plain = problem.white()
            x = layout.coordinates(layout.initial())
            self._coarse[layout.names] = plain.find_coarse_columns(x, ~self.fixed(layout))
        return self._coarse[layout.names]

    # -- fits: secants to compare, Levenberg-Marquardt to end, every sample to report

    def map(self, work: Callable[[Job], Result], jobs: Sequence[Job]) -> list[Result]:
        """Return ``work(job)`` for each of ``jobs``, which are independent fits."""
        return parallel_map(work, jobs, self.workers, "fit")

    def costs(self, problem: WhitenedProblem, rows: np.ndarray) -> np.ndarray:
        """Return the costs (P,) of coordinates (P, d), which are clipped into the bounds."""
        return problem.costs(np.clip(rows, problem.layout.lower, problem.layout.upper))

    def descend(
        self,
        problem: WhitenedProblem,
        x: np.ndarray,
        iterations: int,
        jacobian: np.ndarray | None = None,
        sure: bool = False,
    ) -> Fit:
        """Return the fit after so many secant iterations from coordinates ``x`` (d,)."""
        fixed = self.fixed(problem.layout)
        found = descend_broyden(problem, x, fixed, jacobian, iterations, 1.0, sure)
        return fit_of(problem, fixed, found)

    def further(self, fit: Fit, iterations: int, fidelity: int = kernel.QUICK) -> Fit:
        """Return ``fit`` after so many further secant iterations."""
        problem = fit.problem
        known: np.ndarray | None = fit.jacobian
        if problem.fidelity != fidelity:
            problem = self.problem(problem.layout.base, fit.drift, fidelity)
            known = None
        return self.descend(problem, fit.x, iterations, known)

    def refined(self, fit: Fit, part: float = _GAIN_PART) -> Fit:
        """Return ``fit`` at the end of its valley: secants first, then Levenberg-Marquardt.

        Where the noise is not near, that is where no such ``part`` of chi-square is left to gain.
        """
        problem = fit.problem
        if problem.fidelity == kernel.ROUGH:
            problem = self.problem(problem.layout.base, fit.drift)
        gain = gain_that_ends(fit, part)
        found = descend_broyden(problem, fit.x, fit.fixed, None, 40, gain, True)
        found = descend(problem, found.x, fit.fixed, _TO_THE_END, gain, 1e-3, quick=True)
        return fit_of(problem, fit.fixed, found)

    def careful(self, fit: Fit, iterations: int) -> Fit:
        """Return ``fit`` on every sample, with careful steps and two-sided differences."""
        problem = self.careful_problem(fit.model, fit.drift)
        found = descend(problem, fit.x, fit.fixed, iterations, gain_that_ends(fit), damping=1e-4)
        return fit_of(problem, fit.fixed, found)

    def careful_problem(
        self, model: Actuator | Strip, drift: float, layout: FitLayout | None = None
    ) -> WhitenedProblem:
        """Return every sample with careful steps; ``drift`` is that of the thinned records."""
        # its variance is in units of one reading's noise, which thinning has lowered
        ratios = [(t.noise / f.noise) ** 2 for t, f in zip(self.records, self.full, strict=True)]
        scaled = drift * sum(ratios) / len(ratios)
        return self.problem(model, scaled, kernel.CAREFUL, full=True, layout=layout)

    def thinned_about(self, careful: Fit, drift: float) -> WhitenedProblem:
        """Return the thinned records, moved so that their optimum is that of a ``careful`` fit.

        ``drift`` is that of the thinned records.
        """
        layout = careful.problem.layout
        problem = self.problem(careful.model, drift, layout=layout)
        recentre(problem, careful.problem, careful.problem.layout.values(careful.x))
        return problem

    # -- coordinates of starts

    def start_of(
        self, problem: WhitenedProblem, parent: np.ndarray, values: Sequence[float]
    ) -> np.ndarray:
        """Return coordinates (d,) of ``problem``: a ``parent``'s, then the effect's ``values``."""
        layout = problem.layout
        row = np.concatenate([np.zeros(parent.size), values])
        x = np.concatenate([parent, layout.coordinates(row)[parent.size :]])
        return np.clip(x, layout.lower, layout.upper)

    def with_springs(self, fit: Fit, moduli: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return the coordinates (d,) of ``fit`` with other springs, moduli in Pa, times in s."""
        layout = fit.problem.layout
        row = layout.values(fit.x)
        mu, t = layout.column("mu"), layout.column("T")
        row[mu] = moduli[[layout.quantities[j].index for j in mu]]
        row[t] = times
        return layout.coordinates(row)

    # -- the baseline: springs without effects, from a global search

    def baseline(self, progress: Callable[[str, float], None]) -> Fit:
        """Return the model without effects, fitted from a global search of its springs."""
        base = replace(self.base, effects=())
        problem = self.problem(base)
        if not self.of_actuator:
            return self._strip_baseline(problem, progress)
        best = self._from_springs(problem, progress)
        self._prepare(best.model)
        return self.refined(replace(best, problem=self.problem(best.model)))

    def _from_springs(
        self,
        problem: WhitenedProblem,
        progress: Callable[[str, float], None],
        part: float = _GAIN_PART,
    ) -> Fit:
        """Return the best fit from several starts of the springs, ``refined`` to a ``part``."""
        starts = voltage_starts(problem, progress, _BASELINE_STARTS)
        fits = self.map(lambda x: self.descend(problem, x, 8), list(starts))
        leaders = sorted(fits, key=lambda f: f.cost)[:2]
        fits = self.map(
            lambda f: self.descend(problem, f.x, _BASELINE_ITERATIONS, sure=True), leaders
        )
        return self.refined(min(fits, key=lambda f: f.cost), part)

    def identified(self, baseline: Fit, iterations: int) -> Fit:
        """Return the model without effects as ``identify`` fits it, on every sample.

        The search holds the locking limits, and seeks a branch that relaxes at once as a drag, one
        that never does as a stiffer spring. Here relaxation times are free, and so are the limits
        where that explains significantly more. The fit is ``baseline`` where nothing is better.
        """
        fits = [self.careful(baseline, iterations)]
        if not self.of_actuator:
            return fits[0]
        layout = FitLayout(baseline.model, constraints=self.constraints)
        problem = self.problem(baseline.model, layout=layout)
        own = baseline.problem.layout.values(baseline.x)
        # the shortest branch as a drag: modulus times relaxation time is what slow motion shows
        drag = own.copy()
        times = layout.column("T")
        shortest = times[np.argmin(own[times])]
        modulus = layout.column("mu")[-times.size :][np.argmin(own[times])]
        drag[shortest], drag[modulus] = _AT_ONCE, own[modulus] * own[shortest] / _AT_ONCE
        starts = np.clip(layout.coordinates(np.array([own, drag])), layout.lower, layout.upper)
        wide = [
            self._from_springs(problem, lambda *_: None, REPORTED_TOLERANCE),
            *self.map(
                lambda x: self.descend(problem, x, _BASELINE_ITERATIONS, sure=True), list(starts)
            ),
        ]
        best = min(wide, key=lambda f: f.cost)
        fixed, gain = best.fixed, gain_that_ends(best, REPORTED_TOLERANCE)
        found = descend(problem, best.x, fixed, _BASELINE_ITERATIONS, gain, 1e-4, quick=True)
        stated, limits = layout.fixed, int(np.count_nonzero(fixed & ~layout.fixed))
        freed = descend(problem, found.x, stated, _BASELINE_ITERATIONS, gain, quick=True)
        if is_worth_freeing(problem, found.cost, freed, limits):
            found, fixed = freed, stated
        every = self.careful_problem(baseline.model, 0.0, layout)
        found = descend(every, found.x, fixed, iterations, gain, 1e-4, quick=True)
        fits.append(fit_of(every, fixed, found))
        return min(fits, key=lambda f: f.cost)

    def _prepare(self, model: Actuator | Strip) -> None:
        """Thin the records as the fitted ``model`` allows, and find their coarse drives."""
        self.records = tuple(
            replace(r, coarse_drive=coarse_drive_of(r, model))
            if isinstance(r, ActuatorRecord) and isinstance(model, Actuator)
            else r
            for r in self._prepared(model)
        )
        self.read_noise(model)
        self._coarse.clear()

    def _strip_baseline(
        self, problem: WhitenedProblem, progress: Callable[[str, float], None]
    ) -> Fit:
        """The same of strips; the limits are free where that explains significantly more."""
        found, fixed = fit_globally(problem, None, progress, stiffening=False)
        limits = int(np.count_nonzero(fixed & ~problem.layout.fixed))
        if limits:
            freed, free = fit_globally(problem, None, progress)
            if is_worth_freeing(problem, found.cost, freed, limits):
                found, fixed = freed, free
        self._limits = fixed
        return fit_of(problem, fixed, found)


def gain_that_ends(fit: Fit, part: float = _GAIN_PART) -> float:
    """Return the gain of chi-square below which a descent from ``fit`` has ended.

    Where much more than noise is left, it is a ``part`` of that.
    """
    return _GAIN if fit.cost < _POLISHED else part * fit.cost * fit.problem.samples


def fit_of(problem: WhitenedProblem, fixed: np.ndarray, found: LocalFit) -> Fit:
    """Return what a descent has ``found`` for ``problem``, with parameters ``fixed`` (d,)."""
    readings, rows = problem.of_readings(found.residuals), problem.of_channels(found.residuals)
    cost = found.cost
    if rows.size:
        left = found.cost * problem.samples - float(rows @ rows)
        cost = left / (problem.samples - rows.size)
    return Fit(problem, found.x, fixed, cost, readings, found.jacobian)
