"""Commands on files start without the solvers, the compiler and the plots."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SAMPLE = ROOT / "recordings" / "sample-plain.h5"

#: Runs the command with packages that cannot be imported: the first argument names them.
WITHOUT = """
import sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in refused:
            raise RuntimeError(f"{name} is imported")

refused = sys.argv.pop(1).split(",")
sys.meta_path.insert(0, Refuse())
from dearig.cli.main import main
main()
"""
SOLVERS = "scipy,numba,matplotlib,pyarrow,PySide6,nidaqmx"


def run(refused: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", WITHOUT, refused, *arguments],
        capture_output=True, text=True, encoding="utf-8", check=False, timeout=200,
    )  # fmt: skip


@pytest.mark.parametrize(
    "arguments", [["--version"], ["--help"], ["record", "-h"], ["doctor", "-h"]]
)
def test_help_and_version_import_nothing_heavy(arguments: list[str]) -> None:
    ended = run(f"{SOLVERS},numpy,h5py", *arguments)
    assert ended.stderr == ""
    assert ended.returncode == 0
    assert "dearig" in ended.stdout


@pytest.mark.parametrize("arguments", [["info"], ["info", "--json", "-"], ["info", "--verify"]])
def test_info_needs_no_solver(arguments: list[str]) -> None:
    ended = run(SOLVERS, *arguments, str(SAMPLE))
    assert ended.stderr == ""
    assert ended.returncode == 0
    assert "5168" in ended.stdout or "every check passed" in ended.stdout


def test_watching_needs_no_solver() -> None:
    """A watcher stands on the computer that runs the rig."""
    ended = run(SOLVERS, "watch", str(SAMPLE), "--once")
    assert ended.stderr == ""
    assert "sample-plain.h5" in ended.stdout


def test_export_to_csv_needs_no_solver(tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    ended = run(SOLVERS, "export", str(SAMPLE), "--to", "csv", "--out", str(out))
    assert ended.stderr == ""
    assert len(out.read_text(encoding="utf-8").splitlines()) == 5169


def test_a_package_that_is_needed_is_noticed() -> None:
    ended = run("h5py", "info", str(SAMPLE))
    assert ended.returncode == 1
    assert "h5py is imported" in ended.stderr


def test_a_run_needs_no_filters_of_images() -> None:
    """``scipy`` itself is small: numba imports it, and its parts are loaded when they are used."""
    code = (
        "import sys, dearig.acquisition.overlay, dearig.acquisition.run, "
        "dearig.analysis.readings.compatibility; "
        "print(*sorted(m for m in sys.modules if m.count('.') == 1))"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=200
    )
    loaded = set(ended.stdout.split())
    assert "numba.core" in loaded
    assert not loaded & {f"scipy.{part}" for part in ("fft", "ndimage", "signal", "special")}
