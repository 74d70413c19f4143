"""Errors and notes: what they say, what they are about, and that they know no face."""

from __future__ import annotations

import ast
import pickle
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from dearig.errors import InputError, InstrumentFault, Note, hints_of, noted

ROOT = Path(__file__).parents[1]
#: Where texts are worded for the person who reads them there.
FACES = ("app/cli/", "app/window/", "app/api/", "app/command_line.py")
OPTION = re.compile(r"--[a-z]")


def modules() -> Iterator[Path]:
    for top in ("app", "drivers", "model", "sim_backend"):
        for path in sorted((ROOT / top).rglob("*.py")):
            if not path.relative_to(ROOT).as_posix().startswith(FACES):
                yield path


def literals(tree: ast.Module) -> Iterator[ast.Constant]:
    """Every text of a module that is not a docstring."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docs = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            yield node


def of_another_program(tree: ast.Module, text: str) -> bool:
    """Whether ``text`` is one argument, in a module that starts other programs."""
    starts = any(
        isinstance(node, ast.Import) and any(name.name == "subprocess" for name in node.names)
        for node in ast.walk(tree)
    )
    return starts and re.fullmatch(r"--[a-z0-9-]+(=.*)?", text) is not None


def test_no_text_below_the_faces_holds_an_option_of_the_command():
    found = []
    for path in modules():
        text = path.read_text(encoding="utf-8")
        if "--" not in text:
            continue
        tree = ast.parse(text)
        found += [
            f"{path.relative_to(ROOT)}:{node.lineno}: {node.value}"
            for node in literals(tree)
            if OPTION.search(node.value) and not of_another_program(tree, node.value)
        ]
    assert found == []


def test_an_option_in_a_text_would_be_found():
    tree = ast.parse('"""--doc"""\ndef f():\n    """--doc"""\n    raise E(f"{x}: give --area-mm2")')
    assert [node.value for node in literals(tree) if OPTION.search(node.value)] == [
        ": give --area-mm2"
    ]


@pytest.mark.parametrize(
    "text", [InputError("no area", option="area_mm2"), Note("no area", "area_mm2")]
)
def test_a_text_names_what_it_is_about_also_in_another_process(text):
    for each in (text, pickle.loads(pickle.dumps(text))):  # noqa: S301  (made here)
        assert str(each) == "no area"
        assert each.options == ("area_mm2",)
        assert each.command == ()


def test_hints_of_an_error_are_found_after_it_was_raised_again():
    first = InputError("one", option=("a", "b"))
    with pytest.raises(InstrumentFault) as second:
        raise InstrumentFault(f"two: {first}", command=("recover", "x.h5")) from first
    assert [(hint.options, hint.command) for hint in hints_of(second.value)] == [
        ((), ("recover", "x.h5")),
        (("a", "b"), ()),
    ]


def test_an_error_for_another_process_keeps_all_its_hints():
    first = InputError("one", option=("a", "b"))
    with pytest.raises(InstrumentFault) as second:
        raise InstrumentFault("two", option="c", command=("recover", "x.h5")) from first
    note = pickle.loads(pickle.dumps(noted(second.value)))  # noqa: S301  (made here)
    assert (note, note.options, note.command) == ("two", ("c", "a", "b"), ("recover", "x.h5"))


def test_a_text_without_hints_has_none():
    assert hints_of("text") == hints_of(InputError("text")) == hints_of(ValueError("text")) == []
