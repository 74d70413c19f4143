"""What has to hold of a recording whatever moment its run was killed at."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

import h5py
import numpy as np

from dearig.errors import InputError
from dearig.recording import open_recording, recover
from dearig.recording.reading.opening import opened
from dearig.recording.verify import verify
from tests.tools.recording_victim import pattern

__all__ = ["Told", "check", "told"]

#: What files are called that stand next to a recording.
BESIDE = (".said", ".old")


class Told:
    """What the run had said when it ended: samples flushed, whether it closed or had closed."""

    def __init__(self, lines: Iterable[str]) -> None:
        whole = list(lines)
        self.flushed = max((int(line) for line in whole if line.isdigit()), default=0)
        self.closing = "closing" in whole
        self.closed = "closed" in whole


def told(path: Path) -> Told:
    """What stands in the file next to the recording ``path``."""
    said = path.with_name(f"{path.name}.said")
    text = said.read_text("ascii") if said.exists() else ""
    return Told(line for line in text.split("\n")[:-1])


def check(path: Path, size: int, scratch: Path, total: int | None = None) -> int:
    """Raise ``AssertionError`` unless all that was flushed is in ``path``, now and recovered.

    ``size`` is that of a block, ``total`` what a run had that closed. Returns the samples found, 0
    where nothing had been flushed.
    """
    said = told(path)
    if not said.flushed and not said.closing:
        # too early for anything to be promised but a sentence
        try:
            samples = open_recording(path).samples
        except InputError:
            return 0
    else:
        samples = open_recording(path).samples
    assert samples >= said.flushed, (samples, said.flushed)
    if said.closed and total is not None:
        assert samples == total
    _same(path, samples, size)
    copy = scratch / path.name
    for name in (path, path.with_name(f"{path.name}.journal")):
        if name.exists():
            shutil.copyfile(name, scratch / name.name)
    before = open_recording(copy)
    mended = recover(copy)
    assert not (mended and said.closed)
    found = verify(copy)
    assert found.sound, found.faults
    after = open_recording(copy)
    assert after.samples == samples
    assert after.events == before.events
    with h5py.File(copy, "r") as file:
        assert file["entry/data/displacement"].shape == (samples,)
    _same(copy, samples, size)
    if said.closed:
        assert after.complete
    for left in scratch.iterdir():
        left.unlink()
    return samples


def _same(path: Path, samples: int, size: int) -> None:
    with opened(path) as file:
        for c, name in enumerate(
            ("voltage_command", "voltage_monitor", "current_monitor", "displacement")
        ):
            counts = file[f"entry/data/{name}_counts"][:samples]
            np.testing.assert_array_equal(counts, pattern(0, samples)[c])
    messages = [e.message for e in open_recording(path).events]
    due = [f"block {i}" for i in range(0, -(-samples // size), 8)]
    # an event stands in the file with its block, and no flush comes between
    assert messages[: len(due)] == due[: len(messages)]
    assert len(messages) >= len(range(0, told(path).flushed // size, 8))
