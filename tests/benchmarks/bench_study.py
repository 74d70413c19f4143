"""Studies: what the engines cost next to the fits, and what a lost worker or scheduler changes.

``python -m tests.benchmarks.bench_study --recordings 8``. The cluster is of real processes, which
are killed; it needs the extra ``cluster``.

``python -m tests.benchmarks.bench_study --beside 1000`` plays ``dearig study --do identify`` with
two processes next to bare fits of the same recordings: ``identify_recordings`` of each path, in a
``multiprocessing`` pool of two. Both are whole programs, and read the files themselves. They run in
turns of a few seconds, the other one being stopped (SIGSTOP), so that the load of the machine is
the same for both. It prints their processor times and the sums of their turns, after each tenth of
the recordings. With ``--kept FOLDER`` the recordings are made there once, and used again.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil

from dearig.acquisition.run import RunOptions, record
from dearig.analysis.identify import identify_recordings
from dearig.batch.engines import LocalEngine, engine_at
from dearig.batch.fits import FitTask, Row, StudyOptions, fit_task
from dearig.batch.numbers import parameters_of
from dearig.batch.studies import study_recordings, subjects_of
from dearig.batch.table_file import read_table
from dearig.config.rigfile import load_rig_file
from dearig.config.sequencefile import parse_sequence
from dearig.errors import InputError
from tests.tools.command import LOBE, SLOW_RIG, write
from tests.tools.machine import cores_and_load


def made(folder: Path, count: int) -> Path:
    """Recordings of the rigs ``sim:0``, ``sim:1``, ...: other effects, and other noise."""
    recordings = folder / "recordings"
    recordings.mkdir()
    rig_file = load_rig_file(write(folder / "rig.toml", SLOW_RIG))
    loaded = parse_sequence(LOBE, "lobe", folder)
    for seed in range(count):
        out = recordings / f"r{seed:04d}.h5"
        record(loaded, f"sim:{seed}", rig_file, out, RunOptions(seed=seed))
    return recordings


def nothing(task: FitTask) -> Row:
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


_TURN_S = 5.0  # that one of two programs runs while the other is stopped
_BLOCKS = 10


def bare_fit(path: str) -> tuple[str, float]:
    """Return the name of a recording, and mu_0 in kPa of a model with one branch.

    NaN where the recording cannot be fitted.
    """
    try:
        found = parameters_of(identify_recordings([path], branches=(1,), intervals=False))
    except InputError:
        return Path(path).name, math.nan
    return Path(path).name, next(p["value"] for p in found if p["name"] == "mu_0_kPa")


def bare(recordings: Path, out: Path) -> None:
    """Fit each of ``recordings`` in a pool of two, and append a line to ``out`` for each."""
    paths = [str(path) for path in sorted(recordings.glob("*.h5"))]
    with multiprocessing.get_context("spawn").Pool(2) as pool, out.open("w") as told:
        for name, value in pool.imap_unordered(bare_fit, paths):
            told.write(f"{name} {value!r}\n")
            told.flush()
        pool.close()
        pool.join()


@dataclass
class Turns:
    """A program that runs in turns, and what it had done after each of them."""

    command: list[str]
    count: Callable[[], int]
    wall: float = 0.0
    cpu: float = 0.0
    seen: list[tuple[int, float]] = field(default_factory=lambda: [(0, 0.0)])
    ended: bool = False

    def __post_init__(self) -> None:
        self._process = subprocess.Popen(
            self.command, start_new_session=True, stdout=subprocess.DEVNULL
        )
        os.killpg(self._process.pid, signal.SIGSTOP)

    def take(self) -> None:
        """Run for one turn."""
        os.killpg(self._process.pid, signal.SIGCONT)
        began = time.monotonic()
        usage = None
        while usage is None and time.monotonic() - began < _TURN_S:
            pid, status, found = os.wait4(self._process.pid, os.WNOHANG)
            if pid:
                assert status == 0, self.command
                usage = found
            else:
                time.sleep(0.01)
        self.wall += time.monotonic() - began
        if usage is not None:
            # with that of its children, which it has waited for
            self.cpu, self.ended = usage.ru_utime + usage.ru_stime, True
        else:
            os.killpg(self._process.pid, signal.SIGSTOP)
            root = psutil.Process(self._process.pid)
            spent = [p.cpu_times() for p in (root, *root.children(recursive=True))]
            ended = spent[0].children_user + spent[0].children_system
            self.cpu = ended + sum(each.user + each.system for each in spent)
        self.seen.append((self.count(), self.cpu))

    def close(self) -> None:
        """End the program where it has not ended."""
        if not self.ended:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()

    def cost(self, recordings: float) -> float:
        """Return the processor time in s until so many ``recordings`` were done."""
        rows, cpu = np.array(self.seen, dtype=float).T
        rows, first = np.unique(rows, return_index=True)
        return float(np.interp(recordings, rows, cpu[first]))


def beside(folder: Path, recordings: Path) -> None:
    """Play a study next to bare fits of the same ``recordings``, in turns."""
    paths = sorted(recordings.glob("*.h5"))
    count = len(paths)
    bare_fit(str(paths[0]))  # the kernels are compiled and kept
    told, out = folder / "bare.txt", folder / "out"
    fits = Turns(
        [
            sys.executable,
            "-m",
            "tests.benchmarks.bench_study",
            "--bare",
            str(recordings),
            str(told),
        ],
        lambda: told.read_text().count("\n") if told.exists() else 0,
    )
    study = Turns(
        [sys.executable, "-m", "dearig", "study", str(recordings), "--do", "identify",
         "--branches", "1", "--no-intervals", "--workers", "2", "--out", str(out)],
        lambda: len(list((out / "cache").glob("*.json"))),
    )  # fmt: skip
    try:
        print(f"{count} recordings of sim:0 to sim:{count - 1}, one branch, two processes")
        print("recordings   bare: s of a core   study: s of a core   the block   from the start")
        before, parts = (0.0, 0.0), []
        for stop in np.linspace(0, count, _BLOCKS + 1)[1:]:
            while min(fits.seen[-1][0], study.seen[-1][0]) < stop:
                for each in (fits, study):
                    if not each.ended:
                        each.take()
            now = fits.cost(stop), study.cost(stop)
            parts.append((now[1] - before[1]) / (now[0] - before[0]) - 1.0)
            print(
                f"{stop:10.0f} {now[0]:19.1f} {now[1]:20.1f} {100.0 * parts[-1]:+9.1f} % "
                f"{100.0 * (now[1] / now[0] - 1.0):+14.1f} %",
                flush=True,
            )
            before = now
        for each in (fits, study):
            while not each.ended:
                each.take()
    finally:
        fits.close()
        study.close()
    values = dict(line.split() for line in told.read_text().splitlines())
    rows = read_table(out / "study.csv")
    given = [row["mu_0_kPa"] for row in rows]
    both = [(float(values[r["recording"]]), v) for r, v in zip(rows, given, strict=True)]
    same = sum(one == two or (math.isnan(one) and two is None) for one, two in both)
    error = np.std(parts, ddof=1) / np.sqrt(len(parts))
    print(
        f"to the end of the programs: bare {fits.cpu:.1f} s of a core in {fits.wall:.0f} s of "
        f"turns ({fits.cpu / count:.3f} s a fit), study {study.cpu:.1f} s in {study.wall:.0f} s\n"
        f"more for the study: {100.0 * (study.cpu / fits.cpu - 1.0):+.1f} % of processor time "
        f"(standard error of the blocks {100.0 * error:.1f} %), "
        f"{100.0 * (study.wall / fits.wall - 1.0):+.1f} % of the turns (limit: 5 %)\n"
        f"mu_0 is the same to the last digit in {same} of {count}, of which "
        f"{given.count(None)} cannot be fitted"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=8)
    parser.add_argument("--empty", type=int, default=300, help="Tasks without work.")
    parser.add_argument("--beside", type=int, default=0, metavar="RECORDINGS")
    parser.add_argument("--kept", type=Path, metavar="FOLDER")
    parser.add_argument("--bare", type=Path, nargs=2, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    count, empty = asked.recordings, asked.empty
    if asked.bare:
        bare(*asked.bare)
        return
    if asked.beside:
        with tempfile.TemporaryDirectory() as made_folder:
            folder = Path(made_folder) if asked.kept is None else asked.kept
            recordings = folder / "recordings"
            beside(
                Path(made_folder), recordings if recordings.exists() else made(folder, asked.beside)
            )
        print(cores_and_load())
        return
    options = StudyOptions("identify")
    # worker processes import nothing from the working folder, so that it is another one
    with tempfile.TemporaryDirectory() as made_folder, chdir(made_folder):
        folder = Path(made_folder)
        subjects = subjects_of([made(folder, count)], folder / "out")
        began = time.process_time()
        alone = [fit_task(FitTask(s.name, s.path, "", options)) for s in subjects]
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
            ] == [row["mu_0_kPa"] for row in alone]
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
