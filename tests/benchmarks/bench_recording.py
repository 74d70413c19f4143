"""What recording costs at the card's full rate, against h5py alone writing the same bytes.

Run as ``python -m tests.benchmarks.bench_recording [--seconds S] [--hours H] [--folder DIR]``. Both
write the same blocks of 3 channels, 1 MS/s together, with the same flushes; each in a process of
its own, whose peak memory is told. Then a file of H hours is recorded, and opened.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from dearig.drivers.rig import Block, RigIdentity
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.recording import RecordingWriter, RunMetadata, open_recording
from dearig.recording.content.layout import LIBVER
from dearig.recording.writing import writer as writer_module
from tests.tools.recordings import CHANNELS, SEQUENCE, Clock

THREE = (CHANNELS[0], CHANNELS[1], CHANNELS[3])
RATE = 1e6 / 3.0
BLOCK = 10_000
REPEATS = 3


def peak_memory() -> int:
    """Bytes that this process has had at most; from the kernel, so on Linux only."""
    status = Path("/proc/self/status").read_text("ascii")
    return int(status.split("VmHWM:")[1].split()[0]) * 1024


def blocks(seconds: float) -> list[np.ndarray]:
    """A second of the run, again and again: what is timed is the writing, not the making."""
    rng = np.random.default_rng(0)
    time_s = np.arange(round(RATE)) / RATE
    wave = np.array([np.sin(6.0 * time_s), np.sin(6.0 * time_s), np.sin(6.0 * time_s) ** 2])
    counts = np.rint(9000 * wave + rng.normal(0.0, 5.0, wave.shape)).astype(np.int16)
    starts = range(0, counts.shape[1] - BLOCK, BLOCK)
    ring = [np.ascontiguousarray(counts[:, start : start + BLOCK]) for start in starts]
    count = round(seconds * RATE / BLOCK)
    return [ring[i % len(ring)] for i in range(count)]


def ours(path: Path, seconds: float, fsync: bool) -> dict[str, float]:
    clock = Clock()
    identity = RigIdentity("sim", True, (), THREE)
    run = blocks(seconds)
    recorder = RecordingWriter(
        path, identity, RATE, BLOCK * len(run),
        RunMetadata(sequence_toml=SEQUENCE, film=THESIS_FILM, load=THESIS_LOAD),
        overwrite=True, fsync=fsync, now=clock,
    )  # fmt: skip
    wall, cpu = time.perf_counter(), time.process_time()
    for i, counts in enumerate(run):
        clock.moment += BLOCK / RATE
        recorder.append(Block(i * BLOCK, counts))
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    memory = peak_memory()
    closing = time.perf_counter()
    recorder.close()
    closing = time.perf_counter() - closing
    return {
        "wall": wall, "cpu": cpu, "memory": memory, "closing": closing,
        "memory_closed": peak_memory(), "bytes": path.stat().st_size,
    }  # fmt: skip


def bare(path: Path, seconds: float) -> dict[str, float]:
    run = blocks(seconds)
    with h5py.File(path, "w", libver=LIBVER) as file:
        rows = [
            file.create_dataset(c.name, shape=(0,), maxshape=(None,), chunks=(65536,), dtype="<i2")
            for c in THREE
        ]
        file.swmr_mode = True
        wall, cpu = time.perf_counter(), time.process_time()
        flushed = 0.0
        for i, counts in enumerate(run):
            start = i * BLOCK
            for row, values in zip(rows, counts, strict=True):
                row.resize((start + BLOCK,))
                row[start : start + BLOCK] = values
            if (start + BLOCK) / RATE - flushed >= writer_module.FLUSH_INTERVAL:
                file.flush()
                flushed = (start + BLOCK) / RATE
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        memory = peak_memory()
    return {"wall": wall, "cpu": cpu, "memory": memory, "bytes": path.stat().st_size}


def apart(kind: str, path: Path, seconds: float) -> dict[str, float]:
    """One of the above in a process of its own."""
    command = [sys.executable, "-m", "tests.benchmarks.bench_recording", "--one", kind]
    command += ["--folder", str(path), "--seconds", str(seconds)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def one(kind: str, folder: Path, seconds: float) -> dict[str, float]:
    path = folder / "bench.h5"
    path.unlink(missing_ok=True)
    found = bare(path, seconds) if kind == "bare" else ours(path, seconds, kind == "fsync")
    path.unlink()
    return found


def compare(folder: Path, seconds: float) -> None:
    print(f"3 channels, 1 MS/s together, {seconds:g} s of data in blocks of {BLOCK}:")
    best: dict[str, dict[str, float]] = {}
    for _ in range(REPEATS):
        for kind in ("bare", "ours", "fsync"):
            found = apart(kind, folder, seconds)
            if kind not in best or found["cpu"] < best[kind]["cpu"]:
                best[kind] = found
    for kind, f in best.items():
        print(
            f"  {kind:<6} {f['cpu'] / seconds * 100:5.2f} % of a core, "
            f"{f['cpu'] / best['bare']['cpu']:4.2f} x bare, "
            f"wall {f['wall'] / seconds * 100:5.2f} %, "
            f"peak {f['memory'] / 2**20:.0f} MiB, file {f['bytes'] / 2**20:.0f} MiB"
            + (f", closing {f['closing']:.2f} s" if "closing" in f else "")
        )


def timed(action: Callable[[], object], repeats: int = 1) -> float:
    spent = []
    for _ in range(repeats):
        before = time.perf_counter()
        action()
        spent.append(time.perf_counter() - before)
    return max(spent)


def long_run(folder: Path, hours: float) -> None:
    path = folder / "long.h5"
    found = ours(path, hours * 3600.0, False)
    size = path.stat().st_size
    print(
        f"{hours:g} h: {size / 1e9:.1f} GB, peak {found['memory_closed'] / 2**20:.0f} MiB, "
        f"written in {found['wall']:.0f} s ({found['cpu'] / (hours * 36.0):.2f} % of a core), "
        f"closed in {found['closing']:.2f} s"
    )
    rng = np.random.default_rng(1)

    def look() -> None:
        run = open_recording(path)
        for channel in ("displacement", "voltage_command", "voltage_monitor"):
            run.overview(channel, 2000)

    print(f"  opened, with the overviews of three channels: {timed(look) * 1e3:.0f} ms")
    run = open_recording(path)

    def windows() -> None:
        width = int(10.0 ** rng.uniform(2, np.log10(run.samples)))
        start = int(rng.integers(0, run.samples - width))
        run.overview("displacement", 2000, start, start + width)

    print(f"  any window as 2000 points, the slowest of 200: {timed(windows, 200) * 1e3:.0f} ms")

    def second() -> None:
        start = int(rng.integers(0, run.samples - round(RATE)))
        run.window("displacement", start, start + round(RATE))

    print(f"  every sample of a second, the slowest of 50: {timed(second, 50) * 1e3:.0f} ms")
    path.unlink()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--hours", type=float, default=0.0)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--one", choices=("bare", "ours", "fsync"))
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=asked.folder) as made:
        if asked.one:
            print(json.dumps(one(asked.one, Path(made), asked.seconds)))
            return
        compare(Path(made), asked.seconds)
        if asked.hours:
            long_run(Path(made), asked.hours)


if __name__ == "__main__":
    main()
