"""Rows of a finished recording, deflated by several threads into chunks that all readers inflate.

HDF5's own filters run on one thread. Here zlib deflates chunks outside of Python's lock, and HDF5
stores them as they are. Which order of the bytes deflates better depends on the row, and is tried:
equal values repeat as whole words, smooth ones byte by byte (HDF5's shuffle).
"""

from __future__ import annotations

import os
import zlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

import h5py
import numpy as np

from dearig.recording.content.layout import CHUNK
from dearig.recording.content.safe import PACKED_MAX

__all__ = ["Packed", "Packer", "packer"]

#: Level of zlib up to ``THOROUGH`` samples, and of longer runs, whose end would take long.
LEVEL, LEVEL_FAST, THOROUGH = 6, 1, 2**20
#: Bytes of a chunk for each that is stored, at most: a reader refuses a row that claims 100 times
#: what is stored, and the chunks of a row are not all alike.
TIGHTEST = 0.9 * PACKED_MAX
#: Bytes between flushes of a chunk that would be tighter, as a constant one would be: a flush takes
#: some 15 bytes, so that a constant chunk is stored at 1/85.
PIECE = 1280


@dataclass(frozen=True)
class Packed:
    """A row of ``samples`` values of ``kind``; ``chunks`` are as they will be in the file."""

    samples: int
    kind: np.dtype
    chunk: int
    shuffle: bool
    level: int
    chunks: Iterable[bytes]

    def store(self, parent: h5py.Group, name: str) -> h5py.Dataset:
        """Make the dataset ``name`` of the row."""
        if not self.samples:
            return parent.create_dataset(name, shape=(0,), dtype=self.kind)
        dataset = parent.create_dataset(
            name, shape=(self.samples,), dtype=self.kind, chunks=(self.chunk,),
            shuffle=self.shuffle, compression="gzip", compression_opts=self.level,
        )  # fmt: skip
        for number, content in enumerate(self.chunks):
            dataset.id.write_direct_chunk((number * self.chunk,), content)
        return dataset


class Packer:
    """Deflates rows with the threads of ``pool``."""

    def __init__(self, pool: ThreadPoolExecutor, threads: int) -> None:
        self._pool, self._threads = pool, threads

    def pack(self, samples: int, part: Callable[[int, int], np.ndarray]) -> Packed:
        """Return the row of what ``part(start, stop)`` returns, (n,) each, deflated on demand.

        ``part`` is called from the thread that takes the chunks.
        """
        kind = part(0, 0).dtype
        if not samples:
            return Packed(0, kind, 0, False, 0, ())
        # chunks of equal size: HDF5 stores the last one in full
        chunk = -(-samples // -(-samples // CHUNK))
        level = LEVEL if samples <= THOROUGH else LEVEL_FAST
        piece, shuffle = self._tried(part(*_middle(samples, chunk)), level)

        def deflate(start: int) -> Future[bytes]:
            values = part(start, min(start + chunk, samples))
            padded = np.pad(values, (0, chunk - values.size), mode="edge")
            return self._pool.submit(_deflated, padded, level, piece, shuffle)

        chunks = self._in_order(deflate, range(0, samples, chunk))
        return Packed(samples, kind, chunk, shuffle, level, chunks)

    def _tried(self, values: np.ndarray, level: int) -> tuple[int, bool]:
        """Return the bytes between flushes, and whether to shuffle, for ``values`` (n,)."""
        for piece in (values.nbytes, PIECE):
            tried = [
                self._pool.submit(_deflated, values, level, piece, shuffle)
                for shuffle in (False, True)
            ]
            plain, shuffled = (len(found.result()) for found in tried)
            if min(plain, shuffled) * TIGHTEST >= values.nbytes:
                break
        return piece, shuffled < plain

    def _in_order(
        self, deflate: Callable[[int], Future[bytes]], starts: Iterable[int]
    ) -> Iterator[bytes]:
        waiting: deque[Future[bytes]] = deque()
        for start in starts:
            waiting.append(deflate(start))
            if len(waiting) > self._threads:
                yield waiting.popleft().result()
        for found in waiting:
            yield found.result()


@contextmanager
def packer() -> Iterator[Packer]:
    """Yield a packer with a thread for each processor, four at most."""
    threads = min(os.cpu_count() or 1, 4)
    with ThreadPoolExecutor(threads) as pool:
        yield Packer(pool, threads)


def _middle(samples: int, chunk: int) -> tuple[int, int]:
    """Return first and last sample of the chunk in the middle: the lead-in is not like the run."""
    start = samples // chunk // 2 * chunk
    return start, min(start + chunk, samples)


def _deflated(values: np.ndarray, level: int, piece: int, shuffle: bool) -> bytes:
    """Return the chunk ``values`` (n,) as HDF5 stores it, flushed after each ``piece`` bytes."""
    content = values.view(np.uint8)
    if shuffle:
        content = content.reshape(values.size, -1).T.reshape(-1)
    deflate = zlib.compressobj(level)
    found = []
    for start in range(0, content.size, piece):
        found.append(deflate.compress(content[start : start + piece].data))
        if start + piece < content.size:
            found.append(deflate.flush(zlib.Z_SYNC_FLUSH))
    return b"".join((*found, deflate.flush()))
