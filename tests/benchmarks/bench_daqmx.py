"""Runs through the card's driver, interlocks, guardian and recorder, on a simulated card.

Run as ``python -m tests.benchmarks.bench_daqmx hour|stream [--minutes M]``. The card is served by
``dearig serve-daqmx`` in a process of its own; what is told of this process is the run alone.

    hour      one hour at 1 kHz, as fast as it can
    stream    M minutes in real time at the card's full rate, 3 inputs and 1 MS/s together
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from dearig.acquisition.run import RunOptions, record
from dearig.config.rigfile import load_rig_file
from dearig.config.sequencefile import parse_sequence
from dearig.recording import open_recording
from tests.benchmarks.bench_recording import peak_memory

RIG = """\
[film]
name = "bench"
[card]
sample_rate_Hz = {rate}
first_convert_us = {first}
convert_interval_us = {interval}
# a disk that thinks for a second or two must not end a run of gigabytes
[interlocks]
late_s = 5.0
[guardian]
timeout_s = 5.0
"""
SEQUENCE = """\
name = "bench"
[[segment]]
kind = "half_sine"
amplitude_kV = 6.0
frequency_Hz = 0.5
repeats = {lobes}
"""


@contextmanager
def served(rig_file: Path, pace: str) -> Iterator[str]:
    """Address of a simulated card in a process of its own."""
    server = subprocess.Popen(
        [
            sys.executable, "-m", "dearig", "serve-daqmx", "--rig-file", str(rig_file), pace,
            "--client-timeout", "6",
        ],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        if server.stdout is None:
            raise RuntimeError("the server says nothing")
        yield server.stdout.readline().split("--rig ")[1].split(";")[0]
    finally:
        server.terminate()
        server.wait()


def run(minutes: float, rate: float, pace: str, timing: tuple[float, float]) -> None:
    """Record ``minutes`` at ``rate`` Hz and tell what it took."""
    with tempfile.TemporaryDirectory() as folder:
        rig_file, out = Path(folder) / "rig.toml", Path(folder) / "run.h5"
        text = RIG.format(rate=rate, first=timing[0], interval=timing[1])
        rig_file.write_text(text, encoding="utf-8")
        sequence = SEQUENCE.format(lobes=max(1, round(minutes * 60.0 / 2.0)))
        loaded = parse_sequence(sequence, "bench", Path())
        with served(rig_file, pace) as rig:
            cpu, wall = time.process_time(), time.perf_counter()
            result = record(loaded, rig, load_rig_file(rig_file), out, RunOptions(text))
            cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        recording = open_recording(out)
        size = out.stat().st_size
    seconds = result.samples / result.rate_Hz
    inputs = 3
    print(
        f"{seconds:.0f} s at {result.rate_Hz:g} Hz, {inputs} inputs "
        f"({inputs * result.rate_Hz * 1e-6:.3g} MS/s): {result.outcome}, {result.samples} samples, "
        f"{len(result.events)} events, complete: {recording.complete}, {size / 1e6:.0f} MB\n"
        f"  wall {wall:.1f} s ({seconds / wall:.1f} times real time), of one core {cpu:.1f} s "
        f"({100.0 * cpu / wall:.0f} %), with the planning before and the closing after; "
        f"peak memory {peak_memory() / 1e9:.2f} GB"
    )


def main() -> None:
    """Do what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=["hour", "stream"])
    parser.add_argument("--minutes", type=float, default=None)
    options = parser.parse_args()
    if options.what == "hour":
        run(options.minutes or 60.0, 1000.0, "--fast", (50.0, 10.0))
    else:
        run(options.minutes or 10.0, 333_000.0, "--paced", (0.0, 1.0))


if __name__ == "__main__":
    main()
