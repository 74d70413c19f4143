"""The search for what a model lacks: residual, candidates, refits, choice, pruning, and again."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.actuator import Actuator
from dearig.model.diagnosis.bench import Bench, Trial, Work, akaike, information, merged, relieved
from dearig.model.diagnosis.residual import signatures
from dearig.model.diagnosis.results import (
    MUCH_LEFT,
    Candidate,
    Diagnosis,
    Round,
    Step,
)
from dearig.model.diagnosis.screening import Promise, Screen, is_of, sizes_of, with_effect
from dearig.model.diagnosis.stress import missing_stress
from dearig.model.diagnosis.symbolic_regression import describe_unnamed
from dearig.model.effects import EFFECTS, Effect, any_hysteretic
from dearig.model.film import Strip
from dearig.model.fitting import Estimate
from dearig.model.fitting.parameters import Layout
from dearig.model.records import ActuatorRecord, Record
from dearig.model.verdict import (
    EXPLAINED,
    NOTHING_MISSING,
    PARTLY_EXPLAINED,
    TOLERANCE,
    UNEXPLAINED,
)

__all__ = ["diagnose"]

Progress = Callable[[str, float], None]

# effects that the rules below were not made with: neither their cost nor their rivals are known
_NOT_TRIED = ("sensor delay", "thinning drag", "viscoplastic flow")

# steps of simulations that a search may take: some forty-five seconds of two cores
_EFFORT = 2.8e8
_OF_SEVERAL = 0.9  # of that, of several records: there the last fits take longer
_POLISHING = 2e7  # of these, that each of the final fits may take
_FIRST_REFITS = 0.32  # of that: where refits of single effects take more, others must be quick
_AT_LAST = 0.1  # of that: what one that is ended may take to prune, and to tell laws apart
_EFFECTS_MAX = 3  # more at once no record of this kind tells apart
_TURNS = 3  # of searching on and pruning: what is pruned makes room
_EXCHANGES = 3  # of one effect for another, when more than one is there
_DECISIVE = 12.0  # of the information criterion: odds of e^6, over some forty candidates
_ALIKE = 10.0  # of the same, for explaining alone: candidates nearer than that are not told apart
_TRUE_TO = 1e-4  # of what is explained: no law is true to more of it
_MATTERS = 0.01  # of the noise's mean square: less is not worth an effect
_SECOND_SHARE = 0.25  # of what is left above the noise: less is not worth one more effect
_OF_ITS_FORM = 0.02  # of what is explained: a law not quite the true one leaves so little
_FORM_SHARE = 0.7  # of that: less is not worth one more effect
_SOME = 0.3  # of what is asked: who has explained less will not get so far in the end
_BY_FAR = 150.0  # of the criterion: a gain that needs no such share
_SHOWN = 0.5  # of that: so much shows in what is promised, where little is left
_HOPE = 0.95  # of the cost: who explains less than the rest of it is not followed on
_BEAM = 2  # how many explanations are followed on
_BEAM_COST = 1.5  # of the leader's: what explains so much less is not followed on
_SETTLED = 5  # leading candidates that are fitted to the end of their valleys
_SETTLED_QUICKLY = 12  # that are followed a little, while the leader leaves more than noise
_NEARLY_ALL = 0.95  # of what was above the noise: who explains it may be in a wrong valley of it
_MOSTLY = 0.8  # of the same: who explains it does most of what an effect without a cause does
_AS_GOOD = 0.98  # of its cost: who did not come near the one will not come near the other
_CLOSE = 1.15  # of the leader's cost: so near, and better than nothing, any other is one too
_NEAR_LEAD = 2.0  # of the leader's cost before that: no branch of these is left without work
_NEAR_NOISE = 1.5  # of the same, beside a leader that leaves but noise
_MAY_LEAD = 6.0  # of the leader's cost: what has come so near may lead by its last steps
_NEAR_LAW = 100.0  # of chi-square: what lies so near may come to lead by its very last steps
_NEAR_RIVAL = 30.0  # of the same, of another family
_UNNAMED_MARGIN = (
    20.0  # of the criterion, by which an unnamed effect must be better than named ones
)
_SCREENED = 8  # effects at a time
_ABREAST = 4  # effects that are fitted at a time
_PROMISES = 2  # of one effect, in different shapes, from which a fit sets out
_NEARLY = 0.8  # of the best promise of an effect: another shape that is worth a start
_BETTER = 1e-4  # of the cost: less is the same place
_IN_THE_WAY = 0.9  # of what no branches account for: with an effect that leaves less, they hid it
_CLEARLY = 2.0  # of the least that is left: more, and it is not the one that they hid
_AS_WELL = 1.1  # of what is left beside a leader that explains all: these may do so too
_ANEW = 3  # of such effects that are fitted anew
_RIVALS = 0.5  # of what a leader explains that leaves but noise: such are followed to their ends
_OUT_OF_REACH = 100.0  # times the leader's cost: from there no branches elsewhere lead to it
_IDLE = 0.01  # of the cost: a law that is so near that of a simpler one does what that one does
_SHAKEN_FROM = 0.8  # of what is above the noise: who explains so much is in a valley near the best
_PLAYED = 0.7  # of what a walk explains: a law that explains so much may be what it plays
_LAWS = 3  # of such that are sought all over their shapes
_AFAR = 4  # promises of such a law that are followed
_CONTENDERS = 4  # of those that promised as much as a leader that explains all
_ANEW_SIZES = (0.3, 1.0, 3.0, 10.0, 30.0)  # times the typical one, tried for that
_ANEW_CLOSER = (0.56, 0.75, 1.0, 1.33, 1.78)  # times the best of these
_ANEW_FROM = (1.0, 1.33, 1.78)  # times that: the branches' measure of it is on the small side
_HINT = 0.05  # of the most promising one's: who promises less is not refitted beside it
_KEPT = 0.8  # of a promise, or of what the leader explains
_FOLLOWED = 12  # candidates refitted beside an effect, the most promising ones; half beside two
_UNNAMED_SHARE = 0.5  # of what was above the noise: explaining less names nothing
_TRUSTED = 0.8  # of the same: what explains less may be a disguise, and predicts nothing else
_WORSE = 1.5  # of the cost of one record: a law that is not quite the true one may ask as much
_TAKEN_OVER = 2.0  # times what others explain beside a walk: explaining more without, they play it


def _quiet(stage: str, fraction: float) -> None:
    """Progress that nobody watches."""


def _never() -> bool:
    return False


@dataclass(frozen=True)
class _Tried:
    """One candidate of a round: its trial on the bench and what the score test promised."""

    name: str
    parent: Trial
    trial: Trial
    promised: float


class _Interrupted(Exception):  # noqa: N818
    """The operator wants the end: what was found until now is handed back."""


class _Enough(Exception):  # noqa: N818
    """The search has taken all the work that it may."""


def diagnose(
    records: Sequence[Record],
    base: Actuator | Strip,
    *,
    workers: int = 2,
    progress: Progress = _quiet,
    stop: Callable[[], bool] = _never,
    thorough: bool = False,
) -> Diagnosis:
    """Fit ``base`` to ``records``, find what it lacks, and put that in.

    ``records`` are all of actuators or all of films; nothing else is ever looked at, so errors on
    other recordings are honest. ``progress(stage, fraction)`` is called often, the fraction being
    that of the whole work; when ``stop()`` is True, what was found until then is returned. So it is
    after about a minute on two cores, unless it is to be ``thorough``: what takes longer is a law
    that none of the library quite is, and hardly gains by it. That is counted in simulations, not
    by a clock: the same records give the same answer on any machine. Raises ``ModelError`` for
    records and models that do not fit together.
    """
    return _Search(records, base, workers, progress, stop, thorough).run()


class _Search:
    def __init__(
        self,
        records: Sequence[Record],
        base: Actuator | Strip,
        workers: int,
        progress: Progress,
        stop: Callable[[], bool],
        thorough: bool = False,
    ) -> None:
        self.thorough = thorough
        self.ran_out = False
        self.work = Work()
        self.bench = Bench(records, base, workers, self._watch, self.work)
        few = _OF_SEVERAL if self.bench.is_dear else 1.0
        self.most = math.inf if thorough else _EFFORT * few
        self.base = base
        self._progress = progress
        self._reached = 0.0
        self.stop = stop
        self._searching = False
        self.effects = [
            e
            for e in EFFECTS.values()
            if not e.is_general and e.name not in _NOT_TRIED and is_of(e, self.bench)
        ]
        self.rounds: list[Round] = []
        self.found: dict[frozenset[str], Trial] = {}
        self.settled: set[frozenset[str]] = set()
        self.ended: dict[frozenset[str], float] = {}  # beside a leader of which cost
        self.last: dict[frozenset[str], Trial] = {}  # those that were fitted to the last
        self.screened: dict[frozenset[str], tuple[Screen, dict[str, list[Promise]]]] = {}
        self.refitted: set[tuple[frozenset[str], str]] = set()  # on top of what, and which
        self.left_out: set[tuple[frozenset[str], str]] = set()
        self.extended: set[frozenset[str]] = set()  # from where a simpler law has ended
        self.reset: set[tuple[frozenset[str], str]] = set()  # which, from which other law
        self.interrupted = False
        self.held = False

    def report(self, stage: str, fraction: float) -> None:
        """Progress, which never goes back: how often what is pruned is made up for is not known."""
        self._reached = max(self._reached, fraction)
        self._progress(stage, self._reached)

    # -- the course of things

    def run(self) -> Diagnosis:
        self.report("baseline", 0.0)
        baseline = self.bench.baseline(
            self.base,
            lambda s, f: self.report("baseline", 0.05 * (f + (s == "descents"))),
        )
        baseline = self._timed(baseline)
        self.found[frozenset()] = baseline
        self._searching = True
        try:
            best = self._within_effort(self._ended(baseline))
        except _Interrupted:
            self.interrupted = True
            best = self._leading()
        finally:
            self._searching = False
        return self._finding(self.found[frozenset()], best)

    def _within_effort(self, baseline: Trial) -> Trial:
        """What ``baseline`` lacks, as far as the search gets with the work that it may take.

        Where it is ended, what is needless in what it has found may still be sought, and by which
        law of its family each effect follows.
        """
        try:
            best = self._among_rivals(self._in_own_laws(self._explained(baseline)))
            return self._retimed(self._as_it_foretells(best))
        except _Enough:
            self.ran_out = True
            # fits side by side may have gone a little further: as much is left, however far
            self.work.effort = self.most
            self.most *= 1.0 + _AT_LAST
        best = self._without_needless(self._leading())
        told = (self._in_own_laws, self._among_rivals, self._as_it_foretells)
        for step in (self._pruned, self._in_refined, *told):
            try:
                best = step(best)
            except _Enough:
                break
        return best

    def _without_needless(self, best: Trial) -> Trial:
        """``best`` without what a search that is not ended would not have taken beside the rest.

        What was refitted first in a round that was cut short may be anything that plays the last
        of what another leaves.
        """
        for name in best.effects:
            rest = self.found.get(frozenset(best.effects) - {name})
            if rest is None or not rest.effects:
                continue
            gain = self._gain(rest, best, self._correlation([rest, best]))
            if not self._matters(rest, _Tried(name, rest, best, 0.0), gain):
                return self._without_needless(rest)
        return best

    def _explained(self, best: Trial) -> Trial:
        """``best`` with what it lacks, and without what it does not need.

        What was found first may turn out needless when another is there, and then there is room
        for what a search with it in the way could not see.
        """
        been = {frozenset(best.effects)}
        for _ in range(_TURNS):
            grown = self._search(best)
            best = self._exchanged(self._pruned(grown))
            if len(best.effects) == 1:
                # no other was found beside it: then it may be its own law that is not the right one
                best = self._in_other_laws(best, (0.8, 0.1))
            names = frozenset(best.effects)
            same = names == frozenset(grown.effects) and best.cost > _AS_GOOD * grown.cost
            if same or names in been or best.is_white:
                break
            been.add(names)
        return best

    def _exchanged(self, best: Trial) -> Trial:
        """``best`` with effects exchanged, one by one, for others that explain more in their place.

        What was found first was found while the others were missing, and may have stood for them.
        What all together explain too little to be named is not worth it.
        """
        base = self.found[frozenset()]
        for _ in range(_EXCHANGES):
            if len(best.effects) < 2 or _explained(base, best) < _UNNAMED_SHARE:
                break
            before, best = best, self._replaced(best, (0.8, 0.1))
            if frozenset(best.effects) == frozenset(before.effects):
                break
            best = self._pruned(best)
        return best

    def _in_other_laws(self, best: Trial, span: tuple[float, float]) -> Trial:
        """``best`` with other laws of the families in it, where these explain more.

        Which law it is was asked while the others were missing, or in a wrong valley.
        """
        for _ in range(_EXCHANGES):
            if best.is_noise:
                break
            before, best = best, self._replaced(best, span, laws=True)
            if frozenset(best.effects) == frozenset(before.effects):
                break
        return best

    def _in_own_laws(self, best: Trial) -> Trial:
        """``best``, each effect by that law of its family which explains most at the very end.

        Where several leave but noise, some ten of chi-square tell which it is, and with it what
        other recordings will show: no quick descent is so sure of its end.
        """
        for name in best.effects:
            best = self._told_from(best, name, _NEAR_LAW, EFFECTS[name].family)
        return best

    def _among_rivals(self, best: Trial) -> Trial:
        """The same of what else has come near, of any family."""
        for name in best.effects:
            best = self._told_from(best, name, _NEAR_RIVAL)
        return best

    def _as_it_foretells(self, best: Trial) -> Trial:
        """``best``, each effect by that law of its family by which other recordings should follow.

        Which cause it is the Bayesian criterion has told. On which law it follows only predictions
        hang, and there Akaike's is the one to ask: the simplest law that a record of slow lobes
        allows need not be true, and a number too many costs predictions little. Only laws that were
        fitted to the last are asked.
        """
        if not (best.is_noise and best.is_of_actuator):
            return best
        for name in filter(_is_law, best.effects):
            family = [e.name for e in self.effects if e.family == EFFECTS[name].family]
            tried = [
                t
                for t in self._in_its_place(best, name, filter(_is_law, family))
                if t.name == name or frozenset(t.trial.effects) in self.last
            ]
            if len(tried) < 2:
                continue
            correlation = self._correlation([t.trial for t in tried])
            samples = self.bench.samples / correlation
            law = min(tried, key=lambda t: akaike(t.trial.cost, t.trial.free, samples))
            if law.name != name:
                self._record(
                    tried, correlation, law, "predicts other recordings better in cross-validation"
                )
                best = law.trial
        return best

    def _in_its_place(self, best: Trial, name: str, others: Iterable[str]) -> list[_Tried]:
        """What was found of ``others`` in the place of the effect ``name`` of ``best``."""
        parent = self._without(best, name)
        _, promises = self.screened.get(frozenset(parent.effects), (None, {}))
        keys = {n: frozenset((*parent.effects, n)) for n in others if n not in parent.effects}
        # what refines another promises at least what that does
        asked = {n: promises.get(_coarsest(n), []) for n in keys}
        shares = {n: max((p.share for p in asked[n]), default=0.0) for n in keys}
        return [
            _Tried(n, parent, self.found[k], shares[n]) for n, k in keys.items() if k in self.found
        ]

    def _told_from(self, best: Trial, name: str, near: float, family: str = "") -> Trial:
        """``best``, or with another effect in the place of one, of those that lie so ``near``.

        In chi-square; with a ``family``, only effects of that one. Where more than noise is left,
        such steps tell nothing; of a film no model is asked to be so good.
        """
        if not (best.is_noise and best.is_of_actuator):
            return best
        names = [e.name for e in self.effects if family in ("", e.family)]
        most = best.cost + near * best.correlation / self.bench.samples
        laws = [t for t in self._in_its_place(best, name, names) if t.trial.cost < most]
        due = [t for t in laws if self.last.get(frozenset(t.trial.effects)) is not t.trial]
        if len(laws) < 2 or not due:
            return best
        self.report("comparing effects", 0.92)
        fresh = {t.name: t.trial for t in due}
        for some in _abreast(list(fresh)):
            trials = self.bench.parallel_map(lambda n: self.bench.to_the_last(fresh[n]), some)
            for trial in trials:
                self._keep(trial)
                key = frozenset(trial.effects)
                self.last[key] = self.found[key]
        fitted, correlation = self._ranked(best, laws)
        if fitted[0].name != name:
            self._record(fitted, correlation, fitted[0], "explains more after its fit converged")
        return fitted[0].trial

    def _replaced(self, best: Trial, span: tuple[float, float], laws: bool = False) -> Trial:
        """``best``, or what does better with any other effect in the place of one.

        Of ``laws``, only with such as are of the family of that one.
        """
        tried: list[_Tried] = []
        for name in best.effects:
            parent = self._ended(self._without(best, name))
            family = EFFECTS[name].family if laws else ""
            tried += self._round(parent, len(parent.effects), span, best, family)
        if not tried:
            return best
        fitted, correlation = self._settled(best, tried, to_other_laws=True)
        leader = fitted[0]
        gain = self._demerit(best, correlation) - self._demerit(leader.trial, correlation)
        same = frozenset(leader.trial.effects) == frozenset(best.effects)
        if gain <= 0.0 or same:
            return self._ended(leader.trial if same else best)
        self._record(
            fitted,
            correlation,
            leader,
            "explains more beside the other effects than the one that it replaces",
        )
        return self._ended(leader.trial)

    def _timed(self, baseline: Trial) -> Trial:
        """The baseline of a voltage that stands between samples, where that is all that is missing.

        A table does not say what the voltage did between its rows. Half a sample too early, the
        model would be found to lack a lag of half a sample.
        """
        held = self._if_held()
        if baseline.is_noise or held is None:
            return baseline
        bench = Bench(held, self.base, self.bench.workers, self._watch, self.work)
        trial = bench.baseline(self.base, lambda *_: self.report("baseline", 0.1))
        if not trial.is_noise or trial.cost > baseline.cost - _MATTERS:
            return baseline
        self.bench, self.held = bench, True
        return trial

    def _retimed(self, best: Trial) -> Trial:
        """``best`` under a voltage that stands between samples, where that spares an effect.

        Beside something else the half sample shows as one more lag; or it explains more.
        """
        held = self._if_held()
        if held is None or not best.effects:
            return best
        before = (self.bench, self.found, self.settled, self.ended, self.left_out)
        bench = Bench(held, self.base, self.bench.workers, self._watch, self.work)
        fits = [bench.fit(t.model, [(t.x, None)], t.fixed) for t in (self.found[frozenset()], best)]
        self.bench, self.settled, self.ended, self.left_out = bench, set(), {}, set()
        self.found = {frozenset(t.effects): t for t in fits}
        try:
            trial = self._pruned(self._ended(fits[1]))
            correlation = self._correlation([best, trial])
            gain = self._gain(best, trial, correlation)
            self.held = gain > (0.0 if len(trial.effects) < len(best.effects) else _DECISIVE)
        finally:
            if not self.held:
                self.bench, self.found, self.settled, self.ended, self.left_out = before
        return trial if self.held else best

    def _if_held(self) -> list[ActuatorRecord] | None:
        """The records with a voltage that stands between samples; None where it is no question."""
        records = [r for r in self.bench.full if isinstance(r, ActuatorRecord)]
        if len(records) < len(self.bench.full) or any(r.drive.hold for r in records):
            return None
        return [replace(r, drive=replace(r.drive, hold=True)) for r in records]

    def _search(self, start: Trial) -> Trial:
        """The best explanation of up to ``_EFFECTS_MAX`` effects, those of ``start`` among them.

        Where none alone explains enough to be believed, the leading ones are followed on once: of
        two effects each may leave so much of the other that only both are a finding. Beside one
        that is believed, others must be so on their own.
        """
        best, beam = start, [start]
        looking_on = False
        for depth in range(len(start.effects), _EFFECTS_MAX):
            tried: list[_Tried] = []
            for i, parent in enumerate(beam):
                span = (0.1 + 0.28 * (depth + i / len(beam)), 0.28 / len(beam))
                tried += self._round(parent, depth, span)
                if any(t.trial.is_noise for t in tried):
                    break  # what else may do as well is sought by exchanges
            if not tried:
                break
            least = self._least(best)
            fitted, correlation = self._ranked(best, tried)
            in_haste = self._leaves_no_time(fitted[0].trial)
            if not in_haste:
                fitted, correlation = self._settled(best, tried, least)
            leader = fitted[0].trial
            gain = self._gain(best, leader, correlation)
            promising = gain > self._asked(fitted[0].name) or not best.is_noise
            if promising and best.cost - leader.cost > least and not in_haste:
                fitted, correlation = self._settled(best, self._anew(fitted), least)
                fitted, correlation = self._rivals_ended(best, fitted)
                fitted, correlation = self._laws_of_walk(best, fitted)
                fitted, correlation = self._refined(best, fitted)
                fitted, correlation = self._out_of_simpler(best, fitted)
                fitted, correlation = self._shaken(best, fitted)
            leader = fitted[0].trial
            gain = self._gain(best, leader, correlation)
            matters = self._matters(best, fitted[0], gain)
            significant = gain > self._asked(fitted[0].name) and matters
            taken = significant and self._foretells(best, fitted[0])
            if taken:
                reason = f"gains {gain:.0f} of the information criterion"
            elif significant:
                reason = (
                    "the best effect does not predict the parts of the record left out of its fit"
                )
            elif gain > self._asked(fitted[0].name):
                reason = "the best effect explains too little to matter"
            else:
                reason = (
                    f"no effect explains significantly more (the best gains {gain:.1f} of the "
                    f"information criterion; the threshold is {self._asked(fitted[0].name):g})"
                )
            hopeless = bool(best.effects) or best.is_noise or leader.cost > _HOPE * best.cost
            last = depth + 1 == _EFFECTS_MAX
            if not taken and not (looking_on or hopeless or last):
                reason += "; the best effects are tried in pairs with others"
            self._record(fitted, correlation, fitted[0] if taken else None, reason)
            if taken:
                best, looking_on = self._restarted(self._ended(leader)), False
                if len(best.effects) > 1:
                    best = self._in_other_laws(best, (0.1 + 0.28 * (depth + 1), 0.0))
                if best.is_white:
                    break
            elif looking_on or hopeless:
                break
            else:
                looking_on = True
            beam = [self._ended(t) for t in self._beam(best if taken else leader, fitted)]
        return best

    def _ended(self, trial: Trial, leader: float = math.inf) -> Trial:
        """``trial`` at the bottom of its valley: what is built on it must not make up for it.

        Beside a ``leader`` of such a cost, as far as it takes to see that it will not lead.
        """
        return self._all_ended([trial], leader)[0]

    def _all_ended(self, trials: Sequence[Trial], leader: float = math.inf) -> list[Trial]:
        """Each of ``trials``, of different effects, as ``_ended`` has it: all, or none of them."""
        keys = [frozenset(t.effects) for t in trials]
        due = [k for k in zip(keys, trials, strict=True) if self._is_due(k[0], leader)]
        found = self.bench.parallel_map(lambda k: self.bench.ended(k[1], leader), due)
        for (key, _), trial in zip(due, found, strict=True):
            self.settled.add(key)
            self.found[key] = trial
            # who has come down to the leader was held back by none
            self.ended[key] = leader if trial.cost > leader else math.inf
        return [self.found[key] for key in keys]

    def _is_due(self, key: frozenset[str], leader: float) -> bool:
        """Whether a trial was followed down less far than beside a ``leader`` of such a cost."""
        return self.ended.get(key, 0.0) < _AS_GOOD * leader

    def _restarted(self, trial: Trial) -> Trial:
        """``trial`` from a new global search, with what its effects do taken off the records."""
        self._keep(self.bench.restarted(trial))
        return self._ended(self.found[frozenset(trial.effects)])

    def _matters(self, best: Trial, tried: _Tried, gain: float) -> bool:
        """Whether what one more effect explains of what ``best`` leaves is worth it."""
        explained = best.cost - tried.trial.cost
        if explained <= _MATTERS * max(1.0, 0.2 * tried.trial.cost):
            return False
        # no more is asked of a model of a film than what it may be off
        if best.is_noise and not best.is_of_actuator:
            return False
        if not best.effects or (gain > _BY_FAR and self._is_all(tried)):
            return True
        # beside another, little of what no effect explains may go to any
        return explained > self._share(best, gain) * (best.cost - 1.0)

    def _share(self, best: Trial, gain: float) -> float:
        """The part of what ``best`` leaves above the noise that one more effect must explain.

        So little may be left as a law in ``best`` is not quite the true one; a walk follows none.
        """
        explained = self.found[frozenset()].cost - best.cost
        lawful = all(EFFECTS[n].is_reproducible for n in best.effects)
        if lawful and best.cost - 1.0 < _OF_ITS_FORM * explained:
            return _FORM_SHARE
        return _SECOND_SHARE if gain < _BY_FAR else 0.0

    def _foretells(self, best: Trial, tried: _Tried) -> bool:
        """Whether each part of the records follows better from the rest than it did before.

        What happens at one moment, or at none again, is not asked: nothing else foretells it.
        """
        if not EFFECTS[tried.name].is_reproducible:
            return True
        return self.bench.left_out_cost(tried.trial) < self.bench.left_out_cost(best)

    @staticmethod
    def _is_all(tried: _Tried) -> bool:
        """Whether an effect that follows a law leaves nothing: then it took all that there was.

        However much that is of the cost, in which the noise may be read a little wrong.
        """
        return tried.trial.is_white and _is_law(tried.name)

    def _leaves_no_time(self, leader: Trial) -> bool:
        """Whether the work that is left is needed for what is missing beside a ``leader``.

        Where much is left and refits take long, two effects are there at once, or one that follows
        the path: to be sure of the first would leave nothing for the second.
        """
        late = self.work.effort > _FIRST_REFITS * self.most
        return leader.cost > MUCH_LEFT and late and self.bench.is_dear

    def _least(self, best: Trial) -> float:
        """The cost that one more effect must explain to be followed on; -inf: none is asked for."""
        asked = self._share(best, math.inf) if best.effects else 0.0  # of any gain, however large
        return _SOME * asked * (best.cost - 1.0) if asked > 0.0 else -math.inf

    @staticmethod
    def _asked(name: str) -> float:
        """Gain of the criterion that is asked for: more of an effect that names no cause."""
        return _DECISIVE + (_UNNAMED_MARGIN if EFFECTS[name].family == "unknown" else 0.0)

    def _round(
        self,
        parent: Trial,
        depth: int,
        span: tuple[float, float],
        other: Trial | None = None,
        family: str = "",
    ) -> list[_Tried]:
        """All effects on top of ``parent``: promises of all, refits of all or the best of them.

        ``other`` is ``parent`` with another effect in the place of which they are tried; with a
        ``family``, only effects of that one.
        """
        promises, jacobian = self._screened(parent, span, family)
        shares = {n: self._promised(parent, n, promises[n][0], other) for n in promises}
        order = sorted(shares, key=lambda n: -shares[n])
        if depth > 0:
            order = order[: _FOLLOWED // depth]
        if depth > 0 and other is None and parent.is_noise:
            # of so little it would have to gain by far: that much shows in what is promised
            worth = parent.cost * self.bench.samples / max(1.0, parent.correlation)
            order = [n for n in order if shares[n] * worth > _SHOWN * _BY_FAR]
        many = len(order)
        tried: list[_Tried] = []

        def refit(names: list[str]) -> None:
            for some in _abreast([n for n in names if n not in {t.name for t in tried}]):
                unknown = [n for n in some if self._owes(parent, n, shares[n])]
                trials = self.bench.parallel_map(
                    lambda n: self._refit(parent, n, promises[n], jacobian, other), unknown
                )
                for name, trial in zip(unknown, trials, strict=True):
                    self.refitted.add((frozenset(parent.effects), name))
                    self._keep(trial)
                for name in some:
                    trial = self.found[frozenset((*parent.effects, name))]
                    tried.append(_Tried(name, parent, trial, shares[name]))
                part = 0.25 + 0.75 * len(tried) / many
                self.report(_stage(parent, "refitting"), span[0] + span[1] * part)

        if depth > 0:
            refit([n for n in order if _leads_to(n, order[0])])
            if any(t.trial.is_noise for t in tried):
                # who promises next to nothing beside what explains all is no rival of it
                least = _HINT * shares[order[0]]
                order = [n for n in order if shares[n] > least]
        if order and parent.cost > MUCH_LEFT and (depth > 0 or not self.thorough):
            # so far from the noise it matters which family it is, not yet which law of it
            refit([n for n in order if _is_first_of_family(n, order)])
            several = depth > 0 or self.bench.is_dear
            near = (_NEAR_LEAD if several else _MAY_LEAD) * min(t.trial.cost for t in tried)
            may_lead = {EFFECTS[t.name].family for t in tried if t.trial.cost < near}
            order = [n for n in order if EFFECTS[n].family in may_lead]
        refit(order)
        return tried

    def _promised(self, parent: Trial, name: str, promise: Promise, other: Trial | None) -> float:
        """The part of what ``parent`` leaves that an effect promises to take off.

        To first order; or as it was alone, where the rest is as beside the effect that ``other``
        has in its place: what is missing there bends the rest of ``parent``, for which it would
        have to make up.
        """
        alone = self.found.get(frozenset((name,)))
        if other is None or alone is None:
            return promise.share
        there = self._in_place(promise.model, other, alone)
        left = float(self.bench.problem(promise.model).costs(there[None])[0])
        return max(promise.share, 1.0 - left / parent.cost)

    def _owes(self, parent: Trial, name: str, promised: float) -> bool:
        """Whether an effect has yet to be refitted on top of ``parent``.

        What was found with it on top of another, while something else was missing, will do where it
        is as good as it is ``promised`` to be from here.
        """
        found = self.found.get(frozenset((*parent.effects, name)))
        kept = found is not None and parent.cost - found.cost > _KEPT * promised * parent.cost
        return not kept and (frozenset(parent.effects), name) not in self.refitted

    def _screened(
        self, parent: Trial, span: tuple[float, float], family: str = ""
    ) -> tuple[dict[str, list[Promise]], np.ndarray]:
        """What each effect (of a ``family``) promises on top of ``parent``; its Jacobian.

        Exchanges come back to models that were screened before.
        """
        key = frozenset(parent.effects)
        if key not in self.screened or self.screened[key][0].trial is not parent:
            self.screened[key] = (Screen(self.bench, parent), {})
        screen, known = self.screened[key]
        of_family = [e for e in self.effects if family in ("", e.family) and not e.generalises]
        wanted = [e for e in of_family if e.name not in key]
        asked = [e for e in wanted if e.name not in known]
        for n in range(0, len(asked), _SCREENED):
            some = asked[n : n + _SCREENED]
            found = self.bench.parallel_map(screen.promises, some)
            known.update({e.name: p[:_PROMISES] for e, p in zip(some, found, strict=True)})
            part = 0.25 * (n + len(some)) / len(asked)
            self.report(_stage(parent, "screening"), span[0] + span[1] * part)
        return {e.name: known[e.name] for e in wanted if known[e.name]}, screen.jacobian

    def _refit(
        self,
        parent: Trial,
        name: str,
        promises: list[Promise],
        jacobian: np.ndarray,
        other: Trial | None = None,
    ) -> Trial:
        """The best fit of one effect: from nothing, and from where its promises were simulated.

        Also with the rest as it is beside the effect that ``other`` has in its place.
        """
        effect = EFFECTS[name]
        model = promises[0].model
        first = parent.x.size
        starts: list[tuple[np.ndarray, np.ndarray | None]] = []
        # from nothing: the first step, which all numbers take together, is the linear guess
        nothing = promises[0].start.copy()
        nothing[:first] = parent.x
        nothing[first : first + len(effect.amplitudes)] = [p.neutral for p in effect.amplitudes]
        worth = [p for p in promises if p.share > _NEARLY * promises[0].share]
        for start, promise in ((nothing, promises[0]), *((p.start, p) for p in worth)):
            near = _near(jacobian, promise, effect)
            starts.append((start, self.bench.problem(model).project_off_drift(near)))
        simpler = self._simpler(parent, effect, promises[0].start)
        if simpler is not None:
            starts.append((simpler, starts[0][1]))
        alone = self.found.get(frozenset((name,)))
        if other is not None and alone is not None:
            starts.append((self._in_place(model, other, alone), starts[0][1]))
        anew: list[np.ndarray] = []
        if effect.is_viscoelastic and isinstance(model, Actuator):
            anew = self._relieved(parent, promises[0])
        elif effect.acts_on == "inertia" and parent.cost > MUCH_LEFT:
            anew = self._moving(parent, promises[0])
        fixed = np.concatenate([parent.fixed, np.zeros(len(effect.parameters), dtype=bool)])
        leader = min(t.cost for t in self.found.values())
        noise = parent.is_noise
        return self.bench.fit(model, starts, fixed, leader, parent.cost, noise, anew)

    def _in_place(self, model: Actuator | Strip, other: Trial, alone: Trial) -> np.ndarray:
        """Coordinates of ``model`` as ``other`` is, but its new effect as it was ``alone``."""
        return _placed(self.bench.problem(model).layout, _numbers(alone) | _numbers(other))

    def _relieved(self, parent: Trial, promise: Promise) -> list[np.ndarray]:
        """Coordinates where an effect has taken over from a branch; the rest is as promised."""
        layout = self.bench.problem(promise.model).layout
        found = []
        for springs, modulus, time in relieved(parent):
            values = layout.values(promise.start)
            values[springs.size : springs.size + 2] = modulus, time
            x = np.clip(layout.coordinates(values), layout.lower, layout.upper)
            x[: springs.size] = springs
            found.append(x)
        return found

    def _moving(self, parent: Trial, promise: Promise) -> list[np.ndarray]:
        """Coordinates with the mass, and the springs beside it, that the measured stretch tells.

        While a mass is missing, so much is bent that no size of it promises anything from there.
        """
        layout = self.bench.problem(promise.model).layout
        found = []
        for springs, mass in self.bench.moving(parent):
            values = layout.values(promise.start)
            values[parent.x.size] = mass
            x = np.clip(layout.coordinates(values), layout.lower, layout.upper)
            x[: springs.size] = springs
            found.append(x)
        return found

    def _settled(
        self,
        best: Trial,
        fitted: list[_Tried],
        least: float = -math.inf,
        to_other_laws: bool = False,
    ) -> tuple[list[_Tried], float]:
        """The candidates, best first, the leading ones fitted to the end of their valleys.

        Of these only such as explain ``least`` of the cost of ``best``, and far from the noise one
        of each family. Who has not kept a promise by which it would lead is followed like those.
        Named effects go before unnamed ones that do no better than a margin: an attached mode can
        play a moved mass, a step nearly anything, and a walk all that is slow. ``to_other_laws``
        also sets out from where simpler ones have ended.
        """

        def rank(tried: _Tried) -> float:
            return self._demerit(tried.trial, correlation)

        correlation = self._correlation([best, *(t.trial for t in fitted)])
        order = sorted(fitted, key=rank)
        names = [t.name for t in order]
        lead = first = order[0].trial.cost
        to_the_end = not best.is_noise
        # little is to be explained: who explains it is told by the last steps of each
        subtle = not (to_the_end or best.is_white)
        mark = self._criterion(best, correlation) - _DECISIVE
        of_parent: Counter[frozenset[str]] = Counter()
        for place, tried in enumerate(order):
            near = tried.trial.cost < _CLOSE * lead
            kept = tried.parent.cost - tried.trial.cost > _KEPT * tried.promised * tried.parent.cost
            owing = _promised_as_much(tried, lead) and not kept
            leads = self.found[frozenset(order[0].trial.effects)]
            reach = (_NEAR_NOISE if leads.is_white else _NEAR_LEAD) * first
            # an exchange looks for the best beside each of several parents
            beside = frozenset(tried.parent.effects)
            follow = _SETTLED if leads.is_white and not subtle else _SETTLED_QUICKLY
            most = follow if subtle else _SETTLED
            may_lead = owing or (tried.trial.cost < reach and of_parent[beside] < most)
            of_parent[beside] += 1
            if place >= follow and not (near and rank(tried) < mark) and not may_lead:
                continue
            if lead > MUCH_LEFT and not _is_first_of_family(tried.name, names):
                continue
            worse = rank(tried) - self._criterion(tried.parent, correlation)
            if place and not owing and worse > (_DECISIVE if subtle else 0.0):
                continue  # who is worse than nothing after a refit will not lead
            if best.cost - tried.trial.cost < least:
                continue
            key = frozenset(tried.trial.effects)
            # beside a leader that leaves but noise, it need only be seen who does as well
            if may_lead and subtle:
                self._ended(tried.trial)
            elif may_lead and to_the_end and not leads.is_white:
                self._ended(tried.trial, lead)
            elif key not in self.settled and tried.trial.cost < _MAY_LEAD * lead:
                self.settled.add(key)
                self.found[key] = self.bench.settled(tried.trial, lead)
            lead = min(lead, self.found[key].cost)
        order = self._as_found(order)
        if to_the_end:
            self._set_out_from_leader(order)
            order = self._as_found(order)
        if to_other_laws and to_the_end:
            self._set_out_from_simpler(best, order)
            order = self._as_found(order)
        return self._ranked(best, order)

    def _rivals_ended(self, best: Trial, tried: list[_Tried]) -> tuple[list[_Tried], float]:
        """The candidates, best first, those that rival the leader at their ends.

        A leader that leaves but noise has shown where the noise is, and held others back on their
        way there: who explains a good part of what it does may yet do so with fewer numbers. Of
        families that follow the path only the best law: the others take long to be no better.
        """
        leader = tried[0].trial
        order = sorted(tried, key=lambda t: t.trial.cost)
        names = [t.name for t in order]
        if leader.is_noise:
            rivals: list[Trial] = []
            for one in order:
                rivalling = best.cost - one.trial.cost > _RIVALS * (best.cost - leader.cost)
                named = EFFECTS[one.name].family != "unknown"
                quick = not any_hysteretic(one.trial.model.effects)
                if rivalling and named and (quick or _is_first_of_family(one.name, names)):
                    rivals.append(one.trial)
            for n in range(0, len(rivals), _ABREAST):
                self._all_ended(rivals[n : n + _ABREAST])
        return self._ranked(best, order)

    def _out_of_simpler(self, best: Trial, tried: list[_Tried]) -> tuple[list[_Tried], float]:
        """The candidates, best first, laws of the leading family from where simpler ones end.

        While more than noise is left, a law of many numbers may be in a wrong valley, even where it
        leads. From the bottom of the valley of the one that it extends, what it has more idle, the
        way down is its own. Each sets out once from the most intricate that it extends.
        """
        order, correlation = self._ranked(best, tried)
        family = EFFECTS[order[0].name].family
        laws = [t for t in order if EFFECTS[t.name].family == family]
        for one in sorted(laws, key=lambda t: _intricacy(t.name)):
            lead = order[0]
            if lead.trial.is_white or _explained(lead.parent, lead.trial) < _SHAKEN_FROM:
                break
            simpler = [t for t in order if _extends(one, t)]
            nearest = max(simpler, key=lambda t: _intricacy(t.name), default=one)
            both = (frozenset(one.trial.effects), nearest.name)
            if nearest is one or both in self.reset:
                continue
            self.reset.add(both)
            start = self._idle(one, nearest)
            if start is not None:
                # a few steps by which it is on its way; what it is idle in shows no way on
                fit = self.bench.fit(one.trial.model, [(start, None)], one.trial.fixed)
                # where it leads shows in its last steps only
                self._keep(self.bench.ended(fit))
                order, correlation = self._ranked(best, order)
        return order, correlation

    @staticmethod
    def _idle(tried: _Tried, simpler: _Tried) -> np.ndarray | None:
        """Coordinates (d,) where a law does what the ``simpler`` one does; None if none is seen.

        One of the numbers that it has more is at an end of its range there, the others are where
        fits set out.
        """
        law, problem = EFFECTS[tried.name], tried.trial.problem
        shared = _taken_over(tried.name, simpler)
        more = [p for p in law.parameters if f"{law.name}: {p.name}" not in shared]
        known = {f"{law.name}: {p.name}": p.starts[0] for p in more if p.starts} | shared
        places = [known | {f"{law.name}: {p.name}": end} for p in more for end in p.fit_bounds]
        xs = np.array([_placed(problem.layout, place) for place in places])
        away = np.abs(problem.costs(xs) / simpler.trial.cost - 1.0)
        found = int(np.argmin(away))
        return xs[found] if away[found] < _IDLE else None

    def _shaken(self, best: Trial, tried: list[_Tried]) -> tuple[list[_Tried], float]:
        """The candidates, best first, that one shaken which leads and still leaves more than noise.

        A film that sticks and slips has a valley for every phase in which it does, and which one a
        descent ends in is a matter of chance. So a law that follows the path, and explains most of
        what is there, or the law of most numbers that extends it, is fitted again from all around.
        """
        lead = tried[0]
        some = _explained(lead.parent, lead.trial) > _SHAKEN_FROM
        if EFFECTS[lead.name].is_hysteretic and some and not lead.trial.is_noise:
            wider = [t for t in tried if _extends(t, lead)]
            law = max([lead, *wider], key=lambda t: _intricacy(t.name))
            key = frozenset(law.trial.effects)
            far = law.trial.cost > _MAY_LEAD * lead.trial.cost
            if far and key not in self.extended:
                self.extended.add(key)
                self._keep(self._extended(law, lead))
            if not self.found[key].is_noise:
                trial = self.found[key]
                own = [n.startswith(f"{law.name}: ") for n in trial.problem.layout.names]
                for better in self.bench.shaken(trial, np.array(own), lead.trial.cost):
                    self._keep(better)
        return self._ranked(best, tried)

    def _laws_of_walk(self, best: Trial, tried: list[_Tried]) -> tuple[list[_Tried], float]:
        """The candidates, best first, laws that a leading walk may play sought all over.

        A walk plays all that is slow, from wherever it sets out. A law of two time constants does
        so only near them, and where it sets out the branches may have taken one of them over.
        """
        lead = min(tried, key=lambda t: t.trial.cost)
        if _is_walk(lead.name):
            explained = lead.parent.cost - lead.trial.cost
            names = [t.name for t in tried]
            laws = [
                t
                for t in tried
                if _is_law(t.name)
                and t.parent is lead.parent
                and t.parent.cost - t.trial.cost > _PLAYED * explained
                and _is_first_of_family(t.name, names)
            ]
            for law in laws[:_LAWS]:
                self._sought_all_over(law, lead.trial)
                if self.found[frozenset(law.trial.effects)].cost < lead.trial.cost:
                    break
        return self._ranked(best, tried)

    def _refined(self, best: Trial, tried: list[_Tried]) -> tuple[list[_Tried], float]:
        """The candidates, best first, and what refines an effect of the one that explains most."""
        lead = min(tried, key=lambda t: t.trial.cost)
        return self._ranked(best, [*tried, *self._refining(lead.trial)])

    def _in_refined(self, best: Trial) -> Trial:
        """``best``, or what refines an effect of it, where that explains more."""
        tried = self._refining(best)
        correlation = self._correlation([best, *(t.trial for t in tried)])
        found = min([best, *(t.trial for t in tried)], key=lambda t: self._demerit(t, correlation))
        for one in tried:
            if one.trial is found:
                self._record(
                    [one],
                    correlation,
                    one,
                    "explains more than the simpler effect that it generalises",
                )
        return found

    def _refining(self, trial: Trial) -> list[_Tried]:
        """What refines effects of ``trial``, in their place, where it leaves more than noise.

        From where that has ended, what there is more doing nothing; and what refines that.
        """
        refining = [e for e in self.effects if e.generalises in trial.effects]
        tried: list[_Tried] = []
        for effect in refining if not trial.is_white else ():
            parent = self._without(trial, effect.generalises)
            key = frozenset((*parent.effects, effect.name))
            if key not in self.found:
                nothing = tuple(p.neutral or 0.0 for p in effect.amplitudes)
                model = with_effect(parent.model, effect.name, nothing)
                layout = self.bench.problem(model).layout
                known = dict(zip(layout.names, layout.initial(), strict=True))
                coarse = _Tried(effect.generalises, parent, trial, 0.0)
                start = _placed(layout, known | _taken_over(effect.name, coarse))
                fixed = np.concatenate([parent.fixed, np.zeros(len(nothing), dtype=bool)])
                self._keep(self.bench.ended(self.bench.fit(model, [(start, None)], fixed)))
            fine = self._in_its_place(trial, effect.generalises, [effect.name])
            tried += fine
            for one in fine:
                tried += self._refining(one.trial)
        return tried

    def _sought_all_over(self, tried: _Tried, lead: Trial) -> None:
        """Fit an effect again from the shapes, of all within its bounds, that promise most."""
        screen = self.screened[frozenset(tried.parent.effects)][0]
        promises = screen.scattered(EFFECTS[tried.name])[:_AFAR]
        fixed = tried.trial.fixed

        def fit(promise: Promise) -> Trial:
            jacobian = _near(screen.jacobian, promise, EFFECTS[tried.name])
            trial = self.bench.fit(promise.model, [(promise.start, jacobian)], fixed, lead.cost)
            # where it leads shows in its last steps only
            return self.bench.ended(trial, lead.cost)

        for trial in self.bench.parallel_map(fit, promises):
            self._keep(trial)

    def _ranked(self, best: Trial, tried: list[_Tried]) -> tuple[list[_Tried], float]:
        """The candidates as they are by now, best first, by one count of independent samples.

        A walk gives way to a law that does nearly all that it does, and leaves but noise: it plays
        all that is slow, the last of it the law's own form, and foretells nothing. An effect that
        names no cause, and leaves more than noise, gives way to a law that does most of what it
        does: it plays a part of two things at once, and stands in the way of either.
        """
        order = self._as_found(tried)
        correlation = self._correlation([best, *(t.trial for t in order)])
        order.sort(key=lambda t: self._demerit(t.trial, correlation))
        lead = order[0]
        explained = lead.parent.cost - lead.trial.cost
        if _is_walk(lead.name):
            part, white = _NEARLY_ALL, True
        elif EFFECTS[lead.name].family == "unknown" and lead.trial.cost > TOLERANCE**2:
            part, white = _MOSTLY, False
        else:
            return order, correlation
        order.sort(
            key=lambda t: (
                not _is_law(t.name)
                or t.parent is not lead.parent
                or t.parent.cost - t.trial.cost < part * explained
                or (white and not t.trial.is_white)
            )
        )
        return order, correlation

    def _as_found(self, tried: list[_Tried]) -> list[_Tried]:
        """The candidates as the best fits of them are by now."""
        return [replace(t, trial=self.found[frozenset(t.trial.effects)]) for t in tried]

    def _set_out_from_simpler(self, best: Trial, tried: list[_Tried]) -> None:
        """Fit laws again from where the best that they extend has ended, each once, until one fits.

        These are laws that do no better than a simpler one, and the leading one, where it leaves
        more than noise: a valley that it came into while something else was missing may be the
        wrong one. Where its law does not lead, the simpler one must do as well as ``best``, of what
        there was before.
        """
        lead = min((t.trial for t in tried), key=lambda t: t.cost)
        for one in tried:
            names = frozenset(one.trial.effects)
            simpler = [t for t in tried if _extends(one, t)]
            if names in self.extended or not simpler:
                continue
            if lead.is_noise:
                return
            leads = one.trial is lead and _explained(one.parent, lead) > _NEARLY_ALL
            most = _NEAR_LEAD * lead.cost
            if not leads:
                most = min(most, best.cost, one.trial.cost)
            nearest = min(simpler, key=lambda t: t.trial.cost)
            if nearest.trial.cost <= most:
                self.extended.add(names)
                trial = self._extended(one, nearest)
                self._keep(trial)
                lead = min(lead, trial, key=lambda t: t.cost)

    def _set_out_from_leader(self, tried: list[_Tried]) -> None:
        """Fit others again from where the leading one has ended, each once.

        One that leaves more than noise is not the right law. A simpler one may be, in whose valley
        it is already; or one whose own way down has led elsewhere.
        """
        lead = min(tried, key=lambda t: t.trial.cost)
        if lead.trial.is_white:
            return
        for one in tried:
            both = (frozenset(one.trial.effects), lead.name)
            if one is lead or one.parent is not lead.parent or both in self.reset:
                continue
            start = self._beside_leader(one, lead)
            if start is None:
                continue
            self.reset.add(both)
            trial = self.bench.fit(
                one.trial.model, [(start, None)], one.trial.fixed, lead.trial.cost
            )
            self._keep(trial)
            near = 1.0 if lead.trial.cost > MUCH_LEFT else _NEAR_LEAD
            if trial.cost < near * lead.trial.cost:
                self._ended(self.found[both[0]], lead.trial.cost)

    @staticmethod
    def _beside_leader(tried: _Tried, lead: _Tried) -> np.ndarray | None:
        """Coordinates (d,) of an effect with the rest as the leading one has it; None if no good.

        What a law that extends it has found is taken over. Of another, that size is taken which
        suits the rest best.
        """
        law, trial = EFFECTS[tried.name], tried.trial
        layout, known = trial.problem.layout, _taken_over(tried.name, lead)
        if _extends(lead, tried):
            return _placed(layout, known)
        if (
            len(law.amplitudes) != 1
            or law.is_hysteretic
            or trial.cost > _MAY_LEAD * lead.trial.cost
        ):
            return None
        (size,) = law.amplitudes
        rest, name = _numbers(trial) | known, f"{law.name}: {size.name}"

        def suited(sizes: Sequence[float]) -> tuple[float, float, np.ndarray]:
            xs = np.array([_placed(layout, rest | {name: s}) for s in sizes])
            costs = trial.problem.costs(xs)
            best = int(np.argmin(costs))
            return float(costs[best]), sizes[best], xs[best]

        _, near, _ = suited(sizes_of(size, _ANEW_SIZES))
        left, _, start = suited([f * near for f in _ANEW_CLOSER])
        return start if left < _NEAR_LEAD * trial.cost else None

    def _anew(self, tried: list[_Tried]) -> list[_Tried]:
        """The candidates, those fitted anew in whose way the branches stand.

        While an effect was missing, the branches imitated it, and a descent from there may not find
        out. The measured stretch tells without one: with the effect's part taken off it, do
        branches account for more of the Maxwell stress than before? Where the leader explains all,
        only those are fitted anew beside which they account for as much as beside it; and those
        that have promised about as much as it keeps, or as it did, from where they are.
        """
        parents = {frozenset(t.parent.effects): t.parent for t in tried}
        before = {
            key: float(self.bench.unaccounted(p.problem, p.x[None])[0])
            for key, p in parents.items()
        }

        leader = tried[0].trial

        def looked(place: int) -> tuple[float, int, float] | None:
            one = tried[place]
            sizes = EFFECTS[one.name].amplitudes
            # beside a leader that leaves much, others are looked for beside it next
            reach = _MAY_LEAD if leader.cost > MUCH_LEFT else _OUT_OF_REACH
            if len(sizes) != 1 or one.trial.cost > reach * leader.cost:
                return None
            left, size = self._unaccounted(one, sizes_of(sizes[0], _ANEW_SIZES))
            if not left < _IN_THE_WAY * before[frozenset(one.parent.effects)]:
                return None
            left, size = self._unaccounted(one, [f * size for f in _ANEW_CLOSER])
            return left, place, size

        looks = [k for k in self.bench.parallel_map(looked, range(len(tried))) if k is not None]
        looks.sort(key=lambda look: look[0])
        most = _CLEARLY * looks[0][0] if looks else 0.0
        if leader.is_noise:
            there = float(self.bench.unaccounted(leader.problem, leader.x[None])[0])
            there = min([there, *(left for left, place, _ in looks if place == 0)])
            most = min(most, _AS_WELL * there)
        again = list(tried)
        names = [tried[place].name for _, place, _ in looks]
        if leader.cost > MUCH_LEFT:
            looks = [k for k in looks if _is_first_of_family(tried[k[1]].name, names)]
        starts = {
            place: self._sized(tried[place], [f * size for f in _ANEW_FROM])
            for left, place, size in looks[:_ANEW]
            if left <= most
        }
        if leader.cost < TOLERANCE**2:
            mark = _KEPT * tried[0].promised
            owing = [
                i
                for i, t in enumerate(tried)
                if i
                and (
                    _promised_as_much(t, leader.cost)
                    or (t.parent is tried[0].parent and t.promised > mark)
                )
            ]
            starts.update(
                {i: tried[i].trial.x[None] for i in owing[:_CONTENDERS] if i not in starts}
            )
        correlation = self._correlation([leader])
        for place, sizes in starts.items():
            one = tried[place]
            if one.trial.is_white and self._explains_as_well(one.trial, leader, correlation):
                continue  # nothing is left to be gained
            trial = self.bench.sought(one.trial, sizes)
            if trial is not one.trial:
                self._keep(trial)
                again[place] = replace(one, trial=trial)
        return again

    def _extended(self, tried: _Tried, simpler: _Tried) -> Trial:
        """The law that was ``tried``, fitted from where one that it extends has ended.

        It can do all that the ``simpler`` one does. What it has more is scattered over its bounds.
        """
        trial, layout = tried.trial, tried.trial.problem.layout
        known = _taken_over(tried.name, simpler)
        more = np.array([n not in known for n in layout.names])
        start = layout.values(trial.x)
        start[~more] = [known[n] for n in layout.names if n in known]
        start = np.clip(layout.coordinates(start), layout.lower, layout.upper)
        return self.bench.scattered(trial, start, more, min(trial.cost, simpler.trial.cost))

    def _unaccounted(self, tried: _Tried, sizes: Sequence[float]) -> tuple[float, float]:
        """What branches do not account for beside the effect, at the best of ``sizes``; which."""
        left = self.bench.unaccounted(tried.trial.problem, self._sized(tried, sizes))
        best = int(np.argmin(left))
        return float(left[best]), sizes[best]

    @staticmethod
    def _sized(tried: _Tried, sizes: Sequence[float]) -> np.ndarray:
        """Coordinates (K, d): the parent's, and the effect as it was fitted, but of ``sizes``."""
        layout = tried.trial.problem.layout
        first = tried.parent.x.size
        values = np.tile(layout.values(tried.trial.x), (len(sizes), 1))
        values[:, :first] = tried.parent.problem.layout.values(tried.parent.x)
        values[:, first] = sizes
        places = np.array([layout.coordinates(v) for v in values])
        return np.clip(places, layout.lower, layout.upper)

    def _simpler(self, parent: Trial, effect: Effect, start: np.ndarray) -> np.ndarray | None:
        """Coordinates of the best fit of a simpler effect of the family, as a start for this one.

        Numbers that both have (by name and unit) are taken over, the others are as in ``start``.
        """
        best: Trial | None = None
        for name in {n for key in self.found for n in key} - set(parent.effects):
            other = EFFECTS[name]
            trial = self.found.get(frozenset((*parent.effects, name)))
            simpler = _intricacy(name) < _intricacy(effect.name)
            if other.family != effect.family or not simpler or trial is None:
                continue
            if trial.effects[:-1] == parent.effects and (best is None or trial.cost < best.cost):
                best = trial
        if best is None:
            return None
        first = start.size - len(effect.parameters)
        taken = start.copy()
        taken[:first] = best.x[:first]
        for j, i in _shared(effect, EFFECTS[best.effects[-1]]):
            taken[first + j] = best.x[first + i]
        return taken

    def _beam(self, leader: Trial, fitted: list[_Tried]) -> list[Trial]:
        """The explanations to follow on: the best of different families, the leader first."""
        beam: list[Trial] = []
        seen: set[frozenset[str]] = set()
        for trial in (leader, *(t.trial for t in fitted)):
            if trial.cost > _BEAM_COST * leader.cost:
                continue
            families = frozenset(EFFECTS[n].family for n in trial.effects)
            if families not in seen:
                seen.add(families)
                beam.append(trial)
            if len(beam) == _BEAM:
                break
        return beam

    def _pruned(self, best: Trial) -> Trial:
        """``best`` without what it does not need, were it its only effect."""
        while best.effects:
            smaller = {name: self._ended(self._without(best, name)) for name in best.effects}
            correlation = self._correlation([best, *smaller.values()])
            mark = self._criterion(self._of_any_age(best), correlation)
            spare = {
                name: self._criterion(self._of_any_age(t), correlation) - mark - self._asked(name)
                for name, t in smaller.items()
            }
            least = min(spare, key=lambda n: spare[n])
            if spare[least] > 0.0:
                break
            best = smaller[least]
        return best

    def _of_any_age(self, trial: Trial) -> Trial:
        """``trial`` with the cost that it has where each record's readings are as old as suits."""
        return replace(trial, cost=self.bench.cost_at_any_age(trial))

    def _without(self, trial: Trial, name: str) -> Trial:
        key = frozenset(trial.effects) - {name}
        # however well it is known: what is left out may have shown the others a better place
        if (frozenset(trial.effects), name) not in self.left_out:
            model = replace(
                trial.model, effects=tuple(e for e in trial.model.effects if e[0] != name)
            )
            layout = self.bench.problem(model).layout
            fixed = self.found[frozenset()].fixed
            fixed = np.concatenate([fixed, np.zeros(layout.size - fixed.size, dtype=bool)])
            start = layout.coordinates(layout.initial())
            # to its end, however far behind: what is needless shows only there
            starts = [start]
            if EFFECTS[name].is_viscoelastic and isinstance(model, Actuator):
                known = _numbers(trial)
                numbers = [known[f"{name}: {p.name}"] for p in EFFECTS[name].parameters[:2]]
                starts += merged(layout, start, *numbers)
            fits = self.bench.parallel_map(
                lambda x: self.bench.fit(model, [(x, None)], fixed, leader=math.inf), starts
            )
            self._keep(min(fits, key=lambda t: t.cost))
            self.left_out.add((frozenset(trial.effects), name))
        return self.found[key]

    def _keep(self, trial: Trial) -> None:
        """``trial``, if it is the best with its effects; it is not at its valley's end then."""
        key = frozenset(trial.effects)
        if key not in self.found or trial.cost < (1.0 - _BETTER) * self.found[key].cost:
            self.found[key] = trial
            self.settled.discard(key)
            self.ended.pop(key, None)

    def _for_others(self, trial: Trial) -> Trial:
        """``trial`` as it predicts other recordings: without what may not happen again.

        The rest is fitted without: then whoever has found nothing else predicts as before, and no
        worse. Where the rest then plays what happened once, it predicts nothing, and the baseline
        does: it explains far less than all did, or far more without it than beside it.
        """
        once = self._once(trial)
        kept = self._with_only(trial, [n for n in trial.effects if n not in once])
        base = self.found[frozenset()]
        if kept is trial or kept is base:
            return kept
        explained = base.cost - kept.cost
        beside = self._with_only(trial, once).cost - trial.cost
        if explained < _TRUSTED * (base.cost - trial.cost) or explained > _TAKEN_OVER * beside:
            return base
        return kept

    def _once(self, trial: Trial) -> list[str]:
        """Effects of ``trial`` that may not happen again, and what else is of their families.

        A moment or a walk is of one recording, unless several of these show it alike: all are
        fitted with one set of numbers, and each must be the better for it. What else is of its
        family goes with it: where a reading walks, what else drifts may be of the walk.
        """
        lawless = {
            EFFECTS[n].family
            for n in trial.effects
            if not EFFECTS[n].is_reproducible and not self._recurred(trial, self._without(trial, n))
        }
        return [n for n in trial.effects if EFFECTS[n].family in lawless]

    def _predicting(self, trial: Trial, fitted: Callable[[Trial], Trial]) -> Actuator | Strip:
        """The model by which ``trial`` predicts other recordings, ``fitted`` as well as is asked.

        Where a walk is beyond doubt, the rest is as it is beside it.
        """
        if not self._walks_beyond_doubt(trial):
            return fitted(self._for_others(trial)).in_common
        model, once = fitted(trial).in_common, self._once(trial)
        return replace(model, effects=tuple(e for e in model.effects if e[0] not in once))

    def _walks_beyond_doubt(self, trial: Trial) -> bool:
        """Whether ``trial`` leaves but noise, and nothing that was found without a walk does.

        Then no law of the rig plays it: springs that know of it foretell other recordings as if it
        had not been, and those of a fit without it are bent by it.
        """
        small = TOLERANCE**2
        lawful = (t for key, t in self.found.items() if not any(map(_is_walk, key)))
        if self.interrupted or trial.cost > small or any(t.cost < small for t in lawful):
            return False
        return any(map(_is_walk, self._once(trial)))

    def _recurred(self, trial: Trial, without: Trial) -> bool:
        """Whether each of several recordings is decisively and mostly explained by it.

        One for all: two walks that differ have something in common, too, but that leaves much of
        each.
        """
        edges = np.cumsum([r.measured.size for r in trial.problem.records])[:-1]
        used = np.isfinite(trial.problem.sigma).astype(float)
        left = trial.residuals_in_common
        rows = (without.residuals**2 - left**2, without.residuals**2 - used)
        gained, missing = ([float(p.sum()) for p in np.split(row, edges)] for row in rows)
        least = _DECISIVE * self._correlation([trial])
        shown = [g > max(least, _TRUSTED * m) for g, m in zip(gained, missing, strict=True)]
        return len(shown) > 1 and all(shown)

    # -- judgement

    def _criterion(self, trial: Trial, correlation: float) -> float:
        return information(trial.cost, trial.free, self.bench.samples / correlation)

    def _gain(self, over: Trial, trial: Trial, correlation: float) -> float:
        """What ``trial`` gains of the criterion over another."""
        return self._criterion(over, correlation) - self._criterion(trial, correlation)

    def _explains_as_well(self, trial: Trial, best: Trial, correlation: float) -> bool:
        """Whether the data cannot tell ``trial`` from ``best``, which may be the simpler one.

        However many they are, they tell no two laws apart that differ by less than a hundredth (in
        RMS) of what they explain: by as much no law is true to a film.
        """
        samples = self.bench.samples / correlation
        behind = information(trial.cost, 0, samples) - information(best.cost, 0, samples)
        explained = self.found[frozenset()].cost - best.cost
        return behind < _ALIKE or trial.cost - best.cost < min(_TRUE_TO * explained, _MATTERS)

    def _demerit(self, trial: Trial, correlation: float) -> float:
        """The criterion, and a margin for each effect that names no cause, or follows no law."""
        unnamed = sum(
            EFFECTS[name].family == "unknown" or not EFFECTS[name].is_reproducible
            for name in trial.effects
        )
        return self._criterion(trial, correlation) + _UNNAMED_MARGIN * unnamed

    def _correlation(self, trials: Sequence[Trial]) -> float:
        """One count of independent samples for all: by the fit that leaves the least structure."""
        return max(1.0, min(t.correlation for t in trials))

    def _leading(self) -> Trial:
        trials = list(self.found.values())
        correlation = self._correlation(trials)
        # each effect must be worth as much as is asked of one
        best = min(
            trials,
            key=lambda t: self._demerit(t, correlation) + _DECISIVE * len(t.effects),
        )
        base = self.found[frozenset()]
        if len(best.effects) == 1:
            alone = [_Tried(t.effects[0], base, t, 0.0) for t in trials if len(t.effects) == 1]
            best = self._ranked(base, alone)[0][0].trial
        gain = self._gain(base, best, correlation)
        return best if gain > _DECISIVE else base

    def _watch(self) -> None:
        """End the search, wherever it is: the fits that run are given up."""
        if self._searching and self.stop():
            raise _Interrupted
        if self._searching and self.work.effort > self.most:
            raise _Enough

    # -- what is handed back

    def _record(
        self, tried: list[_Tried], correlation: float, chosen: _Tried | None, reason: str
    ) -> None:
        """Keep the round: the candidates on top of the base that the choice was made from."""
        parent = tried[0].parent
        of_parent = [t for t in tried if t.parent is parent]
        best = min((t.trial for t in of_parent), key=lambda t: self._criterion(t, correlation))
        candidates = []
        for t in of_parent:
            effect = EFFECTS[t.name]
            behind = self._gain(t.trial, best, correlation)
            better = self._gain(parent, t.trial, correlation)
            verdict = "worthless"
            if chosen is not None and t is chosen:
                verdict = "chosen"
            elif better > _DECISIVE and self._explains_as_well(t.trial, best, correlation):
                verdict = "indistinguishable"
            elif better > _DECISIVE:
                verdict = "better"
            candidates.append(
                Candidate(
                    effect=t.name,
                    family=effect.family,
                    acts_on=effect.acts_on,
                    stage=self.bench.stage(t.trial, correlation),
                    promised=t.promised,
                    gained=1.0 - t.trial.cost / parent.cost,
                    gain=better,
                    behind=behind,
                    verdict=verdict,
                    note=_note(t, parent),
                )
            )
        candidates.sort(key=lambda c: c.behind)
        self.rounds.append(
            Round(
                parent.effects,
                tuple(candidates),
                chosen.name if chosen else None,
                f"{chosen.name} {reason}" if chosen else reason,
            )
        )

    def _finding(self, baseline: Trial, best: Trial) -> Diagnosis:
        self.report("final fits", 0.94)
        first = self._polished(baseline)
        last = self._polished(best) if best.effects else first
        correlation = max(1.0, last.correlation)
        stage0 = self.bench.stage(first, correlation, estimates=True)
        explained = _explained(first, last)
        small = last.cost < TOLERANCE**2
        doubtful = not small and (explained < _TRUSTED or _is_worse_in_one(first, last))
        done = {frozenset(): first, frozenset(best.effects): last}

        def fitted(trial: Trial) -> Trial:
            key = frozenset(trial.effects)
            return done[key] if key in done else self._polished(trial)

        others = first.model if doubtful else self._predicting(best, fitted)
        final = self.bench.stage(last, correlation, estimates=True, for_others=others)
        steps, rivals = self._steps(best, last, final.estimates, correlation)
        before = signatures(self.bench.full, first)
        after = signatures(self.bench.full, last)
        missing_before = missing_stress(self.bench.full, first.model)
        missing_after = [
            m
            for record, model in zip(self.bench.full, last.models, strict=True)
            for m in missing_stress([record], model)
        ]
        is_noise = all(s.is_noise for s in after)
        if not best.effects:
            verdict = NOTHING_MISSING if small else UNEXPLAINED
        elif small and last.uneven <= _OF_ITS_FORM * (first.cost - last.cost):
            verdict = EXPLAINED
        else:
            verdict = PARTLY_EXPLAINED if explained > _UNNAMED_SHARE else UNEXPLAINED
        unnamed = None
        partly = verdict in (UNEXPLAINED, PARTLY_EXPLAINED) and not self.interrupted
        if partly or any(s.family == "unknown" for s in steps):
            unnamed = describe_unnamed(missing_after, after, steps)
        notes = []
        if self.ran_out:
            notes.append("the search stopped at its computing budget; --thorough searches further")
        if self.interrupted and not (self.rounds or best.effects):
            notes.append(
                "interrupted before the first round ended: it is not known what is missing"
            )
        gone = [n for n in best.effects if n not in {name for name, _ in others.effects}]
        if gone and doubtful:
            notes.append(
                "the effects found explain too little, or raise the error of one of these "
                "recordings: other recordings are predicted without them"
            )
        elif gone:
            notes.append(
                f"{', '.join(gone)}: specific to these recordings as far as they show; other "
                "recordings are predicted without it"
            )
        if not is_noise and verdict in (NOTHING_MISSING, EXPLAINED):
            notes.append(
                "the residual is not quite white noise, but too small to attribute to an effect"
            )
        if self.held:
            notes.append(
                "the voltage is held between samples, as by a converter, although the records "
                "declare it linear: half a sample of delay, not an effect of the rig"
            )
        self.report("final fits", 1.0)
        return Diagnosis(
            verdict=verdict,
            baseline=stage0,
            rounds=tuple(self.rounds),
            steps=tuple(steps),
            final=final,
            before=before,
            after=after,
            missing_before=missing_before,
            missing_after=tuple(missing_after),
            unnamed=unnamed,
            rivals=tuple(rivals),
            simulations=self.work.simulations,
            interrupted=self.interrupted,
            held=self.held,
            notes=tuple(notes),
            status="stopped" if self.interrupted else "budget" if self.ran_out else "complete",
        )

    def _polished(self, trial: Trial) -> Trial:
        """``trial`` fitted to every reading, as far as there is time for it."""
        most = math.inf if self.thorough else _POLISHING
        return self.bench.polished(trial, 0.0 if self.interrupted else most)

    def _steps(
        self, best: Trial, last: Trial, numbers: Sequence[Estimate], correlation: float
    ) -> tuple[list[Step], list[tuple[str, Actuator | Strip]]]:
        """The effects of ``best``, the one that explains most first, each with its evidence.

        ``last`` is ``best`` fitted to every sample, ``numbers`` are those of ``last``.
        """
        names = best.effects
        if not names:
            return [], []
        # in the order of what each is worth: the first alone, then with the next, ...
        order: list[str] = []
        while len(order) < len(names):
            rest = [n for n in names if n not in order]
            trials = {n: self._with_only(best, [*order, n]) for n in rest}
            order.append(min(rest, key=lambda n: trials[n].cost))
        steps, rivals = [], []
        correlation_thin = self._correlation([best])
        for i, name in enumerate(order):
            effect = EFFECTS[name]
            alike = self._alike(best, name, correlation_thin)
            rivals += [(EFFECTS[n].family, t.model) for n, t in alike]
            families = tuple(dict.fromkeys(EFFECTS[n].family for n, _ in alike))
            on_bench = self._with_only(best, order[: i + 1])
            with_it = last if i == len(order) - 1 else on_bench
            without = self._with_only(best, [n for n in order if n != name])
            own = tuple(
                replace(e, name=e.name.split(": ", 1)[1])
                for e in numbers
                if e.name.startswith(f"{name}: ")
            )
            worth = self._gain(without, best, correlation_thin)
            evidence = [
                f"without it the residual is {np.sqrt(without.cost):.3g} times the noise, with it "
                f"{np.sqrt(best.cost):.3g} times",
                f"without it the information criterion is worse by {worth:.0f}",
                *(f"{n} explains these data as well" for n, _ in alike),
            ]
            steps.append(
                Step(
                    effect=name,
                    family=effect.family,
                    acts_on=effect.acts_on,
                    stage=self.bench.stage(
                        with_it, correlation, for_others=self._predicting(on_bench, lambda t: t)
                    ),
                    estimates=own,
                    indistinguishable_from=families,
                    evidence=tuple(evidence),
                    numbers=(("criterion_without", worth),),
                )
            )
        return steps, rivals

    def _with_only(self, best: Trial, names: list[str]) -> Trial:
        """``best`` with only some of its effects, refitted."""
        trial = best
        for name in best.effects:
            if name not in names:
                trial = self._without(trial, name)
        return trial

    def _alike(self, best: Trial, name: str, correlation: float) -> list[tuple[str, Trial]]:
        """Effects of other families that, in place of ``name``, explain the data as well."""
        others = frozenset(best.effects) - {name}
        family = EFFECTS[name].family
        without = self._without(best, name)
        found: dict[str, tuple[float, str, Trial]] = {}
        for key, trial in self.found.items():
            fresh = key - others
            if len(fresh) != 1 or not others <= key:
                continue
            (other,) = fresh
            of = EFFECTS[other].family
            as_well = self._explains_as_well(trial, best, correlation)
            if of == family or not as_well:
                continue
            behind = self._gain(trial, best, correlation)
            better = self._gain(without, trial, correlation)
            if better > self._asked(other) and behind < found.get(of, (np.inf,))[0]:
                found[of] = (behind, other, trial)
        return [(n, t) for _, n, t in sorted(found.values(), key=lambda f: f[0])]


def _near(jacobian: np.ndarray, promise: Promise, effect: Effect) -> np.ndarray:
    """The Jacobian (N, d) near a promise: that of the base model (N, f), and of the effect's sizes.

    Of shapes, and far from the base model, the sensitivities are not known yet: NaN.
    """
    shapes = np.full((jacobian.shape[0], len(effect.shape_parameters)), np.nan)
    return np.column_stack([jacobian, promise.columns, shapes])


def _is_law(name: str) -> bool:
    """Whether an effect names a cause, which acts in the same way whenever the rig runs."""
    return EFFECTS[name].is_reproducible and EFFECTS[name].family != "unknown"


def _is_walk(name: str) -> bool:
    """Whether an effect is of one recording, and of no moment in it."""
    return not EFFECTS[name].is_reproducible and EFFECTS[name].family != "unknown"


def _numbers(trial: Trial) -> dict[str, float]:
    """The numbers of a model as they were fitted, by name."""
    layout = trial.problem.layout
    return dict(zip(layout.names, layout.values(trial.x), strict=True))


def _placed(layout: Layout, known: Mapping[str, float]) -> np.ndarray:
    """Coordinates (d,) of numbers by name, within the bounds of ``layout``."""
    x = layout.coordinates(np.array([known[n] for n in layout.names]))
    return np.clip(x, layout.lower, layout.upper)


def _taken_over(name: str, other: _Tried) -> dict[str, float]:
    """The numbers of another law's model, and by their names those that law ``name`` shares."""
    known = _numbers(other.trial)
    law, of = EFFECTS[name], EFFECTS[other.name]
    for j, i in _shared(law, of):
        shared = known[f"{other.name}: {of.parameters[i].name}"]
        known[f"{name}: {law.parameters[j].name}"] = shared
    return known


def _shared(effect: Effect, other: Effect) -> list[tuple[int, int]]:
    """Places of the numbers that both have, in the one and in the other."""
    return [
        (j, i)
        for j, p in enumerate(effect.parameters)
        for i, q in enumerate(other.parameters)
        if (p.name, p.unit, p.logarithmic) == (q.name, q.unit, q.logarithmic)
    ]


def _extends(tried: _Tried, other: _Tried) -> bool:
    """Whether the law can do all that the other does, by a choice of shapes of its own."""
    law, simpler = EFFECTS[tried.name], EFFECTS[other.name]
    shared = [j for j, _ in _shared(law, simpler)]
    more = [p for j, p in enumerate(law.parameters) if j not in shared]
    return (
        tried.parent is other.parent
        and law.family == simpler.family
        and len(shared) == len(simpler.parameters)
        and bool(more)
        and all(p.neutral is None for p in more)
    )


def _explained(base: Trial, trial: Trial) -> float:
    """The part that ``trial`` explains of what ``base`` leaves above the noise."""
    return 1.0 - max(trial.cost - 1.0, 0.0) / max(base.cost - 1.0, 1e-9)


def _is_worse_in_one(base: Trial, trial: Trial) -> bool:
    """Whether a record is much the worse for what explains others: no law of the rig does that."""
    costs = zip(base.record_costs, trial.record_costs, strict=True)
    return any(after > max(_WORSE * before, TOLERANCE**2) for before, after in costs)


def _promised_as_much(tried: _Tried, lead: float) -> bool:
    """Whether the score test promised about what a leader of cost ``lead`` explains."""
    return tried.promised * tried.parent.cost > _KEPT * (tried.parent.cost - lead)


def _abreast(names: list[str]) -> list[list[str]]:
    """``names`` of effects in groups that may be fitted at a time, whatever the number of threads.

    The simpler of a family first: the others start from it too. What takes long comes last, when it
    is known how far others get.
    """

    def late(name: str) -> tuple[bool, int]:
        return EFFECTS[name].is_hysteretic, _intricacy(name)

    groups: list[list[str]] = []
    for name in sorted(names, key=late):
        last = groups[-1] if groups else []
        if 0 < len(last) < _ABREAST and late(last[0]) == late(name):
            last.append(name)
        else:
            groups.append([name])
    return groups


def _is_first_of_family(name: str, order: Sequence[str]) -> bool:
    """Whether no other law of the family of ``name`` stands before it in ``order``."""
    return name == next(n for n in order if EFFECTS[n].family == EFFECTS[name].family)


def _leads_to(name: str, other: str) -> bool:
    """Whether ``name`` is ``other``, or a simpler law of its family that it may start from."""
    same = EFFECTS[name].family == EFFECTS[other].family
    return name == other or (same and _intricacy(name) < _intricacy(other))


def _coarsest(name: str) -> str:
    """The effect that ``name`` refines, or what that one refines, ..., or ``name``."""
    while EFFECTS[name].generalises:
        name = EFFECTS[name].generalises
    return name


def _intricacy(name: str) -> int:
    return len(EFFECTS[name].parameters)


def _stage(parent: Trial, what: str) -> str:
    return f"{what} beside {', '.join(parent.effects)}" if parent.effects else what


def _note(tried: _Tried, parent: Trial) -> str:
    gained = 1.0 - tried.trial.cost / parent.cost
    if tried.promised < 0.1 < gained:
        return "the baseline's parameters absorb it: it shows only when all are refitted"
    return ""
