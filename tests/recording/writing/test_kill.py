"""A run that is killed loses nothing that was flushed, and can be rescued."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.errors import InputError
from dearig.recording import open_recording, recover
from dearig.recording.content.superblock import lookup3
from tests.deep import mostly_deep
from tests.tools.recording_victim import pattern
from tests.tools.recordings import run_counts, writer

ROOT = Path(__file__).parents[3]


def killed(path: Path, blocks: int, lines: int) -> int:
    """Kill a recording when it has said ``lines`` lines; returns the samples it had flushed."""
    flushed = 0
    with subprocess.Popen(
        [sys.executable, "-m", "tests.tools.recording_victim", str(path), str(blocks)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    ) as victim:
        assert victim.stdout is not None
        for _ in range(lines):
            said = victim.stdout.readline()
            if said.strip() in ("", "closing"):
                break
            flushed = int(said)
        victim.kill()
        # it went on while it was being killed
        for said in victim.stdout:
            flushed = int(said) if said.endswith("\n") and said.strip().isdigit() else flushed
    return flushed


@pytest.mark.parametrize("seed", mostly_deep(range(5), [0]))
def test_a_kill_at_a_random_moment_loses_nothing_flushed(tmp_path: Path, seed: int) -> None:
    path = tmp_path / "run.h5"
    flushed = killed(path, 10**9, random.Random(seed).randint(1, 120))  # noqa: S311
    assert flushed > 0
    run = open_recording(path)
    assert not run.complete
    assert run.samples >= flushed
    with h5py.File(path, "r", swmr=True) as file:
        for channel, expected in zip(run.channels, pattern(0, run.samples), strict=True):
            counts = file[f"entry/data/{channel.name}_counts"][: run.samples]
            np.testing.assert_array_equal(counts, expected)
    assert len(run.events) >= (flushed - 1) // (8 * 250) + 1
    assert [e.message for e in run.events[:3]] == ["block 0", "block 8", "block 16"][
        : len(run.events)
    ]

    assert recover(path)
    with h5py.File(path, "r") as file:
        assert file["entry/data/displacement"].shape == (run.samples,)
        assert not file["entry"].attrs["complete"]
    mended = open_recording(path)
    assert not mended.complete
    assert mended.outcome == f"killed; {run.samples} samples recovered"
    np.testing.assert_array_equal(mended.displacement, run.displacement)
    assert mended.events == run.events
    assert not recover(path)


@pytest.mark.parametrize("blocks", mostly_deep([400, 4000], [400]))
def test_a_kill_while_closing_leaves_a_whole_file_or_all_counts(
    tmp_path: Path, blocks: int
) -> None:
    path = tmp_path / "run.h5"
    killed(path, blocks, 10**9)
    assert open_recording(path).samples == blocks * 250


def test_a_run_killed_before_its_first_block(tmp_path: Path) -> None:
    path, copy = tmp_path / "run.h5", tmp_path / "copy.h5"
    recorder = writer(path)
    copy.write_bytes(path.read_bytes())
    recorder.close()
    with pytest.raises(InputError, match="no samples: the run ended before its first block"):
        open_recording(copy)
    with pytest.raises(InputError, match="no samples"):
        recover(copy)


def test_a_run_can_be_looked_at_while_it_goes_on(tmp_path: Path) -> None:
    from dearig.drivers.rig import Block

    path, copy = tmp_path / "run.h5", tmp_path / "copy.h5"
    recorder = writer(path)
    recorder.append(Block(0, run_counts(2000)))
    recorder._flush_all(1.8e9)
    copy.write_bytes(path.read_bytes())
    recorder.close()
    run = open_recording(copy)
    assert (run.samples, run.complete) == (2000, False)
    assert run.outcome == "killed, or still running"
    np.testing.assert_array_equal(run.displacement, open_recording(path).displacement)


def test_lookup3_gives_its_authors_values() -> None:
    assert lookup3(b"") == 0xDEADBEEF
    assert lookup3(b"Four score and seven years ago") == 0x17770551
    assert lookup3(b"Four score and seven years ago", 1) == 0xCD628161
