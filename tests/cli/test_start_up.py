"""Commands on files start without the solvers, the compiler and the plots."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SAMPLE = ROOT / "recordings" / "sample-plain.h5"

#: Runs commands one after another with packages that cannot be imported: the first argument names
#: them, the second has the commands. A form feed stands after the texts of each.
WITHOUT = """
import json, sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in refused:
            raise RuntimeError(f"{name} is imported")

refused, commands = sys.argv[1].split(","), json.loads(sys.argv[2])
sys.meta_path.insert(0, Refuse())
from dearig.cli.main import main
for words in commands:
    sys.argv = ["dearig", *words]
    try:
        main()
        code = 0
    except SystemExit as end:
        code = end.code
    print(code, end="\\f", flush=True)
    print(end="\\f", file=sys.stderr, flush=True)
"""
SOLVERS = "scipy,numba,matplotlib,pyarrow,PySide6,nidaqmx"


def start(refused: str, *commands: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", WITHOUT, refused, json.dumps(commands)],
        capture_output=True, text=True, encoding="utf-8", check=False, timeout=200,
    )  # fmt: skip


def run(refused: str, *commands: list[str]) -> list[tuple[str, str]]:
    """Return what each of ``commands`` wrote to its two streams, with its code after the first."""
    ended = start(refused, *commands)
    assert ended.returncode == 0, ended.stderr
    texts = (stream.split("\f")[:-1] for stream in (ended.stdout, ended.stderr))
    answers = list(zip(*texts, strict=True))
    assert len(answers) == len(commands)
    return answers


def test_help_and_version_import_nothing_heavy() -> None:
    commands = [["--version"], ["--help"], ["record", "-h"], ["doctor", "-h"]]
    for words, (out, err) in zip(commands, run(f"{SOLVERS},numpy,h5py", *commands), strict=True):
        assert err == "", words
        assert out.endswith("\n0"), words
        assert "dearig" in out, words


def test_reading_watching_and_exporting_need_no_solver(tmp_path: Path) -> None:
    """A watcher stands on the computer that runs the rig."""
    sample, csv = str(SAMPLE), tmp_path / "out.csv"
    commands = [
        ["info", sample],
        ["info", "--json", "-", sample],
        ["info", "--verify", sample],
        ["watch", sample, "--once"],
        ["export", sample, "--to", "csv", "--out", str(csv)],
    ]
    answers = run(SOLVERS, *commands)
    for words, (out, err) in zip(commands, answers, strict=True):
        assert err == "", words
        assert out.endswith("\n0"), words
    about, data, checked, watched, _ = (out for out, _ in answers)
    assert "5168" in about
    assert "5168" in data
    assert "every check passed" in checked
    assert "sample-plain.h5" in watched
    assert len(csv.read_text(encoding="utf-8").splitlines()) == 5169


def test_a_package_that_is_needed_is_noticed() -> None:
    ended = start("h5py", ["info", str(SAMPLE)])
    assert ended.stdout == "1\f"
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
