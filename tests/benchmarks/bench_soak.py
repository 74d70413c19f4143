"""What a server and a program that runs for long keep: memory, threads, files, tasks.

Run as ``python -m tests.benchmarks.bench_soak [--hours H] [--runs N]``. First the simulated card's
server works through H hours of its own clock, which jumps: an output that repeats, inputs that are
read, an event, and short-lived clients every minute. Then one process makes N runs with guardians
on a server in another process. A table shows what both keep after each tenth; the command ends
with 1 if something is more in the second half than in the first.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import psutil
from nidaqmx.system import Device as ClientDevice

from dearig.acquisition.run import record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.sim_backend.clock import ManualClock
from tests.tools.command import LOBE
from tests.tools.daqmx import (
    add_inputs,
    add_output,
    clock_inputs,
    clock_output,
    connected,
    read,
    served,
    task,
)

RATE = 500.0  # Hz
BLOCK = 5000  # scans of a read, 10 s
STEPS = 10
#: What may grow by the noise of an allocator, in MB; everything else may not grow at all.
MEMORY_SLACK_MB = 8.0


@dataclass(frozen=True)
class Kept:
    """What a process keeps."""

    memory_MB: float
    threads: int
    files: int

    @classmethod
    def of(cls, process: psutil.Process) -> Kept:
        """Return what ``process`` keeps now."""
        files = process.num_handles() if sys.platform == "win32" else process.num_fds()
        return cls(process.memory_info().rss / 1e6, process.num_threads(), files)


def grows(history: list[Kept]) -> list[str]:
    """Return the names of what has a higher maximum in the second half than in the first.

    A closed connection keeps its threads and files for some seconds, so single values vary.
    """
    half = len(history) // 2
    found = []
    for field in fields(Kept):
        before, after = (
            max(getattr(kept, field.name) for kept in part)
            for part in (history[:half], history[half:])
        )
        if after > before + (MEMORY_SLACK_MB if field.name == "memory_MB" else 2):
            found.append(f"{field.name} from {before:g} to {after:g}")
    return found


def row(label: str, *kept: Kept | int) -> None:
    """Print one line of the table."""
    cells = []
    for one in kept:
        if isinstance(one, Kept):
            cells.append(f"{one.memory_MB:8.1f} MB {one.threads:4d} threads {one.files:4d} files")
        else:
            cells.append(f"{one:6d}")
    print(f"{label:>10}  " + "  |  ".join(cells), flush=True)


def hours_of_a_server(hours: float) -> list[str]:
    """Print what the server keeps during ``hours`` of its clock; returns what grows."""
    print(f"\n{hours:g} hours of the server's clock, {RATE:g} Hz: process, tasks, clients, changes")
    me, history = psutil.Process(), []
    link = ManualClock()
    reads = round(hours * 3600 * RATE / BLOCK)
    with (
        served(link=link, client_timeout=3600.0) as card,
        task(card.session) as ao,
        task(card.session) as ai,
    ):
        add_output(ao)
        clock_output(ao, RATE)
        ao.write(np.concatenate([np.full(500, 1.0), np.zeros(500)]))
        add_inputs(ai, "ai0", "ai2")
        clock_inputs(ai, RATE)
        ai.register_every_n_samples_acquired_into_buffer_event(BLOCK, lambda *_: 0)
        ai.start()
        ao.start()
        for place in range(reads):
            read(ai, BLOCK, timeout=100.0)
            link.advance(BLOCK / RATE)
            if place % 6 == 0:
                with connected(card.server.port) as other:
                    assert ClientDevice("Dev1", grpc_options=other).serial_num
                    with task(other) as still:
                        add_inputs(still, "ai5") if place % 12 else add_output(still, "ao1")
            if (place + 1) % max(1, reads // STEPS) == 0:
                history.append(Kept.of(me))
                row(
                    f"{(place + 1) * BLOCK / RATE / 3600:.2f} h", history[-1],
                    len(card.device.state.tasks), len(card.server.clients.known),
                    len(card.device.history()),
                )  # fmt: skip
        ai.stop()
        ao.stop()
    return grows(history)


@contextmanager
def server_process() -> Iterator[tuple[str, psutil.Process]]:
    """Serve a card in a process of its own; yields the rig's address and the process."""
    process = subprocess.Popen(
        [sys.executable, "-m", "dearig", "serve-daqmx", "--fast"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        yield line.split("--rig ")[1].split(";")[0], psutil.Process(process.pid)
    finally:
        process.terminate()
        process.communicate()


def runs_in_one_process(runs: int) -> list[str]:
    """Print what this process and the server keep during ``runs`` runs; returns what grows."""
    print(f"\n{runs} runs in one process: this process | the server's")
    rig = RigFile.model_validate(
        {"film": {"name": "soak"}, "card": {"sample_rate_Hz": RATE, "do_hv_enable": "port0/line0"}}
    )
    me = psutil.Process()
    mine: list[Kept] = []
    servers: list[Kept] = []
    with tempfile.TemporaryDirectory() as folder, server_process() as (address, server):
        for number in range(runs):
            out = Path(folder) / "run.h5"
            out.unlink(missing_ok=True)
            result = record(parse_sequence(LOBE, "the lobe", Path(folder)), address, rig, out)
            assert result.outcome == "finished", result.outcome
            if (number + 1) % max(1, runs // STEPS) == 0:
                mine.append(Kept.of(me))
                servers.append(Kept.of(server))
                row(f"{number + 1} runs", mine[-1], servers[-1])
    assert threading.active_count() < 10, threading.enumerate()
    return [f"this process: {what}" for what in grows(mine)] + [
        f"the server: {what}" for what in grows(servers)
    ]


def main() -> int:
    """Print the tables; returns 1 if something grows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=3.0)
    parser.add_argument("--runs", type=int, default=200)
    options = parser.parse_args()
    found = []
    if options.hours > 0:
        found += hours_of_a_server(options.hours)
    if options.runs > 0:
        found += runs_in_one_process(options.runs)
    print("\nnothing grows" if not found else "\nGROWS: " + "; ".join(found))
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
