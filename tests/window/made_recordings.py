"""Recordings for the window's tests, made on the simulated rig."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from dearig.acquisition.run import RunOptions, record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence, parse_sequence
from dearig.drivers.rig import Block
from tests.tools.recordings import Clock, run_counts, writer

SLOW_RIG = RigFile.model_validate({"card": {"sample_rate_Hz": 100.0}})

LOBES = """\
name = "lobes of {top} kV"
lead_in_s = 0.5
[[segment]]
kind = "half_sine"
amplitude_kV = {top}
frequency_Hz = 1.0
repeats = 2
"""


def made(folder: Path, name: str, top: float = 6.0, **said: str) -> Path:
    """Two lobes up to ``top`` kV on the rig of the thesis."""
    loaded = parse_sequence(LOBES.format(top=top), name, Path())
    out = folder / f"{name}.h5"
    record(loaded, "sim", SLOW_RIG, out, RunOptions(f"[load]\nmass_g = {200}\n", **said))  # type: ignore[arg-type]
    return out


def of_rig(folder: Path, name: str, address: str, preset: str = "thesis") -> Path:
    """A preset on the rig at ``address``."""
    out = folder / f"{name}.h5"
    record(load_sequence(preset), address, SLOW_RIG, out)
    return out


def killed(folder: Path, name: str) -> Path:
    """What a kill leaves of a run: the file as it stands on the disk before it is closed."""
    running, out = folder / f"{name}.running", folder / f"{name}.h5"
    clock = Clock()
    recorder = writer(running, now=clock)
    counts = run_counts()
    for start in range(0, 2000, 500):
        clock.moment += 0.5  # so that every block is flushed
        recorder.append(Block(start, counts[:, start : start + 500]))
    shutil.copyfile(running, out)
    recorder.discard()
    os.utime(out, (1.8e9, 1.6e9))  # long ago: no one is writing to it any more
    return out
