"""Estimates of a fit with profile-likelihood intervals, on means of its readings."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import count

import numpy as np

from dearig.model.fitting.intervals import (
    OPEN,
    BetterPoint,
    correlation_time,
    covariance,
    is_determined,
    natural_ends,
    open_text,
)
from dearig.model.fitting.levenberg import descend, gain_that_counts
from dearig.model.fitting.parameters import NORMAL_95, Estimate, FitLayout, FreeParameter
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.spare import Optimum, has_spare, sums_of_weak, valleys_of, widened
from dearig.model.readings.records import ActuatorRecord, FilmRecord

__all__ = [
    "AT_BOUND",
    "AT_STATED_BOUND",
    "BY_CURVATURE",
    "MOVES_MAX",
    "ONE_VALLEY",
    "BetterPoint",
    "Intervals",
    "at_bound",
    "end_text",
    "estimates_with_intervals",
    "fixed_estimate",
    "recentre",
]

#: Note of a parameter at the end of its search range.
AT_BOUND = "at the end of its search range"

#: The same, where a person has stated that end.
AT_STATED_BOUND = "at its stated bound"

#: Note of an interval whose profile was not followed.
BY_CURVATURE = "from the curvature at the optimum: the profile was not followed to its end"
#: Note of an interval where other fits may be as good.
ONE_VALLEY = "about this optimum alone: others that may be as good were not all followed"

#: Moves of an optimum to better points that profiles come to; what gains goes on.
MOVES_MAX = 3

_END_STATED = "the interval ends at a stated bound"
_END_OF_LAW = "the interval ends where the range of its law does"
_FIXED = "fixed"
_J_TEXT = "no spring stiffens measurably at these stretches: only a lower bound"
_AT_END = 1e-9  # of a coordinate: a descent clips to the bound itself


def recentre(means: Problem, full: Problem, values: np.ndarray) -> None:
    """Move the readings of ``means`` so that its optimum is that of ``full``, at ``values`` (d,).

    Both have the same records, in ``means`` as means of neighbours. Averaging shifts a curve, and
    intervals can be narrower than the shift. So the readings become the prediction at the optimum
    plus the averaged residual of the full problem.
    """
    # a subclass whitens its predictions; readings are plain
    of_full, _ = Problem.predict(full, values)
    of_means, _ = Problem.predict(means, values)
    edges_full = np.cumsum([0, *(r.measured.size for r in full.records)])
    edges_means = np.cumsum([0, *(r.measured.size for r in means.records)])
    moved = means.readings.copy()
    for i, (record, thinner) in enumerate(zip(full.records, means.records, strict=True)):
        model = of_full[0, edges_full[i] : edges_full[i + 1]]
        part = slice(edges_means[i], edges_means[i + 1])
        if isinstance(record, ActuatorRecord) and isinstance(thinner, ActuatorRecord):
            left = replace(record, displacement=record.displacement - model)
            moved[part] = left.in_means(thinner.means_of // record.means_of).measured
        elif isinstance(record, FilmRecord):
            # as many means as the thinner record has
            pulled = replace(record, stress=record.stress - model)
            moved[part] = pulled.coarse(max(thinner.time.size - 1, 1)).measured
    means.set_readings(of_means[0] + moved)


class _Ended(Exception):  # noqa: N818  (it is not an error)
    """The profiles are to end."""


def _never() -> bool:
    return False


@dataclass(frozen=True)
class Intervals:
    """Estimates with 95 % intervals, and ``sums`` of moduli of which the parts are not determined.

    ``covariance`` (f, f), in SI units, is that of the parameters ``names``, which were fitted.
    """

    estimates: tuple[Estimate, ...]
    names: tuple[str, ...]
    covariance: np.ndarray
    sums: tuple[Estimate, ...] = ()


def estimates_with_intervals(
    problem: Problem,
    values: np.ndarray,
    held: np.ndarray,
    report: Callable[[float], None],
    lower_ends: bool = True,
    ended: Callable[[], bool] = _never,
    gain: float | None = math.inf,
    finer: tuple[Problem, np.ndarray] | None = None,
) -> Intervals:
    """Return estimates at the optimum ``values`` (d,) of ``problem`` with 95 % intervals.

    ``held`` (d,) bool are parameters that were not fitted; with ``lower_ends`` each locking limit
    among them is freed alone for its own lower end. ``finer`` is a problem with the same optimum
    and which parameters (d,) bool are profiled on it. ``report`` receives the fraction that is
    done, at each point of a profile. Once ``ended()`` is True no profile is followed any further:
    the intervals that are left come from the curvature at the optimum, and their notes say so.
    Raises ``BetterPoint`` where chi-square falls by more than ``gain`` anywhere that a profile
    comes to; None is what ends a descent.
    """
    layout = problem.layout
    best, cov, jac = _about(problem, values, held, gain)
    ends = at_bound(layout, best.x)
    bent = np.zeros(layout.size, dtype=bool) if finer is None else finer[1]
    # other valleys count as one more
    shares = layout.size + 1
    estimates = []
    # a better point, if there is one, shows first where the data fix least
    for place in (*np.flatnonzero(bent), *np.flatnonzero(~bent)):
        j = int(place)
        q, value = layout.quantities[j], float(values[j])
        if q.is_fixed:
            estimates.append(fixed_estimate(q))
            continue
        if held[j] and not (lower_ends and q.kind == "J"):
            estimates.append(
                Estimate(
                    q.name, q.unit, value, *q.open_ends, False, "held", constraint=q.constraint
                )
            )
            continue
        on = replace(best, problem=finer[0]) if finer is not None and bent[j] else best
        if held[j]:
            # freed for its own end alone: that it stays held has been decided by its evidence
            on = replace(on, gain=math.inf)
        sides = (-1.0,) if held[j] else (-1.0, 1.0)  # a held limit is already at its upper end
        tick = _ticks(report, ended, len(estimates), shares)
        try:
            low, high = on.profile(j, jac, tick, sides)
            followed = True
        except _Ended:
            low, high = _by_curvature(best.x, cov, ~held, j)
            followed = False
        low, high = natural_ends(q, low, high)
        estimates.append(
            _estimate(q, value, (low, high), bool(held[j]), bool(ends[j]), followed=followed)
        )
    estimates.sort(key=lambda e: layout.names.index(e.name))
    sums: tuple[Estimate, ...] = ()
    on = best if finer is None else replace(best, problem=finer[0])
    tick = _ticks(report, ended, layout.size, shares)
    if has_spare(layout, estimates):
        with suppress(_Ended):  # the notes say so
            valleys = valleys_of(on, estimates, partial(_end_if, ended))
            estimates, sums = widened(valleys, estimates, tick, _Ended)
        if ended():
            estimates = [_without_valleys(e) for e in estimates]
    if not ended():
        sums = sums_of_weak(best, jac, estimates, sums, tick, _Ended)
    names = tuple(n for n, h in zip(layout.names, held, strict=True) if not h)
    natural = np.where([q.logarithmic for q in layout.quantities], values, 1.0)[~held]
    return Intervals(tuple(estimates), names, cov * np.outer(natural, natural), sums)


def _about(
    problem: Problem, values: np.ndarray, held: np.ndarray, gain: float | None
) -> tuple[Optimum, np.ndarray, np.ndarray]:
    """Return the optimum at ``values`` (d,), with the covariance (f, f) and Jacobian (N, f) there.

    Raises ``BetterPoint`` where it is none.
    """
    layout = problem.layout
    x = np.clip(layout.coordinates(values), layout.lower, layout.upper)
    residuals = problem.residuals(x)
    chi2 = float(residuals @ residuals)
    enough = gain_that_counts(chi2, problem.samples) if gain is None else gain
    if math.isfinite(enough):
        fit = descend(problem, x, held, iterations=10, gain=enough)
        gained = chi2 - fit.cost * problem.samples
        if gained > enough:
            raise BetterPoint(fit.x, gained)
    apart = correlation_time(problem.of_readings(residuals))
    inflation = max(1.0, chi2 / problem.samples) * max(1.0, apart)
    jac = problem.jacobian(x, ~held)
    best = Optimum(problem, x, held, chi2, inflation, enough)
    return best, covariance(jac.T @ jac, inflation), jac


def _ticks(
    report: Callable[[float], None], ended: Callable[[], bool], before: int, shares: int
) -> Callable[[], None]:
    """Return what is called at each point of a profile, after so many ``before`` of ``shares``."""
    points = count(1)

    def tick() -> None:
        # how many points a profile takes is not known: four are the rule
        report((before + 1.0 - 0.5 ** (next(points) / 2.0)) / shares)
        _end_if(ended)

    return tick


def _end_if(ended: Callable[[], bool]) -> None:
    if ended():
        raise _Ended


def _without_valleys(e: Estimate) -> Estimate:
    """Return ``e`` with the note that other valleys were not followed to their ends."""
    if not e.free or not e.determined:
        return e
    return replace(e, note=_with(e.note, ONE_VALLEY))


def _with(note: str, more: str) -> str:
    return f"{note}; {more}" if note else more


def _estimate(
    q: FreeParameter,
    value: float,
    span: tuple[float, float],
    held: bool,
    at_end: bool,
    followed: bool,
) -> Estimate:
    """Return the estimate of one parameter with the interval ``span``, and a note on it."""
    low, high = span
    determined = is_determined(low, high) and not at_end
    note = "" if determined else open_text(low, high)
    if held:
        note = _J_TEXT if low > 0.0 else OPEN
    elif at_end:
        note = end_text(q, value)
    elif not followed:
        note = _with(note, BY_CURVATURE)
    if not at_end and (why := _cut(q, low, high)):
        note = _with(note, why)
    return Estimate(
        q.name, q.unit, value, low, high, determined, note, at_bound=at_end, constraint=q.constraint
    )


def _cut(q: FreeParameter, low: float, high: float) -> str:
    """Return which bound cuts an interval off, before the data end it; "" where none does."""
    stated = q.constraint
    if stated is not None and (low == stated.low or high == stated.high):
        return _END_STATED
    lowest, highest = q.open_ends
    # an interval that begins at 0 is that of something which may be absent, and its note says so
    return _END_OF_LAW if low == lowest != 0.0 or high == highest < math.inf else ""


def fixed_estimate(q: FreeParameter) -> Estimate:
    """Return the estimate of a fixed parameter: its value, without an interval."""
    value = q.bounds[0]
    return Estimate(
        q.name, q.unit, value, value, value, True, _FIXED, free=False, constraint=q.constraint
    )


def _by_curvature(
    x: np.ndarray, cov: np.ndarray, free: np.ndarray, index: int
) -> tuple[float, float]:
    """Return the linear 95 % interval of coordinate ``index`` about ``x`` (d,); open where held."""
    if not free[index]:
        return -math.inf, math.inf
    place = int(np.count_nonzero(free[:index]))
    width = NORMAL_95 * math.sqrt(float(cov[place, place]))
    return float(x[index]) - width, float(x[index]) + width


def at_bound(layout: FitLayout, x: np.ndarray) -> np.ndarray:
    """Return which coordinates ``x`` (d,) are at an end of their search range, (d,) bool.

    A fixed parameter has no range.
    """
    room = np.minimum(x - layout.lower, layout.upper - x)
    return np.asarray((room <= _AT_END * (1.0 + np.abs(x))) & ~layout.fixed)


def end_text(q: FreeParameter, value: float) -> str:
    """Return the note of a ``value`` at an end of its range."""
    ends = () if q.constraint is None else (q.constraint.low, q.constraint.high)
    stated = any(end is not None and math.isclose(value, end, rel_tol=1e-6) for end in ends)
    return AT_STATED_BOUND if stated else AT_BOUND
