"""Estimates of a fit with profile-likelihood intervals, on means of its readings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count

import numpy as np

from dearig.model.fitting.intervals import correlation_time, covariance, profile
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import NORMAL_95, Estimate, FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.records import ActuatorRecord, FilmRecord

__all__ = [
    "AT_BOUND",
    "BY_CURVATURE",
    "at_bound",
    "estimates_with_intervals",
    "is_determined",
    "recentre",
]

#: Note of a parameter at the end of its search range.
AT_BOUND = "at the end of its search range"

#: Note of an interval whose profile was not followed.
BY_CURVATURE = "from the curvature at the optimum: the profile was not followed to its end"

_DETERMINED_RATIO = 5.0  # ratio of the ends of an interval, above which a value is not quoted
_J_WORDS = "no spring stiffens measurably at these stretches: only a lower bound"
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


class _Ended(Exception):  # noqa: N818  (it is no error)
    """The profiles are to end."""


def _never() -> bool:
    return False


def estimates_with_intervals(
    problem: Problem,
    values: np.ndarray,
    held: np.ndarray,
    report: Callable[[float], None],
    lower_ends: bool = True,
    which: np.ndarray | None = None,
    ended: Callable[[], bool] = _never,
) -> tuple[list[Estimate], tuple[str, ...], np.ndarray]:
    """Return estimates at ``values`` (d,) with 95 % intervals, and names and covariance (f, f).

    ``held`` (d,) bool are parameters that were not fitted; with ``lower_ends`` each locking limit
    among them is freed alone for its own lower end. ``problem`` has its optimum near ``values``.
    Only the parameters ``which`` (d,) bool get an estimate, where it is given.
    ``report`` receives the fraction that is done, at each point of a profile. Once ``ended()`` is
    True no profile is followed any further: the intervals that are left come from the curvature at
    the optimum, and their notes say so. The covariance, in SI units, is that of the parameters that
    were fitted.
    """
    layout = problem.layout
    centre = descend(problem, layout.coordinates(values), held, iterations=10)
    free = ~held
    inflation = max(1.0, centre.cost) * max(1.0, correlation_time(centre.residuals))
    jac = problem.jacobian(centre.x, free)
    cov = covariance(jac.T @ jac, inflation)
    chi2 = centre.cost * problem.samples
    ends = at_bound(layout, layout.coordinates(values))
    estimates = []
    wanted = [j for j in range(layout.size) if which is None or which[j]]
    for place, j in enumerate(wanted):
        q, value = layout.quantities[j], float(values[j])
        if held[j] and not (lower_ends and q.kind == "J"):
            estimates.append(Estimate(q.name, q.unit, value, 0.0, math.inf, False, "held"))
            continue
        points = count(1)

        def tick(before: int = place, points: Iterator[int] = points) -> None:
            # how many points a profile takes is not known: four are the rule
            part = 1.0 - 0.5 ** (next(points) / 2.0)
            report((before + part) / len(wanted))
            if ended():
                raise _Ended

        sides = (-1.0,) if held[j] else (-1.0, 1.0)  # a held limit is already at its upper end
        try:
            low, high = profile(problem, centre.x, chi2, j, jac, inflation, held, tick, sides)
            followed = True
        except _Ended:
            low, high = _by_curvature(centre.x, cov, free, j)
            followed = False
        if q.logarithmic:
            low, high = math.exp(low), math.exp(high)
        # an open end of a spring's parameter is 0 or infinite, of an effect's the end of its range
        lowest, highest = q.bounds if q.kind == "effect" else (0.0, math.inf)
        low, high = max(low, lowest), min(high, highest)
        low, high = float(min(low, value)), float(max(high, value))
        determined = is_determined(low, high) and not ends[j]
        note = "" if determined else _open_text(low, high)
        if held[j]:
            note = _J_WORDS if low > 0.0 else "not determined by these data"
        elif ends[j]:
            note = AT_BOUND
        elif not followed:
            note = f"{note}; {BY_CURVATURE}" if note else BY_CURVATURE
        estimates.append(
            Estimate(q.name, q.unit, value, low, high, determined, note, at_bound=bool(ends[j]))
        )
    names = tuple(n for n, f in zip(layout.names, free, strict=True) if f)
    natural = np.where([q.logarithmic for q in layout.quantities], values, 1.0)[free]
    return estimates, names, cov * np.outer(natural, natural)


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
    """Return which coordinates ``x`` (d,) are at an end of their search range, (d,) bool."""
    room = np.minimum(x - layout.lower, layout.upper - x)
    return np.asarray(room <= _AT_END * (1.0 + np.abs(x)))


def is_determined(low: float, high: float) -> bool:
    """Whether an interval is narrow enough for its value to be quoted, and excludes 0."""
    near, far = sorted((abs(low), abs(high)))
    return low * high > 0.0 and far < math.inf and far / near <= _DETERMINED_RATIO


def _open_text(low: float, high: float) -> str:
    if low < 0.0 < high:
        return "not distinguishable from 0 with these data"
    if low == 0.0 and math.isinf(high):
        return "not determined by these data"
    if math.isinf(high):
        return "only a lower bound"
    if low == 0.0:
        return "only an upper bound"
    return f"known only within a factor of {high / low:.3g}"
