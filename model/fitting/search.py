"""Global searches: the thesis's Algorithm 1 as printed, and starts of the hybrid method."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from math import comb, inf
from typing import Any

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model import kernel
from dearig.model.coefficients import ELECTRIC, MODULUS
from dearig.model.errors import ModelError
from dearig.model.film.material import Branch, Network, Spring
from dearig.model.film.network import HEAD
from dearig.model.fitting.parameters import THESIS_RANGES, FitLayout, FreeParameter
from dearig.model.fitting.problem import Problem
from dearig.model.kinematics import electric_along
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import network_stress, through_effects, unit_stresses
from dearig.model.springs import SPRING_LAWS

__all__ = [
    "ALGORITHM_1",
    "SMOOTHING",
    "Algorithm1",
    "algorithm_1",
    "film_starts",
    "resolved_times",
    "voltage_starts",
]

Progress = Callable[[str, float], None]

#: Standard deviation in s of the smoothing window for lam'': it passes up to about 10 Hz.
SMOOTHING = 0.015
_WIDE_LIMIT = 1e4  # of J: a spring that does not stiffen within any stretch of an actuator
_REST_ITERATIONS = 6
_LEAST = {"mu": 1e-9, "J": 1e-9, "T": 1e-300}  # of Algorithm 1's values, natural
_STATED_POINTS = 4  # of a range that is stated of a relaxation time
_TIME_ERROR = 1e-9  # of the logarithm of a time: rounding
_OUT = 1e6  # cost of a branch outside of its range, above any distance from a prior
_READ_TURNS = 8  # at most, of a search with effects; with slack two were enough
_READ_STEP = 1e-3  # of the largest stress: step of a difference quotient
_READ_CHANGE = 0.01  # of the misfit, below which the search is not repeated
_SETS_MAX = 6000  # of branches, each tried by least squares: a third of a second


@dataclass(frozen=True)
class Algorithm1:
    """Settings of Algorithm 1 as printed; the thesis does not print the size of the population.

    ``members`` is ten for each of the thesis's eleven parameters, the factor that Storn and Price
    recommend. ``stop`` is the thesis's delta on e_rms (a fraction, eq. 50 without its 100 %).
    """

    generations: int = 150
    mutation: float = 0.6
    crossover: float = 0.9
    members: int = 110
    stop: float = 1e-3


ALGORITHM_1 = Algorithm1()


def algorithm_1(
    problem: Problem, seed: int, progress: Progress, settings: Algorithm1 = ALGORITHM_1
) -> np.ndarray:
    """Return natural parameter values (d,) by differential evolution, as the thesis prints it.

    DE/rand/1/bin, uniform initial members over the printed ranges, linear (not logarithmic)
    coordinates. Eq. 50's e_rms is in the displacement's own unit, taken as mm.
    """
    layout = problem.layout
    bounds = np.array([q.within(THESIS_RANGES.get(q.kind, q.bounds)) for q in layout.quantities])
    rng = np.random.default_rng(seed)
    members = rng.uniform(bounds[:, 0], bounds[:, 1], (settings.members, layout.size))
    # the open ends of the ranges: a modulus or a limit of exactly 0 is not a spring
    lowest = np.array([_LEAST.get(q.kind, -inf) for q in layout.quantities])

    def cost(population: np.ndarray) -> np.ndarray:
        values = np.maximum(np.atleast_2d(population.T), lowest)
        predicted, status = problem.predict(values)
        rms = np.sqrt(np.mean((predicted - problem.measured) ** 2, axis=1))
        still = np.sqrt(np.mean(problem.measured**2))
        return np.where(status == 0, rms, 10.0 * still + rms)

    generation = 0

    def watch(intermediate_result: Any) -> bool:
        nonlocal generation
        generation += 1
        progress("differential evolution", generation / settings.generations)
        return bool(intermediate_result.fun * 1e3 < settings.stop)

    result = scipy.optimize.differential_evolution(
        cost,
        bounds,
        strategy="rand1bin",
        maxiter=settings.generations,
        mutation=settings.mutation,
        recombination=settings.crossover,
        init=members,
        tol=0.0,
        atol=0.0,
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=rng,
        callback=watch,
    )
    return np.maximum(result.x, lowest)


def voltage_starts(problem: Problem, progress: Progress, starts: int = 6) -> np.ndarray:
    """Return start coordinates (K, d) for records driven by voltage, best first.

    The stretch is measured except for its rest value, so it can be imposed on the branches. Every
    term of the motion equation is then known and linear in the moduli (the film's inertia is left
    out). The rest stretch depends on mu_0 alone and hardly changes the terms, so a few iterations
    of fit and rest state suffice. The remaining search over sets of relaxation times is exhaustive,
    with non-negative least squares for the moduli, and needs no seed.
    """
    layout = problem.layout
    candidates, parts, target = _at_rest_balance(problem, progress)
    found = _subsets(layout, _wide(layout), candidates, parts, target)
    progress("global search", 1.0)
    return _ranked(layout, found, starts)


def _actuator(problem: Problem) -> Actuator:
    base = problem.layout.base
    if not isinstance(base, Actuator):
        raise ModelError("records driven by voltage need an actuator to fit")
    return base


def _start_values(layout: FitLayout) -> np.ndarray:
    """Return natural start values (d,) at which no spring stiffens."""
    values = layout.initial()
    values[layout.column("J")] = _WIDE_LIMIT
    for j in layout.column("shape"):
        q = layout.quantities[j]
        values[j] = SPRING_LAWS[q.law].neutral[q.place]
    return values


def _wide(layout: FitLayout) -> tuple[float, ...]:
    """Return the values at which the equilibrium spring does not stiffen, in bounds."""
    return _in_bounds(layout, _shape_values(layout.network.equilibrium.kind, _WIDE_LIMIT))


def _in_bounds(layout: FitLayout, first: tuple[float, ...]) -> tuple[float, ...]:
    """Return values ``first`` of the equilibrium spring's law, within what is stated of them."""
    own = {q.place: q.bounds for q in layout.quantities if q.is_shape and q.index == 0}
    return tuple(float(np.clip(v, *own.get(place, (v, v)))) for place, v in enumerate(first))


def _shape_values(kind: str, limit: float) -> tuple[float, ...]:
    """Return the parameters of a strain energy with that ``limit``, otherwise neutral."""
    law = SPRING_LAWS[kind]
    return (limit, *law.neutral[1:]) if law.has_limit else law.neutral


def _candidates(problem: Problem) -> np.ndarray:
    """Return relaxation times and limits (G, 2) of the candidate branches."""
    return np.array([(t, _WIDE_LIMIT) for t in _time_grid(problem)])


def _at_rest_balance(
    problem: Problem, progress: Progress
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return candidates (G, 2) and the balance as in ``_balance`` about its own rest state."""
    layout = problem.layout
    base = _actuator(problem)
    c = layout.coefficients(_start_values(layout))[0]
    candidates = _candidates(problem)
    measured = base.load.rest_length
    rest = 1.1 if measured is None else measured / base.film.length
    for turn in range(_REST_ITERATIONS):
        parts, target = _balance(problem, base, c, candidates, rest)
        progress("global search", (turn + 1) / (_REST_ITERATIONS + 1))
        if measured is not None:
            break
        moduli, _ = scipy.optimize.nnls(parts.T, target)
        if moduli[0] <= 0.0:
            break
        c[HEAD + MODULUS] = np.clip(moduli[0], *_modulus_ranges(layout)[0])
        status, solved = kernel.rest_stretch(c, 0.0)
        if status != kernel.OK or abs(solved - rest) < 1e-6:
            break
        rest = solved
    return candidates, parts, target


def _balance(
    problem: Problem,
    base: Actuator,
    c: np.ndarray,
    candidates: np.ndarray,
    rest: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Stress per unit modulus (1 + G, N) less that at rest, and the Maxwell stress (N,)."""
    parts, targets = [], []
    for record in problem.records:
        if isinstance(record, ActuatorRecord):
            stretch = rest + record.displacement / base.film.length
            # from the rest state, so that the measured stretch starts where the branches do
            stretch[0] = rest
            part, _ = _unit_stresses(
                base.network, base.film.held, _wide(problem.layout), candidates, record.time,
                stretch,
            )  # fmt: skip
            part -= part[:, :1]
            thrust = electric_along(base.film.held, stretch)
            target = c[ELECTRIC] * record.drive.voltage**2 * thrust
            parts.append(part)
            targets.append(target)
    return np.concatenate(parts, axis=1), np.concatenate(targets)


def film_starts(
    problem: Problem, progress: Progress, stiffening: bool = True, starts: int = 8
) -> np.ndarray:
    """Return start coordinates (K, d) for records driven by stretch, best first.

    Springs are practically neo-Hookean unless ``stiffening``.

    With the stretch imposed the stress is linear in the moduli: an exhaustive search over sets of
    branches (each a relaxation time and a locking limit) and over the starts of the equilibrium
    spring's law, with non-negative least squares for the moduli. With effects such as slack the
    reading is not the stress of the springs: it is linearised about the stress of the best set,
    and the search is repeated.
    """
    layout = problem.layout
    records = [r for r in problem.records if isinstance(r, FilmRecord)]
    greatest = max(float(np.max(r.stretch)) for r in records)
    firsts = tuple(
        dict.fromkeys(
            _in_bounds(layout, first)
            for first in SPRING_LAWS[layout.network.equilibrium.kind].starts(greatest**2)
        )
    )
    if not stiffening:
        firsts = (_wide(layout),)
    # a branch with a low limit flows at a nearly constant stress at any rate
    limits: tuple[float, ...] = (_WIDE_LIMIT, 1.0, 0.03)
    if not stiffening or layout.network.springs[-1].kind != "gent":
        limits = limits[:1]
    found: list[tuple[float, np.ndarray]] = []
    for n, first in enumerate(firsts):
        groups = []
        for limit in limits:
            group = np.array([(t, limit) for t in _time_grid(problem)])
            responses = [
                _unit_stresses(layout.network, layout.held, first, group, r.time, r.stretch)
                for r in records
            ]
            if all(followed for _, followed in responses):
                groups.append((group, np.concatenate([part for part, _ in responses], axis=1)))
        if groups:
            candidates = np.concatenate([group for group, _ in groups])
            parts = np.concatenate([groups[0][1][:1], *(part[1:] for _, part in groups)])
            found += _read_sets(problem, records, first, candidates, parts)
        progress("global search", (n + 1) / len(firsts))
    return _ranked(layout, found, starts)


def _read_sets(
    problem: Problem,
    records: Sequence[FilmRecord],
    first: tuple[float, ...],
    candidates: np.ndarray,
    parts: np.ndarray,
) -> list[tuple[float, np.ndarray]]:
    """Return sets as ``_subsets`` does, for what is read through the effects of the model.

    ``parts`` (1 + G, N) are stresses per unit modulus.
    """
    layout, weight = problem.layout, 1.0 / problem.sigma
    own = layout.coefficients(layout.initial())[0]

    def read(stress: np.ndarray) -> np.ndarray:
        return np.concatenate(
            [
                through_effects(own, r.time, r.stretch, stress[a:b])
                for r, (a, b) in zip(records, pairwise(problem.edges), strict=True)
            ]
        )

    stress, before = problem.measured, inf
    small = _READ_STEP * float(np.max(np.abs(stress)))
    found: list[tuple[float, np.ndarray]] = []
    for _ in range(_READ_TURNS):
        there = read(stress)
        slope = (read(stress + small) - there) / small
        target = (problem.measured - there + slope * stress) * weight
        found = _subsets(layout, first, candidates, parts * (slope * weight), target)
        misfit, x = min(found, key=lambda f: f[0], default=(0.0, np.empty(0)))
        if np.array_equal(there, stress) or abs(before - misfit) <= _READ_CHANGE * misfit:
            break
        c = layout.coefficients(layout.values(x))[0]
        followed = [network_stress(c, r.time, r.stretch) for r in records]
        if any(status != kernel.OK for _, status, _ in followed):
            break
        stress, before = np.concatenate([piece for piece, _, _ in followed]), misfit
    return found


def resolved_times(records: Sequence[Record]) -> tuple[float, float]:
    """Return the least and largest relaxation time in s that ``records`` resolve.

    Two samples, and three durations.
    """
    shortest = min(float(np.median(np.diff(r.time))) for r in records)
    longest = max(float(r.time[-1] - r.time[0]) for r in records)
    return 2.0 * shortest, 3.0 * longest


def _time_grid(problem: Problem, points: int = 16) -> np.ndarray:
    """Return relaxation times that records resolve, in bounds, and those that are stated."""
    layout = problem.layout
    first, last = resolved_times(problem.records)
    times = layout.column("T")
    if times.size:
        low, high = np.exp(layout.lower[times].min()), np.exp(layout.upper[times].max())
        first, last = np.clip([first, last], low, high)
    stated = [_stated_times(layout.quantities[j], first, last) for j in times]
    return np.unique(np.concatenate([np.geomspace(first, last, points), *stated]))


def _stated_times(q: FreeParameter, first: float, last: float) -> np.ndarray:
    """Return times at which a branch may be by what is stated of its time ``q``."""
    stated = q.constraint
    if stated is None:
        return np.zeros(0)
    low, high = q.within((first, last))
    points = list(np.geomspace(low, high, 1 if q.is_fixed else _STATED_POINTS))
    if stated.mean is not None:
        points.append(float(np.clip(stated.mean, low, high)))
    return np.array(points)


def _modulus_ranges(layout: FitLayout) -> np.ndarray:
    """Return the ranges in Pa of the moduli of all springs, (1 + branches, 2), from 0 on."""
    found = np.tile([0.0, inf], (len(layout.network.springs), 1))
    for j in layout.column("mu"):
        q = layout.quantities[j]
        if q.constraint is not None:
            found[q.index] = q.within((0.0, inf))
    return found


def _fitted_moduli(
    parts: np.ndarray, target: np.ndarray, ranges: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return the moduli (n,) within ``ranges`` (n, 2) of least squares, and their misfit."""
    if not ranges[:, 0].any() and np.isinf(ranges[:, 1]).all():
        return scipy.optimize.nnls(parts, target)
    low, high = ranges.T
    moduli, free = low.copy(), low < high
    if free.any():
        left = target - parts[:, ~free] @ moduli[~free]
        moduli[free] = scipy.optimize.lsq_linear(
            parts[:, free], left, (low[free], high[free]), method="bvls"
        ).x
    return moduli, float(np.linalg.norm(parts @ moduli - target))


def _slots(layout: FitLayout, times: np.ndarray) -> np.ndarray | None:
    """Return which of ``times`` (n,) each of the n branches takes, by what is stated of theirs.

    None where it may not take them.
    """
    places = layout.column("T")
    quantities = [layout.quantities[j] for j in places]
    if not any(q.constraint for q in quantities):
        return np.arange(times.size)
    x = np.log(times)
    beyond = np.maximum(layout.lower[places, None] - x, 0.0)
    beyond += np.maximum(x - layout.upper[places, None], 0.0)
    away = np.zeros_like(beyond)
    for row, q in enumerate(quantities):
        if q.constraint is not None and q.constraint.mean is not None:
            away[row] = np.abs(x - np.log(np.maximum(q.constraint.mean, 1e-300)))
    _, taken = scipy.optimize.linear_sum_assignment(_OUT * (beyond > _TIME_ERROR) + away)
    return taken if not (beyond[np.arange(x.size), taken] > _TIME_ERROR).any() else None


def _unit_stresses(
    network: Network,
    held: int,
    first: tuple[float, ...],
    candidates: np.ndarray,
    time: np.ndarray,
    stretch: np.ndarray,
) -> tuple[np.ndarray, bool]:
    """Return stress per unit modulus (1 + G, N) of the equilibrium spring and candidate branches.

    ``first`` are the values of the equilibrium spring's law, ``candidates`` (G, 2) relaxation times
    and limits of the branches.
    """
    springs = network.springs
    kind = springs[-1].kind
    equilibrium = Spring.of(springs[0].kind, 1.0, first)
    branches = (Branch(Spring.of(kind, 1.0, _shape_values(kind, j)), t) for t, j in candidates)
    many = Network(equilibrium, tuple(branches))
    parts, status, _ = unit_stresses(many.coefficients(held), time, stretch)
    return parts, status == kernel.OK


def _subsets(
    layout: FitLayout,
    first: tuple[float, ...],
    candidates: np.ndarray,
    parts: np.ndarray,
    target: np.ndarray,
) -> list[tuple[float, np.ndarray]]:
    """Return (misfit, coordinates) of every set of branches among ``candidates`` and spring 0.

    Where there are too many sets, only candidates with weight in a least-squares fit of all of them
    at once, and their neighbours, take part.
    """
    branches = layout.column("T").size
    triangle = np.asarray(np.linalg.qr(np.vstack([parts, target]).T, mode="r"))
    pool = list(range(len(candidates)))
    if comb(len(pool), branches) > _SETS_MAX:
        used, _ = scipy.optimize.nnls(triangle[:, :-1], triangle[:, -1])
        weights = used[1:] + 0.5 * (np.roll(used[1:], 1) + np.roll(used[1:], -1))
        order = [int(i) for i in np.argsort(-weights, kind="stable")]
        keep = branches
        while comb(keep + 1, branches) <= _SETS_MAX:
            keep += 1
        pool = sorted({*order[:keep], *_stated_candidates(layout, candidates)})
    mu, times = layout.column("mu"), layout.column("T")
    ranges = _modulus_ranges(layout)
    found = []
    for some in combinations(pool, branches):
        taken = _slots(layout, candidates[list(some), 0])
        if taken is None:
            continue
        chosen = [some[i] for i in taken]
        columns = [0, *(1 + i for i in chosen)]
        moduli, misfit = _fitted_moduli(triangle[:, columns], triangle[:, -1], ranges)
        # a branch of zero weight still needs influence for the descent to move it
        moduli = np.maximum(moduli, 1e-3 * max(float(moduli.max()), 1.0))
        values = layout.initial()
        for j in np.flatnonzero(layout.shapes):
            q = layout.quantities[j]
            own = first
            if q.index:
                own = _shape_values(q.law, float(candidates[chosen[q.index - 1], 1]))
            values[j] = own[q.place]
        values[mu] = moduli[[layout.quantities[j].index for j in mu]]
        values[times] = candidates[chosen, 0]
        found.append((misfit, layout.coordinates(values)))
    return found


def _stated_candidates(layout: FitLayout, candidates: np.ndarray) -> list[int]:
    """Return the ``candidates`` (G, 2) with a time at which something stated wants a branch."""
    stated = [
        _stated_times(layout.quantities[j], *np.exp([layout.lower[j], layout.upper[j]]))
        for j in layout.column("T")
    ]
    return [int(i) for i in np.flatnonzero(np.isin(candidates[:, 0], np.concatenate(stated)))]


def _ranked(layout: FitLayout, found: list[tuple[float, np.ndarray]], starts: int) -> np.ndarray:
    """Return the best starts (K, d) that differ in a relaxation time or limit."""
    if not found:
        raise ModelError(
            "no set of springs can follow these records: check that stretch, displacement and "
            "voltage are in the right units"
        )
    kept: list[np.ndarray] = []
    # times and limits are logarithmic; a shape has a scale of its own
    compared = np.concatenate([layout.column("T"), np.flatnonzero(layout.shapes)])
    scale = np.array([layout.quantities[j].typical or 1.0 for j in compared])
    for _, x in sorted(found, key=lambda f: f[0]):
        start = np.clip(x, layout.lower, layout.upper)
        # the moduli follow from the times and shapes: they are not compared
        far = [np.max(np.abs((start - k)[compared]) / scale, initial=0) > 0.7 for k in kept]
        if all(far):
            kept.append(start)
        if len(kept) == starts:
            break
    return np.array(kept)
