"""How long an identification takes: hybrid and Algorithm 1, and this revision and another.

Run as ``python -m tests.benchmarks.bench_identify [PYTHON [commands [SEED ...]]]``. Without an
argument: one period of the thesis's identification record at its 10 ms sampling, made by Table 3's
film, with 1 um noise. Algorithm 1 as printed runs once for each of three seeds, the hybrid three
times; medians, on a machine that may have other work.

``PYTHON`` is the interpreter of another checkout's environment. Then the two take turns, each in a
process of its own, on one thread: the thesis's record of two periods and of five at 1 kHz, with
intervals and without. Processor seconds, ratios turn by turn, and the costs that are reached.

With ``commands`` whole commands take turns, once each: recordings of simulated rigs, those of
``RIGS`` or of the seeds, made by the other, are identified, and diagnosed with a validation
recording. This works with revisions whose modules have other names. Both have to have compiled
their kernels.
"""

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence

import numpy as np

from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.fitting import Identification, identify
from dearig.model.fitting.search import ALGORITHM_1
from dearig.model.readings.measures import errors
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation import excitation
from dearig.model.simulation.actuator import Actuator, Drive

NOISE = 1e-6
STEP = 0.01
TURNS = 3


def measured() -> dict[str, tuple[float, float]]:
    """Return processor seconds and cost of each identification, by this interpreter."""
    actuator = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)

    def record(periods: int, rate: float) -> ActuatorRecord:
        drive = Drive(*excitation.Sequence.thesis(periods=periods).sample(rate), hold=True)
        noise = NOISE * np.random.default_rng(0).standard_normal(drive.time.size)
        moved = actuator.simulate(drive).displacement
        return ActuatorRecord("made", drive, moved + noise, NOISE)

    identify([record(1, 100.0)], actuator, workers=1)  # compiles
    found = {}
    for periods in (2, 5):
        made = record(periods, 1e3)
        for intervals in (False, True):
            before = time.process_time()
            fit = identify([made], actuator, workers=1, intervals=intervals)
            name = f"{made.time[-1]:.0f} s, {'with' if intervals else 'without'} intervals"
            found[name] = (time.process_time() - before, fit.cost)
    return found


def beside(other: str) -> None:
    """Print what ``measured`` returns of the interpreter ``other`` and of this one, in turns."""
    one_thread = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    turns: list[list[dict[str, list[float]]]] = [[], []]
    for _ in range(TURNS):
        for of, interpreter in zip(turns, (other, sys.executable), strict=True):
            answer = subprocess.run(
                [interpreter, __file__, "measure"],
                check=True, capture_output=True, text=True, env=one_thread,
            )  # fmt: skip
            of.append(json.loads(answer.stdout.splitlines()[-1]))
    print(f"{'processor s':<28}{'other':>8}{'this':>8}{'ratio of each turn':>28}{'costs':>26}")
    for name in turns[0][0]:
        then, now = ([one[name] for one in of] for of in turns)
        ratios = [b[0] / a[0] for a, b in zip(then, now, strict=True)]
        print(
            f"{name:<28}{statistics.median(t[0] for t in then):>8.2f}"
            f"{statistics.median(t[0] for t in now):>8.2f}"
            f"{', '.join(f'{r:.2f}' for r in ratios):>28}{then[0][1]:>13.7f}{now[0][1]:>13.7f}"
        )


#: Seeds of the simulated rigs whose recordings are identified and diagnosed.
RIGS = (7, 11, 12, 13, 2003)


def command(interpreter: str, folder: str, *words: str) -> float:
    """Run a command in ``folder``; return the processor seconds of its process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [interpreter, "-m", "dearig", *words, "--force"], cwd=folder, check=True,
        capture_output=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def commands_beside(other: str, rigs: Sequence[int]) -> None:
    """Print what whole commands of the interpreter ``other`` and of this one take, in turns."""
    print("| command | other (s) | this (s) | ratio |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for seed in rigs:
            train, check = f"thesis-{seed}.h5", f"check-{seed}.h5"
            command(other, folder, "record", "thesis", "--rig", f"sim:{seed}", "--out", train)
            command(
                other, folder, "record", "validation-b-7.0", "--rig", f"sim:{seed}", "--seed", "1",
                "--out", check,
            )  # fmt: skip
            for words in (
                ("identify", train, "--out", "model.toml"),
                ("diagnose", train, "--validate", check),
            ):
                then, now = (command(i, folder, *words) for i in (other, sys.executable))
                name = f"{words[0]}, sim:{seed}"
                print(f"| {name} | {then:.1f} | {now:.1f} | {now / then:.2f} |", flush=True)


def main() -> None:
    actuator = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    segment = excitation.Sequence.thesis(periods=1).segments[0]
    t = np.arange(round(segment.duration / STEP) + 1) * STEP
    drive = Drive(t, segment.voltage(t))
    clean = actuator.simulate(drive).displacement
    noise = NOISE * np.random.default_rng(0).standard_normal(t.size)
    record = ActuatorRecord("thesis, one period", drive, clean + noise, NOISE)
    identify([record], actuator)  # compiles

    def run(method: str, intervals: bool, seed: int) -> tuple[float, Identification, float]:
        before = time.perf_counter()
        fit = identify([record], actuator, method=method, intervals=intervals, seed=seed)
        spent = time.perf_counter() - before
        model = fit.model
        if not isinstance(model, Actuator):
            raise TypeError("an actuator's record was fitted by something else")
        rms = errors(record.displacement, model.simulate(drive).displacement).rms
        return spent, fit, rms

    print(
        f"one period, {t.size} samples at {STEP * 1e3:g} ms, noise {NOISE * 1e6:g} um; "
        f"Algorithm 1: {ALGORITHM_1.generations} generations, {ALGORITHM_1.members} members"
    )
    print(f"{'method':<28}{'s':>8}{'simulations':>14}{'RMS um':>10}{'target s':>10}")
    rows: tuple[tuple[str, Callable[[int], tuple[float, Identification, float]], str], ...] = (
        ("Algorithm 1 as printed", lambda seed: run("de", False, seed), "< 10"),
        ("hybrid, no intervals", lambda seed: run("hybrid", False, seed), "< 5"),
        ("hybrid, with intervals", lambda seed: run("hybrid", True, seed), ""),
    )
    for name, of, target in rows:
        runs = [of(seed) for seed in range(3)]
        spent = statistics.median(r[0] for r in runs)
        simulations = int(statistics.median(r[1].simulations for r in runs))
        rms = statistics.median(r[2] for r in runs)
        print(f"{name:<28}{spent:>8.2f}{simulations:>14}{rms * 1e6:>10.3f}{target:>10}")


if __name__ == "__main__":
    if sys.argv[1:] == ["measure"]:
        print(json.dumps(measured()))
    elif sys.argv[2:3] == ["commands"]:
        commands_beside(sys.argv[1], [int(seed) for seed in sys.argv[3:]] or RIGS)
    elif sys.argv[1:]:
        beside(sys.argv[1])
    else:
        main()
