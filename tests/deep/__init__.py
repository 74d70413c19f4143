"""The tests that need minutes: full sets of cases of which the suite runs one of each kind.

A test or a case marked ``deep`` stays next to its kind in the mirrored folders; the suite leaves it
out, and ``python -m tests.deep`` runs it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable
from typing import Any, TypeVar

import pytest
from hypothesis import settings

from tests.deep.share import VARIABLE

__all__ = ["examples", "mostly_deep", "one_of_each"]

_Test = TypeVar("_Test", bound=Callable[..., object])


def mostly_deep(cases: Iterable[Any], kept: Collection[Any]) -> list[Any]:
    """Return the parameters ``cases``, all but those in ``kept`` marked as deep.

    Parameters
    ----------
    cases : iterable
        Values for ``pytest.mark.parametrize``: of one argument, or ``pytest.param`` objects.
    kept : collection
        The ids (of ``pytest.param`` objects that have one) or values of the cases that the suite
        runs. Each has to be there: a case that was renamed must not leave the suite unnoticed.
    """
    made, found = [], set()
    for case in cases:
        given = case if hasattr(case, "marks") else pytest.param(case)
        name = given.id or (given.values[0] if len(given.values) == 1 else given.values)
        if name in kept:
            found.add(name)
            made.append(given)
        else:
            marks = [*given.marks, pytest.mark.deep]
            made.append(pytest.param(*given.values, id=given.id, marks=marks))
    if missing := set(kept) - found:
        raise ValueError(f"there are no cases {sorted(map(str, missing))}")
    return made


def one_of_each(cases: Iterable[Any], kind: Callable[[Any], object]) -> list[Any]:
    """Return the parameters ``cases``, as ``mostly_deep`` has them, the first of each kind kept."""
    given = list(cases)
    first: dict[object, Any] = {}
    for case in given:
        first.setdefault(kind(case), case)
    return mostly_deep(given, [getattr(case, "id", None) or case for case in first.values()])


def examples(full: int, suite: int) -> Callable[[_Test], _Test]:
    """Return a decorator that gives a property test ``suite`` examples, and deep runs ``full``.

    For properties whose examples are dear (whole commands) and mostly take the same branches.
    """

    def decorate(test: _Test) -> _Test:
        drawn = settings(max_examples=full if VARIABLE in os.environ else suite)(test)
        return pytest.mark.more_examples(drawn)

    return decorate
