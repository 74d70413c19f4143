"""Branches that act as one: their sum has an interval that holds the truth, the parts have none."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest

from dearig.model.film.material import Network
from dearig.model.fitting import Estimate, Identification, identify
from dearig.model.fitting.estimates import ONE_VALLEY, estimates_with_intervals
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.spare import Optimum, Valleys, _together, valleys_of
from dearig.report.as_json import outcome_json
from dearig.report.text.estimates import estimate_table
from dearig.report.text.numbers import symbol
from dearig.report.text.tables import parameter_table
from tests.deep import mostly_deep
from tests.tools.diagnosis import stage
from tests.tools.engine import PLAIN, posed, record_of, thesis_drive
from tests.tools.reports import fit as paper_fit
from tests.tools.reports import identify_outcome

Check = Callable[[], None]

#: Two branches at 0.462 and 0.470 s: a single one of 104.51 kPa leaves the same error.
TWINS = replace(PLAIN, network=Network.gent((50e3, 46.84e3, 57.67e3), (1e4,) * 3, (0.462, 0.470)))
APART = replace(PLAIN, network=Network.gent((50e3, 46.84e3, 57.67e3), (1e4,) * 3, (0.2, 2.0)))
SEEDS = (0, 3)
#: Seed and rate in Hz; with the last noise lowers chi-square by 8.6 in favour of a slow branch.
RECORDS = [pytest.param(*record) for record in ((0, 100.0), (3, 100.0), (3, 50.0))]


@functools.cache
def fit_of_twins(seed: int, rate: float = 100.0) -> Identification:
    base = replace(TWINS, network=Network.gent((50e3,) * 3, (1e4,) * 3, (0.3, 3.0)))
    return identify([record_of(TWINS, thesis_drive(rate=rate), seed=seed)], base)


@pytest.mark.parametrize(("seed", "rate"), mostly_deep(RECORDS, [(0, 100.0), (3, 50.0)]))
def test_no_part_of_a_sum_has_an_interval_without_the_truth(seed: int, rate: float) -> None:
    truth = {"mu_0": 50e3, "mu_1": 46.84e3, "mu_2": 57.67e3, "T_1": 0.462, "T_2": 0.470}
    for e in fit_of_twins(seed, rate).estimates:
        if e.name in truth:
            assert e.low <= truth[e.name] <= e.high, e
            assert e.low <= e.value <= e.high, e
            assert e.determined == (e.name == "mu_0")


@pytest.mark.deep
@pytest.mark.parametrize("seed", SEEDS)
def test_the_sum_of_two_branches_that_act_as_one_is_determined(seed: int) -> None:
    (total,) = fit_of_twins(seed).sums
    assert total.name == "mu_1 + mu_2"
    assert total.determined
    assert total.low <= 46.84e3 + 57.67e3 <= total.high
    assert total.low < total.value < total.high
    assert math.isclose(total.value, 46.84e3 + 57.67e3, rel_tol=5e-3)
    assert any(
        "these data determine mu_1 + mu_2, not the parts" in w for w in fit_of_twins(seed).warnings
    )


def test_tables_and_json_have_the_sum() -> None:
    total = Estimate("mu_1 + mu_2", "Pa", 104.5e3, 104.4e3, 104.6e3, True, "at about 0.466 s")
    fit = paper_fit(sums=(total,))
    rows = [
        parameter_table(fit).rows[-1],
        estimate_table(replace(stage(PLAIN, 1e-6), sums=(total,))).rows[-1],
    ]
    assert all("+" in row.cells[0] and row.detail == "at about 0.466 s" for row in rows)
    # an estimate among the others would count as a free parameter
    assert "mu_1 + mu_2" not in {e.name for e in fit.estimates}
    outcome = identify_outcome()
    (said,) = outcome_json(replace(outcome, fit=replace(outcome.fit, sums=(total,))))["sums"]
    assert (said["name"], said["ci95"]) == ("mu_1 + mu_2", [104.4e3, 104.6e3])


def test_the_name_of_a_sum_says_which_values_it_is_the_sum_of() -> None:
    total = _together([1, 2], 99e3, (91e3, 113e3), "about 0.341", {3})
    assert total.name == "mu_1 + mu_2 (+ mu_3)"
    assert total.note.endswith("in other fits that are as good, mu_3 does so too")
    (row,) = parameter_table(replace(paper_fit(), estimates=(), sums=(total,))).rows
    assert row.cells[0] == " + ".join((symbol("mu_1"), symbol("mu_2"))) + f" (+ {symbol('mu_3')})"
    assert row.detail.endswith(f"{symbol('mu_3')} does so too")


def test_branches_that_the_data_keep_apart_make_no_sum() -> None:
    fit = identify([record_of(APART, thesis_drive(rate=50.0))], APART)
    assert fit.sums == ()
    assert {e.name for e in fit.estimates if e.determined} == {"mu_0", "mu_1", "mu_2", "T_1", "T_2"}


def test_a_limit_that_is_held_stays_where_it_is() -> None:
    """Its own profile frees it, and nearly always gains a little."""
    for seed in range(2):
        fit = identify([record_of(PLAIN, thesis_drive(rate=50.0), seed=seed)], PLAIN)
        assert fit.held_limits == ("J_0", "J_1")
        limits = {e.name: e.value for e in fit.estimates if e.name in fit.held_limits}
        assert limits == pytest.approx({"J_0": 1e4, "J_1": 1e4})


def test_other_valleys_are_left_when_they_are_asked_to_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    record = record_of(TWINS, thesis_drive(rate=50.0))
    problem, x, free = posed(TWINS, record)
    found = descend(problem, x, ~free)
    after: list[int] = []

    def follow(best: Optimum, estimates: Sequence[Estimate], check: Check) -> Valleys:
        best.problem.on_simulations = lambda count, _: after.append(count)
        return valleys_of(best, estimates, check)

    monkeypatch.setattr("dearig.model.fitting.estimates.valleys_of", follow)
    intervals = estimates_with_intervals(
        problem,
        problem.layout.values(found.x),
        ~free,
        lambda _: None,
        lower_ends=False,
        ended=lambda: bool(after),
    )
    # the first population that is simulated on the way to another valley is the last
    assert len(after) == 1
    (known,) = (e for e in intervals.estimates if e.name == "mu_0")
    assert known.determined
    assert ONE_VALLEY in known.note
