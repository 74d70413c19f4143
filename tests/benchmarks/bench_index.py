"""How long ``dearig index`` takes on many recordings, the first time and again; and their trends.

Run as ``python -m tests.benchmarks.bench_index [--files N]``. The files are copies of runs of 20
films, each copy with a temperature and a humidity of its own.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np

from dearig.batch.trends import find_trends
from dearig.drivers.rig import Block
from dearig.recording.reading.index import index_folder
from tests.tools.recordings import run_counts, writer

_FILMS = 20


def make(shelf: Path, files: int) -> None:
    """Recordings of films, with the means of the room as a finished run has them."""
    random = np.random.default_rng(0)
    for film in range(_FILMS):
        base = shelf / f"film-{film:02d}.h5"
        counts = run_counts(200, quiet=100, seed=film)
        with writer(base, samples_expected=200, film_id=f"F{film:02d}") as recorder:
            recorder.append(Block(0, counts, ()))
    for n in range(files):
        path = shelf / f"day-{n // 100:03d}" / f"run-{n:04d}.h5"
        shutil.copyfile(shelf / f"film-{n % _FILMS:02d}.h5", path)
        with h5py.File(path, "r+") as file:
            file["entry"].attrs["temperature_degC"] = random.normal(23.0, 2.0)
            file["entry"].attrs["relative_humidity_percent"] = random.normal(45.0, 8.0)
    for film in range(_FILMS):
        (shelf / f"film-{film:02d}.h5").unlink()


def trended(shelf: Path, cache: Path) -> int:
    """List the folder, filter its films, and trend a number of them; return how many they are."""
    chosen = [e for e in index_folder(shelf, cache=cache) if e.film < "F10"]
    random = np.random.default_rng(1)
    rows = [
        {
            "recording": e.path,
            "started": e.start_time,
            "film": e.film,
            # copies have one peak: a reading of it differs
            "peak_displacement_mm": 1e3 * e.peaks["displacement"] * random.normal(1.0, 0.01),
            **e.room,
        }
        for e in chosen
    ]
    found = find_trends(rows, source=shelf, numbers=["peak_displacement_mm"])
    assert [effect.column.label for effect in found.trends[0].effects] == [
        "temperature",
        "humidity",
    ]
    return len(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=10_000)
    parser.add_argument("--folder", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=asked.folder) as made:
        shelf, cache = Path(made) / "shelf", Path(made) / "cache.json"
        for day in range(-(-asked.files // 100)):
            (shelf / f"day-{day:03d}").mkdir(parents=True)
        make(shelf, asked.files)
        for what in ("first", "again", "again"):
            before = time.perf_counter()
            found = index_folder(shelf, cache=cache)
            took = time.perf_counter() - before
            print(f"{what}: {len(found)} recordings in {took:.2f} s", flush=True)
        trended(shelf, cache)  # imports
        before, used = time.perf_counter(), time.process_time()
        count = trended(shelf, cache)
        took, used = time.perf_counter() - before, time.process_time() - used
        print(
            f"listed, filtered ({count} recordings of 10 films) and trended: {took:.2f} s, "
            f"{used:.2f} s of a core (limit: 2 s)"
        )
        (shelf / "day-000" / "run-0000.h5").touch()
        before = time.perf_counter()
        index_folder(shelf, cache=cache)
        print(f"one changed: {time.perf_counter() - before:.2f} s")


if __name__ == "__main__":
    main()
