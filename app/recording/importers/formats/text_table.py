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

    def append(self, columns: Sequence[np.ndarray], more: float) -> None:
        """Append rows; ``more`` times as many are expected, with these."""
        count = columns[0].size if columns else 0
        end = self.rows + count
        if end > self._room.shape[1]:
            # room that is never written takes no memory
            grown = np.empty((len(columns), self.rows + int(count * max(more, 1.0) * ROOM) + 1))
            grown[:, : self.rows] = self.values
            self._room = grown
        for room, values in zip(self._room[:, self.rows : end], columns, strict=True):
            room[:] = values
        self.rows = end
