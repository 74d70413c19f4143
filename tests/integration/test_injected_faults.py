"""Calls of a short run that fail; ``python -m tests.faults`` makes every one of them fail."""

import pytest

from tests.crash.changes import able
from tests.faults.__main__ import Runs, chosen

pytestmark = pytest.mark.skipif(not able(), reason="needs Linux and a C compiler")


@pytest.mark.parametrize("kind", ["changes", "locks", "allocations"])
def test_a_call_that_fails_ends_in_a_sentence_and_loses_nothing(kind):
    with Runs() as runs:
        runs.run(kind, 0)  # fills the caches
        whole, calls = runs.run(kind, 0)
        assert (whole.code, whole.wrong) == (0, ())
        outcomes = [runs.run(kind, n)[0] for n in chosen(calls, 8, seed=0)]
    assert [outcome for outcome in outcomes if outcome.wrong] == []
    if kind != "allocations":
        assert any(outcome.code for outcome in outcomes)
