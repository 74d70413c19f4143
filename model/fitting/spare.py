"""Other valleys of a fit: a branch in two, two in one, an absent one put back; sums of moduli.

Two branches of nearly equal relaxation times act as one: the data fix the sum of their moduli, not
the parts. A fit may then have both, or one of them and another branch that does next to nothing,
with the same error. A profile that begins at the fit stays in its valley. So each branch that the
data do not fix is put next to each of the others, and where it is as fast and as slow as the
records resolve; what is as good there counts for the intervals. So does the fit without it, unless
it gains more than noise alone would at the best of these places.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from dearig.model.fitting.intervals import (
    CHI2_95,
    OPEN,
    BetterPoint,
    is_determined,
    natural_ends,
    open_text,
    profile,
)
from dearig.model.fitting.levenberg import LocalFit, descend
from dearig.model.fitting.parallel import parallel_map
from dearig.model.fitting.parameters import Estimate, FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.search import resolved_times

__all__ = [
    "SPARE",
    "Optimum",
    "Valleys",
    "has_spare",
    "sums_of_weak",
    "sums_text",
    "valleys_of",
    "widened",
]

#: Note of a parameter of a branch that may be two, or none.
SPARE = "only the sum of several branches is determined"
_MODULUS = re.compile(r"mu_\d+")
_ITERATIONS = 60  # of a descent into another valley
_GAIN = 0.01  # of the threshold of an interval, at which it ends
_FAST, _SLOW = -1, 0  # sites of a branch that is as fast or as slow as the records resolve
_ABSENT = -2  # site of a branch that is not there
_NUMBERS = 2  # of a branch that comes in: modulus and time
_APART = 0.25  # of the logarithm of the times of two halves of a branch; equal ones never part

Span = tuple[float, float]


@dataclass(frozen=True)
class Optimum:
    """A fit to ``problem`` at coordinates ``x`` (d,), about which intervals are taken.

    ``held`` (d,) bool are not fitted; ``chi2`` is counted ``inflation`` times too large. ``gain``
    is by how much less of it a point is taken for better.
    """

    problem: Problem
    x: np.ndarray
    held: np.ndarray
    chi2: float
    inflation: float
    gain: float

    @property
    def threshold(self) -> float:
        """Rise of chi-square at the end of a 95 % interval."""
        return CHI2_95 * self.inflation

    def profile(
        self,
        index: int,
        jacobian: np.ndarray,
        tick: Callable[[], None],
        sides: tuple[float, ...] = (-1.0, 1.0),
    ) -> Span:
        """Return the interval of coordinate ``index``; ``jacobian`` (N, f) is that at ``x``."""
        return profile(
            self.problem, self.x, self.chi2, index, jacobian, self.inflation, self.held, tick,
            sides, self.gain,
        )  # fmt: skip


@dataclass(frozen=True)
class Valleys:
    """Coordinates (d,) as good as the ``best`` fit, by the ``sites`` of the spare branches there.

    ``spare`` are branches that the data do not fix, ``firm`` the others. A site is the firm branch
    to which the relaxation time of a spare one is nearest, as a logarithm, or an end of what the
    records resolve, or that it is absent. The best fit is among them.
    """

    best: Optimum
    spare: tuple[int, ...]
    firm: tuple[int, ...]
    points: Mapping[tuple[int, ...], np.ndarray]

    def spare_at(self, site: int, sites: Sequence[int]) -> list[int]:
        """Return the spare branches that are at a ``site``, such as that of a firm branch."""
        return [s for s, its in zip(self.spare, sites, strict=True) if its == site]

    def allowed(self, sites: Sequence[int]) -> float:
        """Return the rise of chi-square at which the ``sites`` are as good as the best fit.

        That of a 95 % interval, where each branch has a time of its own. One that is absent, or a
        half of another, leaves a model of fewer branches: noise alone lowers its chi-square, for
        each branch that comes in, by a chi-square of two degrees of freedom at each of the places
        that it may have, and the best fit has the largest of these.
        """
        fewer = sum(site > 0 or site == _ABSENT for site in sites)
        if fewer == 0:
            return self.best.threshold
        each = 0.95 ** (1.0 / len(_places(self)))
        return self.best.inflation * float(chdtri(_NUMBERS * fewer, 1.0 - each))

    def at(self, sites: Sequence[int]) -> Optimum:
        """Return the optimum with the spare branches at ``sites``, where each branch stays.

        Its intervals end where those of the best fit would. One that is outside of them is the
        optimum of a model of fewer branches, and has intervals of its own.
        """
        problem = copy(self.best.problem)
        problem.layout = _cells(self, sites)
        x = self.points[tuple(sites)]
        held = _held(self.best, self.spare_at(_ABSENT, sites))
        own = float(np.sum(problem.residuals(x) ** 2))
        chi2 = self.best.chi2 if own <= self.best.chi2 + self.best.threshold else own
        return replace(self.best, problem=problem, x=x, held=held, chi2=chi2)

    @property
    def absent(self) -> frozenset[int]:
        """Spare branches that need not be there."""
        return frozenset(b for sites in self.points for b in self.spare_at(_ABSENT, sites))

    @property
    def parts(self) -> tuple[int, ...]:
        """Branches that may be two, or change places with a part of one, in order."""
        found = set()
        for sites in self.points:
            for spare, site in zip(self.spare, sites, strict=True):
                if site > 0:
                    found |= set(range(min(spare, site), max(spare, site) + 1))
        return tuple(sorted(found))


class _Shared(FitLayout):
    """Layout whose coordinates are the sum of several moduli, and what each takes of the rest."""

    def __init__(self, layout: FitLayout, total: int, parts: Sequence[int]) -> None:
        self.__dict__.update(layout.__dict__)
        self._total, self._parts = total, list(parts)
        self.lower, self.upper = layout.lower.copy(), layout.upper.copy()
        self.lower[self._parts], self.upper[self._parts] = 0.0, 1.0

    def coordinates(self, values: np.ndarray) -> np.ndarray:
        x = super().coordinates(values)
        left = x[..., self._total] + x[..., self._parts].sum(axis=-1)
        x[..., self._total] = left
        for part in self._parts:
            modulus = x[..., part].copy()
            x[..., part] /= np.maximum(left, 1e-300)
            left = left - modulus
        return x

    def values(self, x: np.ndarray) -> np.ndarray:
        found = np.array(super().values(x))
        left = x[..., self._total].copy()
        for part in self._parts:
            found[..., part] = left * x[..., part]
            left = left - found[..., part]
        found[..., self._total] = left
        return found

    def reach(self, x: np.ndarray) -> np.ndarray:
        found = super().reach(x)
        found[self._parts] = 1.0
        return found

    def differences(
        self, x: np.ndarray, in_common: bool = False, central: bool = False
    ) -> np.ndarray:
        found = super().differences(x, in_common, central)
        # as of a modulus that is as large as the sum
        found[self._parts] = found[self._total] / max(abs(float(x[self._total])), 1e-300)
        return found


def _columns(layout: FitLayout, branch: int) -> dict[tuple[str, int], int]:
    """Return the places of a ``branch``'s parameters, by kind and place."""
    return {
        (q.kind, q.place): j
        for j, q in enumerate(layout.quantities)
        if q.kind != "effect" and q.index == branch
    }


def _held(best: Optimum, absent: Iterable[int]) -> np.ndarray:
    """Return which coordinates (d,) bool are not fitted: none of an ``absent`` branch is."""
    held = best.held.copy()
    for branch in absent:
        held[[*_columns(best.problem.layout, branch).values()]] = True
    return held


def _time(layout: FitLayout, branch: int) -> int:
    return _columns(layout, branch)["T", 0]


def has_spare(layout: FitLayout, estimates: Sequence[Estimate]) -> bool:
    """Return True where ``estimates`` do not determine every branch, and one of them is firm."""
    return all(_spare_and_firm(layout, estimates))


def valleys_of(best: Optimum, estimates: Sequence[Estimate], check: Callable[[], None]) -> Valleys:
    """Return the valleys as good as ``best``, where ``has_spare``.

    As good is what a 95 % interval allows. ``estimates`` have the intervals in the valley of
    ``best``. ``check`` is called after each population of simulations, from any thread, and may
    raise. Raises ``BetterPoint`` for a valley that is better.
    """
    layout = best.problem.layout
    spare, firm = _spare_and_firm(layout, estimates)
    alone = Valleys(best, spare, firm, {})

    def followed(start: tuple[np.ndarray, tuple[int, ...]]) -> LocalFit:
        problem = copy(best.problem)  # counts its simulations on its own
        counted = problem.on_simulations

        def on_simulations(count: int, cost: float) -> None:
            if counted is not None:
                counted(count, cost)
            check()

        problem.on_simulations = on_simulations
        x, without = start
        enough = _GAIN * best.threshold
        return descend(problem, x, _held(best, without), _ITERATIONS, enough, quick=False)

    starts: list[tuple[np.ndarray, tuple[int, ...]]] = [
        (start, ()) for branch in spare for start in _starts(alone, branch)
    ]
    starts += [_without(alone, some) for some in {*((b,) for b in spare), spare}]
    reached: dict[tuple[int, ...], tuple[float, np.ndarray]] = {}
    for (_, without), fit in zip(
        starts, parallel_map(followed, starts, best.problem.workers, "valley"), strict=True
    ):
        chi2, sites = fit.cost * best.problem.samples, _sites(alone, fit.x, without)
        if chi2 < reached.get(sites, (best.chi2 + alone.allowed(sites),))[0]:
            reached[sites] = chi2, fit.x
    lowest = min(reached.values(), key=lambda r: r[0], default=(math.inf, best.x))
    if best.chi2 - lowest[0] > best.gain:
        raise BetterPoint(lowest[1], best.chi2 - lowest[0])
    points = {sites: x for sites, (_, x) in reached.items()}
    points[_sites(alone, best.x)] = best.x
    return replace(alone, points=points)


def _spare_and_firm(
    layout: FitLayout, estimates: Sequence[Estimate]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the branches whose relaxation time ``estimates`` do not determine, and the others.

    Of two whose times may be equal, that is the one of the smaller modulus. A branch that may be
    absent has no time. One of which something is stated is known by that.
    """
    known = {e.name: e for e in estimates}
    stated = {q.index for q in layout.quantities if q.kind != "effect" and q.constraint}
    branches = [
        q.index
        for q in layout.quantities
        if q.kind == "T" and {f"mu_{q.index}", q.name} <= {*known}
    ]
    branches.sort(key=lambda b: (b not in stated, -known[f"mu_{b}"].value))
    firm: list[int] = []
    for branch in branches:
        own = known[f"T_{branch}"]
        others = [known[f"T_{b}"] for b in firm]
        apart = all(own.low > other.high or other.low > own.high for other in others)
        if branch in stated or (own.determined and apart):
            firm.append(branch)
    firm = firm or branches[:1]
    return tuple(sorted({*branches} - {*firm})), tuple(sorted(firm))


def _places(found: Valleys) -> list[tuple[float, int]]:
    """Return (logarithm of the time, site), rising: the firm branches, and both ends."""
    layout = found.best.problem.layout
    j = _time(layout, found.spare[0])
    ends = np.clip(
        np.log(resolved_times(found.best.problem.records)), layout.lower[j], layout.upper[j]
    )
    firm = [(float(found.best.x[_time(layout, branch)]), branch) for branch in found.firm]
    return sorted([*firm, (float(ends[0]), _FAST), (float(ends[1]), _SLOW)])


def _sites(found: Valleys, x: np.ndarray, without: Collection[int] = ()) -> tuple[int, ...]:
    """Return where each spare branch is at coordinates ``x`` (d,), ``without`` some of them."""
    layout, places = found.best.problem.layout, _places(found)
    times = {spare: float(x[_time(layout, spare)]) for spare in found.spare}
    return tuple(
        _ABSENT if spare in without else min(places, key=lambda p: abs(p[0] - time))[1]
        for spare, time in times.items()
    )


def _without(found: Valleys, branches: tuple[int, ...]) -> tuple[np.ndarray, tuple[int, ...]]:
    """Return coordinates (d,) at which spare ``branches`` are absent, and these.

    The firm branch next to each has its modulus, or the equilibrium spring that of a slow one.
    """
    layout = found.best.problem.layout
    values = layout.values(found.best.x).copy()
    sites = dict(zip(found.spare, _sites(found, found.best.x), strict=True))
    for branch in branches:
        own = _columns(layout, branch)["mu", 0]
        heir = _columns(layout, 0 if sites[branch] == _SLOW else sites[branch])
        if ("mu", 0) in heir:
            values[heir["mu", 0]] += values[own]
    x = np.clip(layout.coordinates(values), layout.lower, layout.upper)
    for branch in branches:
        own = _columns(layout, branch)["mu", 0]
        x[own] = layout.lower[own]
    return x, branches


def _starts(found: Valleys, branch: int) -> Iterator[np.ndarray]:
    """Yield coordinates (d,) with a spare ``branch`` at each of the places."""
    layout, own = found.best.problem.layout, _columns(found.best.problem.layout, branch)
    for time, site in _places(found):
        x = found.best.x.copy()
        x[own["T", 0]] = time
        # as little as a difference quotient resolves; next to another one, half of that
        x[own["mu", 0]] = layout.differences(x)[own["mu", 0]]
        theirs = _columns(layout, site) if site > 0 else {}
        for key in own.keys() & theirs.keys():
            x[own[key]] = x[theirs[key]]
        if theirs:
            for columns, sign in ((own, 1.0), (theirs, -1.0)):
                x[columns["mu", 0]] *= 0.5
                x[columns["T", 0]] += 0.5 * sign * _APART
        yield np.clip(x, layout.lower, layout.upper)


def widened(
    found: Valleys, estimates: Sequence[Estimate], tick: Callable[[], None], end: type[Exception]
) -> tuple[list[Estimate], tuple[Estimate, ...]]:
    """Return ``estimates`` that allow for all valleys, and those of the sums of moduli.

    An interval holds those about every point. A part of a sum has no lower end, its relaxation time
    no end. ``tick`` is called at each point of a profile; where it raises ``end``, the sums are
    left out.
    """
    layout, held = found.best.problem.layout, found.best.held
    spans = {e.name: (e.low, e.high) for e in estimates}
    parts = {j for b in found.parts for j in _columns(layout, b).values()}
    branches = {j for b in found.spare for j in _columns(layout, b).values()} | parts
    asked = [
        j
        for j, q in enumerate(layout.quantities)
        if j not in branches and not held[j] and spans[q.name] != (0.0, math.inf)
    ]
    sums: dict[int, Span] = {}
    try:
        for sites in found.points:
            at = found.at(sites)
            jacobian = at.problem.jacobian(at.x, ~at.held)
            if at.x is not found.best.x:
                for j in asked:
                    name, q = layout.names[j], layout.quantities[j]
                    ends = natural_ends(q, *at.profile(j, jacobian, tick))
                    spans[name] = _hull(spans[name], ends)
            for branch in found.firm:
                total = layout.quantities[_columns(layout, branch)["mu", 0]].constraint
                if branch in found.parts and (total is None or total.mean is not None):
                    ends = _of_sum(at, branch, found.spare_at(branch, sites), jacobian, tick)
                    sums[branch] = _hull(sums.get(branch, ends), ends)
    except end:
        sums = {}
    most = max((high for _, high in sums.values()), default=math.inf)
    # a sum that is not determined either says nothing
    sums = {branch: span for branch, span in sums.items() if is_determined(*span)}
    absent = {j for b in found.absent for j in _columns(layout, b).values()} - parts
    changed = []
    for e in estimates:
        j = layout.names.index(e.name)
        low, high = spans[e.name]
        if j in absent and not held[j] and e.constraint is None:
            # what may be absent has no least modulus, and any time
            high = high if layout.quantities[j].kind == "mu" else math.inf
            note = e.note if e.at_bound else open_text(0.0, high)
            changed.append(replace(e, low=0.0, high=high, determined=False, note=note))
        elif j in parts and not held[j] and e.constraint is None:
            # a part that is faster than the records show may be larger than any sum
            high = max(most, e.high) if layout.quantities[j].kind == "mu" else math.inf
            note = e.note if e.at_bound else SPARE if sums else OPEN
            changed.append(replace(e, low=0.0, high=high, determined=False, note=note))
        else:
            determined = e.determined and is_determined(low, high)
            changed.append(replace(e, low=low, high=high, determined=determined))
    return changed, tuple(_sum(found, branch, span) for branch, span in sums.items())


def _cells(found: Valleys, sites: Sequence[int]) -> FitLayout:
    """Return the layout in which each branch stays at its site: else two change places."""
    cell = copy(found.best.problem.layout)
    cell.lower, cell.upper = cell.lower.copy(), cell.upper.copy()
    places = _places(found)
    times = [time for time, _ in places]
    for branch, site in (*zip(found.spare, sites, strict=True), *((b, b) for b in found.firm)):
        if site == _ABSENT:
            continue
        j, i = _time(cell, branch), [s for _, s in places].index(site)
        if i > 0:
            cell.lower[j] = max(cell.lower[j], 0.5 * (times[i - 1] + times[i]))
        if i + 1 < len(times):
            cell.upper[j] = min(cell.upper[j], 0.5 * (times[i] + times[i + 1]))
    return cell


def _of_sum(
    at: Optimum,
    branch: int,
    spare_at: Sequence[int],
    jacobian: np.ndarray,
    tick: Callable[[], None],
) -> Span:
    """Return the interval in Pa of the modulus of ``branch`` and those ``spare_at`` it."""
    layout = at.problem.layout
    j = _columns(layout, branch)["mu", 0]
    if spare_at:
        problem = copy(at.problem)
        parts = [_columns(layout, b)["mu", 0] for b in spare_at]
        problem.layout, problem.coarse_columns = _Shared(layout, j, parts), None
        at = replace(at, problem=problem, x=problem.layout.coordinates(layout.values(at.x)))
        jacobian = problem.jacobian(at.x, ~at.held)
    return natural_ends(layout.quantities[j], *at.profile(j, jacobian, tick))


def _hull(one: Span, other: Span) -> Span:
    return float(min(one[0], other[0])), float(max(one[1], other[1]))


def _sum(found: Valleys, branch: int, span: Span) -> Estimate:
    """Return the estimate of all that relaxes as the ``branch`` does, in the reported fit."""
    layout, best = found.best.problem.layout, found.best
    values = layout.values(best.x)
    here = [branch, *found.spare_at(branch, _sites(found, best.x))]
    ever = {branch, *(b for sites in found.points for b in found.spare_at(branch, sites))}
    total = float(sum(values[_columns(layout, b)["mu", 0]] for b in here))
    when = f"about {values[_time(layout, branch)]:.3g}"
    return _together(here, total, span, when, ever.difference(here))


def _together(
    branches: Collection[int], total: float, span: Span, when: str, others: Collection[int] = ()
) -> Estimate:
    """Return the estimate of ``total`` Pa, the modulus of ``branches`` that relax at ``when``.

    ``others`` do so in fits that are as good, not in the reported one. The name has them in
    brackets, because the total is not the sum of their values too.
    """
    name, note = _sum_of(branches), f"all branches that relax at {when} s together"
    if others:
        name = f"{name} (+ {_sum_of(others)})"
        verb = "does" if len(others) == 1 else "do"
        note = f"{note}; in other fits that are as good, {_sum_of(others)} {verb} so too"
    return Estimate(name, "Pa", total, *span, is_determined(*span), note)


def _sum_of(branches: Collection[int]) -> str:
    return " + ".join(f"mu_{b}" for b in sorted(branches))


def sums_of_weak(
    best: Optimum,
    jacobian: np.ndarray,
    estimates: Sequence[Estimate],
    sums: Sequence[Estimate],
    tick: Callable[[], None],
    end: type[Exception],
) -> tuple[Estimate, ...]:
    """Return ``sums``, and those of branches whose times are apart and whose moduli are not known.

    Such branches are neighbours in time: what one has the other lacks. A sum is added where the
    data determine it. ``tick`` is called at each point of a profile; where it raises ``end``, no
    further one is added.
    """
    layout = best.problem.layout
    values, known = layout.values(best.x), {e.name: e for e in estimates}
    summed = {part for one in sums for part in _MODULUS.findall(one.name)}
    groups: list[list[int]] = [[]]
    times = {q.index: values[j] for j, q in enumerate(layout.quantities) if q.kind == "T"}
    for branch in sorted(times, key=times.__getitem__):
        e = known.get(f"mu_{branch}")
        if e is None or e.determined or not e.free or e.constraint or e.name in summed:
            groups.append([])
        else:
            groups[-1].append(branch)
    found = list(sums)
    for group in groups:
        if len(group) < 2:
            continue
        moduli = {b: float(values[_columns(layout, b)["mu", 0]]) for b in group}
        total, *others = sorted(group, key=lambda b: -moduli[b])
        try:
            span = _of_sum(best, total, others, jacobian, tick)
        except end:
            break
        if is_determined(*span):
            low, high = (times[b] for b in (group[0], group[-1]))
            found.append(_together(group, sum(moduli.values()), span, f"{low:.3g} to {high:.3g}"))
    return tuple(found)


def sums_text(sums: Sequence[Estimate]) -> str:
    """Return a sentence on ``sums`` of moduli, of which the data do not determine the parts."""
    return (
        f"these data determine {', '.join(s.name for s in sums)}, not the parts: the branches "
        f"relax alike, or one does next to nothing; fewer branches may fit as well"
    )
