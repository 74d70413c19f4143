"""One model fitted to many records of one film: shared parameters, and own ones of each record.

Least squares over all records at once. The Jacobian is a bordered block diagonal: a record depends
on the shared parameters and on its own. So the own ones are eliminated record by record (a Schur
complement), and the cost of a step grows with the number of records, not with its cube.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dearig.model.errors import ModelError
from dearig.model.fitting.estimates import at_bound
from dearig.model.fitting.identify import coarse_problem, fit_globally
from dearig.model.fitting.intervals import correlation_time, is_determined
from dearig.model.fitting.levenberg import gain_that_counts
from dearig.model.fitting.parameters import NORMAL_95, Estimate, FitLayout, require_free
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.search import Progress
from dearig.model.readings.records import Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = ["SharedFit", "fit_shared"]

_PERMITTIVITY = "permittivity"
_START_RECORDS = 3  # that a global search fits in common, for the start
_ITERATIONS = 40
_FLAT = 1e-12  # of the curvature: a flatter direction gets a variance that determines nothing
_DAMPING_MIN, _DAMPING_MAX = 1e-9, 1e8


@dataclass(frozen=True)
class SharedFit:
    """Result of a fit of one model to many records.

    ``estimates`` has for each record all its parameters, the shared ones first, with 95 % intervals
    by the curvature of the whole least squares. ``models`` are the models of the records, ``costs``
    (R,) the mean squares of their residuals over their noise. ``own`` are the names of the
    parameters that each record has for itself.
    """

    models: tuple[Actuator | Strip, ...]
    estimates: tuple[tuple[Estimate, ...], ...]
    own: tuple[str, ...]
    costs: np.ndarray
    converged: bool
    simulations: int


@dataclass(frozen=True)
class _Step:
    """Normal equations at one point: shared block (s, s), and own and mixed blocks of each record.

    ``balance`` (k,) is the constraint on the own parameters: the sum of their changes by it is
    ``-excess``.
    """

    shared: np.ndarray
    shared_gradient: np.ndarray
    own: list[np.ndarray]
    mixed: list[np.ndarray]
    own_gradient: list[np.ndarray]
    balance: np.ndarray
    excess: float

    def solve(self, damping: float) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return the step of the shared parameters (s,), and of each record's own (k,)."""
        lifted = _lifted(self.shared, damping)
        blocks = [_inverse(_lifted(d, damping)) for d in self.own]
        matrix, borders = self._bordered(lifted, blocks)
        right = np.append(-self.shared_gradient, -self.excess)
        for border, inverse, gradient in zip(borders, blocks, self.own_gradient, strict=True):
            right += border.T @ (inverse @ gradient)
        solution = _solved(matrix, right)
        steps = [
            -inverse @ (gradient + border @ solution)
            for border, inverse, gradient in zip(borders, blocks, self.own_gradient, strict=True)
        ]
        return solution[: lifted.shape[0]], steps

    def covariances(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return the covariance of the shared parameters (s, s), and of each record's own."""
        blocks = [_inverse(_lifted(d, _FLAT)) for d in self.own]
        matrix, borders = self._bordered(_lifted(self.shared, _FLAT), blocks)
        inverse = _solved(matrix, np.eye(matrix.shape[0]))
        size = self.shared.shape[0]
        own = [
            block + block @ border @ inverse @ border.T @ block
            for block, border in zip(blocks, borders, strict=True)
        ]
        return inverse[:size, :size], own

    def _bordered(
        self, shared: np.ndarray, blocks: list[np.ndarray]
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return the matrix (s + 1, s + 1) of shared parameters and multiplier, and (k, s + 1)."""
        size = shared.shape[0]
        matrix = np.zeros((size + 1, size + 1))
        matrix[:size, :size] = shared
        borders = [np.column_stack([mixed.T, self.balance]) for mixed in self.mixed]
        for border, inverse in zip(borders, blocks, strict=True):
            matrix -= border.T @ inverse @ border
        if not self.balance.any():
            matrix[size, size] = 1.0  # no constraint: the multiplier is 0
        return matrix, borders


def _lifted(normal: np.ndarray, damping: float) -> np.ndarray:
    """Return ``normal`` with Marquardt's damping; a parameter without influence stays put."""
    diagonal = np.diag(normal)
    largest = float(diagonal.max(initial=0.0)) or 1.0
    return normal + np.diag(damping * diagonal + np.where(diagonal > 0.0, 0.0, largest))


def _inverse(normal: np.ndarray) -> np.ndarray:
    return _solved(normal, np.eye(normal.shape[0])) if normal.size else normal


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution of a symmetric system, scaled, with flat directions left out."""
    scale = np.sqrt(np.maximum(np.abs(np.diag(matrix)), 1e-300))
    turned = right / (scale if right.ndim == 1 else scale[:, None])
    solution = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-13) @ turned
    return np.asarray(solution / (scale if right.ndim == 1 else scale[:, None]))


class _Many:
    """Least squares of many records; coordinates are shared (s,) and own (R, k)."""

    def __init__(self, problems: Sequence[Problem], own: np.ndarray, shared: np.ndarray) -> None:
        self.problems = tuple(problems)
        self.layout = problems[0].layout
        self.own, self.shared = own, shared  # (d,) bool
        names = np.array(self.layout.names)[own]
        # the mean of the logarithms of the permittivities is that of the film
        self.balance = (names == _PERMITTIVITY).astype(float)
        self.given = float(self.layout.coordinates(self.layout.initial())[own] @ self.balance)

    def at(self, x: np.ndarray, owned: np.ndarray, i: int) -> np.ndarray:
        """Return the coordinates (d,) of record ``i``."""
        found = x.copy()
        found[self.own] = owned[i]
        return found

    def residuals(self, x: np.ndarray, owned: np.ndarray) -> list[np.ndarray]:
        """Return the residuals of each record; those of a failed simulation are large."""
        return [p.residuals(self.at(x, owned, i)) for i, p in enumerate(self.problems)]

    def chi2(self, x: np.ndarray, owned: np.ndarray) -> float:
        """Return the sum of squares; a failed simulation costs more than a still model."""
        return sum(
            float(p.costs(self.at(x, owned, i)[None])[0]) * p.samples
            for i, p in enumerate(self.problems)
        )

    def normal(self, x: np.ndarray, owned: np.ndarray, weights: Sequence[float]) -> _Step:
        """Return the normal equations at a point; ``weights`` divide the records' sums."""
        free = self.own | self.shared
        places = np.flatnonzero(free)
        mine, common = self.own[places], self.shared[places]
        shared = np.zeros((int(common.sum()),) * 2)
        gradient = np.zeros(shared.shape[0])
        blocks: list[np.ndarray] = []
        mixed: list[np.ndarray] = []
        own_gradient: list[np.ndarray] = []
        for i, (problem, weight) in enumerate(zip(self.problems, weights, strict=True)):
            there = self.at(x, owned, i)
            jac = problem.jacobian(there, free)
            r = problem.residuals(there)
            square, down = jac.T @ jac * weight, jac.T @ r * weight
            shared += square[np.ix_(common, common)]
            gradient += down[common]
            blocks.append(square[np.ix_(mine, mine)])
            mixed.append(square[np.ix_(common, mine)])
            own_gradient.append(down[mine])
        excess = float((owned @ self.balance).sum() - len(self.problems) * self.given)
        return _Step(shared, gradient, blocks, mixed, own_gradient, self.balance, excess)

    def descend(
        self, x: np.ndarray, owned: np.ndarray, report: Progress
    ) -> tuple[np.ndarray, np.ndarray, bool]:
        """Return shared coordinates (d,), own ones (R, k), and whether the descent converged."""
        lower, upper = self.layout.lower, self.layout.upper
        chi2, damping = self.chi2(x, owned), 1e-3
        samples = sum(p.samples for p in self.problems)
        for done in range(_ITERATIONS):
            report("descents", 1.0 - 0.8**done)
            normal = self.normal(x, owned, [1.0] * len(self.problems))
            enough = gain_that_counts(chi2, samples)
            gained = 0.0
            while damping <= _DAMPING_MAX:
                step, steps = normal.solve(damping)
                trial, trials = x.copy(), owned + np.array(steps).reshape(owned.shape)
                reach = self.layout.reach(x)
                trial[self.shared] += np.clip(step, -reach[self.shared], reach[self.shared])
                trial = np.clip(trial, lower, upper)
                trials = np.clip(trials, lower[self.own], upper[self.own])
                other = self.chi2(trial, trials)
                if other < chi2:
                    gained, chi2 = chi2 - other, other
                    x, owned = trial, trials
                    damping = max(0.1 * damping, _DAMPING_MIN)
                    break
                damping *= 10.0
            if gained < enough:
                return x, owned, True
        return x, owned, False


def fit_shared(
    records: Sequence[Record],
    base: Actuator | Strip,
    own: Sequence[str],
    workers: int = 2,
    progress: Progress = lambda _stage, _part: None,
) -> SharedFit:
    """Fit ``base`` to ``records``, whose parameters ``own`` each record has for itself.

    ``own`` are names of the layout (mu_0, T_1, ...), or permittivity: then the geometric mean of
    the records' permittivities is that of the film, since a common factor of permittivity and all
    moduli is not seen. Each record has its own offset of displacement in any case. The start is a
    global search over a few records without own parameters. Raises ``ModelError`` for names that
    the model does not have, or that cannot be free.
    """
    layout = _layout(base, own)
    is_own = np.array([name in own for name in layout.names])
    some = np.unique(
        np.linspace(0, len(records) - 1, min(_START_RECORDS, len(records))).astype(int)
    )
    start = Problem([records[i] for i in some], FitLayout(base), workers)
    require_free(start.layout, start.samples)
    found, held = fit_globally(start, None, lambda stage, part: progress(stage, 0.5 * part))
    values = dict(zip(start.layout.names, start.layout.by_relaxation_time(
        start.layout.values(found.x)), strict=True))  # fmt: skip
    natural = layout.initial()
    for j, name in enumerate(layout.names):
        natural[j] = values.get(name, natural[j])
    limits = {n for n, h in zip(start.layout.names, held, strict=True) if h}
    shared = np.array([n not in limits and n not in own for n in layout.names])
    x = np.clip(layout.coordinates(natural), layout.lower, layout.upper)
    owned = np.tile(x[is_own], (len(records), 1))
    full = [Problem([record], layout, workers) for record in records]
    converged, simulations = False, start.simulations
    for problems in ([coarse_problem(p) for p in full], full):
        many = _Many(problems, is_own, shared)
        x, owned, converged = many.descend(
            x, owned, lambda stage, part: progress(stage, 0.5 + 0.5 * part)
        )
        simulations += sum(p.simulations for p in problems)
    progress("descents", 1.0)
    return _result(many, x, owned, converged, simulations)


def _layout(base: Actuator | Strip, own: Sequence[str]) -> FitLayout:
    """Return the layout in which ``own`` are free. Raises ``ModelError``."""
    if _PERMITTIVITY in own and not isinstance(base, Actuator):
        raise ModelError("permittivity: a film driven by stretch has none")
    layout = FitLayout(base, permittivity=_PERMITTIVITY in own)
    for name in own:
        if name not in layout.names:
            why = (
                "it follows from the measured rest length and the weight"
                if name == "mu_0" and isinstance(base, Actuator)
                else f"the model has {', '.join(layout.names)}"
            )
            raise ModelError(f"{name} cannot be a parameter of each record: {why}")
    return layout


def _result(
    many: _Many, x: np.ndarray, owned: np.ndarray, converged: bool, simulations: int
) -> SharedFit:
    layout = many.layout
    residuals = many.residuals(x, owned)
    costs = np.array(
        [float(r @ r) / p.samples for r, p in zip(residuals, many.problems, strict=True)]
    )
    # as in a fit of one record: misfit and correlated residuals widen the intervals
    inflation = [
        max(1.0, cost) * max(1.0, correlation_time(r))
        for cost, r in zip(costs, residuals, strict=True)
    ]
    weighted = many.normal(x, owned, [1.0 / each for each in inflation])
    common, own = weighted.covariances()
    models, estimates = [], []
    for i in range(len(many.problems)):
        there = many.at(x, owned, i)
        sigma = np.full(layout.size, np.nan)
        sigma[many.shared] = _errors(common, weighted.shared)
        sigma[many.own] = _errors(own[i], weighted.own[i])
        models.append(layout.model(layout.values(there)))
        estimates.append(_estimates(layout, there, sigma))
    names = tuple(n for n, o in zip(layout.names, many.own, strict=True) if o)
    return SharedFit(tuple(models), tuple(estimates), names, costs, converged, simulations)


def _errors(covariance: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the standard errors (k,); infinite for a parameter without influence on the data."""
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return np.asarray(np.where(np.diag(normal) > 0.0, errors, np.inf))


def _estimates(layout: FitLayout, x: np.ndarray, sigma: np.ndarray) -> tuple[Estimate, ...]:
    """Return the estimates at coordinates ``x`` (d,) with standard errors (d,), NaN where held."""
    values = layout.values(x)
    ends = at_bound(layout, x)
    found = []
    for q, value, middle, error, end in zip(layout.quantities, values, x, sigma, ends, strict=True):
        if math.isnan(error):
            found.append(Estimate(q.name, q.unit, float(value), 0.0, math.inf, False, "held"))
            continue
        low, high = float(middle - NORMAL_95 * error), float(middle + NORMAL_95 * error)
        if q.logarithmic:
            # beyond these an exponential is 0 or infinite
            low = math.exp(low) if low > -700.0 else 0.0
            high = math.exp(high) if high < 700.0 else math.inf
        elif q.kind == "mu":
            low = max(low, 0.0)
        determined = is_determined(low, high) and not end
        found.append(
            Estimate(
                q.name, q.unit, float(value), float(low), float(high), determined,
                at_bound=bool(end),
            )
        )  # fmt: skip
    return tuple(found)
