"""Texts with the options and commands of the command line."""

from __future__ import annotations

import ast
import itertools
from pathlib import Path

import pytest
from typer.main import get_command

from dearig.cli.main import app
from dearig.cli.output import option_name, with_hints
from dearig.errors import InputError, Note, Remedy
from tests.test_errors import ROOT, modules
from tests.tools.command import dearig


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain", "plain"),
        (Note("no area", "area_mm2"), "no area (--area-mm2)"),
        (InputError("no rate", option=("rate_Hz", "column")), "no rate (--rate-Hz, --column)"),
        (InputError("is there", option="force"), "is there, or use --force"),
        (InputError("full", option=("out", "force")), "full (--out), or use --force"),
        (InputError("cut", command=("recover", "a b.h5")), "cut (dearig recover 'a b.h5')"),
        (
            InputError(
                "no rate",
                option=("rate_Hz", "column"),
                remedy=Remedy(
                    ("import", "a b.csv"), (("out", "o.h5"), ("rate_Hz", 2.5), ("force", True))
                ),
            ),
            "no rate (--column); run: dearig import 'a b.csv' --out o.h5 --rate-Hz 2.5 --force",
        ),
        (
            InputError("open", remedy=Remedy(("import", "a"), (("table", "T"),), holes=("T", "U"))),
            "open. Put what is right for T and U, and run: dearig import a --table T",
        ),
        (
            InputError("guess", remedy=Remedy(("import", "a"), is_guess=True)),
            "guess. If this is right, or after correcting it, run: dearig import a",
        ),
        (InputError("no", command=("queue", "d"), option="skip"), "no (dearig queue d --skip)"),
    ],
)
def test_texts_name_options_and_commands(text, shown):
    assert with_hints(text) == shown


def test_an_error_of_the_command_shows_them(tmp_path):
    (tmp_path / "run.h5").write_text("text")
    answer = dearig("info", tmp_path / "run.h5")
    assert answer.code == 2
    assert answer.err.rstrip().endswith("import data of other programs (dearig import)")


def hinted(keyword: str, folder: Path = ROOT) -> set[str]:
    """Texts, or keys, that modules in ``folder`` below the faces give as ``keyword`` of a call."""
    return {
        constant.value
        for path in modules()
        if path.is_relative_to(folder)
        and f"{keyword}=" in (text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.keyword) and node.arg == keyword
        for part in (node.value.keys if isinstance(node.value, ast.Dict) else [node.value])
        for constant in itertools.islice(ast.walk(part), 20)
        if isinstance(constant, ast.Constant) and isinstance(constant.value, str)
    }


def test_every_option_of_a_hint_is_one_of_a_command():
    commands = get_command(app).commands.values()
    known = {option for command in commands for p in command.params for option in p.opts}
    given = hinted("option") | hinted("answers")
    assert {"rig_file", "resume"} <= given
    assert {option_name(name) for name in given} <= known


def test_every_command_of_a_hint_is_there():
    found = {name for name in hinted("command") if name in get_command(app).commands}
    assert {"import", "hold", "recover", "watch"} <= found
