"""Make files with the real programs, import each, and print what comes in.

Run as ``python -m tests.interop [NAME ...]``. Each program is installed in an environment of its
own, which is removed afterwards; Octave and sigrok-cli are used where they are installed. Every
printed command is run as it is printed: what it imports has to be right too.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import numpy as np

from dearig.recording import open_recording
from tests.interop.programs import PROGRAMS, Program
from tests.tools.command import dearig
from tests.tools.imports import octave_text

ROWS = 1200
TIME = np.round(np.arange(ROWS) * 0.005, 6)
KILOVOLTS = np.where(TIME < 2.0, 0.0, 4.0 * np.sin(np.pi * (TIME - 2.0) / 4.0) ** 2)
RUN = {"time_s": TIME, "voltage_kV": KILOVOLTS, "displacement_mm": 0.1 * KILOVOLTS**2}
_MADE = ("run.npz", "run.txt", "run.csv", "script")


def main() -> None:
    asked = set(sys.argv[1:]) or {program.name for program in PROGRAMS}
    print("| program | version | file | what comes in |\n|---|---|---|---|")
    wrong = 0
    for program in PROGRAMS:
        if program.name not in asked:
            continue
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made)
            np.savez(folder / "run.npz", **RUN)
            (folder / "run.txt").write_text(octave_text(RUN), "utf-8")
            np.savetxt(
                folder / "run.csv", np.column_stack([*RUN.values()]), "%.17g", ",",
                header=",".join(RUN), comments="",
            )  # fmt: skip
            version = write_files(program, folder)
            files = [p for p in sorted(folder.iterdir()) if p.is_file() and p.name not in _MADE]
            if not files:
                print(f"| {program.name} | {version} | | not made |", flush=True)
            for path in files:
                said = what_comes_in(path)
                wrong += said.startswith("WRONG")
                print(f"| {program.name} | {version} | `{path.name}` | {said} |", flush=True)
    sys.exit(wrong)


def write_files(program: Program, folder: Path) -> str:
    """Let ``program`` write its files into ``folder``; return its version, or why there is none."""
    (folder / "script").write_text(program.script, "utf-8")
    if program.command:
        tool = program.tool or program.command[0]
        if shutil.which(tool) is None:
            return "not installed"
        subprocess.run([*program.command, "script"], cwd=folder, check=False, capture_output=True)
        told = subprocess.run([tool, "--version"], capture_output=True, text=True, check=False)
        return next(iter(re.findall(r"\d+\.\d+[.\d]*", told.stdout)), "")
    with tempfile.TemporaryDirectory() as made:
        venv.create(made, with_pip=True)
        python = str(Path(made) / ("Scripts" if sys.platform == "win32" else "bin") / "python")
        install = [python, "-m", "pip", "install", "--quiet", *program.packages]
        if subprocess.run(install, check=False, capture_output=True).returncode:
            return "cannot be installed"
        # some programs keep settings in the home folder
        home = os.environ | {"HOME": made, "USERPROFILE": made}
        done = subprocess.run([python, "script"], cwd=folder, env=home, check=False,
                              capture_output=True, text=True)  # fmt: skip
        if done.returncode:
            print(done.stderr, file=sys.stderr)
    return program.packages[0].partition("==")[2]


def what_comes_in(path: Path) -> str:
    """Return what an import of ``path`` says, after every printed command was run as it is."""
    out = path.with_name("imported.h5")
    words: list[str] = ["import", str(path), "--out", str(out)]
    first = ""
    for _ in range(4):
        out.unlink(missing_ok=True)
        answer = dearig(*words)
        if answer.code == 0:
            said = "right" if is_right(out) else "WRONG"
            out.unlink()
            return f"{said}, by the printed command; first: {first}" if first else said
        told = answer.err.strip().replace(str(path.parent) + "/", "").replace("|", "/")
        first = first or told.removeprefix("dearig: ")
        match = re.search(r"run: dearig (import .*)$", answer.err, re.M)
        if match is None or shlex.split(match[1]) == words:
            break
        words = shlex.split(match[1])
    return f"led on: {first}"


def is_right(path: Path) -> bool:
    """Return True if the recording at ``path`` has the values of the run."""
    run = open_recording(path)
    return run.samples == ROWS and all(
        np.allclose(got, made, rtol=1e-5, atol=1e-7 * scale)
        for got, made, scale in (
            (run.time - run.time[0], TIME, 1e2),
            (run.voltage_command, 1e3 * KILOVOLTS, 1e4),
            (run.displacement, 1e-4 * KILOVOLTS**2, 1e-2),
        )
    )


if __name__ == "__main__":
    main()
