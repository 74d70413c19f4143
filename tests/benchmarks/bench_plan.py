"""What planning and playing a long run cost, against a plan that holds the waveform as an array.

Run as ``python -m tests.benchmarks.bench_plan [--full]``. Each case runs in a process of its own,
which tells its processor time and its peak memory above that of the imports. The alternative
samples the whole sequence, simulates the film over all of it and then asks the gate. It is left out
where it needs more than 8 GB. With ``--full`` the longest plans are made too; then recordings at
333 kHz show how memory grows with the length of a run on the simulated rig.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from dearig.acquisition.plan import plan
from dearig.acquisition.prediction import peaks_of, stride_at
from dearig.acquisition.run import record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, parse_sequence
from dearig.drivers.gate import FilmForecast, admit
from dearig.drivers.samples import Listed
from dearig.model.film.material import TABLE_3
from dearig.model.kinematics import thinning
from dearig.model.simulation.actuator import Actuator, Drive
from tests.benchmarks.bench_recording import peak_memory

# s and Hz; three inputs at 333 kHz are the 1 MS/s of the card
CASES = ((7200.0, 1e3), (600.0, 1e5), (60.0, 1e6 / 3.0))
LONGEST = ((600.0, 1e6 / 3.0), (1000.0, 6e5), (7200.0, 34e3))
RUNS = ((20.0, 1e6 / 3.0), (60.0, 1e6 / 3.0))
HELD_MAX = 8e9 / 40.0  # samples; the alternative holds some 40 bytes of each


def settings(rate: float) -> RigFile:
    """A rig at ``rate`` Hz whose card scans its inputs fast enough."""
    interval = min(10.0, 0.3e6 / rate)
    return RigFile.model_validate(
        {
            "card": {
                "sample_rate_Hz": rate,
                "first_convert_us": 0.0,
                "convert_interval_us": interval,
                "ai_rate_max_kHz": 4000.0,
            },
            "limits": {"energy_max_J": 1e6, "time_at_voltage_max_s": 1e5},
        }
    )


def sequence(seconds: float) -> LoadedSequence:
    """The thesis's lobes for ``seconds``."""
    periods = max(1, round(seconds / 11.4167))
    text = f'name = "long"\n[[segment]]\nkind = "thesis"\nperiods = {periods}\n'
    return parse_sequence(text, "bench", Path())


def ours(seconds: float, rate: float) -> None:
    plan(sequence(seconds), settings(rate)).admitted()


def held(seconds: float, rate: float) -> None:
    rig_file = settings(rate)
    limits = rig_file.gate_limits()
    voltage = sequence(seconds).sample(rate)[1]
    stride = stride_at(rate)
    peaks = peaks_of(Listed(voltage), stride)
    actuator = Actuator(rig_file.as_film(), rig_file.as_load(), TABLE_3)
    drive = Drive(np.arange(peaks.size) * (stride / rate), peaks, hold=True)
    response = actuator.simulate(drive)
    thin = thinning(actuator.film.held, response.stretch) / actuator.film.thickness
    volume = actuator.film.electric_volume
    admit(voltage, rate, limits, FilmForecast(thin, volume, stride=stride))


def run(seconds: float, rate: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        record(sequence(seconds), "sim", settings(rate), Path(folder) / "run.h5")


KINDS = {"ours": ours, "held": held, "run": run}


def measured(kind: str, seconds: float, rate: float) -> dict[str, float]:
    """Processor time and wall time in s, and memory in bytes, of one case in a process."""
    command = [sys.executable, "-m", __spec__.name, "--one", kind, str(seconds), str(rate)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def one(kind: str, seconds: float, rate: float) -> None:
    ours(11.0, rate)  # compile, or load what was compiled
    before, cpu, wall = peak_memory(), time.process_time(), time.perf_counter()
    KINDS[kind](seconds, rate)
    found = {
        "cpu": time.process_time() - cpu,
        "wall": time.perf_counter() - wall,
        "memory": peak_memory() - before,
        "all": peak_memory(),
    }
    print(json.dumps(found))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--one", nargs=3)
    given = parser.parse_args()
    if given.one:
        one(given.one[0], float(given.one[1]), float(given.one[2]))
        return
    print("plan                       processor  wall    memory    of the one that holds the array")
    for seconds, rate in (*CASES, *(LONGEST if given.full else ())):
        new = measured("ours", seconds, rate)
        words = (
            f"{seconds:6.0f} s at {rate * 1e-3:6.0f} kHz   {new['cpu']:7.1f} s {new['wall']:6.1f} s"
        )
        words += f" {new['memory'] * 1e-6:6.0f} MB"
        if seconds * rate <= HELD_MAX:
            old = measured("held", seconds, rate)
            time_part, memory_part = new["cpu"] / old["cpu"], new["memory"] / old["memory"]
            words += f"   {time_part:.2f} of the processor time, {memory_part:.2f} of the memory"
        print(words, flush=True)
    found = []
    for seconds, rate in RUNS if given.full else ():
        played = measured("run", seconds, rate)
        found.append((seconds * rate, played["all"]))
        print(
            f"run of {seconds:.0f} s at {rate * 1e-3:.0f} kHz: {played['wall']:.0f} s, "
            f"{played['all'] * 1e-6:.0f} MB in all",
            flush=True,
        )
    if found:
        growth = (found[1][1] - found[0][1]) / (found[1][0] - found[0][0])
        print(f"growth: {growth if math.isfinite(growth) else 0.0:.2f} bytes for each sample")


if __name__ == "__main__":
    main()
