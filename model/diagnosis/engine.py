"""The search for what a model lacks: regression, race, evidence; grow, exchange, prune."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.diagnosis.channels import Denial
from dearig.model.diagnosis.evidence import Judge, family_of
from dearig.model.diagnosis.fits import DRIFT, Fit, Fitter, with_effect
from dearig.model.diagnosis.preparation import has_line_at_rest
from dearig.model.diagnosis.race import RaceEntry, race
from dearig.model.diagnosis.regression import Regression, Start, is_unseen
from dearig.model.diagnosis.shapes import Extent, extent_of, strongest_line
from dearig.model.effects import EFFECTS, Effect
from dearig.model.fitting.channels import JointProblem, is_electric
from dearig.model.readings.environment import recorded_of
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator

__all__ = ["Race", "Search", "SearchResult"]

_BASELINE_PART = 0.1  # of the progress
_DRIFT_TURNS = 3  # of fitting the model and the drift's variance in turn

Progress = Callable[[str, float], None]


class Stopped(Exception):  # noqa: N818
    """The operator wants the end."""


class BudgetExhausted(Exception):  # noqa: N818
    """The search has taken the work that it may."""


@dataclass(frozen=True)
class Race:
    """One race: its ``parent``, the fits that came through, and the one that was taken, if any.

    ``misfit`` is what the regression leaves without an effect, ``starts`` with each of them.
    """

    parent: Fit
    fits: tuple[Fit, ...]
    misfit: float
    starts: dict[str, float]
    taken: Fit | None = None


@dataclass(frozen=True)
class SearchResult:
    """End of a search: the baseline, the best fit, all others by their members, and the races.

    ``sought`` are the families of effects that the search knows. ``status`` is ``complete``,
    ``stopped`` or ``budget``. ``denials`` are of effects that would explain the displacement as
    well as any, and that an electrical channel denies.
    """

    baseline: Fit
    best: Fit
    fits: dict[frozenset[str], Fit]
    races: tuple[Race, ...]
    judge: Judge
    sought: frozenset[str]
    status: str
    denials: tuple[Denial, ...] = ()


class Search:
    """A search by a ``fitter``. ``log`` receives a line on each choice."""

    def __init__(
        self,
        fitter: Fitter,
        progress: Progress,
        stop: Callable[[], bool],
        log: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.fitter, self.settings = fitter, fitter.settings
        fitter.watched = self.watch
        self.progress, self.stop, self.log = progress, stop, log
        self.fits: dict[frozenset[str], Fit] = {}
        self.races: list[Race] = []
        # of each effect that a channel denies: its best start, and the denial
        self._denials: dict[str, tuple[Start, Denial]] = {}
        self._left_out: set[tuple[frozenset[str], str]] = set()
        self._searching, self._done = False, 0.0
        self._at_rest = ""  # the effect that the readings at rest have shown
        drive = "voltage" if fitter.of_actuator else "stretch"
        drives = [r.drive for r in fitter.full if isinstance(r, ActuatorRecord)]
        there = set(recorded_of([d.temperature for d in drives], [d.humidity for d in drives]))
        if any(d.warmth is not None for d in drives):
            there.add("temperature")
        # drift of one record is noise here; an effect of the room needs recordings of it
        known = [
            e
            for e in EFFECTS.values()
            if drive in e.drives and e.drift_basis is None and (not e.needs or e.needs in there)
        ]
        self.effects = [e for e in known if not e.is_general]
        self.general = [e for e in known if e.is_general]

    def watch(self) -> None:
        """End the search where it is asked to, or has taken the work that it may."""
        if self._searching and self.stop():
            raise Stopped
        if self._searching and self.fitter.work.effort > self.settings.effort:
            raise BudgetExhausted

    def run(self) -> SearchResult:
        """Return what the records lack, or the best of what the work or the operator allowed."""
        baseline = self.keep(self.fitter.baseline(self._of_baseline))
        self.judge = Judge(self.settings, baseline, self.fitter.channels)
        self.log(f"baseline {baseline.cost:.4g}, effort {self.fitter.work.effort:.2e}")
        self._searching, status = True, "complete"
        try:
            best = self._searched(baseline)
        except Stopped:
            best, status = self._most_probable(), "stopped"
        except BudgetExhausted:
            best, status = self._most_probable(), "budget"
        finally:
            self._searching = False
        if status == "budget" and len(best.members) > 1:
            best = self._pruned(best)
        if status == "complete":
            self._behind_the_monitor(best)
        sought = {family_of(e.name) for e in self.effects} - {"unknown"}
        if self.fitter.of_actuator:
            sought.add(family_of(DRIFT))
        races = tuple(self.races)
        return SearchResult(
            baseline, best, self.fits, races, self.judge, frozenset(sought), status, self._denied()
        )

    def _denied(self) -> tuple[Denial, ...]:
        """Return the denials of effects whose start explains the displacement as well as any."""
        misfits = (
            misfit
            for race in self.races
            for name, misfit in race.starts.items()
            if not EFFECTS[name].is_general
        )
        least = min(misfits, default=math.inf)
        near = self.settings.noise_margin * least
        found = sorted((s.misfit, n) for n, (s, _) in self._denials.items() if s.misfit < near)
        return tuple(self._denials[name][1] for _, name in found)

    def _behind_the_monitor(self, best: Fit) -> None:
        """Keep fits of amplifier faults that the monitor does not show, in place of each effect.

        They explain the displacement, and the monitor denies them: it would not show a fault of its
        own divider, or of what is behind it. The best named law and the general one are tried.
        """
        denials = [d for d in self._denied() if d.is_of_monitor]
        if not denials or any(family_of(n) == denials[0].family for n in best.members):
            return
        names = [d.effect for d in denials if not EFFECTS[d.effect].is_general][:1]
        names += [d.effect for d in denials if EFFECTS[d.effect].is_general]
        for member in best.effects:
            parent = self.without(best, member)
            for name in names:
                start = self._denials[name][0]
                problem = self.fitter.problem(
                    with_effect(parent.model, name, start.values), parent.drift
                )
                problem = JointProblem.without_channels(problem)
                x = self.fitter.start_of(problem, parent.x, start.values)
                fit = self.fitter.refined(self.fitter.descend(problem, x, 20))
                self.keep(self.judge.unseen(fit, name, best))

    def _of_baseline(self, stage: str, fraction: float) -> None:
        # searches with and without stiffening springs each count from 0 to 1
        self._done = max(self._done, _BASELINE_PART * fraction)
        self.progress(stage, self._done)

    def keep(self, fit: Fit) -> Fit:
        """Return the best fit with the same members, ``fit`` included, and remember it."""
        old = self.fits.get(fit.members)
        if old is None or fit.cost < old.cost or fit.drift != old.drift:
            self.fits[fit.members] = fit
        return self.fits[fit.members]

    def _most_probable(self) -> Fit:
        self.judge.see(self.fits.values())
        return min(
            self.fits.values(),
            key=lambda f: self.judge.criterion(f) + self.settings.odds * len(f.members),
        )

    # -- the course

    def _searched(self, baseline: Fit) -> Fit:
        """Laws are sought in white noise and in drift, the more promising first."""
        judge = self.judge
        baseline = self._with_interference_at_rest(baseline)
        settled = judge.is_settled(baseline)
        if settled and baseline.problem.noise_drift is None:
            return baseline
        drifting = self._drifting(baseline)
        if settled:
            # a reading that drifts looks at rest like one with 1/f noise: the rest of it decides
            judge.see([drifting] if drifting else [])
            if drifting is not None and judge.gain(baseline, drifting) > self.settings.odds:
                return drifting
            return baseline
        first = self._raced(baseline)
        judge.see([baseline, *first, *([drifting] if drifting else [])])
        if drifting is None or judge.gain(baseline, drifting) < self.settings.odds:
            return self._grown(baseline, first)
        if drifting.cost < self.settings.share * first[0].cost:
            drifted = self._grown(drifting, None)
            if judge.is_settled(drifted):
                return drifted
            lawful = self._grown(baseline, first)
        else:
            lawful = self._grown(baseline, first)
            if judge.is_settled(lawful):
                return lawful
            drifted = self._grown(drifting, None)
        judge.see([lawful, drifted])
        return min(lawful, drifted, key=judge.criterion)

    def _with_interference_at_rest(self, baseline: Fit) -> Fit:
        """Return ``baseline`` with interference where the readings at rest have a line.

        It is there without a voltage, so the film does not cause it. It is fitted first.
        """
        laws = [e for e in self.effects if e.family == "interference"]
        if not laws or not any(map(has_line_at_rest, self.fitter.full)):
            return baseline
        fits = self._raced(baseline, laws)
        self.judge.see([baseline, *fits])
        if not (fits and self.judge.justifies(baseline, fits[0])):
            return baseline
        self._say("hums", baseline, fits[0])
        self.races[-1] = replace(self.races[-1], taken=fits[0])
        (self._at_rest,) = fits[0].effects
        return fits[0]

    def _drifting(self, parent: Fit) -> Fit | None:
        """Return ``parent`` with drift in the noise; None where it is not more probable.

        White noise may be as probable, or something slow that begins with the voltage.
        """
        if not self.fitter.of_actuator:
            return None
        fit, amplitude = parent, 0.0
        for _ in range(_DRIFT_TURNS):
            asked = self.fitter.space().most_probable(fit.plain_residuals())
            if asked == amplitude:
                break
            amplitude = asked
            if amplitude == 0.0:
                return None
            problem = self.fitter.problem(fit.model, amplitude)
            fit = self.fitter.refined(self.fitter.descend(problem, fit.x, 10))
        # springs that were fitted without the drift have absorbed a part of it
        if not (amplitude and self.fitter.drifts_at_rest(fit.plain_residuals())):
            return None
        return self.keep(fit)

    def _grown(self, best: Fit, first: list[Fit] | None) -> Fit:
        """Return ``best`` with effects added, one by one, while that is worth it."""
        while len(best.members) < self.settings.effects_max and not self.judge.is_settled(best):
            fits, first = first or self._raced(best), None
            if not fits:
                break
            self.judge.see([best, *fits])
            worth = self.judge.justifies(best, fits[0])
            self._say("grown" if worth else "not grown", best, fits[0])
            if not worth:
                break
            self.races[-1] = replace(self.races[-1], taken=fits[0])
            best = self._exchanged(fits[0])
        return self._pruned(best) if len(best.members) > 1 else best

    def _exchanged(self, best: Fit) -> Fit:
        """Return ``best`` with each effect replaced, by a race without it, where that is better."""
        for name in best.effects if len(best.members) > 1 else ():
            if self.judge.is_settled(best) or name not in best.effects:
                break
            # a race from this parent was run already, and would give the same
            raced = {race.parent.members for race in self.races}
            if name == self._at_rest or best.members - {name} in raced:
                continue
            fits = self._raced(self.without(best, name))
            self.judge.see([best, *fits])
            if fits and fits[0].members != best.members and self.judge.gain(best, fits[0]) > 1.0:
                self._say("exchanged", best, fits[0])
                best = fits[0]
        return best

    def _pruned(self, best: Fit) -> Fit:
        """Return ``best`` without what the evidence, or the form of a law, does not ask for."""
        while best.effects:
            smaller = [self.without(best, name) for name in best.effects]
            self.judge.see([best, *smaller])
            least = self.judge.ranked(smaller)[0]
            explained = self.judge.base_cost - least.cost
            form = least.cost - best.cost < self.settings.form_share * explained
            form = form and not self.judge.demanded(least, best)
            if not (form and self.judge.is_noise(least)) and (
                self.judge.gain(least, best) > self.settings.odds
            ):
                break
            self._say("pruned", best, least)
            best = least
        return best

    def without(self, fit: Fit, name: str) -> Fit:
        """Return ``fit`` refitted without a member; once for each set of members."""
        left = fit.members - {name}
        if (fit.members, name) in self._left_out:
            return self.fits[left]
        known = dict(zip(fit.problem.layout.names, fit.x, strict=True))
        effects = tuple(e for e in fit.model.effects if e[0] != name)
        drift = 0.0 if name == DRIFT else fit.drift
        problem = self.fitter.problem(replace(fit.model, effects=effects), drift)
        x = np.array([known[n] for n in problem.layout.names])
        found = self.keep(self.fitter.refined(self.fitter.descend(problem, x, 20)))
        self._left_out.add((fit.members, name))  # not before: the fit may end the search
        return found

    def _say(self, what: str, before: Fit, after: Fit) -> None:
        """Log a choice: members and costs before and after, the gain, and the work until now."""
        names = [" + ".join(sorted(f.members)) or "nothing" for f in (before, after)]
        self.log(
            f"{what}: {names[0]} {before.cost:.4g} -> {names[1]} {after.cost:.4g}, "
            f"gain {self.judge.gain(before, after):.1f}, effort {self.fitter.work.effort:.2e}"
        )

    # -- one race

    def _raced(self, parent: Fit, among: Sequence[Effect] | None = None) -> list[Fit]:
        """Return the fits of one more effect each, the most probable first.

        They are ``among`` all effects where nothing else is said.
        """
        # how many races there will be is not known: each is taken for a third of what is left
        self._done += (1.0 - self._done) / 3.0
        self.progress(
            f"candidates added to {' + '.join(sorted(parent.members)) or 'the baseline'}",
            self._done,
        )
        regression, extent = self._regression(parent)
        among = self.effects if among is None else among
        effects = [e for e in among if e.name not in parent.effects]
        starts = regression.starts(effects, extent)
        fits = self._run(parent, starts)
        if fits and not self.judge.is_noise(fits[0]):
            fits, starts = self._with_general(parent, regression, extent, fits, starts)
        self.races.append(
            Race(
                parent,
                tuple(fits),
                regression.misfit,
                {name: some[0].misfit for name, some in starts.items()},
            )
        )
        return fits

    def _with_general(
        self,
        parent: Fit,
        regression: Regression,
        extent: Extent,
        fits: list[Fit],
        starts: dict[str, list[Start]],
    ) -> tuple[list[Fit], dict[str, list[Start]]]:
        """Return ``fits`` and ``starts``, and those of general laws.

        The laws with a name have been fitted from their ``starts``; where the best leaves more than
        noise, its family may have another form. So may a family of which the regression leaves less
        by its general law than by any law with a name.
        """
        families = {family_of(name) for fit in fits for name in fit.members - parent.members}
        least = min((some[0].misfit for some in starts.values()), default=math.inf)
        laws = [e for e in self.general if e.name not in parent.effects]
        racing = {
            name: some
            for name, some in regression.starts(laws, extent).items()
            if EFFECTS[name].family in families or some[0].misfit < least
        }
        return self.judge.ranked([*fits, *self._run(parent, racing)]), starts | racing

    def _run(self, parent: Fit, starts: Mapping[str, list[Start]]) -> list[Fit]:
        """Return the fits that came through one race, and keep them: the next may be the last."""
        candidates = [
            RaceEntry(
                name, tuple(some), is_unseen(EFFECTS[name]), self._of_channels(parent, name, some)
            )
            for name, some in starts.items()
        ]
        return [self.keep(fit) for fit in race(self.fitter, self.judge, parent, candidates)]

    def _of_channels(self, parent: Fit, name: str, starts: Sequence[Start]) -> float:
        """Return what the electrical channels add to the criterion at the best of ``starts``."""
        evidence, model = self.judge.channels, with_effect(parent.model, name, starts[0].values)
        if evidence is None or not (is_electric(name) and isinstance(model, Actuator)):
            return 0.0
        before = parent.model
        already = evidence.total(before) if isinstance(before, Actuator) else 0.0
        denial = evidence.denial(name, model)
        if denial is not None:
            self._denials.setdefault(name, (starts[0], denial))
        return evidence.total(model) - already

    def _regression(self, parent: Fit) -> tuple[Regression, Extent]:
        fitter, records = self.fitter, self.fitter.records
        mean_drift_m: np.ndarray | None = None
        if parent.drift:
            noise = np.concatenate([np.full(r.measured.size, r.noise) for r in records])
            mean_drift_m = parent.mean_drift() * noise
        plain = JointProblem.alone(fitter.problem(parent.model))
        residuals = -parent.plain_residuals()
        regression = Regression(
            records,
            parent.model,
            fitter.times,
            self.settings,
            parent.drift,
            mean_drift_m,
            (plain.jacobian(parent.x, ~parent.fixed, residuals), residuals),
        )
        longest = int(np.argmax([r.measured.size for r in records]))
        residual = parent.by_record()[longest]
        step = float(np.median(np.diff(records[longest].time)))
        return regression, extent_of(
            records, lambda low, high: strongest_line(residual, step, low, high)
        )
