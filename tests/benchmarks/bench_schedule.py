"""Schedule of a study on up to 64 workers, simulated from measured costs.

``python -m tests.benchmarks.bench_schedule --fits 24 --tasks 1000``. It measures the processor time
of bare fits, and that of the engine for each task; then it plays the engine's rule with them: a
task is handed over when a worker is free for it (this computer), or two are at each worker (Dask).

Assumptions: every worker is a core as fast as this one, and starts with compiled kernels; times of
fits are drawn from the measured ones; the client hands over and takes back one task at a time, at
its measured cost; recordings go over one link of 1 Gbit/s, one after the other, each once; a
message takes 1 ms. A worker with two tasks receives the second while it computes the first.
"""

from __future__ import annotations

import argparse
import heapq
import tempfile
import time
from contextlib import chdir
from pathlib import Path

import numpy as np

from dearig.batch.engines import LocalEngine
from dearig.batch.fits import FitTask, StudyOptions, Subject, fit_task
from dearig.batch.studies import study_recordings, subjects_of
from tests.benchmarks.bench_study import made, nothing
from tests.tools.machine import cores_and_load

_LINK = 125e6  # byte/s: 1 Gbit/s
_MESSAGE_S = 1e-3


def makespan(fits: np.ndarray, workers: int, client_s: float, sent_s: float, ahead: int) -> float:
    """Time in s until all ``fits`` (n,) s are done: the client is one, the workers are many.

    ``client_s`` is the client's cost of a task, ``sent_s`` the time of a recording on the link,
    ``ahead`` how many tasks a worker holds.
    """
    client = link = 0.0
    # when each place at a worker is free again, and when the worker's core is
    places = [(0.0, worker) for worker in range(workers) for _ in range(ahead)]
    heapq.heapify(places)
    core = np.zeros(workers)
    end = 0.0
    for fit in fits:
        free, worker = heapq.heappop(places)
        client = max(client, free) + client_s
        link = max(link, client) + sent_s
        core[worker] = max(core[worker], link + _MESSAGE_S) + fit
        end = max(end, float(core[worker]) + _MESSAGE_S)
        heapq.heappush(places, (float(core[worker]) + _MESSAGE_S, worker))
    return end


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fits", type=int, default=24, help="Fits that are measured.")
    parser.add_argument("--tasks", type=int, default=1000, help="Tasks of the simulated study.")
    parser.add_argument("--branches", type=int, default=1)
    asked = parser.parse_args()
    options = StudyOptions("identify", branches=asked.branches, intervals=False)
    # worker processes import nothing from the working folder, so that it is another one
    with tempfile.TemporaryDirectory() as made_folder, chdir(made_folder):
        folder = Path(made_folder)
        subjects = subjects_of([made(folder, asked.fits)], folder / "out")
        fit_task(FitTask("warm", subjects[0].path, "", options))
        times = []
        for subject in subjects:
            began = time.process_time()
            row = fit_task(FitTask(subject.name, subject.path, "", options))
            times.append(time.process_time() - began)
            assert row["state"] == "ok", row["reason"]
        size = float(np.mean([subject.path.stat().st_size for subject in subjects]))
        began = time.process_time()
        many = [Subject(f"{i}", subjects[i % asked.fits].path) for i in range(asked.tasks)]
        study_recordings(many, options, folder / "empty", LocalEngine(2, nothing))
        client = (time.process_time() - began) / asked.tasks
        bare = float(np.sum(times)) * asked.tasks / asked.fits
    print(
        f"{asked.fits} fits ({asked.branches} branch, no intervals): {np.mean(times):.3f} s of a "
        f"core on average, {np.min(times):.3f} to {np.max(times):.3f} s; a recording has "
        f"{size / 1e3:.0f} kB"
    )
    print(
        f"{asked.tasks} tasks without a fit through engine, cache and table: {client * 1e3:.2f} ms "
        f"of a core each; {asked.tasks} such fits on two cores take {bare / 2.0:.0f} s bare and "
        f"{100.0 * client * asked.tasks / bare:.2f} % more (limit: 5 %)"
    )
    fits = np.random.default_rng(1).choice(times, asked.tasks)
    print("workers   local: s  of the ideal   Dask: s  of the ideal")
    for workers in (1, 2, 4, 8, 16, 32, 64):
        ideal = float(fits.sum()) / workers
        local = makespan(fits, workers, client, 0.0, 1)
        dask = makespan(fits, workers, client, size / _LINK, 2)
        print(
            f"{workers:7d} {local:10.1f} {100.0 * ideal / local:11.1f} % {dask:9.1f} "
            f"{100.0 * ideal / dask:11.1f} %"
        )
    print(cores_and_load())


if __name__ == "__main__":
    main()
