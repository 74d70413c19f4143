"""Time and memory of importing a CSV file of three million rows, compared with pandas and pyarrow.

Run as ``python -m tests.benchmarks.bench_import [--rows N]``. Each reading is a process of its own.
Other programs use the machine too: the least of some runs is printed, and medians of ratios to
pandas and pyarrow within a round, of the time on the clock and of the time of all processors.
Memory is the largest resident size less that of the same process before it reads, in multiples of
the columns as float64.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

#: Rows of the file that is read first, which imports what reading needs.
WARM = 10_000
COLUMNS = ("time_s", "voltage_V", "displacement_mm")


def write(path: Path, rows: int) -> None:
    """Write a file of a kilohertz rig: zero, then a triangle, with the laser's noise."""
    rng = np.random.default_rng(1)
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(COLUMNS) + "\n")
        for first in range(0, rows, 10**5):
            n = np.arange(first, min(first + 10**5, rows))
            volts = np.where(n < 2000, 0.0, 6000.0 * np.abs((n / 1000.0) % 2.0 - 1.0))
            moved = 0.1 * (volts / 1e3) ** 2 + rng.normal(0.0, 1e-3, n.size)
            lines = zip((n / 1e3).tolist(), volts.tolist(), moved.tolist(), strict=True)
            file.write("".join(f"{t:.3f},{v:.4f},{d:.6f}\n" for t, v, d in lines))


def spoil(path: Path, out: Path) -> None:
    """Copy a file with a wrong cell in its last row."""
    content = path.read_bytes()
    out.write_bytes(content[: content.rstrip().rfind(b",") + 1] + b"OVER\n")


def read_pandas(path: Path) -> None:
    import pandas as pd

    pd.read_csv(path)


def read_pyarrow(path: Path) -> None:
    from pyarrow import csv

    csv.read_csv(path, read_options=csv.ReadOptions(use_threads=False))


def read_columns(path: Path) -> None:
    from dearig.recording.importers.formats.text_file import TextFile

    TextFile(path).read(COLUMNS)


def read_import(path: Path) -> None:
    from dearig.errors import InputError
    from dearig.recording import import_file

    try:
        import_file(path, path.with_suffix(".h5"), overwrite=True)
    except InputError as error:
        print(error, file=sys.stderr)


READERS = {
    "pandas.read_csv": read_pandas,
    "pyarrow, one thread": read_pyarrow,
    "columns of the import": read_columns,
    "import to a recording": read_import,
}


REFERENCES = ("pandas.read_csv", "pyarrow, one thread")


def _resident(line: str) -> int:
    """Return a memory size of this process in bytes, VmRSS or VmHWM."""
    text = Path("/proc/self/status").read_text("utf-8")
    return 1024 * int(next(row for row in text.splitlines() if row.startswith(line)).split()[1])


def measure(name: str, path: Path, warm: Path) -> None:
    """Read ``path`` and print the time in s and the memory in bytes that it takes."""
    READERS[name](warm)  # imports, and compiles what is compiled
    before, began, used = _resident("VmRSS"), time.perf_counter(), time.process_time()
    READERS[name](path)
    took, used = time.perf_counter() - began, time.process_time() - used
    print(took, used, _resident("VmHWM") - before)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=3_000_000)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--measure", nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.measure:
        name, path, warm = asked.measure
        measure(name, Path(path), Path(warm))
        return
    with tempfile.TemporaryDirectory(dir=asked.folder) as made:
        whole, spoilt, warm = (Path(made) / f"{n}.csv" for n in ("whole", "spoilt", "warm"))
        write(whole, asked.rows)
        write(warm, WARM)
        spoil(whole, spoilt)
        columns = 8 * len(COLUMNS) * asked.rows
        print(f"{asked.rows:,} rows, {whole.stat().st_size / 1e6:.0f} MB, {asked.repeats} rounds")
        readings = [(name, name, whole) for name in READERS]
        readings.append(("import, last cell wrong", "import to a recording", spoilt))
        found: dict[str, list[list[float]]] = {label: [] for label, _, _ in readings}
        wrong = ""
        for _ in range(asked.repeats):
            for label, name, path in readings:
                run = subprocess.run(
                    [sys.executable, "-m", "tests.benchmarks.bench_import", "--measure", name,
                     str(path), str(warm)],
                    capture_output=True, text=True, check=True,
                )  # fmt: skip
                found[label].append([float(word) for word in run.stdout.split()])
                wrong = run.stderr.strip().partition(";")[0].rpartition("/")[2] or wrong
        for label, runs in found.items():
            report(label, np.array(runs), {n: np.array(found[n]) for n in REFERENCES}, columns)
        print(wrong)


def report(label: str, runs: np.ndarray, references: dict[str, np.ndarray], columns: int) -> None:
    """Print the least time and memory of ``runs``, and medians of their ratios to ``references``.

    A ratio is between two readings of one round, which met the same load of the machine.
    """
    took, cpu, memory = runs.min(axis=0)
    ratios = []
    for name, other in references.items():
        clock, processors = np.median(runs[:, :2] / other[:, :2], axis=0)
        ratios.append(f"{clock:4.2f} and {processors:4.2f} of {name}")
    print(
        f"{label:24} {took:5.2f} s, {cpu:5.2f} s of processors, {memory / columns:4.2f} x the "
        f"columns; {'; '.join(ratios)}",
        flush=True,
    )


if __name__ == "__main__":
    main()
