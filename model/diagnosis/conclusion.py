"""From the end of a search to a diagnosis: careful fits, steps with their evidence, the verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dearig.model.diagnosis.channels import ChannelSays
from dearig.model.diagnosis.engine import Race, SearchResult
from dearig.model.diagnosis.evidence import family_of
from dearig.model.diagnosis.fits import DRIFT, Fit, Fitter, fit_of, gain_that_ends
from dearig.model.diagnosis.imposed import lateness
from dearig.model.diagnosis.results import (
    Candidate,
    Diagnosis,
    Round,
    Stage,
    Step,
)
from dearig.model.diagnosis.stages import DRIFT_LAW, stage_of
from dearig.model.effects import EFFECTS
from dearig.model.fitting.channels import ChannelResult, is_electric, results_of
from dearig.model.fitting.estimates import MOVES_MAX, BetterPoint
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import Estimate
from dearig.model.fitting.spare import sums_text
from dearig.model.residual import (
    MissingStress,
    Signature,
    Unnamed,
    describe_unnamed,
    looks,
    missing_stress,
    signatures,
)
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.model.verdict import (
    EXPLAINED,
    NOTHING_MISSING,
    PARTLY_EXPLAINED,
    TOLERANCE,
    UNEXPLAINED,
)

__all__ = ["Conclusion", "conclude", "unnamed_of"]

_RUNNERS_UP = 2  # kept for an experiment: each is simulated under every excitation
_LEADING = 5  # families whose evidence is given by channel
_ITERATIONS = 60  # of the last fits, on every sample: all that have a valley to end in end before


class Conclusion:
    """One search's end, with the fits that the conclusion adds."""

    def __init__(
        self, found: SearchResult, fitter: Fitter, without: Callable[[Fit, str], Fit]
    ) -> None:
        self.found, self.fitter, self.judge = found, fitter, found.judge
        self._without = without
        noise = self.judge.is_noise(found.baseline)
        fit = fitter.careful if noise else fitter.identified
        self.first = fit(found.baseline, _ITERATIONS).by_relaxation_time()
        self.last = self.first
        if found.best.members:
            self.last = fitter.careful(found.best, _ITERATIONS).by_relaxation_time()

    def moved_to(self, x: np.ndarray) -> bool:
        """Refit the last model from coordinates ``x`` (d,); return whether that is a better fit.

        The search's own fit moves with it: the evidence is that of the reported model.
        """
        last = self.last
        gain = gain_that_ends(last)
        found = descend(last.problem, x, last.fixed, _ITERATIONS, gain, damping=1e-4)
        fit = fit_of(last.problem, last.fixed, found)
        if (last.cost - fit.cost) * last.problem.samples < gain:
            return False
        self.last = fit.by_relaxation_time()
        best = self.found.best
        if not best.members:
            self.first = self.last
            return True
        refined = self.fitter.refined(replace(best, x=self.last.x))
        if refined.cost < best.cost:
            fits = {**self.found.fits, best.members: refined}
            self.found = replace(self.found, best=refined, fits=fits)
        return True

    @property
    def explained(self) -> float:
        """Part of what the baseline leaves above the noise that the best fit explains."""
        missing = self.first.cost - 1.0
        return 1.0 - max(self.last.cost - 1.0, 0.0) / missing if missing > 0.0 else 1.0

    @property
    def is_small(self) -> bool:
        """Whether the residual is within 15 % of the noise."""
        return self.last.cost < TOLERANCE**2

    def verdict(self) -> str:
        """Return the verdict on the training records."""
        if not self.found.best.members:
            nothing = self.is_small and self.found.status == "complete"
            return NOTHING_MISSING if nothing else UNEXPLAINED
        if self.is_small:
            return EXPLAINED
        return PARTLY_EXPLAINED if self.explained > self.judge.settings.share else UNEXPLAINED

    def with_only(self, members: frozenset[str]) -> Fit:
        """Return the best fit with these members, refitted from one with more where unknown."""
        fits = self.found.fits
        fit = self.found.best
        for member in sorted(fit.members - members):
            if fit.members - {member} in fits:
                fit = fits[fit.members - {member}]
            elif member != DRIFT:
                fit = self._without(fit, member)
        return fit.by_relaxation_time()

    def order(self) -> list[str]:
        """Return the members of the best fit: what explains most alone, then with the next, ..."""
        members = sorted(self.found.best.members)
        chosen: list[str] = []
        while len(chosen) < len(members):
            rest = [m for m in members if m not in chosen]
            chosen.append(min(rest, key=lambda m: self.with_only(frozenset([*chosen, m])).cost))
        return chosen

    def alike(self, member: str) -> list[tuple[str, Fit]]:
        """Return members of other families that explain as much in place of ``member``."""
        best = self.found.best
        others = best.members - {member}
        taken: dict[str, tuple[float, str, Fit]] = {}
        for members, fit in self.found.fits.items():
            fresh = members - others
            if len(fresh) != 1 or not others <= members:
                continue
            (other,) = fresh
            family = family_of(other)
            behind = self.judge.gain(fit, best)
            near = behind < self.judge.settings.alike or (
                fit.cost - best.cost < self._form() and not self.judge.demanded(fit, best)
            )
            if family != family_of(member) and near and behind < taken.get(family, (math.inf,))[0]:
                taken[family] = (behind, other, fit)
        return [(other, fit) for _, other, fit in sorted(taken.values(), key=lambda t: t[0])]

    def nearest(self, member: str) -> tuple[str, float] | None:
        """Return the best law with a name in place of a general one, and its cost."""
        if member == DRIFT or not EFFECTS[member].is_general:
            return None
        others = self.found.best.members - {member}
        family = EFFECTS[member].family
        named = [
            (fit.cost, name)
            for members, fit in self.found.fits.items()
            if others <= members and len(members - others) == 1
            for name in members - others
            if name != DRIFT and EFFECTS[name].family == family and not EFFECTS[name].is_general
        ]
        if not named:
            return None
        cost, name = min(named)
        return name, cost

    def runners_up(self) -> list[tuple[str, Fit]]:
        """Return the most probable fits of families that the best one lacks, one of each."""
        own = {family_of(m) for m in self.found.best.members}
        score = {
            members: self.judge.criterion(fit) + self.judge.settings.odds * len(members)
            for members, fit in self.found.fits.items()
            if not self.judge.is_denied(fit)
        }
        found: dict[str, Fit] = {}
        for members in sorted(score, key=lambda m: score[m]):
            for family in sorted({family_of(m) for m in members} - own):
                found.setdefault(family, self.found.fits[members])
        return list(found.items())[:_RUNNERS_UP]

    def _form(self) -> float:
        """Return the difference of costs by which no two laws are told apart."""
        s = self.judge.settings
        explained = self.judge.base_cost - self.found.best.cost
        return min(s.form_error**2 * explained, s.form_error)

    @property
    def is_doubtful(self) -> bool:
        """Whether what was found explains too little to predict other recordings by it."""
        return not self.is_small and self.explained < self.judge.settings.trusted_share

    def for_others(self) -> Actuator | Strip:
        """Return the model that predicts other recordings."""
        if self.is_doubtful:
            return self.first.model
        return self.predicting(self.found.best, self.last)

    def predicting(self, fit: Fit, careful: Fit) -> Actuator | Strip:
        """Return the model that predicts other recordings: without what may not happen again.

        The rest is refitted without it, so that a diagnosis that found nothing else predicts as
        before. Only where it leaves half of what any fit without it leaves, the rest stays as it is
        next to it: then no law plays it, and the others would be bent by it.
        """
        once = {m for m in fit.members if m == DRIFT or not EFFECTS[m].is_reproducible}
        if not once:
            return careful.model
        lawful = [f.cost for members, f in self.found.fits.items() if not members & once]
        if fit.cost > self.judge.settings.share * min(lawful, default=math.inf):
            return self.with_only(fit.members - once).model
        kept = tuple(e for e in careful.model.effects if e[0] not in once)
        return replace(careful.model, effects=kept)

    def channels(self) -> tuple[ChannelResult, ...]:
        """Return the electrical channels, with what the first and the last model leave of them."""
        channels, first, last = self.fitter.channels, self.first.model, self.last.model
        if channels is None or not (isinstance(first, Actuator) and isinstance(last, Actuator)):
            return ()
        return results_of(channels, first, last)

    def channel_evidence(self) -> tuple[tuple[str, tuple[tuple[str, float], ...]], ...]:
        """Return, of the best fit of each leading family, what each channel says for it."""
        evidence, judge = self.judge.channels, self.judge
        if evidence is None:
            return ()
        best: dict[str, Fit] = {}
        for fit in judge.ranked(f for f in self.found.fits.values() if f.members):
            best.setdefault(" + ".join(sorted(set(map(family_of, fit.members)))), fit)
        found = []
        for family, fit in list(best.items())[:_LEADING]:
            model = fit.seen
            if isinstance(model, Actuator):
                moved = judge.of_displacement(self.found.baseline).criterion
                moved -= judge.of_displacement(fit).criterion
                said = evidence.of(model)
                odds = (("displacement", moved), *((n, -value) for n, value in said.items()))
                found.append((family, odds))
        return tuple(found)

    def steps(self, final: Stage) -> tuple[list[Step], list[tuple[str, Actuator | Strip]]]:
        """Return the steps with their evidence, and the rivals by family."""
        best, steps, rivals = self.found.best, [], []
        order = self.order()
        for i, member in enumerate(order):
            name = DRIFT_LAW if member == DRIFT else member
            effect = EFFECTS[name]
            alike = self.alike(member)
            rivals += [(family_of(other), fit.model) for other, fit in alike]
            others = best.members - {member}
            # other models keep the springs of a fit with drift; its evidence is of a fit without
            unknown = member == DRIFT and others not in self.found.fits
            without = self._without(best, member) if unknown else self.with_only(others)
            with_it = self.with_only(frozenset(order[: i + 1]))
            worth = self.judge.gain(without, best)
            own = tuple(
                replace(e, name=e.name.split(": ", 1)[1])
                for e in final.estimates
                if e.name.startswith(f"{name}: ")
            )
            said = [
                # of the thinned and whitened readings: not the error over the noise of a table
                f"without it the mean square of the fit's weighted residuals is "
                f"{without.cost / best.cost:.3g} times as large",
                f"without it the information criterion is worse by {worth:.0f}",
                *(f"{_label(other, fit)} explains these data as well" for other, fit in alike),
            ]
            nearest = self.nearest(member)
            if nearest is not None:
                said.append(
                    f"its form is that of no law with a name: {nearest[0]} comes nearest, and "
                    f"leaves {nearest[1] / best.cost:.3g} times the mean square"
                )
            stage = final
            if i < len(order) - 1:
                stage = stage_of(
                    with_it,
                    self.judge,
                    self.fitter.raw,
                    for_others=self.predicting(with_it, with_it),
                )
            says: tuple[ChannelSays, ...] = ()
            evidence, last = self.judge.channels, self.last.model
            if evidence is not None and isinstance(last, Actuator) and is_electric(name):
                says = evidence.says(last, name)
            families = tuple(dict.fromkeys(family_of(other) for other, _ in alike))
            steps.append(
                Step(
                    name,
                    effect.family,
                    effect.acts_on,
                    stage,
                    own,
                    families,
                    (*said, *(s.text for s in says)),
                    (("criterion_without", worth),),
                    nearest[0] if nearest else "",
                    says,
                )
            )
        return steps, rivals


def conclude(
    found: SearchResult,
    fitter: Fitter,
    without: Callable[[Fit, str], Fit],
    held: bool = False,
    stop: Callable[[], bool] = lambda: False,
) -> Diagnosis:
    """Return the diagnosis that a search has ``found``; ``without(fit, name)`` refits.

    Intervals end, and are those of the curvature from then on, where ``stop()`` is True or the work
    has taken what the settings allow.
    """
    allowed = fitter.settings.effort * (1.0 + fitter.settings.intervals)
    end = Conclusion(found, fitter, without)
    judge, full = found.judge, fitter.full
    final = _profiled(end, lambda: stop() or fitter.work.effort > allowed)
    found, others = end.found, end.for_others()
    first = stage_of(end.first, judge, fitter.raw)
    steps, rivals = end.steps(final)
    before, after = signatures(full, end.first), signatures(full, end.last)
    models = final.of_each(len(full))
    missing_after = tuple(
        m
        for record, model in zip(full, models, strict=True)
        for m in missing_stress([record], model)
    )
    verdict = end.verdict()
    unnamed = None
    open_end = verdict in (UNEXPLAINED, PARTLY_EXPLAINED) and found.status != "stopped"
    if open_end or any(s.family == "unknown" for s in steps):
        unnamed = unnamed_of(steps, missing_after, after)
    fits = list(found.fits.values())
    return Diagnosis(
        verdict=verdict,
        baseline=first,
        rounds=tuple(_round(race, found, fitter) for race in found.races),
        steps=tuple(steps),
        final=final,
        before=before,
        after=after,
        missing_before=missing_stress(full, end.first.model),
        missing_after=missing_after,
        unnamed=unnamed,
        rivals=tuple(rivals),
        runners_up=tuple((family, fit.model) for family, fit in end.runners_up()),
        simulations=fitter.work.simulations,
        interrupted=found.status == "stopped",
        held=held,
        notes=tuple(_notes(end, others, after, held, final.sums)),
        status=found.status,
        families=_families(end, judge.probabilities(fits, found.sought)),
        marginals=_families(end, judge.marginals(fits, found.sought)),
        channels=end.channels(),
        channel_evidence=end.channel_evidence(),
        denials=found.denials,
    )


def _profiled(end: Conclusion, ended: Callable[[], bool]) -> Stage:
    """Return the last model with its intervals, moved to where a profile comes to a better fit."""

    def stage(gain: float) -> Stage:
        return stage_of(
            end.last,
            end.judge,
            end.fitter.raw,
            profiled=end.fitter.thinned_about(end.last, end.found.best.drift),
            for_others=end.for_others(),
            ended=ended,
            gain=gain,
        )

    gain = gain_that_ends(end.last)
    for _ in range(MOVES_MAX):
        try:
            return stage(gain)
        except BetterPoint as better:
            # what is none on every sample is an error of the thinned records
            gain = gain_that_ends(end.last) if end.moved_to(better.x) else better.gained
    return stage(math.inf)


def unnamed_of(
    steps: Sequence[Step], missing: Sequence[MissingStress], after: Sequence[Signature]
) -> Unnamed | None:
    """Return a description of what no family explains: an effect of ``unknown`` is its own."""
    own = [s for s in steps if s.family == "unknown"]
    if not own:
        return describe_unnamed(missing, after)
    numbers = "; ".join(f"{s.effect} ({_values(s)})" for s in own)
    text = "; ".join(EFFECTS[s.effect].summary for s in own)
    return Unnamed(own[0].acts_on, numbers, f"{text}. Residual: {looks(after)}")


def _values(step: Step) -> str:
    return ", ".join(f"{e.name} = {e.value:.4g} {e.unit}".strip() for e in step.estimates)


def _label(member: str, fit: Fit) -> str:
    unseen = ", which the voltage monitor does not show," if fit.unseen == member else ""
    return "slow drift of the reading" if member == DRIFT else f"{member}{unseen}"


def _families(end: Conclusion, found: dict[str, float]) -> tuple[tuple[str, float], ...]:
    """Return the probabilities ``found`` of the families for what ``end`` explains, largest first.

    What no fit explains is of no known family.
    """
    if not end.is_small and not (
        end.found.best.members and end.explained > end.judge.settings.trusted_share
    ):
        left = 1.0 - max(end.explained, 0.0)
        found = {family: p * (1.0 - left) for family, p in found.items()}
        found["unknown"] = found.get("unknown", 0.0) + left
    return tuple(sorted(found.items(), key=lambda item: -item[1]))


def _notes(
    end: Conclusion,
    others: Actuator | Strip,
    after: Sequence[object],
    held: bool,
    sums: Sequence[Estimate],
) -> list[str]:
    """Return sentences for the operator."""
    said = []
    if end.fitter.has_tails:
        said.append(
            "the readings at rest have heavier tails than a normal distribution; the fits weigh "
            "readings by their likelihood under Student's t"
        )
    if end.found.status == "stopped" and not (end.found.races or end.found.best.members):
        said.append("interrupted before the first round ended: it is not known what is missing")
    kept = {name for name, _ in others.effects}
    gone = [name for name in end.found.best.effects if name not in kept]
    if DRIFT in end.found.best.members:
        gone.append("slow drift of the reading")
    if gone and end.is_doubtful:
        said.append(
            "the effects found explain too little: other recordings are predicted without them"
        )
    elif gone:
        said.append(
            f"{', '.join(gone)}: specific to these recordings as far as they show; other "
            "recordings are predicted without it"
        )
    if held:
        said.append(
            "the voltage is held between samples, as by a converter, although the records declare "
            "it linear: half a sample of delay, not an effect of the rig"
        )
    said += _own_delays(end)
    said += [denial.text for denial in end.found.denials]
    if sums:
        said.append(sums_text(sums))
    if end.is_small and not all(getattr(s, "is_noise", True) for s in after):
        said.append(
            "the residual is not quite white noise, but too small to attribute to an effect"
        )
    return said


def _own_delays(end: Conclusion) -> list[str]:
    """Return a sentence on each lag that is no longer than the sensor's delay is uncertain."""
    model, said = end.last.model, []
    known = max(getattr(record, "lag_error", 0.0) for record in end.fitter.full)
    for name in end.found.best.effects:
        if isinstance(model, Actuator) and EFFECTS[name].family == "sensor_lag":
            late = lateness(model, name)
            if abs(late) <= known:
                said.append(
                    f"{name}: the reading is late by {late * 1e3:.3g} ms, and the delay of the "
                    f"sensor is known within {known * 1e3:.3g} ms only: it may be the sensor's own"
                )
    return said


def _round(race: Race, found: SearchResult, fitter: Fitter) -> Round:
    """Return a race as a round of the report: candidates with one more effect, best first."""
    judge = found.judge
    parent, candidates = race.parent, []
    single = [f for f in race.fits if len(f.members - parent.members) == 1]
    best = judge.ranked(race.fits)[0] if race.fits else parent
    for fit in judge.ranked(single):
        (name,) = fit.members - parent.members
        effect = EFFECTS[name]
        gain = judge.gain(parent, fit)
        verdict = "denied" if judge.is_denied(fit) else "worthless"
        if race.taken is not None and fit.members == race.taken.members:
            verdict = "chosen"
        elif gain > judge.settings.odds:
            behind = judge.gain(fit, best)
            verdict = "indistinguishable" if behind < judge.settings.alike else "better"
        promised = 1.0 - min((race.starts.get(name, math.inf) / race.misfit) ** 2, 1.0)
        candidates.append(
            Candidate(
                name,
                effect.family,
                effect.acts_on,
                stage_of(fit, judge, fitter.raw),
                promised,
                1.0 - fit.cost / parent.cost,
                gain,
                judge.gain(fit, best),
                verdict,
            )
        )
    added = sorted(race.taken.members - parent.members) if race.taken is not None else []
    chosen = added[0] if len(added) == 1 else None
    if added:
        # a candidate with more parameters can explain a little more, and be less probable
        reason = (
            f"{' and '.join(added)} {'is' if len(added) == 1 else 'together are'} most probable"
        )
    else:
        reason = _why_none(race, found)
    return Round(parent.effects, tuple(candidates), chosen, reason)


def _why_none(race: Race, found: SearchResult) -> str:
    """Return why a race has added nothing."""
    judge, parent = found.judge, race.parent
    worth = [f for f in race.fits if judge.gain(parent, f) > judge.settings.odds]
    if not worth:
        return "no effect gains more than its parameters cost"
    leading = judge.ranked(worth)[0]
    kept = sorted(_label(m, found.best) for m in found.best.members - parent.members)
    if kept and judge.gain(leading, found.best) > 0.0:
        return f"{' and '.join(kept)} {'is' if len(kept) == 1 else 'are'} more probable"
    names = " and ".join(sorted(leading.members - parent.members))
    return f"{names} would explain too little of what is left to be named"
