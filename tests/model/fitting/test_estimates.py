"""Estimates with intervals: bounds are marked, and means of readings keep the optimum."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from dearig.model.fitting import add_intervals, identify
from dearig.model.fitting.estimates import (
    BY_CURVATURE,
    BetterPoint,
    _estimate,
    estimates_with_intervals,
    recentre,
)
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import Estimate, FitLayout
from dearig.model.fitting.problem import Problem
from dearig.report.text.estimates import estimate_table
from dearig.report.text.tables import parameter_table
from tests.tools.diagnosis import stage
from tests.tools.engine import PLAIN, effect, posed, record_of, thesis_drive
from tests.tools.reports import fit as paper_fit


def test_a_parameter_at_an_end_of_its_search_range_is_marked() -> None:
    record = record_of(PLAIN)
    early = np.interp(record.time + 5e-3, record.time, record.displacement)
    lagged = replace(PLAIN, effects=effect("sensor lag", time_constant=2e-3))
    problem, x, free = posed(lagged, replace(record, displacement=early))
    found = descend(problem, x, ~free)
    values = problem.layout.values(found.x)
    estimates = estimates_with_intervals(
        problem, values, ~free, lambda _: None, lower_ends=False
    ).estimates
    lag = estimates[-1]
    assert (lag.value, lag.at_bound, lag.determined) == (0.0, True, False)
    assert lag.note == "at the end of its search range"
    assert [e.name for e in estimates if e.at_bound] == [lag.name]


def test_tables_mark_a_parameter_at_a_bound() -> None:
    ended = Estimate("mu_1", "Pa", 0.01, 0.0, 20.0, False, "at the end", at_bound=True)
    for fit in (
        paper_fit(estimates=(ended,)),
        paper_fit(estimates=(ended,), covariance=np.empty(0)),
    ):
        assert "at bound" in parameter_table(fit).rows[0].cells[3]
        assert "the data may ask for more" in parameter_table(fit).note
    table = estimate_table(stage(PLAIN, 1e-6, estimates=(ended,)))
    assert "at bound" in table.rows[0].cells[3]


@pytest.mark.parametrize("lead_in", [0, 800])
def test_means_of_readings_have_the_optimum_of_all_readings(lead_in: int) -> None:
    record = replace(record_of(PLAIN, thesis_drive(rate=400.0)), lead_in=lead_in)
    problem, x, free = posed(PLAIN, record)
    best = descend(problem, x, ~free)
    means = Problem([record.in_means(8)], problem.layout, workers=1)
    recentre(means, problem, problem.layout.values(best.x))
    gradient = means.jacobian(best.x, free).T @ means.residuals(best.x)
    scale = np.linalg.norm(means.jacobian(best.x, free), axis=0)
    # in standard deviations
    assert np.abs(gradient / scale).max() < 0.1


@pytest.mark.deep
def test_no_interval_is_narrower_than_with_all_others_known() -> None:
    """Two branches that the data do not tell apart lead the path of the others astray."""
    first, *rest = PLAIN.network.branches
    half = replace(first, spring=replace(first.spring, modulus=0.5 * first.spring.modulus))
    twins = replace(PLAIN, network=replace(PLAIN.network, branches=(half, half, *rest)))
    problem, x, free = posed(twins, record_of(PLAIN, thesis_drive(rate=50.0)))
    found = descend(problem, x, ~free)
    estimates = estimates_with_intervals(
        problem, problem.layout.values(found.x), ~free, lambda _: None, lower_ends=False
    ).estimates
    alone = 1.96 / np.linalg.norm(problem.jacobian(found.x, free), axis=0)
    fitted = [e for e, f in zip(estimates, free, strict=True) if f]
    quantities = [q for q, f in zip(problem.layout.quantities, free, strict=True) if f]
    for e, q, least in zip(fitted, quantities, alone, strict=True):
        least *= 0.9 * (e.value if q.logarithmic else 1.0)
        assert min(e.high - e.value, e.value - e.low) > least, e.name


def test_profiles_end_when_they_are_asked_to() -> None:
    problem, x, free = posed(PLAIN, record_of(PLAIN, thesis_drive(rate=50.0)))
    found = descend(problem, x, ~free)
    values = problem.layout.values(found.x)
    points: list[float] = []
    intervals = estimates_with_intervals(
        problem, values, ~free, points.append, lower_ends=False, ended=lambda: len(points) > 2
    )
    estimates, names, cov = intervals.estimates, intervals.names, intervals.covariance
    # one point more for each parameter, at which it is asked
    assert len(points) <= 3 + free.sum()
    fitted = [e for e, f in zip(estimates, free, strict=True) if f]
    ended = [e for e in fitted if BY_CURVATURE in e.note]
    assert len(ended) >= free.sum() - 1
    for e in ended:
        error = math.sqrt(cov[names.index(e.name), names.index(e.name)])
        q = next(q for q in problem.layout.quantities if q.name == e.name)
        if q.logarithmic:
            assert e.high / e.value == pytest.approx(math.exp(1.96 * error / e.value), rel=1e-2)
        else:
            assert e.high - e.value == pytest.approx(1.96 * error, rel=1e-2)


def test_a_value_off_the_optimum_is_no_end_of_its_own_interval() -> None:
    problem, x, free = posed(PLAIN, record_of(PLAIN, thesis_drive(rate=50.0)))
    off = problem.layout.values(descend(problem, x, ~free).x)
    off[problem.layout.names.index("mu_1")] *= 1.01
    with pytest.raises(BetterPoint) as better:
        estimates_with_intervals(problem, off, ~free, lambda _: None, lower_ends=False, gain=None)
    assert better.value.gained > 100.0
    found = descend(problem, better.value.x, ~free)
    estimates = estimates_with_intervals(
        problem, problem.layout.values(found.x), ~free, lambda _: None, lower_ends=False
    ).estimates
    for e, f in zip(estimates, free, strict=True):
        assert not f or e.low < e.value < e.high, e


@pytest.mark.parametrize("changed", ["mu_0", "T_1"])
def test_intervals_take_the_model_to_its_optimum(changed: str) -> None:
    record = record_of(PLAIN, thesis_drive(rate=50.0))
    fit = identify([record], PLAIN)
    branch = PLAIN.network.branches[0]
    network = fit.model.network
    if changed == "mu_0":
        equilibrium = replace(network.equilibrium, modulus=1.02 * network.equilibrium.modulus)
        network = replace(network, equilibrium=equilibrium)
    else:
        network = replace(
            network, branches=(replace(branch, relaxation_time=1.05 * branch.relaxation_time),)
        )
    off = replace(fit, model=replace(fit.model, network=network), cost=10.0 * fit.cost)
    moved = add_intervals([record], off)
    assert moved.cost == pytest.approx(fit.cost, rel=1e-4)
    assert moved.correlation == pytest.approx(fit.correlation, rel=1e-2)
    values = dict(zip(FitLayout(moved.model).names, FitLayout(moved.model).initial(), strict=True))
    for e, before in zip(moved.estimates, fit.estimates, strict=True):
        assert e.value == pytest.approx(values[e.name], rel=1e-9)
        if before.determined:
            assert e.low < e.value < e.high
            assert before.low < e.value < before.high


def test_an_interval_that_the_range_of_a_law_cuts_off_says_so() -> None:
    slow = effect("dielectric relaxation", strength=0.1, relaxation_time=0.2, settled=0.0)
    layout = FitLayout(replace(PLAIN, effects=slow))
    by_name = dict(zip(layout.names, layout.quantities, strict=True))
    late = by_name["dielectric relaxation: relaxation_time"]
    low, high = late.search_range
    assert low > 0.0
    inside = math.sqrt(low * high)
    for span in ((low, inside), (inside, high)):
        cut = _estimate(late, inside, span, held=False, at_end=False, followed=True)
        assert cut.note.endswith("the interval ends where the range of its law does")
    whole = _estimate(late, inside, (0.9 * inside, 1.1 * inside), False, False, followed=True)
    assert (whole.note, whole.determined) == ("", True)
    # of a spring an open end is 0 or infinite, which its note says
    spring = _estimate(by_name["mu_1"], 4e4, (0.0, 5e4), False, False, followed=True)
    assert spring.note == "only an upper bound"
