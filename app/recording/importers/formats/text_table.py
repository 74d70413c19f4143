"""The rows of a text table, block by block."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

__all__ = ["Table"]

#: Room for rows, in multiples of those that the first block lets expect.
ROOM = 1.05


class Table:
    """Columns that grow by blocks of rows; ``rows`` of them are there."""

    def __init__(self, width: int) -> None:
        self._room = np.empty((width, 0))
        self.rows = 0

    @property
    def values(self) -> np.ndarray:
        """The rows that are there, (columns, rows)."""
        return self._room[:, : self.rows]

    def room(self, width: int, count: int, more: float) -> np.ndarray:
        """Return the place (width, count) of the next rows; ``more`` times as many are expected."""
        end = self.rows + count
        if end > self._room.shape[1]:
            # room that is never written takes no memory
            grown = np.empty((width, self.rows + int(count * max(more, 1.0) * ROOM) + 1))
            grown[:, : self.rows] = self.values
            self._room = grown
        return self._room[:, self.rows : end]

    def append(self, columns: Sequence[np.ndarray], more: float) -> None:
        """Append rows; ``more`` times as many are expected, with these."""
        count = columns[0].size if columns else 0
        for room, values in zip(self.room(len(columns), count, more), columns, strict=True):
            if room.ctypes.data != values.ctypes.data:  # it may be there already
                room[:] = values
        self.rows += count
