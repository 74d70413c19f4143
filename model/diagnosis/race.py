"""The race of candidates: successive halving of output-error fits (Jamieson and Talwalkar, 2016).

Each rung fits fewer candidates for more iterations. In the first ones, two starts of each candidate
run abreast: with new springs and with the parent's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from dearig.model import kernel
from dearig.model.diagnosis.evidence import Judge, family_of
from dearig.model.diagnosis.fits import Fit, Fitter, with_effect
from dearig.model.diagnosis.regression import Start
from dearig.model.diagnosis.shapes import typical_values
from dearig.model.effects import EFFECTS

__all__ = ["RaceEntry", "race"]

_MOST = 100.0  # of the logarithm of a misfit: no candidate is worse
_TINY = 1e-3  # of the typical amplitude: an effect that hardly acts, and has a derivative


@dataclass(frozen=True)
class RaceEntry:
    """An effect that is added to a parent, and the starts of their fit, best first.

    One that is ``certain`` enters in any case: the regression does not see what it explains.
    ``channels`` is what the electrical channels add to the criterion at the best start.
    """

    effect: str
    starts: tuple[Start, ...]
    certain: bool = False
    channels: float = 0.0

    def misfit(self, samples: float) -> float:
        """Return what the regression leaves from the best start, with the channels' evidence.

        The criterion of ``samples`` independent readings is 2 n ln(misfit).
        """
        return self.starts[0].misfit * math.exp(min(0.5 * self.channels / samples, _MOST))


def race(fitter: Fitter, judge: Judge, parent: Fit, candidates: Sequence[RaceEntry]) -> list[Fit]:
    """Return the fits of the candidates that came through the race, the most probable first."""
    rungs = fitter.settings.rungs
    ranked = sorted(candidates, key=lambda c: c.misfit(judge.samples))
    seen = [c for c in ranked if not c.certain]
    entered = [*(c for c in ranked if c.certain), *seen[: rungs[0].effects]]
    first = fitter.map(lambda c: _entered(fitter, parent, c, rungs[0].iterations), entered)
    runners = [fit for fits in first for fit in fits]
    if not runners:
        return []
    for place, rung in enumerate(rungs[1:], start=1):
        judge.see(runners)
        runners = _leading(judge, runners, rung.effects, abreast=place == 1)
        run = partial(fitter.further, iterations=rung.iterations)
        runners = fitter.map(run, runners)
    runners = fitter.map(fitter.refined, runners)
    judge.see(runners)
    return _leading(judge, runners, len(runners), abreast=False)


def _leading(judge: Judge, runners: Sequence[Fit], effects: int, abreast: bool) -> list[Fit]:
    """Return the fits of the first ``effects`` sets of effects, and of families that leave noise.

    Families that leave noise race to the end: only fits at the end of their valleys tell them
    apart. Unless ``abreast``, one fit of each set.
    """
    ranked = judge.ranked(runners)
    sets = list(dict.fromkeys(fit.members for fit in ranked))
    noise = {fit.members for fit in ranked if judge.is_noise(fit)}
    keys: list[frozenset[str]] = []
    families: set[frozenset[str]] = set()
    for key in sets:
        of_family = frozenset(map(family_of, key))
        if len(keys) < effects or (key in noise and of_family not in families):
            keys.append(key)
            families.add(of_family)
    if abreast:
        return [fit for fit in ranked if fit.members in keys]
    return [next(fit for fit in ranked if fit.members == key) for key in keys]


def _entered(fitter: Fitter, parent: Fit, candidate: RaceEntry, iterations: int) -> list[Fit]:
    """Return first fits of a candidate: from its best start with new springs, and with old ones."""
    name = candidate.effect
    model = with_effect(parent.model, name, typical_values(EFFECTS[name]))
    problem = fitter.problem(model, parent.drift, kernel.ROUGH)
    refitted, shifted_starts = [], []
    for start in candidate.starts:
        springs = fitter.with_springs(parent, start.moduli, start.times)
        refitted.append(fitter.start_of(problem, springs, start.values))
        shifted = parent.x.copy()
        if start.shift.size:
            shifted[~parent.fixed] += start.shift
        shifted_starts.append(fitter.start_of(problem, shifted, start.shifted))
    # and from nothing, in the best shape
    nothing = near_neutral(name, candidate.starts[0].values)
    shifted_starts.append(fitter.start_of(problem, parent.x, nothing))
    costs = fitter.costs(problem, np.array(refitted + shifted_starts))
    chosen = (
        int(np.argmin(costs[: len(refitted)])),
        len(refitted) + int(np.argmin(costs[len(refitted) :])),
    )
    rows = refitted + shifted_starts
    return [fitter.descend(problem, rows[i], iterations) for i in chosen]


def near_neutral(name: str, values: Sequence[float]) -> tuple[float, ...]:
    """Return ``values`` of effect ``name`` with amplitudes next to neutral."""
    return tuple(
        v if p.neutral is None else p.neutral + _TINY * p.typical
        for p, v in zip(EFFECTS[name].parameters, values, strict=True)
    )
