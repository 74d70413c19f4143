"""Checksums of the counts of a run: CRC-32 of every block of every channel.

Counts use none of HDF5's own checksum filters: a flush writes the last chunk again, and a kill in
the middle of it would make the whole chunk unreadable, with samples of earlier flushes. Rows of a
finished run have the Adler-32 of their deflated chunks.
"""

from __future__ import annotations

import zlib
from array import array
from collections.abc import Callable

import h5py
import numpy as np

__all__ = ["BLOCK", "ChecksumWriter", "checksum", "complete_checksums", "wrong_blocks"]

#: Samples of a channel under one checksum.
BLOCK = 65536
NAME = "checksums"


def checksum(counts: np.ndarray, before: int = 0) -> int:
    """Return the CRC-32 (as of zip files) of ``counts`` (n,) as they are in the file."""
    in_file = np.ascontiguousarray(counts, dtype=counts.dtype.newbyteorder("<"))
    return zlib.crc32(in_file.data, before)


class ChecksumWriter:
    """The dataset ``entry/checksums`` (blocks, channels) uint32 of a run."""

    def __init__(self, entry: h5py.Group, channels: int, rate: float) -> None:
        rows = int(min(max(60.0 * rate / BLOCK, 16), 1024))
        self._dataset = entry.create_dataset(
            NAME,
            shape=(0, channels),
            maxshape=(None, channels),
            chunks=(rows, channels),
            dtype="<u4",
        )
        self._dataset.attrs["block_samples"] = BLOCK
        self._running = [0] * channels
        self._filled = 0
        self._pending: list[list[int]] = []
        self._full = array("I")  # those of all full blocks: 4 bytes for 65,536 samples

    def values(self) -> array[int]:
        """Return the checksums of all blocks so far, channel by channel; the last may be short."""
        return self._full + array("I", self._running if self._filled else ())

    def move_to(self, entry: h5py.Group) -> None:
        """Write to the same dataset of another file from now on."""
        self._dataset = entry[NAME]

    def add(self, counts: np.ndarray) -> None:
        """Take the next ``counts`` (channels, n)."""
        start, n = 0, counts.shape[1]
        while start < n:
            stop = min(n, start + BLOCK - self._filled)
            for i, row in enumerate(counts[:, start:stop]):
                self._running[i] = checksum(row, self._running[i])
            self._filled += stop - start
            if self._filled == BLOCK:
                self._pending.append(self._running)
                self._full.extend(self._running)
                self._running, self._filled = [0] * len(self._running), 0
            start = stop

    def write(self) -> None:
        """Append the blocks that have become full since the last call."""
        if self._pending:
            first = self._dataset.shape[0]
            self._dataset.resize(first + len(self._pending), axis=0)
            self._dataset[first:] = self._pending
            self._pending = []


def complete_checksums(
    entry: h5py.Group, samples: int, read: Callable[[int, int], np.ndarray]
) -> None:
    """Add the missing checksums of ``samples`` samples; ``read(a, b)`` returns counts.

    The last block may be shorter than the others.
    """
    dataset = entry.get(NAME)
    if dataset is None:
        return
    there = min(dataset.shape[0], samples // BLOCK)
    wanted = -(-samples // BLOCK)
    dataset.resize(wanted, axis=0)
    for i in range(there, wanted):
        counts = read(i * BLOCK, min((i + 1) * BLOCK, samples))
        dataset[i] = [checksum(row) for row in counts]


def wrong_blocks(
    entry: h5py.Group, samples: int, read: Callable[[int, int], np.ndarray]
) -> tuple[int, list[tuple[int, int, int]]]:
    """Return the number of samples compared, and (channel, start, stop) of each difference."""
    dataset = entry[NAME]
    size = int(dataset.attrs["block_samples"])
    compared, wrong = 0, []
    for i in range(min(dataset.shape[0], -(-samples // size))):
        start, stop = i * size, min((i + 1) * size, samples)
        counts = read(start, stop)
        wrong += [
            (channel, start, stop)
            for channel, row in enumerate(counts)
            if checksum(row) != int(dataset[i, channel])
        ]
        compared = stop
    return compared, wrong
