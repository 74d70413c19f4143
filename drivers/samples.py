"""Values at the ticks of a clock, computed on request instead of held in memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

__all__ = ["Computed", "Listed", "Repeated", "Samples", "as_samples"]


@runtime_checkable
class Samples(Protocol):
    """A signal of ``samples`` values, read window by window."""

    @property
    def samples(self) -> int:
        """Return the number of samples."""
        ...

    def window(self, start: int, stop: int) -> np.ndarray:
        """Return the samples ``start`` to ``stop`` (stop - start,), 0 <= start <= stop.

        The same window has the same values at every request. A window that reaches beyond
        the last sample ends there.
        """
        ...


@dataclass(frozen=True, eq=False)
class Listed:
    """Samples in an array ``values`` (N,)."""

    values: np.ndarray

    @property
    def samples(self) -> int:
        """Return the number of samples."""
        return int(self.values.size)

    def window(self, start: int, stop: int) -> np.ndarray:
        """Return the samples ``start`` to ``stop``."""
        return self.values[start:stop]


@dataclass(frozen=True, eq=False)
class Repeated:
    """Samples of which every ``stride`` in a row have one value of ``values`` (M,)."""

    values: np.ndarray
    stride: int
    samples: int

    def window(self, start: int, stop: int) -> np.ndarray:
        """Return the samples ``start`` to ``stop``."""
        stop = max(start, min(stop, self.samples))
        first, last = start // self.stride, -(-stop // self.stride)
        repeated = np.repeat(self.values[first:last], self.stride)
        return repeated[start - first * self.stride :][: stop - start]


@dataclass(frozen=True, eq=False)
class Computed:
    """Samples that ``function`` computes for a window, given its start and its stop."""

    samples: int
    function: Callable[[int, int], np.ndarray]

    def window(self, start: int, stop: int) -> np.ndarray:
        """Return the samples ``start`` to ``stop``."""
        return self.function(start, min(stop, self.samples))


def as_samples(values: Samples | np.ndarray) -> Samples:
    """Return ``values`` as samples; an array is taken as it is, without a copy."""
    return Listed(values) if isinstance(values, np.ndarray) else values
