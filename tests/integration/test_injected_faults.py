"""Calls of a short run that fail; ``python -m tests.faults`` makes every one of them fail."""

import pytest

from tests.crash.changes import able
from tests.deep import mostly_deep
from tests.faults.__main__ import Runs, chosen

pytestmark = pytest.mark.skipif(not able(), reason="needs Linux and a C compiler")


@pytest.fixture(scope="module")
def runs():
    with Runs() as made:
        made.run("changes", 0)  # fills the caches
        yield made


@pytest.mark.parametrize("most", mostly_deep([3, 8], [3]))
@pytest.mark.parametrize("kind", mostly_deep(["changes", "locks", "allocations"], ["changes"]))
def test_a_call_that_fails_ends_in_a_sentence_and_loses_nothing(runs, kind, most):
    whole, calls = runs.run(kind, 0)
    assert (whole.code, whole.wrong) == (0, ())
    outcomes = [runs.run(kind, n)[0] for n in chosen(calls, most, seed=1)]
    assert [outcome for outcome in outcomes if outcome.wrong] == []
    if kind != "allocations":
        assert any(outcome.code for outcome in outcomes)
