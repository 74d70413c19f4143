"""What deflated rows hold, and how much of them a file stores."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.recording.content.layout import CHUNK
from dearig.recording.content.safe import PACKED_MAX, checked
from dearig.recording.writing.packing import packer

RNG = np.random.default_rng(0)
ROWS = {
    "time": np.arange(CHUNK + 1) / 1000.0,
    "noise": RNG.normal(size=3 * CHUNK),
    "steps": RNG.integers(-5, 6, 100_001) * 0.1 + 0.07,
    "counts": RNG.integers(-5, 6, 100_001).astype("<i2"),
    "sums": np.arange(70_000, dtype="<i4") * 12_345,
    "overlay": np.full(10, np.nan, dtype="<f4"),
    "constant": np.zeros(2 * CHUNK + 5),
    "one": np.array([np.pi]),
    "none": np.empty(0),
}


def packed(path: Path, row: np.ndarray) -> None:
    with h5py.File(path, "w") as file, packer() as pack:
        pack.pack(row.size, lambda a, b: row[a:b]).store(file, "row")


@pytest.mark.parametrize("name", ROWS)
def test_every_bit_of_a_row_comes_back(tmp_path: Path, name: str) -> None:
    row = ROWS[name]
    packed(tmp_path / "x.h5", row)
    with h5py.File(tmp_path / "x.h5", "r") as file:
        found = checked(file["row"])[()]
    assert found.dtype == row.dtype
    assert found.tobytes() == row.tobytes()


@pytest.mark.parametrize("name", ["time", "constant"])
def test_a_row_without_surprise_is_not_too_tight_for_a_reader(tmp_path: Path, name: str) -> None:
    packed(tmp_path / "x.h5", ROWS[name])
    with h5py.File(tmp_path / "x.h5", "r") as file:
        claimed, stored = file["row"].nbytes, file["row"].id.get_storage_size()
    assert PACKED_MAX / 8 < claimed / stored < PACKED_MAX


def test_steps_are_stored_as_words_and_time_byte_by_byte(tmp_path: Path) -> None:
    for name, shuffled in (("steps", False), ("time", True)):
        packed(tmp_path / f"{name}.h5", ROWS[name])
        with h5py.File(tmp_path / f"{name}.h5", "r") as file:
            assert file["row"].shuffle is shuffled
            assert file["row"].id.get_storage_size() < file["row"].nbytes / 5


def test_a_changed_byte_of_a_row_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    packed(path, ROWS["steps"])
    with h5py.File(path, "r") as file:
        at = file["row"].id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[at.byte_offset + at.size // 2] ^= 0x10
    path.write_bytes(content)
    with h5py.File(path, "r") as file, pytest.raises(OSError, match="filter"):
        file["row"][()]
