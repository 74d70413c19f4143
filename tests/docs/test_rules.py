"""The rules of CONTRIBUTING.md that a program can check, and the form of the decision records."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.docs.markdown import ROOT, documents

PRODUCT = ("app", "drivers", "model", "sim_backend")
RECORDS = sorted((ROOT / "app/docs/decisions").glob("[0-9]*.md"))
#: What a comment or docstring begins with that says why a long file or function is not split.
REASON = "One piece: "
FILE_LINES, FUNCTION_LINES, MODULES = 600, 80, 22


def sources(*folders: str) -> Iterator[tuple[Path, str]]:
    for folder in folders:
        for file in sorted((ROOT / folder).rglob("*.py")):
            yield file.relative_to(ROOT), file.read_text(encoding="utf-8")


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements in ``node``; their expressions, which are most of a tree, are left out."""
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        for child in getattr(node, name, ()):
            yield child
            yield from statements(child)


def long_functions(text: str) -> Iterator[tuple[str, int, str]]:
    """Names, lengths without signature and docstring, and first lines of long functions."""
    lines = text.splitlines()
    for node in statements(ast.parse(text)):
        if (
            isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
            and (node.end_lineno or 0) - node.lineno >= FUNCTION_LINES
        ):
            documented = ast.get_docstring(node) is not None and len(node.body) > 1
            first = node.body[1 if documented else 0]
            length = (node.end_lineno or 0) - first.lineno + 1
            if length > FUNCTION_LINES:
                yield node.name, length, "\n".join(lines[node.lineno - 1 : first.lineno])


def test_a_long_file_says_why_it_is_not_split() -> None:
    silent = [
        f"{path}: {text.count(chr(10))} lines"
        for path, text in sources(*PRODUCT, "tests", ".ci")
        if text.count("\n") > FILE_LINES and REASON not in "\n".join(text.splitlines()[:10])
    ]
    assert silent == []


def test_a_long_function_says_why_it_is_not_split() -> None:
    silent = [
        f"{path}: {name}, {length} lines"
        for path, text in sources(*PRODUCT, "tests", ".ci")
        if text.count("\n") >= FUNCTION_LINES
        for name, length, head in long_functions(text)
        if REASON not in head
    ]
    assert silent == []


def test_the_length_of_a_function_is_that_of_its_body() -> None:
    body = "\n".join(["    x = 1"] * (FUNCTION_LINES + 1))
    text = f'def long(\n    a,\n):\n    """Do it.\n\n    At length.\n    """\n    # why\n{body}\n'
    ((name, length, head),) = long_functions(text)
    assert (name, length) == ("long", FUNCTION_LINES + 1)
    assert "# why" in head
    assert not list(long_functions(text.replace("    x = 1\n", "", 1)))


def test_a_folder_of_a_package_holds_no_more_modules_than_one_can_look_through() -> None:
    modules = [path for path, _ in sources(*PRODUCT) if path.name != "__init__.py"]
    folders = {path.parent for path in modules}
    crowded = {f for f in folders if sum(path.parent == f for path in modules) > MODULES}
    assert crowded == set()


def test_ruff_refuses_what_product_code_may_not_have() -> None:
    ruff = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["ruff"]["lint"]
    assert {"BLE", "D", "E", "S", "T10"} <= set(ruff["select"])  # S101: assert; E722: bare except
    assert not {"E722", "S101", "S110"} & set(ruff["ignore"])
    relaxed = {place for place, rules in ruff["per-file-ignores"].items() if "S101" in rules}
    assert relaxed == {"tests/**", "drivers/contract/**"}


def sleeps(text: str) -> Iterator[int]:
    """Lines with a call of ``sleep`` for more than 0 s and without a comment."""
    lines = text.splitlines()
    for node in ast.walk(ast.parse(text if "sleep" in text else "")):
        if (
            isinstance(node, ast.Call)
            and getattr(node.func, "attr", getattr(node.func, "id", "")) == "sleep"
            and not (node.args and getattr(node.args[0], "value", None) == 0)
            and "#" not in lines[node.lineno - 1]
        ):
            yield node.lineno


def test_a_sleep_in_a_test_says_what_it_waits_for() -> None:
    tests = [(path, text) for path, text in sources("tests") if path.name.startswith("test_")]
    assert [f"{path}:{line}" for path, text in tests for line in sleeps(text)] == []


@pytest.mark.parametrize("file", RECORDS, ids=lambda file: file.name[:4])
def test_a_decision_record_has_its_parts_and_the_name_of_its_title(file: Path) -> None:
    title, date, text = file.read_text(encoding="utf-8").split("\n\n", 2)
    number, statement = re.fullmatch(r"# (\d+)\. (.+)", title).groups()  # type: ignore[union-attr]
    slug = re.sub(r"[^a-z0-9]+", "-", statement.lower()).strip("-")
    assert file.stem == f"{int(number):04d}-{slug}"
    assert re.match(r"20\d\d-\d\d-\d\d\b", date)
    places = [text.index(f"**{part}.**") for part in ("Context", "Decision", "Consequences")]
    assert places == sorted(places)


def test_each_number_of_a_decision_record_is_a_file_or_said_to_be_merged() -> None:
    page = (ROOT / "app/docs/decisions/README.md").read_text(encoding="utf-8")
    merged = {
        int(number)
        for row in re.findall(r"^\| ([\d, ]+) \|", page, re.MULTILINE)
        for number in row.split(", ")
    }
    kept = {int(file.name[:4]) for file in RECORDS}
    assert not merged & kept
    assert set(range(1, max(kept) + 1)) - merged - kept == {37, 39}  # never used


def test_every_result_is_named_by_a_document() -> None:
    folder = ROOT / "tests/benchmarks/results"
    text = "".join(
        (ROOT / path).read_text(encoding="utf-8")
        for path in documents()
        if not path.startswith("tests/benchmarks/results/2")
    )
    names = [file.name for file in sorted(folder.glob("2*.md"))]
    assert [name for name in names if name not in text] == []


def test_only_the_newest_result_of_each_kind_is_kept() -> None:
    kinds: dict[str, list[str]] = {}
    for file in (ROOT / "tests/benchmarks/results").glob("2*.md"):
        kinds.setdefault(re.sub(r"^[\d-]+-|-\d+$", "", file.stem), []).append(file.name)
    # two questions about measured films: branches, and energies
    assert {k: v for k, v in kinds.items() if len(v) > 1 and k != "film"} == {}


def test_readme_and_a_release_of_the_changelog_are_short() -> None:
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= 120
    releases = (ROOT / "CHANGELOG.md").read_text("utf-8").split("\n## ")[1:]
    entries = {r.splitlines()[0]: re.findall(r"^(?:- |  ).*", r, re.MULTILINE) for r in releases}
    assert {name: len(lines) for name, lines in entries.items() if len(lines) > 40} == {}
