"""How long the output keeps its voltage after a run was killed, idle and under load.

Run as ``python -m tests.benchmarks.bench_guardian [--runs N] [--load L]``. A run in another process
is above 3 kV on a simulated card, whose server is in this process. It is killed, and the wire is
watched. Given are, median and longest in s: the guardian's work, from its first call to 0 V on the
voltage monitor; and the time from the kill to 0 V on the wire, which includes the end of the killed
process.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dearig.config.rigfile import RigFile
from dearig.drivers.contract.rig import lobes
from dearig.drivers.daqmx.rig import open_daqmx_rig
from dearig.sim_backend.clock import PacedClock
from dearig.sim_backend.daqmx.opening import open_device
from dearig.sim_backend.daqmx.protocol.server import DaqmxServer
from tests.campaign.trouble import Load

IDLE_S, LOADED_S = 0.5, 1.0  # allowed from the kill to 0 V
AT_VOLTAGE_V = 3000.0
STARTS_WITHIN_S = 120.0
LOADED_FOR_S = 2.0  # before the kill
SETTINGS = RigFile.model_validate(
    {
        "card": {"do_hv_enable": "port0/line0", "hv_enable_watchdog_s": 30.0},
        # a run that gets no processor is not what is measured
        "guardian": {"timeout_s": 5.0},
    }
)


@dataclass(frozen=True)
class Outcome:
    """Times in s: the guardian's own ``work``, and ``to_zero`` of the wire."""

    work: float
    to_zero: float


def play(address: str) -> None:
    """Run in the child: play a long waveform, and read until this process is killed."""
    rig = open_daqmx_rig(address, SETTINGS)
    rig.load(lobes(peaks=(6000.0,) * 200))
    rig.arm()
    rig.start()
    while rig.read() is not None:
        pass


@contextmanager
def unhindered(wanted: bool) -> Iterator[None]:
    """Give this process, with the server, real-time priority, so that the load does not slow it."""
    threads = [int(thread.name) for thread in Path("/proc/self/task").iterdir()] if wanted else []
    for thread in threads:
        os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(1))
    try:
        yield
    finally:
        for thread in threads:
            with suppress(ProcessLookupError):
                os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))


def measure(count: int, *, prompt: bool) -> Outcome:
    """Kill one run under a load of ``count`` processes, which does not slow a ``prompt`` server."""
    clock = PacedClock()
    film, weight = SETTINGS.as_film(), SETTINGS.as_load()
    device = open_device("sim", SETTINGS, film, weight, clock=clock)
    with DaqmxServer(device, client_timeout=None) as server:
        address = f"daqmx:Dev1@127.0.0.1:{server.port}"
        run = subprocess.Popen(
            [sys.executable, "-m", __spec__.name, "--play", address],
            stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        with run, Load(count) as load:
            end = time.monotonic() + STARTS_WITHIN_S
            while abs(device.wire_voltage()) < AT_VOLTAGE_V:
                if run.poll() is not None or time.monotonic() > end:
                    raise RuntimeError("the run did not start")
                time.sleep(0.01)
            load.go()
            time.sleep(LOADED_FOR_S)
            with unhindered(prompt):
                while abs(device.wire_voltage()) < AT_VOLTAGE_V and run.poll() is None:
                    time.sleep(0.01)
                killed = clock.now()
                run.kill()
                said = run.stderr.read() if run.stderr else ""  # until the guardian has ended
        work = re.search(r"taken to 0 V within ([\d.]+) s", said)
        if work is None:
            raise RuntimeError(f"the guardian did not confirm 0 V: {said}")
        zero = next(c.time for c in reversed(device.history()) if c.wire == 0.0 and c.time > killed)
    return Outcome(float(work[1]), zero - killed)


def main() -> int:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--load", type=int, default=20)
    parser.add_argument("--play", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.play:
        play(options.play)
        return 0
    print("| load | server | runs | guardian's work | 0 V on the wire | allowed |")
    print("|---|---|---|---|---|---|")
    rows = (
        (0, False, IDLE_S, "idle"),
        (options.load, True, LOADED_S, "not slowed, as a card is not"),
        (options.load, False, LOADED_S, "slowed by the load"),
    )
    for count, prompt, allowed, server in rows:
        outcomes = [measure(count, prompt=prompt) for _ in range(options.runs)]
        columns = [[getattr(o, name) for o in outcomes] for name in ("work", "to_zero")]
        cells = [f"{np.median(column):.2f} / {max(column):.2f}" for column in columns]
        print(
            f"| {count} | {server} | {options.runs} | {' | '.join(cells)} | {allowed:.2f} |",
            flush=True,
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
