"""The rows of a text table, block by block."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

__all__ = ["GrowingColumns"]

#: Room for rows, in multiples of those that the first block lets expect.
ROOM = 1.05


class GrowingColumns:
    """Columns that grow by blocks of rows; ``rows`` of them are there.

    Each has memory of its own, which is given back once no one needs that column any more. A table
    of no ``width`` counts the rows only.
    """

    def __init__(self, width: int) -> None:
        self._room = [np.empty(0) for _ in range(width)]
        self.rows = 0

    @property
    def values(self) -> list[np.ndarray]:
        """The columns (rows,) that are there."""
        return [room[: self.rows] for room in self._room]

    def append(self, columns: Sequence[np.ndarray], more: float) -> None:
        """Append rows; ``more`` times as many are expected, with these."""
        count = columns[0].size if columns else 0
        end = self.rows + count
        for place, (room, values) in enumerate(zip(self._room, columns, strict=False)):
            if end > room.size:
                # room that is never written takes no memory
                grown = np.empty(self.rows + int(count * max(more, 1.0) * ROOM) + 1)
                grown[: self.rows] = room[: self.rows]
                self._room[place] = grown
            self._room[place][self.rows : end] = values
        self.rows = end
