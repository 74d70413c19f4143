"""How long an identification takes: the thesis's Algorithm 1 as printed, and the hybrid method.

Run as ``python -m tests.benchmarks.bench_identify``. One period of the thesis's identification
record at its 10 ms sampling, made by Table 3's film, with 1 um of noise. Algorithm 1 runs once for
each of three seeds, the hybrid three times; medians, on a machine that may have other work.
"""

import statistics
import time
from collections.abc import Callable

import numpy as np

from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.fitting import Identification, identify
from dearig.model.fitting.search import ALGORITHM_1
from dearig.model.readings.measures import errors
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import Sequence

NOISE = 1e-6
STEP = 0.01


def main() -> None:
    actuator = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    segment = Sequence.thesis(periods=1).segments[0]
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
    main()
