"""Write what a benchmark prints into a dated file of this folder.

Run as ``python -m tests.benchmarks.results NAME [-- ARGUMENTS]``. ``NAME`` is one of the names
that ``--list`` shows; ``ARGUMENTS`` replace those of its commands. The file, such as
``2026-11-26-kernel.md``, has the date, the machine, the versions, the commands and their output.
"""

from __future__ import annotations

import argparse
import datetime
import importlib.metadata
import itertools
import os
import platform
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent
ROOT = FOLDER.parents[2]
#: Distributions whose versions change figures.
DISTRIBUTIONS = (
    "dearig",
    "nidaqmx",
    "numpy",
    "scipy",
    "numba",
    "h5py",
    "pandas",
    "pyarrow",
    "pyside6-essentials",
    "pyqtgraph",
)


#: In a command: a folder that is removed afterwards.
SCRATCH = "DIR"


@dataclass(frozen=True)
class Measurement:
    """A title, and the commands (modules with arguments) that print its tables."""

    title: str
    commands: tuple[str, ...]


MEASUREMENTS = {
    "tests": Measurement(
        "What the tests cost and notice",
        ("tests.benchmarks.bench_suite b2a0705 HEAD", "tests.mutants --count 8 --seed 1"),
    ),
    "kernel": Measurement(
        "Speed of the model's kernel",
        ("tests.benchmarks.bench_kernel",),
    ),
    "identification": Measurement(
        "Speed and recovery of the identification",
        ("tests.benchmarks.bench_identify", "tests.benchmarks.bench_recovery"),
    ),
    "coverage": Measurement(
        "How often the 95 % intervals hold the truth",
        (
            "tests.benchmarks.bench_coverage --rigs 100",
            "tests.benchmarks.bench_coverage --rigs 40 --rate 200 --diagnose",
            "tests.benchmarks.bench_slow_noise",
        ),
    ),
    "bands": Measurement(
        "How often the 95 % bands of predictions hold unseen recordings",
        (f"tests.benchmarks.bench_bands --folder {SCRATCH}",),
    ),
    "rig": Measurement(
        "Speed of the simulated rig, and long runs on the simulated card",
        (
            "tests.benchmarks.bench_rig_speed",
            "tests.benchmarks.bench_daqmx stream",
            "tests.benchmarks.bench_daqmx hour",
        ),
    ),
    "averaging": Measurement(
        "Noise and cost of rows that are means of conversions",
        ("tests.benchmarks.bench_averaging", "tests.benchmarks.bench_averaging --cost"),
    ),
    "plan": Measurement(
        "Processor time and memory of long runs", ("tests.benchmarks.bench_plan --full",)
    ),
    "batch": Measurement(
        "Campaigns that are killed, many runs in one process, and studies that lose their cluster",
        ("tests.benchmarks.bench_campaign", "tests.benchmarks.bench_study"),
    ),
    "watchers": Measurement(
        "A campaign whose watchers are killed", ("tests.benchmarks.bench_watchers",)
    ),
    "trends": Measurement(
        "Trends of many recordings, and the schedule of a study on many workers",
        (
            "tests.benchmarks.bench_trends --campaigns 400",
            "tests.benchmarks.bench_trends --fitted 8",
            "tests.benchmarks.bench_index",
            "tests.benchmarks.bench_schedule",
        ),
    ),
    "soak": Measurement(
        "What a server and a program that runs for long keep", ("tests.benchmarks.bench_soak",)
    ),
    "recordings": Measurement(
        "Cost of recording, and of reading recordings",
        (
            "tests.benchmarks.bench_recording",
            "tests.benchmarks.bench_index",
            "tests.crash replay --torn --blocks 24",
            "tests.crash kills",
            "tests.fuzz --inputs 1050000",
        ),
    ),
    "import": Measurement(
        "Time and memory of importing a large CSV file", ("tests.benchmarks.bench_import",)
    ),
    "window": Measurement("Drawing speed of the window", ("tests.benchmarks.bench_window",)),
    "stop": Measurement("Time until STOP is heard during a run", ("tests.benchmarks.bench_stop",)),
    "ni-component-tests": Measurement(
        "NI's own tests of its library, against the simulated card",
        ("tests.benchmarks.bench_ni_component_tests --source nidaqmx-python",),
    ),
    "campaign": Measurement(
        "Runs that are made to fail", (f"tests.campaign --seeds 20 --out {SCRATCH}",)
    ),
    "diagnosis-blind": Measurement(
        "Blind test of the diagnosis",
        (
            "tests.blind --first 2001 --cases 60 --clean 0 --train thesis --jobs 1",
            "tests.blind --first 2201 --cases 40 --clean 0 --train rich --jobs 1",
            "tests.blind --cases 0 --clean 50 --train thesis --jobs 2",
        ),
    ),
    "misses": Measurement(
        "Where the error of the rigs comes from that the diagnosis misses",
        (
            "tests.benchmarks.bench_misses --rows misses.jsonl --first 244000 --rigs 100",
            "tests.benchmarks.bench_misses --rows misses.jsonl --first 244000 --rigs 100 "
            "--generator second",
        ),
    ),
    "other-makers": Measurement(
        "Rigs of a third maker, in forms that neither generator has",
        ("tests.benchmarks.bench_other_makers",),
    ),
    "diagnosis-peers": Measurement(
        "The diagnosis beside general methods",
        ("tests.benchmarks.bench_diagnosis --train thesis --seeds 2003,79,225",),
    ),
    "track": Measurement(
        "Following a path beside a PID loop and learning without a model",
        ("tests.benchmarks.bench_track",),
    ),
    "learning": Measurement(
        "What each number of the learning is worth", ("tests.benchmarks.bench_learning",)
    ),
    "inversion": Measurement(
        "How near the film comes under the computed voltage", ("tests.benchmarks.bench_inversion",)
    ),
    "hold": Measurement(
        "Holding a displacement for an hour, beside the feedforward alone",
        ("tests.benchmarks.bench_hold",),
    ),
    "ni-examples": Measurement(
        "Example programs of nidaqmx-python on the simulated card",
        ("tests.benchmarks.bench_ni_examples --source FOLDER",),
    ),
    "film": Measurement("Diagnosis of a measured film", ("tests.benchmarks.bench_film",)),
    "springs": Measurement("Strain energies of silicones", ("tests.benchmarks.bench_springs",)),
}


def main() -> None:
    parser = argparse.ArgumentParser(description="Write a benchmark's output into a dated file.")
    parser.add_argument("name", nargs="?", choices=sorted(MEASUREMENTS), help="what to measure")
    parser.add_argument("--list", action="store_true", help="show the names and their commands")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder for the file")
    parser.add_argument("arguments", nargs="*", help="replace the arguments of the commands")
    asked = parser.parse_args()
    if asked.list or asked.name is None:
        for name, measurement in MEASUREMENTS.items():
            print(f"{name}: {measurement.title}")
            for command in measurement.commands:
                print(f"    python -m {command}")
        return
    measurement = MEASUREMENTS[asked.name]
    today = datetime.datetime.now(tz=datetime.UTC).date()
    parts = [header(measurement.title, today)]
    for command in measurement.commands:
        words = shlex.split(command)
        if asked.arguments:
            words = [words[0], *asked.arguments]
        with tempfile.TemporaryDirectory() as scratch:
            run = [scratch if word == SCRATCH else word for word in words]
            done = subprocess.run(
                [sys.executable, "-m", *run],
                cwd=ROOT,
                stdout=subprocess.PIPE,
                text=True,
                check=False,
            )
        parts.append(f"## `python -m {shlex.join(words)}`\n\n{as_markdown(done.stdout)}")
        if done.returncode:
            parts.append(f"The command ended with exit code {done.returncode}.")
    path = asked.out / f"{today.isoformat()}-{asked.name}.md"
    path.write_text("\n\n".join(parts) + "\n", encoding="utf-8", newline="\n")
    print(path)


def header(title: str, today: datetime.date) -> str:
    """Title, date, machine and versions."""
    versions = ", ".join(
        f"{name} {importlib.metadata.version(name)}" for name in DISTRIBUTIONS if _installed(name)
    )
    revision = subprocess.run(
        ["git", "describe", "--always", "--dirty"],
        cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False,
    ).stdout.strip()  # fmt: skip
    return (
        f"# {title}\n\n"
        f"- date: {today.isoformat()}\n"
        f"- revision: {revision or 'unknown'}\n"
        f"- machine: {os.cpu_count()} cores, {platform.machine()}, {platform.system()}\n"
        f"- versions: Python {platform.python_version()}, {versions}"
    )


def as_markdown(printed: str) -> str:
    """What a command printed: its Markdown tables as they are, all other lines as plain text."""
    parts = []
    for is_table, lines in itertools.groupby(
        printed.strip().splitlines(), lambda line: line.startswith("|")
    ):
        text = "\n".join(lines).strip("\n")
        if text.strip():
            parts.append(text if is_table else f"```text\n{text}\n```")
    return "\n\n".join(parts) or "It printed nothing."


def _installed(name: str) -> bool:
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


if __name__ == "__main__":
    main()
