"""Notes of the flushes of a run: /entry/wall_clock, which HDF5 writes last in each flush."""

from __future__ import annotations

import h5py
import numpy as np

from dearig.recording.content.layout import WALL_CLOCK_TYPE
from dearig.recording.content.safe import item

__all__ = ["flush_notes"]


def flush_notes(entry: h5py.Group) -> np.ndarray | None:
    """Return ``sample`` and ``unix_time`` (n,) of the flushes whose note is in the file.

    A kill or a full disk can leave space for notes that were never written; they are left out. None
    where the file has no such notes.
    """
    rows = item(entry, "wall_clock", stored=False)
    if not isinstance(rows, h5py.Dataset) or rows.dtype != WALL_CLOCK_TYPE or rows.ndim != 1:
        return None
    there = rows[: rows.id.get_storage_size() // rows.dtype.itemsize]
    empty = there["unix_time"] == 0.0
    notes: np.ndarray = there[: int(np.argmax(empty))] if empty.any() else there
    return notes
