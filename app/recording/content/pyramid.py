"""Minima and maxima of the counts over bins of growing width, for fast plots of long runs."""

from __future__ import annotations

from collections.abc import Callable

import h5py
import numpy as np

__all__ = ["BINS", "PyramidWriter", "complete_pyramid", "levels", "reduced"]

#: Samples in a bin of each level; each a multiple of the one before.
BINS = (64, 4096, 262144)
#: s of a run in one chunk of a level, within 64 to 16384 bins.
CHUNK = 4.0
#: Types of counts, and of their sums.
_KINDS = (np.dtype(np.int16), np.dtype(np.int32))


def _name(bin_samples: int) -> str:
    return f"bins_of_{bin_samples}"


class PyramidWriter:
    """The levels under ``entry/pyramid`` of a run of ``channels`` channels at ``rate`` Hz.

    Each is (bins, channels, 2) of the ``kind`` of the counts: minimum and maximum of the counts of
    every full bin.
    """

    def __init__(self, entry: h5py.Group, channels: int, rate: float, kind: np.dtype) -> None:
        group = entry.create_group("pyramid")
        self._datasets = []
        for size in BINS:
            rows = int(min(max(CHUNK * rate / size, 64), 16384))
            self._datasets.append(
                group.create_dataset(
                    _name(size),
                    shape=(0, channels, 2),
                    maxshape=(None, channels, 2),
                    chunks=(rows, channels, 2),
                    dtype=kind,
                )
            )
            self._datasets[-1].attrs["bin_samples"] = size
        # for each level, the counts or the bins of the level below that do not fill a bin yet
        self._low = [np.empty((channels, 0), dtype=kind) for _ in BINS]
        self._high = [np.empty((channels, 0), dtype=kind) for _ in BINS]
        self._pending: list[list[np.ndarray]] = [[] for _ in BINS]

    def move_to(self, entry: h5py.Group) -> None:
        """Write to the same datasets of another file from now on."""
        self._datasets = [entry["pyramid"][_name(size)] for size in BINS]

    def add(self, counts: np.ndarray) -> None:
        """Take the next ``counts`` (channels, n)."""
        low = high = counts
        size_below = 1
        for i, size in enumerate(BINS):
            # at the first level low and high are the same array: the counts
            lows = np.concatenate((self._low[i], low), axis=1) if self._low[i].size else low
            highs = lows
            if i:
                highs = np.concatenate((self._high[i], high), axis=1)
            width = size // size_below
            full = lows.shape[1] // width * width
            self._low[i] = lows[:, full:].copy()
            self._high[i] = highs[:, full:].copy()
            if not full:
                return
            low = lows[:, :full].reshape(lows.shape[0], -1, width).min(axis=2)
            high = highs[:, :full].reshape(lows.shape[0], -1, width).max(axis=2)
            self._pending[i].append(np.stack((low.T, high.T), axis=2))
            size_below = size

    def write(self) -> None:
        """Append the bins that have become full since the last call."""
        for dataset, pending in zip(self._datasets, self._pending, strict=True):
            if pending:
                rows = np.concatenate(pending)
                pending.clear()
                first = dataset.shape[0]
                dataset.resize(first + rows.shape[0], axis=0)
                dataset[first:] = rows


def levels(entry: h5py.Group, samples: int) -> dict[int, h5py.Dataset]:
    """Return the complete levels of a run of ``samples`` samples, by samples in a bin."""
    group = entry.get("pyramid")
    if not isinstance(group, h5py.Group):
        return {}
    found = {}
    for size in BINS:
        level = group.get(_name(size))
        usable = isinstance(level, h5py.Dataset) and level.ndim == 3 and level.dtype in _KINDS
        # after a kill a level can be a block behind the counts
        if usable and level.shape[0] >= samples // size:
            found[size] = level
    return found


def complete_pyramid(
    entry: h5py.Group, samples: int, read: Callable[[int, int], np.ndarray]
) -> None:
    """Extend every level to the full bins of ``samples``; ``read(a, b)`` returns (channels, n).

    A run that was killed has left them some bins behind the counts, or ahead.
    """
    group = entry.get("pyramid")
    if group is None:
        return
    for size in BINS:
        level = group[_name(size)]
        wanted, there = samples // size, min(level.shape[0], samples // size)
        level.resize(wanted, axis=0)
        for i in range(there, wanted):
            counts = read(i * size, (i + 1) * size)
            level[i] = np.stack((counts.min(axis=1), counts.max(axis=1)), axis=1)


def reduced(low: np.ndarray, high: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray]:
    """``low`` and ``high`` (n,) over ``points`` bins as even as can be, or as they are if fewer."""
    n = low.size
    if n <= points:
        return low, high
    edges = (np.arange(points) * n) // points
    return np.fmin.reduceat(low, edges), np.fmax.reduceat(high, edges)
