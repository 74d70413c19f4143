"""Rows of a recording as means of several conversions, kept exactly as sums of counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dearig.drivers.channels import Channel, Scaling
from dearig.drivers.rig import Block, Event

__all__ = ["RowMeans", "row_channels"]


class RowMeans:
    """Rows of a run: the counts of ``average`` conversions each, added up.

    The blocks of a rig go in, blocks of whole rows come out. A sum is int32 and exact, so that
    nothing is rounded; the scaling of ``row_channels`` turns it into the mean. With an ``average``
    of 1 the blocks stay as they are, int16. A row that the run ends within is left out.
    """

    def __init__(self, average: int) -> None:
        if average < 1:
            raise ValueError(f"average = {average} must be 1 or more")
        self.average = average
        self._rows = 0  # complete so far
        self._begun: np.ndarray | None = None  # conversions of the row that is not complete

    def row(self, sample: int) -> int:
        """Return the row that the conversion number ``sample`` belongs to."""
        return sample // self.average

    def take(self, block: Block) -> Block:
        """Return the rows that ``block`` completes, perhaps none, with its events."""
        if self.average == 1:
            return block
        counts = block.counts
        if self._begun is not None:
            counts = np.concatenate((self._begun, counts), axis=1)
        channels, conversions = counts.shape
        rows = conversions // self.average
        whole = counts[:, : rows * self.average]
        self._begun = counts[:, rows * self.average :].copy()
        sums = whole.reshape(channels, rows, self.average).sum(axis=2, dtype=np.int32)
        start, self._rows = self._rows, self._rows + rows
        events = tuple(Event(self.row(e.sample), e.level, e.message) for e in block.events)
        return Block(start, sums, events)


def row_channels(channels: Sequence[Channel], average: int) -> tuple[Channel, ...]:
    """Return ``channels`` with the scaling of sums of ``average`` counts.

    The value of a sum S of N counts is the polynomial of the mean, S/N: its coefficient of the
    power p is divided by N**p. Skew and delay are those of one conversion, since the time of a row
    is the mean of its ticks.
    """
    if average == 1:
        return tuple(channels)
    return tuple(replace(c, scaling=_of_sums(c.scaling, average)) for c in channels)


def _of_sums(scaling: Scaling, average: int) -> Scaling:
    coefficients = tuple(c / float(average) ** p for p, c in enumerate(scaling.coefficients))
    return replace(scaling, coefficients=coefficients)
