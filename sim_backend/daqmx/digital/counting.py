"""Counts of edges, and positions of encoders, over time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dearig.sim_backend.daqmx.card.channels import CounterChannel
from dearig.sim_backend.daqmx.card.numbers import RISING
from dearig.sim_backend.daqmx.card.signals import Signal
from dearig.sim_backend.daqmx.card.triggers import Pause
from dearig.sim_backend.daqmx.digital.measures import BY_TERMINAL, TWO_PULSES, UP, X1, X4, Measure

__all__ = ["Counting"]

_FEW = 64  # times for which edges are only counted


class Counting:
    """Value of a counter that counts edges or turns of an encoder, over time."""

    def __init__(self, channel: CounterChannel, signals: Callable[[str], Signal]) -> None:
        self._channel = channel
        self._signals = signals
        self._seen = 0.0
        self._value = 0
        self._offset = channel.initial  # position at a count of 0

    def start(self, now: float) -> None:
        """Begin at ``now``."""
        self._seen = now
        self._value = int(self._channel.initial) if self._is_count else 0
        self._offset = self._channel.initial

    @property
    def _is_count(self) -> bool:
        return self._channel.measure == Measure.COUNT_EDGES

    def at(self, times: np.ndarray, pause: Pause | None) -> tuple[np.ndarray, np.ndarray]:
        """Return the counts (n,) at ``times`` and the positions (n,) at which they are 0.

        The times are in rising order, and none is before the last ones.
        """
        if times.size < _FEW or self._channel.index:
            counts, offsets = np.zeros(times.size, dtype=np.int64), np.zeros(times.size)
            for i, time in enumerate(times.tolist()):
                counts[i], offsets[i] = self._advance(time, pause), self._offset
            return counts, offsets
        edges, steps = self._events(self._seen, float(times[-1]), pause)
        sums = self._value + np.concatenate(([0], np.cumsum(steps)))
        self._value, self._seen = int(sums[-1]), float(times[-1])
        counts = sums[np.searchsorted(edges, times, side="right")]
        return counts, np.full(times.size, self._offset)

    def _advance(self, time: float, pause: Pause | None) -> int:
        channel = self._channel
        if self._is_count and pause is None and channel.direction != BY_TERMINAL:
            counted = self._signals("input").count(self._seen, time, channel.edge == RISING)
            self._value += counted if channel.direction == UP else -counted
            self._seen = max(self._seen, time)
            return self._value
        reset = self._index(self._seen, time) if channel.index else None
        if reset is not None:
            self._seen, self._value, self._offset = reset, 0, channel.index_value
        _, steps = self._events(self._seen, time, pause)
        self._value += int(np.sum(steps))
        self._seen = max(self._seen, time)
        return self._value

    def _events(
        self, first: float, last: float, pause: Pause | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the times of the counter's steps, and by how much each steps."""
        if not self._is_count:
            return self._turns(first, last)
        channel = self._channel
        edges = self._signals("input").edges(first, last, channel.edge == RISING)
        if pause is not None and edges.size:
            edges = edges[pause.signal.level(edges) != pause.when_high]
        if channel.direction == BY_TERMINAL:
            steps = np.where(self._signals("direction").level(edges), 1, -1)
        else:
            steps = np.full(edges.size, 1 if channel.direction == UP else -1)
        return edges, steps

    def _turns(self, first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
        a, b = self._signals("a"), self._signals("b")
        decoding = self._channel.decoding
        if decoding == TWO_PULSES:
            up, down = a.edges(first, last, True), b.edges(first, last, True)
            return _in_order((up, np.ones(up.size)), (down, -np.ones(down.size)))
        # forwards A leads B: A rises while B is low
        parts = []
        a_up, a_down = a.edges(first, last, True), a.edges(first, last, False)
        up_forward, down_forward = ~b.level(a_up), b.level(a_down)
        if decoding == X1:
            parts = [(a_up, up_forward * 1), (a_down, ~down_forward * -1)]
        else:
            parts = [
                (a_up, np.where(up_forward, 1, -1)),
                (a_down, np.where(down_forward, 1, -1)),
            ]
        if decoding == X4:
            b_up, b_down = b.edges(first, last, True), b.edges(first, last, False)
            parts += [
                (b_up, np.where(a.level(b_up), 1, -1)),
                (b_down, np.where(a.level(b_down), -1, 1)),
            ]
        return _in_order(*parts)

    def _index(self, first: float, last: float) -> float | None:
        """Return when the index of the encoder last reset the position in this time, or None."""
        phase = self._channel.index_phase
        a_high, b_high = phase in (10040, 10041), phase in (10040, 10042)
        rises = [
            signal.edges(first, last, rising)
            for role, signal, rising in (
                ("z", self._signals("z"), True),
                ("a", self._signals("a"), a_high),
                ("b", self._signals("b"), b_high),
            )
        ]
        times = np.sort(np.concatenate(rises))
        if not times.size:
            return None
        matches = (
            self._signals("z").level(times)
            & (self._signals("a").level(times) == a_high)
            & (self._signals("b").level(times) == b_high)
        )
        found = times[matches]
        return float(found[-1]) if found.size else None


def _in_order(*parts: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    times = np.concatenate([part[0] for part in parts])
    steps = np.concatenate([part[1] for part in parts]).astype(np.int64)
    order = np.argsort(times, kind="stable")
    return times[order], steps[order]
