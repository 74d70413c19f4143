"""The scripts of ``findings/`` have their form. They install packages, so they are run by hand."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.docs.markdown import ROOT, links

SCRIPTS = sorted((ROOT / "findings").glob("*.sh"))
#: Beginnings of the lines of a header, after the title.
HEADER = ("# Expected: ", "# Seen: ", "# Version", "# Who is hurt: ")


def test_the_page_lists_every_script() -> None:
    listed = [link for link in links("findings/README.md") if link.endswith(".sh")]
    assert listed == [script.name for script in SCRIPTS]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_script_says_what_it_shows_and_stands_alone(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    lines = text.splitlines()
    header = lines[1 : lines.index("set -euo pipefail")]
    assert lines[0] == "#!/usr/bin/env bash"
    assert all(line.startswith("#") for line in header)
    for beginning in HEADER:
        assert sum(line.startswith(beginning) for line in header) == 1, beginning
    assert "folder=$(mktemp -d)\ntrap 'rm -rf \"$folder\"' EXIT\n" in text
    assert not re.search(r"dearig|://|/work/|/tmp/|/home/|/root/", text)
    if bash := shutil.which("bash"):
        subprocess.run([bash, "-n", str(script)], check=True)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_script_pins_each_package_that_it_installs(script: Path) -> None:
    text = script.read_text(encoding="utf-8").replace("\\\n", " ")
    installs = re.findall(r"(?:pip|npm) install (.*)", text)
    packages = [word for line in installs for word in line.split() if not word.startswith("--")]
    assert packages
    for package in packages:
        assert re.fullmatch(r'"[\w.-]+(\[\w+\])?==[\w.]+"|\w+@[\d.]+', package), package
