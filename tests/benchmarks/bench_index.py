"""How long ``dearig index`` takes on many recordings, the first time and again.

Run as ``python -m tests.benchmarks.bench_index [--files N]``.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path

from dearig.recording.index import index_folder
from tests.tools.recordings import run_counts, write_run


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=10_000)
    parser.add_argument("--folder", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=asked.folder) as made:
        shelf, cache = Path(made) / "shelf", Path(made) / "cache.json"
        for day in range(-(-asked.files // 100)):
            (shelf / f"day-{day:03d}").mkdir(parents=True)
        first = shelf / "day-000" / "run-0000.h5"
        write_run(first, run_counts(200, quiet=100))
        for n in range(1, asked.files):
            shutil.copyfile(first, shelf / f"day-{n // 100:03d}" / f"run-{n:04d}.h5")
        for what in ("first", "again", "again"):
            before = time.perf_counter()
            found = index_folder(shelf, cache=cache)
            took = time.perf_counter() - before
            print(f"{what}: {len(found)} recordings in {took:.2f} s", flush=True)
        (shelf / "day-000" / "run-0000.h5").touch()
        before = time.perf_counter()
        index_folder(shelf, cache=cache)
        print(f"one changed: {time.perf_counter() - before:.2f} s")


if __name__ == "__main__":
    main()
