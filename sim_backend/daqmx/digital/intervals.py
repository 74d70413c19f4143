"""Lengths of time between the edges of signals."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dearig.sim_backend.daqmx.card.channels import CounterChannel
from dearig.sim_backend.daqmx.card.numbers import RISING
from dearig.sim_backend.daqmx.card.signals import Signal
from dearig.sim_backend.daqmx.digital.measures import PULSES, Measure

__all__ = ["EdgeIntervals"]

_MOST_EDGES = 1 << 20  # edges that are looked at in one step


class EdgeIntervals:
    """Lengths of time between edges: each complete one, in s, with the time of its end."""

    def __init__(self, channel: CounterChannel, signals: Callable[[str], Signal]) -> None:
        self._channel = channel
        self._signals = signals
        self._seen = 0.0
        self._edges: list[float] = []  # those of the interval that is not complete

    def start(self, now: float) -> None:
        """Begin at ``now``."""
        self._seen = now
        self._edges = []

    def most(self, now: float) -> int:
        """Return how many more can be complete at ``now``, at most."""
        return self._signals("input").count(self._seen, now, self._channel.edge == RISING)

    @property
    def _both(self) -> bool:
        """Return True for what needs the edges of both directions."""
        return self._channel.measure not in (Measure.FREQUENCY, Measure.PERIOD)

    def _step(self, first: float, last: float) -> np.ndarray:
        """Return the edges (times, kinds) in order; the kind is 0 for a first one, 1 for others."""
        channel = self._channel
        one = self._signals("input")
        if channel.measure == Measure.TWO_EDGE_SEPARATION:
            other = self._signals("second").edges(first, last, channel.second_edge == RISING)
        elif self._both:
            other = one.edges(first, last, channel.edge != RISING)
        else:
            other = np.empty(0)
        own = one.edges(first, last, channel.edge == RISING)
        times = np.concatenate((own, other))
        kinds = np.concatenate((np.zeros(own.size), np.ones(other.size)))
        order = np.argsort(times, kind="stable")
        return np.array([times[order], kinds[order]])

    def complete(self, now: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the new complete ones (2, n) in s, and when each ended (n,).

        The second row is for pulses, whose sample is the time of either level.
        """
        values: list[tuple[float, float]] = []
        ends: list[float] = []
        first = self._seen
        pieces = max(1, math.ceil(self.most(now) / _MOST_EDGES))
        for i in range(pieces):
            last = now if i == pieces - 1 else first + (now - self._seen) / pieces
            for time, kind in self._step(first, last).T.tolist():
                self._take(time, bool(kind), values, ends)
            first = last
        self._seen = max(self._seen, now)
        return np.array(values).reshape(-1, 2).T, np.array(ends)

    def _take(
        self, time: float, other: bool, values: list[tuple[float, float]], ends: list[float]
    ) -> None:
        measure, edges = self._channel.measure, self._edges
        if measure == Measure.SEMI_PERIOD:
            if edges or not other:
                if edges:
                    values.append((time - edges[0], 0.0))
                    ends.append(time)
                self._edges = [time]
        elif measure in PULSES:
            if not other and len(edges) == 2:
                values.append((edges[1] - edges[0], time - edges[1]))
                ends.append(time)
                self._edges = [time]
            elif (other and len(edges) == 1) or (not other and not edges):
                edges.append(time)
        elif measure in (Measure.PULSE_WIDTH, Measure.TWO_EDGE_SEPARATION):
            if other and edges:
                values.append((time - edges[0], 0.0))
                ends.append(time)
                self._edges = []
            elif not other and not edges:
                edges.append(time)
        else:
            if edges:
                values.append((time - edges[0], 0.0))
                ends.append(time)
            self._edges = [time]

    def next(self, missing: int) -> float | None:
        """Return when ``missing`` more may be complete, or None where it is unknown."""
        channel = self._channel
        one = self._signals("input")
        ahead = missing if self._edges else missing + 1
        if channel.measure == Measure.TWO_EDGE_SEPARATION:
            return self._signals("second").nth(
                self._seen, max(1, missing), channel.second_edge == RISING
            )
        if channel.measure == Measure.PULSE_WIDTH:
            return one.nth(self._seen, max(1, missing), channel.edge != RISING)
        if channel.measure == Measure.SEMI_PERIOD:
            nth = max(1, ahead // 2)
            found = [one.nth(self._seen, nth, rising) for rising in (True, False)]
            return None if None in found else min(t for t in found if t is not None)
        return one.nth(self._seen, max(1, ahead), channel.edge == RISING)
