"""A home that cannot be written: commands go on without it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from dearig.model.compiled.jit import cache_folder
from tests.tools.command import LOBE, thesis_model, write
from tests.tools.recordings import write_run

pytestmark = [
    pytest.mark.skipif(os.name == "nt", reason="the folders of a user are elsewhere"),
    # a dozen commands in processes of their own
    pytest.mark.timeout(1200),
]

HOMES = {
    "a home in which nothing can be made": {"HOME": "/proc/home"},
    "a home that is not a folder": {"HOME": "/dev/null"},
    "folders of the desktop that are none": {
        f"XDG_{name}_HOME": "/dev/null/x" for name in ("CACHE", "CONFIG", "STATE", "DATA")
    },
}


def run(home: dict[str, str], folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    clean = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("XDG_", "MPL", "NUMBA_", "DEARIG_"))
    }
    kernels = cache_folder()
    assert kernels is not None
    # compiled kernels are given, so that the test does not wait for a compilation
    given = {"NUMBA_CACHE_DIR": str(kernels.parent), "TMPDIR": str(folder.parent / "tmp"), **home}
    return subprocess.run(
        [sys.executable, "-m", "dearig", *arguments], cwd=folder, env={**clean, **given},
        capture_output=True, text=True, check=False,
    )  # fmt: skip


#: What asks for the folders of settings, cache and log only, and what makes a recording beside.
FEW = ("index .", "record lobe.toml --rig sim --out lobe.h5")
ALL = ("info run.h5", "docs --no-browser", "validate model.toml lobe.h5 --report report.html")


@pytest.mark.deep
@pytest.mark.parametrize("name", HOMES)
def test_every_command_goes_on(tmp_path: Path, name: str) -> None:
    home, most = HOMES[name], name == "a home in which nothing can be made"
    (tmp_path / "tmp").mkdir()
    work = tmp_path / "work"
    work.mkdir()
    write_run(work / "run.h5")
    thesis_model(work / "model.toml")
    write(work / "lobe.toml", LOBE)
    for command in (*FEW, *(ALL if most else ())):
        ended = run(home, work, *command.split())
        assert ended.returncode == 0, (command, ended.stderr)
        assert "Traceback" not in ended.stderr
        assert ended.stderr.count("\n") <= 1, ended.stderr
    assert not most or (work / "report.html").stat().st_size > 10_000
    doctor = run(home, work, "doctor")
    assert (doctor.returncode, "Traceback" in doctor.stderr) == (0, False)
    assert "instead of the usual folder" in " ".join(doctor.stdout.split())
    assert not (work / "~").exists()


#: Three commands in one process, in which temporary folders are no place for a cache either.
WITHOUT_A_CACHE = """
import sys
import dearig.model.compiled.trusted_folder as trusted
trusted._temporary = lambda: iter(())
from dearig.cli.main import main
for command in (["index", "."], ["doctor"], ["docs", "--no-browser"]):
    sys.argv = ["dearig", *command]
    try:
        main()
    except SystemExit as end:
        print(f"code={end.code}", flush=True)
"""


def test_without_any_place_for_a_cache_one_sentence_says_so(tmp_path: Path) -> None:
    """The kernels are then compiled in every command; here none is needed."""
    environment = {**os.environ, "XDG_CACHE_HOME": "/dev/null/x", "NUMBA_CACHE_DIR": "/dev/null/x"}
    ended = subprocess.run(
        [sys.executable, "-c", WITHOUT_A_CACHE], cwd=tmp_path, env=environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "Traceback" not in ended.stderr
    assert ended.returncode == 0, ended.stderr
    said = " ".join(ended.stdout.split())
    assert [word for word in said.split() if word.startswith("code=")] == [
        "code=0", "code=0", "code=2",
    ]  # fmt: skip
    assert "none, so every command is slower" in said
    assert "there is no folder for the pages" in ended.stderr
    assert "--out" in ended.stderr
