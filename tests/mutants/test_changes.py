"""What counts as a small change."""

import ast

import pytest

from tests.mutants.changes import mutants_of


@pytest.mark.parametrize(
    ("source", "changed"),
    [
        ("a < b", {"a <= b"}),
        ("a <= b < c", {"a < b < c", "a <= b <= c"}),
        ("a == b", {"a != b"}),
        ("x = 3", {"x = 4"}),
        ("x = 2.0", {"x = 3.0"}),
        ("x = True", {"x = False"}),
        ("a and b", {"a or b"}),
        ("a - b", {"a + b"}),
        ("x = -a", {"x = +a"}),
        ("x is None", {"x is not None"}),
    ],
)
def test_each_change_is_made_once(source: str, changed: set[str]) -> None:
    assert {m.source for m in mutants_of(source)} == changed


def test_not_is_taken_off() -> None:
    (mutant,) = mutants_of("def f(x):\n    return not x")
    made: dict = {}
    exec(mutant.source, made)  # noqa: S102
    assert (made["f"](True), made["f"](False)) == (True, False)


def test_what_no_test_can_see_stays() -> None:
    source = '"""Twice 2."""\n__all__ = ["a"]\n\n\ndef f(x: "int"):\n    """Or 3."""\n'
    assert mutants_of(source) == []


def test_every_change_is_python_and_says_where_it_is() -> None:
    found = mutants_of("x = 1\nif x > 1 or not x:\n    x = x + 2\n")
    assert [m.line for m in found] == sorted(m.line for m in found)
    assert {m.line for m in found} == {1, 2, 3}
    for mutant in found:
        ast.parse(mutant.source)
        assert " -> " in mutant.change
