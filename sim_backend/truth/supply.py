"""Supply of the film: what the stages between the amplifier and the film hand on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

__all__ = ["Supply"]


@dataclass(frozen=True)
class Supply:
    """Supply in the interval that begins at each of N nodes; arrays (N,) unless said otherwise.

    ``pull`` V is the voltage whose square gives the mean Maxwell stress of an interval. ``first``
    and ``last`` V are the voltage at its start, after the step, and at its end. ``bound`` (2, N) V,
    multiplied by the capacitance, is the charge at these two times, and ``creep`` (2, N) V/s its
    rate: they differ from the voltage where the polarisation lags. ``joined`` is False where no
    lead reaches the film.
    """

    pull: np.ndarray
    first: np.ndarray
    last: np.ndarray
    bound: np.ndarray | None = None
    creep: np.ndarray | None = None
    joined: np.ndarray | None = None

    def mapped(self, law: Callable[[np.ndarray], np.ndarray]) -> Supply:
        """Return the supply after a ``law`` of the voltage (N,) V that has no memory."""
        return replace(self, pull=law(self.pull), first=law(self.first), last=law(self.last))

    def following(self, pull: np.ndarray, nodes: np.ndarray) -> Supply:
        """Return the supply after a law with memory that is at ``nodes`` (N,) V at the nodes."""
        return replace(self, pull=pull, first=nodes, last=np.append(nodes[1:], nodes[-1:]))
