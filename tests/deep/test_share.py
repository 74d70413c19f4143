"""Which deep tests run on which day."""

from __future__ import annotations

import pytest

from tests.deep import mostly_deep, one_of_each
from tests.deep.share import DAYS, share_of

NAMES = [f"test_{i:03}" for i in range(100)]


def test_without_a_share_all_of_them_run() -> None:
    assert share_of(NAMES, "") == set(NAMES)


def test_eight_weeks_run_each_of_them_once() -> None:
    days = [share_of(NAMES, f"day {day}") for day in range(739_000, 739_000 + DAYS)]
    assert set().union(*days) == set(NAMES)
    assert sum(map(len, days)) == len(NAMES)
    assert max(map(len, days)) - min(map(len, days)) <= 1


def test_a_share_is_the_same_whatever_the_order_of_the_tests() -> None:
    for share in ("day 3", "seed 8"):
        assert share_of(NAMES, share) == share_of(NAMES[::-1], share)
    assert share_of(NAMES, "seed 8") != share_of(NAMES, "seed 9")
    assert len(share_of(NAMES, "seed 8")) == 2  # 100 of 56, rounded up


def test_a_share_of_another_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="'week 2'"):
        share_of(NAMES, "week 2")


def is_deep(case) -> bool:
    return any(mark.name == "deep" for mark in case.marks)


def test_all_cases_stay_and_all_but_those_kept_are_deep() -> None:
    made = mostly_deep(["a", pytest.param(1, 2, id="b"), "c"], kept=["b"])
    assert [(case.values, is_deep(case)) for case in made] == [
        (("a",), True), ((1, 2), False), (("c",), True),
    ]  # fmt: skip


def test_a_kept_case_that_is_not_there_is_an_error() -> None:
    with pytest.raises(ValueError, match="renamed"):
        mostly_deep(["a", "b"], kept=["renamed"])


def test_of_each_kind_the_first_is_kept() -> None:
    cases = [pytest.param(kind, n, id=f"{kind}{n}") for kind in "xy" for n in range(2)]
    made = one_of_each(cases, lambda case: case.values[0])
    assert [case.id for case in made if not is_deep(case)] == ["x0", "y0"]
