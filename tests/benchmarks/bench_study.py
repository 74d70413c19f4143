"""Studies: what the engines cost beside the fits, and what a lost worker or scheduler changes.

``python -m tests.benchmarks.bench_study --recordings 8``. The cluster is of real processes, which
are killed; it needs the extra ``cluster``.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from pathlib import Path

from dearig.acquisition.run import RunOptions, record
from dearig.batch.engines import LocalEngine, engine_at
from dearig.batch.fits import Row, StudyOptions, Task, fit_task
from dearig.batch.studies import study_recordings, subjects_of
from dearig.config.rigfile import load_rig_file
from dearig.config.sequencefile import parse_sequence
from tests.tools.command import LOBE, SLOW_RIG, write
from tests.tools.machine import cores_and_load


def made(folder: Path, count: int) -> Path:
    """Recordings of the simulated rig, each with its own noise."""
    recordings = folder / "recordings"
    recordings.mkdir()
    rig_file = load_rig_file(write(folder / "rig.toml", SLOW_RIG))
    loaded = parse_sequence(LOBE, "lobe", folder)
    for seed in range(count):
        out = recordings / f"r{seed:04d}.h5"
        record(loaded, "sim", rig_file, out, RunOptions(seed=seed))
    return recordings


def nothing(task: Task) -> Row:
    return {"recording": task.name, "state": "ok", "reason": "", "sha256": "", "value": 1.0}


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Scheduler and workers as processes; gives the address, and the processes."""
    told = folder / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    processes = [
        subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_scheduler", "--scheduler-file", str(told),
             "--port", "0", "--no-dashboard", "--host", "127.0.0.1"], **quiet,
        )
    ]  # fmt: skip
    while not told.exists() or not told.read_text("utf-8"):
        time.sleep(0.05)
    address = json.loads(told.read_text("utf-8"))["address"]
    processes += [
        subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1",
             "--no-dashboard", "--local-directory", str(folder)], **quiet,
        )
        for _ in range(workers)
    ]  # fmt: skip
    try:
        yield address, processes
    finally:
        for process in processes:
            process.kill()
            process.wait()
        told.unlink(missing_ok=True)


def after(rows: int, act: Callable[[], None]) -> Callable[[str, float], None]:
    """Return a progress that acts once so many rows are there."""
    done = threading.Event()

    def progress(stage: str, fraction: float) -> None:
        if stage == "fitting" and fraction >= rows and not done.is_set():
            done.set()
            act()

    return progress


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=8)
    parser.add_argument("--empty", type=int, default=300, help="Tasks without work.")
    count, empty = (vars(parser.parse_args())[name] for name in ("recordings", "empty"))
    options = StudyOptions("identify")
    # worker processes import nothing from the working folder, so that it is another one
    with tempfile.TemporaryDirectory() as made_folder, chdir(made_folder):
        folder = Path(made_folder)
        subjects = subjects_of([made(folder, count)], folder / "out")
        began = time.process_time()
        bare = [fit_task(Task(s.name, s.path, "", options)) for s in subjects]
        each = (time.process_time() - began) / count
        began = time.process_time()
        many = [type(subjects[0])(f"{i}", subjects[i % count].path) for i in range(empty)]
        study_recordings(many, options, folder / "empty", LocalEngine(2, nothing))
        cost = (time.process_time() - began) / empty
        print(
            f"one fit: {each:.2f} s of a core; the engine, its cache and the table: "
            f"{cost * 1e3:.1f} ms of a core for each recording"
        )
        print(f"engine / fit: {100.0 * cost / each:.2f} % (limit: 5 %)")

        def told(name: str, **about: object) -> bytes:
            began = time.monotonic()
            table = study_recordings(subjects, options, folder / name, **about)  # type: ignore[arg-type]
            took = time.monotonic() - began
            assert [
                row["mu_0_kPa"] for row in sorted(table.rows, key=lambda r: r["recording"])
            ] == [row["mu_0_kPa"] for row in bare]
            print(f"{name:24s} {took:6.1f} s  {table.moved}")
            return table.table.read_bytes()

        tables = [told("two processes", engine=LocalEngine(2))]
        with cluster(folder, 2) as (address, processes):
            tables.append(told("Dask, two workers", engine=engine_at(f"dask:{address}")))
        for victim, which in (("a worker killed", 1), ("the scheduler killed", 0)):
            with cluster(folder, 2) as (address, processes):
                kill = after(1 / count, processes[which].kill)
                tables.append(told(victim, engine=engine_at(f"dask:{address}"), progress=kill))
        print("the same table, to the last digit:", all(table == tables[0] for table in tables))
    print(cores_and_load())


if __name__ == "__main__":
    main()
