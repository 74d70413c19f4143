"""The documents are true: links lead somewhere, commands exist and run, examples are accepted."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest
from typer.main import get_command

from dearig.cli.main import app
from dearig.config.campaignfile import parse_campaign
from dearig.config.modelfile import load_model
from dearig.config.parameterfile import constraints_of, stated_of
from dearig.config.rigfile import load_rig_file
from dearig.config.segments import SEGMENT_KINDS
from dearig.config.sequencefile import parse_sequence
from dearig.config.targetfile import parse_target
from dearig.docs import pages
from dearig.docs.site import anchors
from dearig.model.film.material import Branch, Network, Spring
from dearig.model.simulation.strip import Strip
from tests.deep import mostly_deep
from tests.docs import reference
from tests.docs.markdown import (
    ROOT,
    Block,
    blocks,
    documents,
    inline_code,
    inline_commands,
    links,
)
from tests.tools.command import done, write

#: Pages whose commands are run in the order shown, in one folder for each page.
RUN = [p for p in documents() if p.startswith("app/docs/") or "/" not in p]
#: Options of ``dearig`` itself.
GENERAL = {"--help", "-h", "--version", "--install-completion", "--show-completion"}
COMMANDS: dict[str, Any] = get_command(app).commands  # type: ignore[attr-defined]


def is_history(path: str) -> bool:
    """Whether a document tells of former states: its names need not exist any more."""
    return path == "CHANGELOG.md" or "/results/2" in path


def of_language(*names: str) -> list[Block]:
    return [b for path in documents() for b in blocks(path) if b.language in names]


@pytest.mark.parametrize("path", documents())
def test_every_link_and_anchor_resolves(path: str) -> None:
    broken = []
    for link in links(path):
        if re.match(r"[a-z][a-z0-9+.-]*:", link):
            continue
        where, _, anchor = unquote(link).partition("#")
        file = (ROOT / path).parent / where if where else ROOT / path
        if file.is_dir():
            file /= "README.md"
        if not file.exists() or (anchor and anchor not in anchors(file.read_text("utf-8"))):
            broken.append(link)
    assert broken == []


@pytest.mark.parametrize("page", [page.path for page in pages()])
def test_a_packaged_page_shows_no_picture_from_outside_the_package(page: str) -> None:
    packaged = tuple(ROOT / name for name in ("app", "drivers", "model", "sim_backend"))
    for link in links(page):
        if link.endswith((".png", ".svg")):
            picture = ((ROOT / page).parent / link).resolve()
            assert any(picture.is_relative_to(folder) for folder in packaged), link


@pytest.mark.parametrize("block", of_language("sh", "console"), ids=str)
def test_every_command_shown_is_accepted(block: Block) -> None:
    for words in block.commands:
        accept(words)


@pytest.mark.parametrize("path", documents())
def test_every_command_within_a_line_exists(path: str) -> None:
    for text in inline_commands(path):
        name, *words = text.removeprefix("dearig ").split()
        if name in GENERAL:
            continue
        assert name in COMMANDS, text
        known = {"--help", "-h"}
        for parameter in COMMANDS[name].params:
            known.update(parameter.opts, parameter.secondary_opts)
        options = [w.split("=")[0] for w in words if re.match(r"--?[a-z]", w)]
        assert [o for o in options if o not in known] == [], text


#: Files that an example tells the reader to write, or that stand for files of the reader.
EXAMPLES = {
    *("acme.py", "app.py", "conftest.py", "drivers.py", "fading_drag.py", "model.py"),
    *("numbers.py", "queue.py", "sawtooth.py", "spaced.py", "test_acme.py", "test_sawtooth.py"),
}


@pytest.mark.parametrize("path", [p for p in documents() if not is_history(p)])
def test_every_file_and_folder_named_in_a_line_exists(path: str) -> None:
    missing = [
        text
        for text in inline_code(path)
        if re.fullmatch(r"[\w./-]+\.py" if "README" not in path else r"[\w./-]+(\.py|/)", text)
        and text.split("/")[-1] not in EXAMPLES
        and not text.startswith(("/", ".", "../shared"))
        and not is_named(text.rstrip("/"), (ROOT / path).parent)
    ]
    assert missing == []


@pytest.mark.parametrize("path", [p for p in documents() if p.endswith("README.md")])
def test_every_module_in_a_table_of_modules_exists(path: str) -> None:
    text = (ROOT / path).read_text(encoding="utf-8")
    for table in re.findall(r"^\| module \|.*\n\|[-|]+\n((?:\|.*\n)+)", text, re.MULTILINE):
        names = re.findall(r"`([\w./]+)`", "".join(r.split("|")[1] for r in table.splitlines()))
        folder = (ROOT / path).parent
        missing = [n for n in names if not is_named(n.removesuffix("/"), folder)]
        missing = [n for n in missing if not is_named(f"{n}.py", folder)]
        assert names
        assert missing == []


@cache
def repository() -> frozenset[str]:
    """All sources and folders of sources, as paths that begin with a slash."""
    roots = [ROOT / name for name in ("app", "drivers", "model", "sim_backend", "tests", ".ci")]
    files = {file for root in roots for file in root.rglob("*.py")}
    folders = {folder for file in files for folder in file.parents if folder.is_relative_to(ROOT)}
    return frozenset(f"/{p.relative_to(ROOT).as_posix()}" for p in files | folders)


def is_named(name: str, folder: Path) -> bool:
    """Whether a file of this name is in the folder, or the end of a path in the repository."""
    return (folder / name).exists() or any(p.endswith(f"/{name}") for p in repository())


def accept(words: list[str]) -> None:
    """Fail unless the command exists and takes these arguments."""
    shown = " ".join(words)
    if words[0] == "dearig":
        if words[1] in GENERAL:
            return
        assert words[1] in COMMANDS, f"{shown}: there is no such command"
        COMMANDS[words[1]].make_context(words[1], words[2:])
    elif words[:2] == ["python", "-m"] and words[2].startswith(("tests.", "dearig")):
        assert importlib.util.find_spec(words[2]), f"{shown}: there is no such module"
    elif words[0].startswith("python") and words[1].endswith(".py"):
        assert (ROOT / words[1]).is_file(), f"{shown}: there is no such file"


@pytest.mark.parametrize("block", of_language("toml"), ids=str)
def test_every_toml_example_is_accepted(block: Block, tmp_path: Path) -> None:
    accept_toml(block.text, tmp_path)


#: A model with all springs that examples of parameter files name.
KNOWN = Strip(Network(Spring(1e5, 1e4), tuple(Branch(Spring(1e5, 1e4), 1.0) for _ in range(3))))


def accept_toml(text: str, folder: Path) -> None:
    """Fail unless the reader that such a file is for takes it."""
    content = tomllib.loads(text)
    keys = {key for table in content.get("segment", ()) for key in table}
    if "mu_0_kPa" in content:
        assert constraints_of(stated_of(content), [KNOWN], with_effects=True)
    elif any(key.endswith("_mm") for key in keys):
        parse_target(text, "example", folder)
    elif "segment" in content and "name" not in content:  # a part of a sequence
        for table in content["segment"]:
            SEGMENT_KINDS[table["kind"]].model_validate(table)
    elif "segment" in content:
        parse_sequence(text, "example", folder)
    elif "sequence" in content:
        parse_campaign(text, "example", folder)
    elif content.get("format", "").startswith("dearig-model/"):
        load_model(write(folder / "model.toml", text))
    elif not {"project", "tool"} & set(content):  # those are parts of a pyproject.toml
        load_rig_file(write(folder / "rig.toml", text))


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    mostly_deep(
        [p for p in RUN if any(b.language == "sh" for b in blocks(p))],
        ["README.md", "app/docs/tutorial.md"],
    ),
)
def test_commands_run_in_the_order_shown(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for block in blocks(path):
        if block.language == "sh" and not block.reason:
            for words in block.commands:
                assert words[0] == "dearig", f"{block}: say why {words[0]} is not run"
                done(*words[1:])


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    mostly_deep(
        [p for p in RUN if any(b.language == "python" for b in blocks(p))],
        ["app/docs/how-to/notebook.md"],
    ),
)
def test_python_examples_run(path: str, tmp_path: Path) -> None:
    code = "\n".join(b.text for b in blocks(path) if b.language == "python" and not b.reason)
    ran = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr


@pytest.mark.parametrize("block", [b for b in of_language("python") if b.path in RUN], ids=str)
def test_every_python_example_uses_names_that_exist(block: Block) -> None:
    tree = ast.parse(block.text)
    for node in ast.walk(tree):
        owner = node.value if isinstance(node, ast.Attribute) else None
        if isinstance(owner, ast.Name) and owner.id == "dearig":
            assert hasattr(importlib.import_module("dearig"), node.attr), node.attr


@pytest.mark.parametrize("name", reference.PAGES)
def test_reference_pages_are_what_the_code_says(name: str) -> None:
    page: Callable[[], str] = reference.PAGES[name]
    kept = (reference.FOLDER / name).read_text(encoding="utf-8")
    assert kept == page(), "run python -m tests.docs.reference"


def test_every_json_format_is_on_the_page() -> None:
    written = {
        found
        for source in (ROOT / "app").rglob("*.py")
        for found in re.findall(r'"format": "(dearig-[a-z]+/\d+)"', source.read_text("utf-8"))
    }
    page = (reference.FOLDER / "json.md").read_text(encoding="utf-8")
    assert written
    assert [name for name in sorted(written) if f"`{name}`" not in page] == []


def test_new_imports_of_the_changelog_exist() -> None:
    table = (ROOT / "CHANGELOG.md").read_text("utf-8").partition("| old | new |")[2]
    new = re.findall(r"`(dearig(?:\.[a-z_]+)+)`", table)
    assert len(new) > 10
    assert [name for name in new if importlib.util.find_spec(name) is None] == []


def test_no_block_is_left_out_without_a_reason() -> None:
    for path in RUN:
        for block in blocks(path):
            assert block.language, f"{block}: name the language of the block"
