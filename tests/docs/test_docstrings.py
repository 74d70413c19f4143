"""The public docstrings, which a notebook shows: numpydoc sections that agree with the code."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import dearig

FUNCTIONS = {
    name: getattr(dearig, name)
    for name in dearig.__all__
    if inspect.isfunction(getattr(dearig, name))
}


def methods() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Public methods of the classes of the interface that are written in ``dearig.api``."""
    for name in dearig.__all__:
        kind = getattr(dearig, name)
        if not (inspect.isclass(kind) and kind.__module__.startswith("dearig.api")):
            continue
        for key, member in vars(kind).items():
            method = inspect.unwrap(getattr(member, "__func__", member))
            if inspect.isfunction(method) and not key.startswith("_"):
                yield f"{name}.{key}", method


METHODS = dict(methods())


def sections(described: Callable[..., Any]) -> dict[str, str]:
    """Sections of a docstring by name; the summary has the name ""."""
    parts = re.split(r"^(\w+)\n-{3,}\n", inspect.getdoc(described) or "", flags=re.MULTILINE)
    return {"": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


def documented(section: str) -> list[str]:
    """Names that a section of parameters describes."""
    lines = re.findall(r"^(\*{0,2}\w[\w, *]*)(?: :.*)?$", section, re.MULTILINE)
    return [name.strip("* ") for line in lines for name in line.split(",")]


@pytest.mark.parametrize("name", [*FUNCTIONS, *METHODS])
def test_a_docstring_has_the_parameters_of_the_code(name: str) -> None:
    described = FUNCTIONS.get(name) or METHODS[name]
    found = sections(described)
    parameters = [p for p in inspect.signature(described).parameters if p not in ("self", "cls")]
    assert documented(found.get("Parameters", "")) == parameters
    assert found["Returns"].strip()
    order = ["Parameters", "Returns", "Raises", "Examples"]
    assert [s for s in order if s in found] == [s for s in found if s]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_raises_and_shows_a_call(name: str) -> None:
    found = sections(FUNCTIONS[name])
    assert "InputError\n" in found["Raises"]
    code = "\n".join(re.findall(r"^>>> (.*)$", found["Examples"], re.MULTILINE))
    calls = [node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.Call)]
    named = {n.func.attr: n for n in calls if isinstance(n.func, ast.Attribute)}
    given = [k.arg for k in named[name].keywords]
    inspect.signature(FUNCTIONS[name]).bind(*named[name].args, **dict.fromkeys(given))


def test_public_classes_have_methods_that_are_checked() -> None:
    assert {"Recording.save", "Sequence.add", "Model.open", "DiagnoseResult.plot"} <= set(METHODS)
