"""The descent by secants: the optimum of the full one, for fewer simulations."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from dearig.model.film.material import Network
from dearig.model.fitting.broyden import boxed_step, descend_broyden
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from tests.tools.engine import PLAIN, effect, record_of

TRUTH = replace(PLAIN, effects=effect("linear drag", drag=400.0))
AWAY = replace(
    PLAIN,
    network=Network.gent((50e3, 54e3), (1e4, 1e4), (0.5,)),
    effects=effect("linear drag", drag=0.0),
)


@functools.cache
def record():
    return record_of(TRUTH)


def posed(model=AWAY):
    """Problem, start, what is held."""
    problem = Problem([record()], FitLayout(model), workers=1)
    layout = problem.layout
    held = np.zeros(layout.size, dtype=bool)
    held[layout.column("J")] = True
    return problem, layout.coordinates(layout.initial()), held


@functools.cache
def by_full_jacobians():
    problem, start, held = posed()
    return descend(problem, start, held, gain=0.01), problem.simulations


def sigmas():
    problem, _, held = posed()
    jac = problem.jacobian(by_full_jacobians()[0].x, ~held)
    return np.sqrt(np.diag(np.linalg.inv(jac.T @ jac)))


def require_the_optimum(fit, within=0.15):
    wanted, _ = by_full_jacobians()
    problem, _, held = posed()
    assert fit.cost == pytest.approx(wanted.cost, abs=0.1 / problem.samples)
    off = (fit.x - wanted.x)[~held] / sigmas()
    assert np.abs(off).max() < within
    np.testing.assert_array_equal(fit.x[held], wanted.x[held])
    assert fit.cost == pytest.approx(problem.costs(fit.x[None])[0], rel=1e-9)
    np.testing.assert_allclose(fit.residuals, problem.residuals(fit.x), atol=1e-9)
    assert fit.jacobian.shape == (problem.samples, np.count_nonzero(~held))


def test_from_nothing():
    problem, start, held = posed()
    fit = descend_broyden(problem, start, held, gain=0.01)
    assert fit.converged
    require_the_optimum(fit)
    assert problem.simulations < 0.6 * by_full_jacobians()[1]


def test_from_a_jacobian_that_is_known():
    problem, start, held = posed()
    known = problem.jacobian(start, ~held)
    kept = known.copy()
    problem.simulations = 0
    fit = descend_broyden(problem, start, held, known, gain=0.01)
    require_the_optimum(fit)
    assert problem.simulations < 0.6 * by_full_jacobians()[1]
    np.testing.assert_array_equal(known, kept)


def test_columns_that_are_not_known_are_computed():
    problem, start, held = posed()
    known = problem.jacobian(start, ~held)
    known[:, [1, 3]] = np.nan
    problem.simulations = 0
    fit = descend_broyden(problem, start, held, known, gain=0.01)
    require_the_optimum(fit)
    assert np.isnan(known[:, [1, 3]]).all()
    assert problem.simulations < 0.6 * by_full_jacobians()[1]
    # nor of one that is known in part
    known = problem.jacobian(start, ~held)
    known[700:, 3] = np.nan
    require_the_optimum(descend_broyden(problem, start, held, known, gain=0.01))


def test_a_misleading_jacobian_is_found_out():
    problem, start, held = posed()
    wrong = problem.jacobian(start, ~held)
    rng = np.random.default_rng(0)
    wrong = wrong * rng.choice([-1.0, 1.0], wrong.shape[1])
    require_the_optimum(descend_broyden(problem, start, held, wrong, gain=0.01))


def test_at_the_optimum_nothing_is_left_to_do():
    best, _ = by_full_jacobians()
    problem, _, held = posed()
    fit = descend_broyden(problem, best.x, held)
    assert fit.converged
    require_the_optimum(fit)
    # itself, and one Jacobian, one-sided, to be sure: the place again next to the others
    assert problem.simulations == 2 + np.count_nonzero(~held)
    problem.simulations = 0
    fit = descend_broyden(problem, best.x, held, best.jacobian, sure=False)
    assert fit.converged
    assert problem.simulations == 1


def test_a_few_steps_are_a_few_steps():
    problem, start, held = posed()
    first = float(problem.costs(start[None])[0])
    fit = descend_broyden(problem, start, held, iterations=2)
    assert fit.iterations == 2
    assert not fit.converged
    assert fit.cost < first
    # and from there on
    rest = descend_broyden(problem, fit.x, held, fit.jacobian, gain=0.01)
    require_the_optimum(rest)


def test_bounds_hold():
    problem, start, held = posed()
    layout = problem.layout
    # the drag's lower bound is 0; the truth is moved beyond it
    back = replace(PLAIN, effects=effect("linear drag", drag=0.0))
    other = record_of(back)
    pushed = replace(other, displacement=other.displacement + 3e-6 * np.gradient(
        other.displacement, other.time) / 1e-3)  # fmt: skip
    problem = Problem([pushed], layout, workers=1)
    fits = [f(problem, start, held) for f in (descend, descend_broyden)]
    for fit in fits:
        assert np.all(fit.x >= layout.lower)
        assert np.all(fit.x <= layout.upper)
        assert layout.values(fit.x)[layout.column("effect")[0]] == 0.0
    assert fits[1].cost == pytest.approx(fits[0].cost, abs=1.0 / problem.samples)
    # a start outside is taken in
    outside = start.copy()
    outside[layout.column("effect")] = -50.0
    outside[0] = 2.0 * layout.upper[0]
    fit = descend_broyden(problem, outside, held, iterations=0)
    assert fit.x[layout.column("effect")[0]] == layout.lower[layout.column("effect")[0]]
    assert fit.x[0] == layout.upper[0]


@pytest.mark.parametrize("seed", range(30))
def test_a_step_within_a_box_is_the_best_one_there(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 12))
    columns = rng.normal(size=(40, n))
    # two numbers that nearly cancel: without the box they would go far, and opposite ways
    columns[:, 1] = columns[:, 0] + 1e-4 * columns[:, 1]
    columns /= np.linalg.norm(columns, axis=0)
    low, high = -rng.exponential(size=n), rng.exponential(size=n)
    if seed % 3 == 0:
        low[0] = 0.0
    if seed % 5 == 0:
        low[-1] = high[-1] = 0.0
    normal, gradient = columns.T @ columns, columns.T @ (3.0 * rng.normal(size=40))

    def model(step):
        return float(step @ (2.0 * gradient + normal @ step))

    step = boxed_step(normal, gradient, 1e-9, low, high)
    assert np.all((low <= step) & (step <= high))
    wanted = minimize(
        model, np.zeros(n), jac=lambda s: 2.0 * (gradient + normal @ s),
        bounds=list(zip(low, high, strict=True)), method="L-BFGS-B",
        options={"maxiter": 5000, "ftol": 1e-15, "gtol": 1e-12},
    ).fun  # fmt: skip
    assert model(step) <= wanted + 1e-6 * abs(wanted)
    assert model(step) < 0.0
