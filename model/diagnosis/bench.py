"""The bench on which models are tried: records thinned to what matters, fits, and how they compare.

Everything that chooses happens here, on the training records alone. A dense record is averaged over
a few samples first, as many as cost nothing; what is chosen is fitted once more to every sample.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from threading import Lock

import numpy as np
from scipy.stats.qmc import Sobol

from dearig.model import kernel
from dearig.model.actuator import Actuator, at_rest
from dearig.model.diagnosis.preparation import prepared, with_model_error
from dearig.model.diagnosis.results import NOISE_RMS, NOT_BY_CHANCE, Stage
from dearig.model.effects import any_hysteretic
from dearig.model.film import Strip
from dearig.model.fitting.broyden import descend_broyden
from dearig.model.fitting.coarse_drive import coarse_drive_of
from dearig.model.fitting.drift import DriftFit
from dearig.model.fitting.identify import fit_globally, is_determined, is_worth_freeing
from dearig.model.fitting.intervals import correlation_time, covariance, is_flat, unevenness
from dearig.model.fitting.left_out import left_out
from dearig.model.fitting.levenberg import LocalFit, descend
from dearig.model.fitting.parallel import Job, Result, parallel_map
from dearig.model.fitting.parameters import Estimate, Layout
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.search import moving_starts, voltage_misfit, voltage_starts
from dearig.model.records import ActuatorRecord, Record

__all__ = [
    "Bench",
    "Trial",
    "akaike",
    "information",
    "merged",
    "relieved",
]

#: s; a branch that relaxes faster than the excitation shows is a drag, and is sought as one
FASTEST_BRANCH = 0.1
_LONGER_THAN_RECORD = 3.0  # a branch slower than so many records is another equilibrium spring
_STARTS = 5  # of the baseline, from the global search
_BASELINE = 20  # iterations of its descents
_SCOUTING = 3  # iterations from each start
_NOT_WORTH = 0.05  # of what a fit lies behind: promising less, it is left where it is
_FAR_BEHIND = 0.1  # of its own misfit: such a fit will not lead, and need not be sure of its end
_MUCH_EXPLAINED = 0.5  # of the cost without it is left: such a fit must be sure of its end
_SETTLING = 10  # iterations of a fit that may come to lead
_NOT_NEARER = 0.05  # of what it lies behind: promising less, it will not
_NO_RIVAL = 0.02  # of the same, of a fit that has come near the leader
_ENDING = 40  # iterations of a fit that others build on
_LAST_GAIN = 0.1  # of chi-square: what a descent must promise where laws are told apart
_ROUGHLY = 100.0  # of the noise's mean square: what leaves more need not be simulated any better
_WHITE_CORRELATION = 1.3
_LASTING = 2.0  # samples of correlation: so much is no noise of a sensor
_POLISHING = 8  # iterations on every sample
_TRIED = 9  # places that each of these tries, beside two for each number
_PATIENCE = 3  # iterations down a valley that together must gain something
_NEARLY = 1.02  # of the cost: a descent from elsewhere that comes so near is followed on
_FAR_ABOVE = 1.1  # of the cost of a descent from elsewhere: such a valley is left
_RESTARTS = 2  # from a new global search, beside what was found
_SETTING = 6  # iterations of the branches alone
_PLACED = 3  # of the starts, the branches in their places, that are followed on
_RESTART = 10  # iterations of each
_SCATTERED = 128  # places of numbers of which nothing is known
_SHAKEN = (0.5, 0.8)  # of a number, or of its logarithm: a little, and a lot
_UNSURE = 3.0  # standard deviations, by as much at least
_SHAKES = 2  # times that all is tried around what is best by then
_SCOUTED = 6  # of these, the best ones, that are followed
_SCATTERINGS = 2  # the second from the best of the first
_AS_GOOD = 0.98  # of the cost: who has gained less is where it was
_LEADERS = 2  # of several starts that are followed on: the best at first does not always get down
_ALIKE = 0.5  # of the logarithm of relaxation times: a factor of 1.6
_AT_END = 0.05  # of the logarithm of a relaxation time: so near the bound it wants to go further
_BESIDE = (0.6, 1.6)  # of the relaxation time of the branch that it helps
_SLOWER = 3.0  # times the relaxation time of the stiffest branch: such do something else than it
_ELSEWHERE = (1.0, 4.0, 16.0)  # s, where a branch that is spare may be of use
_WORTH = 1e-4  # of chi-square: a descent that promises less has ended
_MOST_OF_IT = 0.5  # of the motion: what does so much of it is not taken off the records
_SLOW_RATE = 50.0  # Hz: enough to see which branches there may be


def information(cost: float, free: int, samples: float) -> float:
    """Bayesian information criterion of a fit of ``free`` numbers to ``samples`` independent ones.

    ``cost`` is the mean square of residual over noise. The logarithm asks how much of what is left
    an effect explains, so that it also compares models that all leave more than noise.
    """
    return samples * math.log(max(cost, 1e-12)) + free * math.log(max(samples, 2.0))


def akaike(cost: float, free: int, samples: float) -> float:
    """Akaike's information criterion of the same: by it models are chosen that predict best."""
    return information(cost, 0, samples) + 2.0 * free


@dataclass(frozen=True)
class Trial:
    """A model fitted on the bench: ``x`` (d,) in the coordinates of ``problem``'s layout.

    ``fixed`` (d,) bool are numbers that were held; ``residuals`` (N,) are over the noise, ``cost``
    their mean square, ``correlation`` their correlation time in samples.
    """

    problem: Problem
    x: np.ndarray
    fixed: np.ndarray
    residuals: np.ndarray
    cost: float
    correlation: float

    @property
    def model(self) -> Actuator | Strip:
        """The fitted model."""
        layout = self.problem.layout
        return layout.model(layout.values(self.x))

    @property
    def models(self) -> tuple[Actuator | Strip, ...]:
        """The fitted model of each record, with the walk that each has of its own."""
        if self.drift is None:
            return (self.model,) * len(self.problem.records)
        return tuple(self._walked(sizes) for sizes in self.drift.amplitudes)

    @property
    def in_common(self) -> Actuator | Strip:
        """The fitted model with one walk for all records, which they may not show alike."""
        return self.model if self.drift is None else self._walked(self.drift.in_common)

    @property
    def residuals_in_common(self) -> np.ndarray:
        """What the model ``in_common`` leaves, (N,) over the noise."""
        return self.residuals if self.drift is None else self.drift.residuals_in_common

    @cached_property
    def drift(self) -> DriftFit | None:
        """Drift of each record by itself; None where no record has one."""
        return self.problem.fit_drift(self.x)

    def _walked(self, sizes: np.ndarray) -> Actuator | Strip:
        layout = self.problem.layout
        values = layout.values(self.x)
        values[self.problem.own] = sizes
        return layout.model(values)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects in it."""
        return tuple(name for name, _ in self.problem.layout.base.effects)

    @property
    def free(self) -> int:
        """How many numbers were fitted, those of each record's own among them."""
        more = 0 if self.problem.drift is None else self.problem.drift.more
        return int(np.count_nonzero(~self.fixed)) + more

    @property
    def is_of_actuator(self) -> bool:
        """True where the noise is that of a sensor; of a film it is what a model may be off."""
        return isinstance(self.problem.layout.base, Actuator)

    @property
    def is_noise(self) -> bool:
        """True where no more is left than noise; of an actuator nothing that lasts, either."""
        lasting = self.is_of_actuator and self.correlation >= _LASTING
        return self.cost < NOISE_RMS**2 and not lasting

    @property
    def is_white(self) -> bool:
        """True where only noise is left: no fit of the same model can be much better.

        By its spectrum, as a lead-in tells the size of the noise to some 4 % only. Of a film, where
        a model is as good as it is asked to be: what is left then is not white.
        """
        if not (self.is_noise and self.is_of_actuator):
            return self.is_noise
        flat = (is_flat(part) for part in _by_record(self.problem, self.residuals))
        return self.correlation <= _WHITE_CORRELATION and all(flat)

    @property
    def uneven(self) -> float:
        """The part of ``cost`` that by its spectrum is no white noise beyond doubt; 0 of a film."""
        if not self.is_of_actuator:
            return 0.0
        parts = _by_record(self.problem, self.residuals)
        shares = [unevenness(p, NOT_BY_CHANCE) for p in parts]
        return float(np.dot(shares, [p @ p for p in parts])) / self.problem.samples

    @property
    def record_costs(self) -> list[float]:
        """Mean square of residual over noise in each record."""
        parts = _by_record(self.problem, self.residuals)
        scales = _by_record(self.problem, self.problem.sigma)
        counts = [max(int(np.count_nonzero(np.isfinite(s))), 1) for s in scales]
        return [float(np.sum(p**2)) / n for p, n in zip(parts, counts, strict=True)]

    def jacobian(self, quick: bool = False) -> np.ndarray:
        """d(residuals)/dx (N, f) over the free numbers; ``quick`` by one-sided differences."""
        return self.problem.jacobian(self.x, ~self.fixed, self.residuals if quick else None)


class Work:
    """What was simulated, by all benches of a search: how many records, in how many quick steps."""

    def __init__(self) -> None:
        self.simulations = 0
        self.effort = 0.0
        self._counting = Lock()

    def add(self, simulations: int, effort: float) -> None:
        """Count some more, from any thread."""
        with self._counting:
            self.simulations += simulations
            self.effort += effort


def _unwatched() -> None:
    """For fits that nobody ends early."""


class Bench:
    """Training records of one kind, ``full`` and thinned, and the fits made to them.

    ``model`` is asked how far records may be thinned, and what is fitted to them as the baseline is
    asked again. ``watched`` is called often while they run, from any thread, and may raise to end
    them. What they simulate is counted in ``work``, its own where none is handed over.
    """

    def __init__(
        self,
        records: Sequence[Record],
        model: Actuator | Strip,
        workers: int,
        watched: Callable[[], None] = _unwatched,
        work: Work | None = None,
    ) -> None:
        self.watched = watched
        self.work = work or Work()
        self.full = tuple(with_model_error(r) for r in records)
        # what a model of a rubber gets wrong no averaging takes away
        self.records = tuple(with_model_error(prepared(r, model)) for r in records)
        self.workers = workers
        self._coarse_columns: dict[tuple[str, ...], np.ndarray] = {}
        longest = max(float(r.time[-1] - r.time[0]) for r in records)
        self.times = (
            (FASTEST_BRANCH, _LONGER_THAN_RECORD * longest)
            if isinstance(records[0], ActuatorRecord)
            else None
        )

    @property
    def simulations(self) -> int:
        """How many records were simulated, here and wherever its work is counted."""
        return self.work.simulations

    @property
    def is_dear(self) -> bool:
        """Whether a fit takes so long that they must be few: of several recordings of a rig."""
        return len(self.records) > 1 and isinstance(self.records[0], ActuatorRecord)

    @property
    def samples(self) -> int:
        """How many readings count."""
        return sum(
            r.measured.size if r.valid is None else int(np.count_nonzero(r.valid))
            for r in self.records
        )

    def problem(self, model: Actuator | Strip, fidelity: int = kernel.QUICK) -> Problem:
        """The thinned records, or with ``CAREFUL`` all samples, with ``model``'s numbers free."""
        layout = Layout(model, self.times)
        records = self.full if fidelity == kernel.CAREFUL else self.records
        problem = Problem(records, layout, self.workers, fidelity, self._count)
        if fidelity != kernel.CAREFUL:
            problem.coarse_columns = self._coarse_columns.get(layout.names)
        return problem

    def _count(self, simulations: int, effort: float) -> None:
        self.work.add(simulations, effort)
        self.watched()

    def parallel_map(self, work: Callable[[Job], Result], jobs: Sequence[Job]) -> list[Result]:
        """Return ``work(job)`` for each of ``jobs``, which are independent fits."""
        return parallel_map(work, jobs, self.workers, "fit")

    def baseline(self, base: Actuator | Strip, progress: Callable[[str, float], None]) -> Trial:
        """``base`` fitted from a global search.

        The locking limits of an actuator stay where no spring stiffens: at a few per cent of strain
        they could only imitate what is missing. Those of a film do unless they explain
        significantly more.
        """
        problem = self.problem(replace(base, effects=()))
        if isinstance(base, Strip):
            fit, fixed = fit_globally(problem, None, progress, stiffening=False)
            if fixed.any():
                freed, free = fit_globally(problem, None, progress)
                if is_worth_freeing(problem, fit.cost, freed, int(fixed.sum())):
                    fit, fixed = freed, free
        else:
            fixed = np.zeros(problem.layout.size, dtype=bool)
            fixed[problem.layout.column("J")] = True
            fits = self.parallel_map(
                lambda start: descend_broyden(problem, start, fixed, iterations=8, sure=False),
                list(voltage_starts(problem, progress, _STARTS)),
            )
            progress("descents", 0.5)
            fits = self.parallel_map(
                lambda f: descend(problem, f.x, fixed, iterations=_BASELINE), _leaders(fits)
            )
            fit = min(fits, key=lambda f: f.cost)
            problem, fit = self._thinned_anew(problem, fit, fixed)
        progress("descents", 1.0)
        return self._with_coarse_drives(_trial(problem, fit, fixed))

    def _thinned_anew(
        self, problem: Problem, fit: LocalFit, fixed: np.ndarray
    ) -> tuple[Problem, LocalFit]:
        """The ``fit`` to records thinned as its own model asks, where it asks for other rates."""
        layout = problem.layout
        model = layout.model(layout.values(fit.x))
        records = tuple(prepared(r, model) for r in self.full)
        if [r.measured.size for r in records] == [r.measured.size for r in self.records]:
            return problem, fit
        self.records = records
        problem = self.problem(layout.base)
        return problem, descend(problem, fit.x, fixed, iterations=_BASELINE)

    def _with_coarse_drives(self, trial: Trial) -> Trial:
        """The ``trial``, and those to come, with sketches as it foresees the records."""
        model = trial.model
        self.records = tuple(
            replace(r, coarse_drive=coarse_drive_of(r, model))
            if isinstance(r, ActuatorRecord) and isinstance(model, Actuator)
            else r
            for r in self.records
        )
        self._find_coarse_columns(self.problem(model, kernel.ROUGH), trial.fixed)
        return replace(trial, problem=self.problem(trial.problem.layout.base))

    def fit(
        self,
        model: Actuator | Strip,
        starts: Sequence[tuple[np.ndarray, np.ndarray | None]],
        fixed: np.ndarray,
        leader: float = 0.0,
        parent: float = 0.0,
        noise: bool = False,
        anew: Sequence[np.ndarray] = (),
    ) -> Trial:
        """``model`` fitted from the best of several starts: coordinates and a Jacobian near them.

        ``anew`` are others, with branches in new places: these take longer to show where they lead.

        ``leader`` is the cost to beat, ``parent`` that of the model without what is tried here: a
        fit that lies far behind the one, and not much before the other, is not followed to its end.
        ``noise`` is True where there is but noise to explain: then what a Jacobian from nearby
        promises is believed.
        """
        scouted = self.problem(model, kernel.ROUGH)
        scouted.coarse_columns = self._find_coarse_columns(scouted, fixed)
        problem = self.problem(model)
        scouts = [
            descend_broyden(scouted, start, fixed, jacobian, _SCOUTING, sure=False)
            for start, jacobian in starts
        ]
        scouts += [
            descend_broyden(scouted, start, fixed, iterations=_SCOUTING + _RESTART, sure=False)
            for start in anew
        ]
        best = min(scouts, key=lambda f: f.cost)
        if best.cost > _ROUGHLY and any_hysteretic(model.effects):
            problem = scouted

        def down(trial: Trial) -> Trial:
            behind = max(trial.cost - leader, 0.0) * problem.samples
            fit = descend_broyden(
                trial.problem,
                trial.x,
                fixed,
                best.jacobian,
                gain=max(0.5, _NOT_WORTH * behind, _WORTH * trial.cost * problem.samples),
                sure=not noise
                and (
                    behind < _FAR_BEHIND * problem.samples * trial.cost
                    or trial.cost < _MUCH_EXPLAINED * parent
                ),
            )
            return _trial(trial.problem, fit, fixed)

        return self._as_near(_trial(problem, best, fixed), down)

    def _find_coarse_columns(self, problem: Problem, fixed: np.ndarray) -> np.ndarray:
        """Which numbers (d,) bool sketches tell; asked once of each combination of effects.

        Where springs are told without effects, they are beside all that leave a film its turns.
        """
        layout, effects = problem.layout, problem.layout.base.effects
        if layout.names not in self._coarse_columns:
            springs: np.ndarray | None = None
            if effects and not any_hysteretic(effects):
                plain = self.problem(replace(layout.base, effects=()), problem.fidelity)
                springs = self._find_coarse_columns(plain, fixed[: plain.layout.size])
                springs = springs if springs.any() else None
            x = layout.coordinates(layout.initial())
            self._coarse_columns[layout.names] = problem.find_coarse_columns(x, ~fixed, springs)
        return self._coarse_columns[layout.names]

    def settled(self, trial: Trial, leader: float = math.inf) -> Trial:
        """``trial`` followed towards the end of its valley, on the thinned records.

        No further than it takes to see that it does not come near the cost of the ``leader``.
        """

        def down(trial: Trial) -> Trial:
            return self._down(trial, _SETTLING, _worth_going(trial, leader, _NOT_NEARER))

        return self._as_near(trial, down)

    def _as_near(self, trial: Trial, work: Callable[[Trial], Trial]) -> Trial:
        """What ``work`` makes of ``trial``: once more, carefully, if it comes near noise.

        Far from it a rough simulation is good enough, where an effect follows the path.
        """
        done = work(trial)
        if done.problem.fidelity != kernel.ROUGH or done.cost > _ROUGHLY:
            return done
        problem = self.problem(done.model)
        here = descend_broyden(problem, done.x, done.fixed, iterations=0)
        return work(_trial(problem, here, done.fixed))

    def _down(self, trial: Trial, iterations: int, gain: float) -> Trial:
        return self._further(self._broyden(trial, iterations, gain), iterations, gain)

    @staticmethod
    def _broyden(trial: Trial, iterations: int, gain: float) -> tuple[Trial, bool]:
        """``trial`` as far down as secants lead, and whether that is the bottom."""
        fit = descend_broyden(
            trial.problem, trial.x, trial.fixed, iterations=iterations, gain=_chi2(trial, gain)
        )
        return _trial(trial.problem, fit, trial.fixed), fit.converged

    @staticmethod
    def _further(reached: tuple[Trial, bool], iterations: int, gain: float) -> Trial:
        """What secants have ``reached``, and on from there: valleys that curve ask for more."""
        trial, converged = reached
        if converged:
            return trial
        fit = descend(
            trial.problem, trial.x, trial.fixed, iterations, _chi2(trial, gain), 1e-3, _PATIENCE,
            quick=True,
        )  # fmt: skip
        return _trial(trial.problem, fit, trial.fixed)

    def ended(self, trial: Trial, leader: float = math.inf) -> Trial:
        """``trial`` at the bottom of its valley, or of a better one that a spare branch opens.

        While something was missing, branches gathered where they could imitate it; two that relax
        alike are one, and the other is of use elsewhere. What others build on must not lack it.
        Beside a ``leader`` no further than it takes to see that it does not come near its cost.
        """
        return self._as_near(trial, lambda t: self._to_the_end(t, leader))

    def _to_the_end(self, trial: Trial, leader: float) -> Trial:
        def gain(trial: Trial) -> float:
            return _worth_going(trial, leader, _NO_RIVAL)

        near, converged = self._broyden(trial, _ENDING, gain(trial))
        layout = near.problem.layout
        starts = [] if near.is_white else _reseeded(layout, near.x)
        if not starts:
            return self._further((near, converged), _ENDING, gain(near))
        scouts = self.parallel_map(
            lambda x: descend_broyden(
                near.problem, x, near.fixed, iterations=_SCOUTING, sure=False
            ),
            starts,
        )
        fits = self.parallel_map(
            lambda f: descend_broyden(
                near.problem, f.x, near.fixed, f.jacobian, _RESTART, sure=False
            ),
            _leaders(scouts),
        )
        other = _trial(near.problem, min(fits, key=lambda f: f.cost), near.fixed)
        # who is far behind the other is not worth the rest of its way
        if near.cost < _FAR_ABOVE * other.cost:
            near = self._further((near, converged), _ENDING, gain(near))
        # a few steps do not reach the bottom: nearly as good is promising
        if other.cost < _NEARLY * near.cost:
            other = self._down(other, _ENDING, gain(other))
        return min(near, other, key=lambda t: t.cost)

    def to_the_last(self, trial: Trial) -> Trial:
        """``trial`` at the very bottom of its valley, or of one in which branches sought anew end.

        Two-sided differences, and some steps that gain next to nothing each: along a valley in
        which branches trade places with an effect, quick descents end some ten of chi-square too
        early, as much as tells two laws apart.
        """
        trial = self.sought(trial, trial.x[None])
        fit = descend(trial.problem, trial.x, trial.fixed, _ENDING, _LAST_GAIN, damping=1e-3)
        return _trial(trial.problem, fit, trial.fixed)

    def restarted(self, trial: Trial) -> Trial:
        """``trial``, or a better fit that a new global search leads to.

        One that leaves nothing to be found is the best. The baseline's search took what its effects
        do for work of the branches. Their part, as the trial has it, is taken off the measurement,
        and the branches are sought anew. Of a film it is asked whether its springs stiffen.
        """
        if trial.is_white:
            return trial
        if isinstance(trial.model, Strip):
            return self._stiffening(trial)
        return self.sought(trial, trial.x[None])

    @staticmethod
    def _stiffening(trial: Trial) -> Trial:
        """``trial``, or with its locking limits free, where that explains significantly more.

        While an effect was missing, what springs do at large strains was not to be seen.
        """
        layout, limits = trial.problem.layout, trial.problem.layout.column("J")
        if not trial.fixed[limits].any():
            return trial
        fixed = trial.fixed.copy()
        fixed[limits] = False
        nearer = trial.x.copy()
        nearer[limits] -= layout.reach(nearer)[limits]
        fits = [descend(trial.problem, x, fixed, iterations=_ENDING) for x in (trial.x, nearer)]
        freed = min(fits, key=lambda f: f.cost)
        if is_worth_freeing(trial.problem, trial.cost, freed, limits.size):
            return _trial(trial.problem, freed, fixed)
        return trial

    def scattered(self, trial: Trial, start: np.ndarray, more: np.ndarray, leader: float) -> Trial:
        """The model of ``trial`` fitted from the best of many places, or ``trial``.

        These are ``start`` (d,), but with ``more`` (d,) of its numbers scattered over their bounds;
        and once more from a better fit, beside which they may belong elsewhere. Beside a ``leader``
        no further than it takes to see that it does not come near its cost.
        """
        problem, layout, fixed = trial.problem, trial.problem.layout, trial.fixed
        where = Sobol(int(more.sum()), scramble=False).random(_SCATTERED)

        def down(trial: Trial) -> Trial:
            return self._down(trial, _ENDING, _worth_going(trial, leader, _NO_RIVAL))

        for _ in range(_SCATTERINGS):
            xs = np.tile(start, (_SCATTERED, 1))
            xs[:, more] = layout.lower[more] + where * (layout.upper - layout.lower)[more]
            leaders = [
                _trial(problem, f, fixed) for f in _leaders(self._scouted(trial, xs, _SCOUTED))
            ]
            found = min(self.parallel_map(down, leaders), key=lambda t: t.cost)
            gained = found.cost < _AS_GOOD * trial.cost
            trial = min(trial, found, key=lambda t: t.cost)
            if not gained or trial.is_white:
                break
            start = trial.x
        return self._as_near(trial, down)

    def shaken(self, trial: Trial, some: np.ndarray, leader: float) -> Iterator[Trial]:
        """Better and better fits of the model of ``trial`` from places around it, if there are any.

        There ``some`` (d,) of its numbers are other than they are: a little and a lot, and by as
        much as they are not determined; and again around a better one. Beside a ``leader`` as
        ``scattered``.
        """
        problem, layout, fixed = trial.problem, trial.problem.layout, trial.fixed
        where = 2.0 * Sobol(int(some.sum()), scramble=False).random(_SCATTERED // 2) - 1.0
        by_ratios = np.array([q.logarithmic for q in layout.quantities])
        unsure = _UNSURE * self._spread(trial, trial.jacobian(quick=True))

        def down(trial: Trial) -> Trial:
            return self._down(trial, _ENDING, _worth_going(trial, leader, _NO_RIVAL))

        best = trial
        for _ in range(_SHAKES):
            scouts: list[LocalFit] = []
            for part in _SHAKEN:
                width = np.maximum(part * np.where(by_ratios, 1.0, np.abs(best.x)), unsure)
                low = np.maximum(best.x - width, layout.lower)[some]
                high = np.minimum(best.x + width, layout.upper)[some]
                xs = np.tile(best.x, (where.shape[0], 1))
                xs[:, some] = 0.5 * (low + high + where * (high - low))
                scouts += self._scouted(trial, xs, _SCOUTED // len(_SHAKEN))
            found = _trial(problem, min(scouts, key=lambda f: f.cost), fixed)
            if found.cost > _AS_GOOD * best.cost:
                break
            yield found  # should the search be ended on the way down
            best = self._as_near(found, down)
            yield best
            if best.is_white:
                break

    def _scouted(self, trial: Trial, xs: np.ndarray, many: int) -> list[LocalFit]:
        """First steps down from the best places ``xs`` (K, d) for the model of ``trial``."""
        problem, fixed = trial.problem, trial.fixed
        return self.parallel_map(
            lambda x: descend_broyden(problem, x, fixed, iterations=_RESTART, sure=False),
            list(xs[np.argsort(problem.costs(xs))[:many]]),
        )

    def unaccounted(self, problem: Problem, xs: np.ndarray) -> np.ndarray:
        """Parts (K,) of the Maxwell stress that no branches account for, beside effects at ``xs``.

        By the measured stretch, without what the effects do to it at the coordinates (K, d); inf
        where that is not known, or most of the motion: without what holds a film still, twice its
        motion would be left, which branches of half the stiffness account for. Slow samples are
        enough, and quick.
        """
        left = np.full(len(xs), math.inf)
        cs = problem.layout.coefficients(problem.layout.values(xs))
        moved = np.linalg.norm(problem.measured / problem.sigma)
        for i, searched in enumerate(self._without_effects(problem, xs)):
            if searched is not None:
                taken = (searched.measured - problem.measured) / problem.sigma
                if np.linalg.norm(taken) > _MOST_OF_IT * moved:
                    continue
                left[i] = voltage_misfit(self._slow(searched), at_rest(cs[i])[1])
        return left

    @staticmethod
    def _slow(problem: Problem) -> Problem:
        """The ``problem`` in samples that are enough to see which branches there may be."""
        records = [r for r in problem.records if isinstance(r, ActuatorRecord)]
        return Problem([r.coarse(_SLOW_RATE) for r in records], problem.layout)

    def sought(self, trial: Trial, starts: np.ndarray) -> Trial:
        """``trial``, or a better fit from one of ``starts`` (K, d), with the branches sought anew.

        They settle beside the effects as these are there, before all are fitted.
        """
        return self._as_near(trial, lambda t: self._sought(t, starts))

    def _sought(self, trial: Trial, starts: np.ndarray) -> Trial:
        held = trial.fixed.copy()
        held[self.problem(replace(trial.model, effects=())).layout.size :] = True
        anew = [
            np.concatenate([springs, start[springs.size :]])
            for start, searched in zip(
                starts, self._without_effects(trial.problem, starts), strict=True
            )
            if searched is not None
            for springs in voltage_starts(self._slow(searched), lambda *_: None, _RESTARTS)
        ]
        if not anew:
            return trial

        scouted = self.problem(trial.model, kernel.ROUGH)
        placed = self.parallel_map(
            lambda x: descend_broyden(scouted, x, held, iterations=_SETTING, sure=False), anew
        )
        fits = self.parallel_map(
            lambda f: descend_broyden(scouted, f.x, trial.fixed, iterations=_RESTART, sure=False),
            _leaders(placed, _PLACED),
        )
        best = min(fits, key=lambda f: f.cost)
        fit = descend_broyden(trial.problem, best.x, trial.fixed, iterations=0)
        other = _trial(trial.problem, fit, trial.fixed)
        # who comes to where it was finds nothing on from there
        if other.cost < _AS_GOOD * trial.cost:
            other = self._down(other, _ENDING, _WORTH * other.cost)
        return min(trial, other, key=lambda t: t.cost)

    def moving(self, trial: Trial) -> list[tuple[np.ndarray, float]]:
        """Coordinates (d,) of springs beside a mass that the measured stretch asks for; its kg."""
        return [
            (springs, mass)
            for searched in self._without_effects(trial.problem, trial.x[None])
            if searched is not None
            for found, mass in (moving_starts(searched, _RESTARTS),)
            for springs in found
        ]

    def _without_effects(self, problem: Problem, xs: np.ndarray) -> list[Problem | None]:
        """The records without what the effects do at each of ``xs`` (K, d): for the springs alone.

        None of films, and of a model that cannot follow the records.
        """
        model = problem.layout.base
        if isinstance(model, Strip):
            return [None] * len(xs)
        if not model.effects:
            return [problem] * len(xs)
        plain = self.problem(replace(model, effects=()))
        # sizes of one effect are tried with the same springs
        springs, which = np.unique(xs[:, : plain.layout.size], axis=0, return_inverse=True)
        without, lost = plain.predict(plain.layout.values(springs))
        with_them, failed = problem.predict(problem.layout.values(xs))
        edges = np.cumsum([r.measured.size for r in self.records])[:-1]
        found: list[Problem | None] = []
        for there, bad, i in zip(with_them, failed, which.ravel(), strict=True):
            if bad or lost[i]:
                found.append(None)
                continue
            corrected = [
                replace(r, displacement=r.displacement - part)
                for r, part in zip(self.records, np.split(there - without[i], edges), strict=True)
                if isinstance(r, ActuatorRecord)
            ]
            found.append(Problem(corrected, plain.layout, self.workers, kernel.QUICK, self._count))
        return found

    def cost_at_any_age(self, trial: Trial) -> float:
        """The cost, had the readings of each record the age that suits the trial best.

        As far as it is not known: a sensor's clock is not the card's, and what is missing is then
        no effect of the rig.
        """
        problem = trial.problem
        open_ages = [r for r in problem.records if isinstance(r, ActuatorRecord) and r.lag_error]
        if not open_ages:
            return trial.cost
        older = [
            replace(r, lag=r.lag + r.lag_error) if isinstance(r, ActuatorRecord) else r
            for r in problem.records
        ]
        there = Problem(older, problem.layout, self.workers, problem.fidelity, self._count)
        moved = _by_record(problem, there.residuals(trial.x) - trial.residuals)
        total = 0.0
        for residuals, by in zip(_by_record(problem, trial.residuals), moved, strict=True):
            size = float(by @ by)
            share = np.clip(-float(by @ residuals) / size, -1.0, 1.0) if size > 0.0 else 0.0
            total += float(np.sum((residuals + share * by) ** 2))
        return total / problem.samples

    def left_out_cost(self, trial: Trial) -> float:
        """Mean square over the noise of each segment of time, predicted by a fit to all others."""
        predicted = _left_out(trial, trial.jacobian(quick=True))
        return float(predicted @ predicted) / trial.problem.samples

    def polished(self, trial: Trial, most: float = math.inf) -> Trial:
        """``trial`` fitted to every sample, to the end, or as far as ``most`` work leads.

        With none, it is what it was, on every sample; else it takes one step at least.
        """
        problem = self.problem(trial.model, kernel.CAREFUL)
        gain = max(0.5, _WORTH * trial.cost * problem.samples)
        iterations = 0
        if most > 0.0:
            before = self.work.effort
            problem.residuals(trial.x)
            one = (self.work.effort - before) * (2 * trial.free + _TRIED)
            iterations = int(min(_POLISHING, max(1.0, most / one)))
        fit = descend(problem, trial.x, trial.fixed, iterations, gain, damping=1e-4)
        return _trial(problem, fit, trial.fixed)

    def stage(
        self,
        trial: Trial,
        correlation: float,
        estimates: bool = False,
        for_others: Actuator | Strip | None = None,
    ) -> Stage:
        """What the trial comes to, with the correlation time by which samples count.

        ``for_others`` is the model by which other recordings are predicted, where it is another.
        """
        jac = trial.jacobian(quick=not estimates)
        predicted = _left_out(trial, jac)
        scale = trial.problem.sigma
        good = np.isfinite(scale)
        # thinning took noise away: put back, so that errors compare with those of every sample
        lost = 0.0 if trial.problem.records is self.full else self._noise_lost()
        rms = math.sqrt(float(np.mean((trial.residuals[good] * scale[good]) ** 2)) + lost)
        left_out = predicted[good] * scale[good]
        samples = trial.problem.samples / max(correlation, 1.0)
        return Stage(
            model=trial.model,
            cost=trial.cost,
            train_rms=rms,
            selection_rms=math.sqrt(float(np.mean(left_out**2)) + lost),
            selection_max=float(np.max(np.abs(left_out))),
            criterion=information(trial.cost, trial.free, samples),
            estimates=self.estimates(trial, jac) if estimates else (),
            for_others=for_others or trial.in_common,
            models=trial.models,
        )

    def _noise_lost(self) -> float:
        """Mean square of the noise that thinning averaged away, pooled over readings."""
        sizes = np.array([r.measured.size for r in self.records], dtype=float)
        lost = np.array(
            [f.noise**2 - r.noise**2 for f, r in zip(self.full, self.records, strict=True)]
        )
        return float(np.sum(sizes * lost) / np.sum(sizes))

    @staticmethod
    def _spread(trial: Trial, jac: np.ndarray) -> np.ndarray:
        """Standard deviations (d,) in coordinates, infinite of what is held."""
        inflation = max(1.0, trial.cost) * max(1.0, trial.correlation)
        spread = np.full(trial.x.size, math.inf)
        spread[~trial.fixed] = np.sqrt(np.diag(covariance(jac.T @ jac, inflation)))
        return spread

    def estimates(self, trial: Trial, jac: np.ndarray) -> tuple[Estimate, ...]:
        """All numbers of the model with 95 % intervals from the curvature at the optimum.

        Widened by what the residual is above the noise, and by its correlation.
        """
        layout = trial.problem.layout
        spread = 1.96 * self._spread(trial, jac)
        values = layout.values(trial.x)
        found = []
        at_end = np.minimum(trial.x - layout.lower, layout.upper - trial.x) < 1e-9
        for q, x, value, s, end, own in zip(
            layout.quantities, trial.x, values, spread, at_end, trial.problem.own, strict=True
        ):
            if own:
                continue
            if not math.isfinite(s):
                found.append(Estimate(q.name, q.unit, float(value), 0.0, math.inf, False, "held"))
                continue
            low, high = (x - s, x + s)
            if q.logarithmic:
                low, high = math.exp(max(low, -700.0)), math.exp(min(high, 700.0))
            bounds = q.bounds
            low, high = max(float(low), bounds[0]), min(float(high), bounds[1])
            sure = is_determined(low, high)
            note = "" if sure else "poorly determined by these data"
            if end:
                # a law that would go further there is not quite the one that acts
                note = "at the end of its search range"
            found.append(Estimate(q.name, q.unit, float(value), low, high, sure, note))
        return (*found, *self._own_estimates(trial))

    @staticmethod
    def _own_estimates(trial: Trial) -> Iterator[Estimate]:
        """The same of the walks that each record has of its own."""
        problem, drift = trial.problem, trial.drift
        if problem.drift is None or drift is None:
            return
        shared = ~trial.fixed & ~problem.own
        jac = problem.without_drift().jacobian(trial.x, shared)
        jac = np.hstack([jac, problem.drift_jacobian()])
        inflation = max(1.0, trial.cost) * max(1.0, trial.correlation)
        sizes = drift.amplitudes.ravel()
        spread = 1.96 * np.sqrt(np.diag(covariance(jac.T @ jac, inflation)))[-sizes.size :]
        whose = product(problem.records, problem.drift.names)
        for (record, name), value, s in zip(whose, sizes, spread, strict=True):
            low, high = float(value - s), float(value + s)
            sure = is_determined(low, high)
            note = "" if sure else "poorly determined by these data"
            yield Estimate(f"{name} in {record.name}", "m", float(value), low, high, sure, note)


def _leaders(fits: Sequence[LocalFit], many: int = _LEADERS) -> list[LocalFit]:
    return sorted(fits, key=lambda f: f.cost)[:many]


def _reseeded(layout: Layout, x: np.ndarray) -> list[np.ndarray]:
    """Coordinates with a branch that is spare sent elsewhere; none where every branch has work.

    Spare is one of two that relax alike, or one that has gone to the end of the times there are. It
    may be of use at other times, or beside the stiffest, whose relaxation is then broader.
    """
    values = layout.values(x)
    times, moduli = layout.column("T"), layout.column("mu")
    if times.size < 2:
        return []
    offset = moduli.size - times.size  # without mu_0 where the rest length gives it
    order = np.argsort(values[times])
    ratios = np.diff(np.log(values[times][order]))
    pair = int(np.argmin(ratios))
    stray = np.minimum(x[times] - layout.lower[times], layout.upper[times] - x[times]) < _AT_END
    if stray.any():
        spare = int(np.argmax(stray))
    elif ratios[pair] < _ALIKE:
        spare = int(order[pair])
    else:
        return []

    def moved(time: float, twin: int, given: float) -> np.ndarray:
        there = values.copy()
        both = there[moduli[offset + twin]]
        if not stray.any():
            both += there[moduli[offset + spare]]
        part = given * both
        there[moduli[offset + twin]] = both - part
        there[moduli[offset + spare]] = max(part, 0.01 * float(values[moduli].sum()))
        there[times[spare]] = time
        return np.clip(layout.coordinates(there), layout.lower, layout.upper)

    # the last is as good as one more equilibrium spring that takes its time
    elsewhere = (*_ELSEWHERE, 0.8 * math.exp(float(layout.upper[times][spare])))
    if not stray.any():
        return [moved(time, int(order[pair + 1]), 0.0) for time in elsewhere]
    others = values[moduli[offset:]].copy()
    others[spare] = -np.inf
    stiffest = int(np.argmax(others))
    starts = [moved(time, stiffest, 0.0) for time in elsewhere]
    beside = float(values[times[stiffest]])
    return [*starts, *(moved(beside * ratio, stiffest, 0.5) for ratio in _BESIDE)]


def relieved(trial: Trial) -> list[tuple[np.ndarray, float, float]]:
    """Coordinates (d,) with a slow branch's work left to an effect; its modulus Pa and time s.

    While the effect was missing, slow branches stood in for it, and what they are there for was
    left to the stiffest alone. The branch goes back to its side. One for each slow branch.
    """
    layout = trial.problem.layout
    values = layout.values(trial.x)
    times = layout.column("T")
    moduli = layout.column("mu")[-times.size :]  # of the branches
    if not times.size:
        return []
    stiffest = int(np.argmax(values[moduli]))
    beside = values[times[stiffest]]
    found = []
    for slow in np.flatnonzero(values[times] > _SLOWER * beside):
        there, both = values.copy(), np.array([stiffest, slow])
        there[moduli[both]] = 0.5 * values[moduli[stiffest]]
        there[times[both]] = beside * np.array(_BESIDE)
        x = np.clip(layout.coordinates(there), layout.lower, layout.upper)
        found.append((x, float(values[moduli[slow]]), float(values[times[slow]])))
    return found


def merged(layout: Layout, start: np.ndarray, modulus: float, time: float) -> list[np.ndarray]:
    """Coordinates ``start`` (d,) with one more branch (Pa, s), two that are neighbours made one.

    One for each two: what one more branch explains, as many as there were may do in other places.
    """
    values = layout.values(start)
    times = layout.column("T")
    if not times.size:
        return []
    moduli = layout.column("mu")[-times.size :]  # of the branches
    all_times = np.append(values[times], time)
    order = np.argsort(all_times)
    there, weight = np.log(all_times[order]), np.append(values[moduli], modulus)[order]
    found = []
    for i in range(times.size):
        both = slice(i, i + 2)
        one = np.average(there[both], weights=np.maximum(weight[both], 1e-9))
        fewer = values.copy()
        fewer[times] = np.exp(np.concatenate([there[:i], [one], there[i + 2 :]]))
        fewer[moduli] = np.concatenate([weight[:i], [weight[both].sum()], weight[i + 2 :]])
        found.append(np.clip(layout.coordinates(fewer), layout.lower, layout.upper))
    return found


def _worth_going(trial: Trial, leader: float, part: float) -> float:
    """Of the cost: what a descent must promise, and ``part`` of what it is behind a ``leader``."""
    return max(_WORTH * trial.cost, part * max(trial.cost - leader, 0.0))


def _chi2(trial: Trial, gain: float) -> float:
    """What a descent must promise of chi-square: a part of what is left, whatever is left.

    More would only polish a misfit.
    """
    return max(0.5, gain * trial.problem.samples)


def _trial(problem: Problem, fit: LocalFit, fixed: np.ndarray) -> Trial:
    return Trial(problem, fit.x, fixed, fit.residuals, fit.cost, _correlation(problem, fit))


def _correlation(problem: Problem, fit: LocalFit) -> float:
    """Correlation time of the residuals, the mean over records (each by its own)."""
    parts = _by_record(problem, fit.residuals)
    times, sizes = [correlation_time(p) for p in parts], [p.size for p in parts]
    return float(np.average(times, weights=sizes))


def _by_record(problem: Problem, residuals: np.ndarray) -> list[np.ndarray]:
    edges = np.cumsum([r.measured.size for r in problem.records])
    return np.split(residuals, edges[:-1])


def _left_out(trial: Trial, jac: np.ndarray) -> np.ndarray:
    """Return the residuals over noise (N,) that ``left_out`` gives, drift included."""
    reach = trial.problem.layout.reach(trial.x)[~trial.fixed]
    # the drift in a segment is predicted by that in the rest of its record
    own = trial.problem.drift_jacobian()
    jac, reach = np.hstack([jac, own]), np.append(reach, np.full(own.shape[1], np.inf))
    return left_out(trial.residuals, jac, reach)
