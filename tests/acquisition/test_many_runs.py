"""A hundred runs in one process: nothing grows."""

from __future__ import annotations

import gc
import sys
import threading
from pathlib import Path

import psutil
import pytest

from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.run import RunObserver, RunOptions, record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.rig import Block
from dearig.errors import Interrupted
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator
from tests.tools.command import LOBE

RUNS, WARM_UP = 100, 40
#: Blocks of memory that 60 runs may add, in caches that are not full yet; an object that a run
#: leaves behind has hundreds.
SLACK = 2000
RIG = RigFile.model_validate({"card": {"sample_rate_Hz": 200.0}})


class Hasty(RunObserver):
    def __init__(self, interrupts: Interrupts) -> None:
        self.interrupts = interrupts

    def block(self, block: Block) -> None:  # noqa: ARG002
        self.interrupts.ask()


def one_run(number: int, folder: Path) -> str:
    """Every third run is plain, has an overlay model, or is interrupted."""
    path = folder / "run.h5"
    path.unlink(missing_ok=True)
    loaded = parse_sequence(LOBE, "lobe", folder)
    interrupts = Interrupts()
    overlay, observer = None, None
    if number % 3 == 1:
        actuator = Actuator(RIG.as_film(), RIG.as_load(), TABLE_3)
        overlay = OverlayModel("x", actuator, toml="name = 'x'")
    if number % 3 == 2:
        observer = Hasty(interrupts)
    try:
        result = record(
            loaded, "sim", RIG, path, RunOptions(seed=number), overlay=overlay,
            observer=observer, interrupts=interrupts,
        )  # fmt: skip
    except Interrupted:
        return "interrupted"
    return result.outcome


@pytest.mark.deep
def test_nothing_grows_in_a_hundred_runs(tmp_path: Path) -> None:
    process = psutil.Process()

    def kept() -> tuple[int, int, int]:
        gc.collect()
        files = process.num_handles() if sys.platform == "win32" else process.num_fds()
        return threading.active_count(), files, sys.getallocatedblocks()

    outcomes = set()
    for number in range(RUNS):
        outcomes.add(one_run(number, tmp_path))
        if number == WARM_UP:
            before = kept()
    after = kept()
    assert outcomes == {"finished", "interrupted"}
    # Fewer is not a fault: what an earlier test of this process left may be closed meanwhile.
    assert after[0] <= before[0]
    assert after[1] <= before[1]
    assert after[2] - before[2] < SLACK
