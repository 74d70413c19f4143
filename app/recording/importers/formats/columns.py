"""What all sources that keep their columns by name have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

import numpy as np

__all__ = ["ColumnOverview", "NamedColumns", "unseen"]


class _Column(Protocol):
    @property
    def own(self) -> str: ...

    @property
    def unit(self) -> str: ...


@dataclass(frozen=True)
class ColumnOverview:
    """First values (k,) of a column, how many it has, and the least and the greatest of them."""

    first: np.ndarray = field(default_factory=lambda: np.empty(0))
    count: int = 0
    low: float = math.inf
    high: float = -math.inf

    def with_values(self, values: np.ndarray, shown: int) -> ColumnOverview:
        """Return the overview with more ``values`` (n,), and ``shown`` first ones at most."""
        if not values.size:
            return self
        return ColumnOverview(
            np.append(self.first, values[: shown - self.first.size]),
            self.count + int(values.size),
            min(self.low, float(values.min())),
            max(self.high, float(values.max())),
        )


C = TypeVar("C", bound=_Column)


class NamedColumns(Generic[C]):
    """Columns ``C`` of a file by their names; the base of a ``Source``.

    ``progress`` is called with the part of a reading that is done, 0 to 1; a caller that waits for
    it sets it.
    """

    def __init__(self, columns: Mapping[str, C]) -> None:
        self._columns = dict(columns)
        self.progress: Callable[[float], None] = unseen

    @property
    def names(self) -> list[str]:
        """Names of all columns."""
        return list(self._columns)

    @property
    def units(self) -> dict[str, str]:
        """Units by column, where the file gives them next to the name."""
        return {name: column.unit for name, column in self._columns.items() if column.unit}

    def own_name(self, name: str) -> str:
        """Return ``name`` without its path, specimen or table."""
        return self._columns[name].own


def unseen(part: float) -> None:
    """Show nothing."""
