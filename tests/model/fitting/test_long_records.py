"""A fit on corrected means: the optimum and the intervals are those of all readings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.fitting import identify
from dearig.model.fitting.estimates import estimates_with_intervals
from dearig.model.fitting.identify import coarse_problem
from dearig.model.fitting.intervals import firm_directions, linear_widths
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.thinning import thinned
from dearig.model.simulation.excitation import Steps
from tests.model.fitting.test_thinning import dense
from tests.tools.engine import PLAIN, effect, posed, record_of, thesis_drive

LAGGED = replace(PLAIN, effects=effect("sensor lag", time_constant=8e-3))


@pytest.mark.parametrize("maker", [PLAIN, LAGGED], ids=["clean", "undeclared effect"])
def test_the_fit_is_the_optimum_of_all_readings(maker) -> None:
    record = record_of(maker, thesis_drive(rate=200.0))
    fitted = identify([record], PLAIN, intervals=False)
    problem, x, free = posed(PLAIN, record)
    best = descend(problem, x, ~free)
    # a tenth of chi-square is a third of a standard deviation at most
    assert fitted.cost * problem.samples < best.cost * problem.samples + 0.1 * max(best.cost, 1.0)


def test_intervals_on_means_are_those_of_all_readings() -> None:
    record = record_of(PLAIN, thesis_drive(rate=200.0))
    fitted = identify([record], PLAIN)
    problem, x, free = posed(fitted.model, record)
    exact = estimates_with_intervals(
        problem, problem.layout.values(x), ~free, lambda _: None, lower_ends=False
    )
    whole = {e.name: e for e in exact.estimates if e.determined}
    assert len(whole) == int(free.sum())
    for e in fitted.estimates:
        if (other := whole.get(e.name)) is not None:
            width = other.high - other.low
            assert abs(e.low - other.low) < 0.05 * width, e.name
            assert abs(e.high - other.high) < 0.05 * width, e.name


def test_corrected_means_may_differ_by_as_much_as_the_noise() -> None:
    record = dense(Steps((8e3, 2e3, 6e3, 0.0), 1.0, 0.02))
    assert thinned(record, 200.0, PLAIN, corrected=True).means_of > 1
    exact = thinned(record, 200.0, PLAIN)
    assert exact.means_of < thinned(record, 200.0, PLAIN, corrected=True).means_of


def test_branches_that_hardly_differ_have_no_linear_interval() -> None:
    first, *rest = PLAIN.network.branches
    half = replace(first.spring, modulus=0.5 * first.spring.modulus)
    near = [
        replace(first, spring=half, relaxation_time=first.relaxation_time * factor)
        for factor in (0.99, 1.01)
    ]
    alike = replace(PLAIN, network=replace(PLAIN.network, branches=(*near, *rest)))
    for model, loose in ((PLAIN, 0), (alike, 1)):
        problem, x, free = posed(model, record_of(model, thesis_drive(rate=100.0)))
        jacobian, values = problem.jacobian(x, free), problem.layout.values(x)
        directions, _ = firm_directions(jacobian, values, problem.layout, free)
        assert directions.shape[1] == int(free.sum()) - loose
        widths = linear_widths(jacobian, 2.0 * jacobian, directions)
        np.testing.assert_allclose(widths, 0.5, rtol=1e-6)


def test_a_film_costs_alone_what_it_costs_among_others() -> None:
    # profiles compare the chi-square of the optimum, computed alone, with those of several points
    record = record_of(PLAIN, thesis_drive(rate=200.0))
    problem, x, _ = posed(PLAIN, record)
    means = coarse_problem(problem, corrected=True, rate=25.0)
    others = x * (1.0 + 1e-3 * np.arange(1, 5)[:, None])
    alone, among = means.costs(x[None])[0], means.costs(np.vstack([x, others]))[0]
    assert abs(among - alone) * means.samples < 0.01
