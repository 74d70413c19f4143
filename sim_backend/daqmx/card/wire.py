"""Outputs and digital lines of the card over time, and the resulting voltage at the film."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dearig.sim_backend.daqmx.card.acquisition import SharedTicks
from dearig.sim_backend.daqmx.card.output import Generation, Track
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.wiring import Wiring

__all__ = ["Change", "Wire"]

_AT_ONCE = 1 << 20  # samples processed at a time
_TRACED_MOST = 1 << 22  # samples of a repeated waveform that are searched for changes at a time
_HISTORY = 100_000  # changes that are kept, some 10 MB; a server may run for weeks


@dataclass(frozen=True)
class Change:
    """Change of the output at ``time`` s on the clock: to zero, from zero, or by a single value.

    From then on ``output`` V are at the card's terminal and ``wire`` V at the film.
    """

    time: float
    output: float
    wire: float


class Wire:
    """Outputs and digital lines of a card with ``wiring`` at its terminals.

    ``client`` changed the wired output last. What no task of the card can read any more is
    discarded.
    """

    def __init__(
        self, state: CardState, wiring: Wiring, outputs: Sequence[str], lines: Sequence[str]
    ) -> None:
        card = state.settings.card
        self._state = state
        self._wired = card.ao_command
        self._wiring = wiring
        self._tracks = {terminal: Track() for terminal in outputs}
        self.levels = dict.fromkeys(lines, False)
        self._enable = card.do_hv_enable
        self._enabled: list[tuple[float, bool]] = [(-math.inf, self._enable is None)]
        self.history: deque[Change] = deque(maxlen=_HISTORY)
        self._following: tuple[Generation, int] | None = None
        self._traced = 0  # ticks of the generation that are in the history
        self._away = False  # True while the output is not at zero
        self.client = ""
        self._trace(0.0, 0)

    @property
    def switched(self) -> bool:
        """Return True if a line enables the amplifier."""
        return self._enable is not None

    @property
    def track(self) -> Track:
        """Return the output that is wired to the amplifier."""
        return self._tracks[self._wired]

    def track_of(self, terminal: str) -> Track:
        """Return the output ``terminal``."""
        return self._tracks[terminal]

    def is_wired(self, terminal: str) -> bool:
        """Return True if ``terminal`` is wired to the amplifier."""
        return terminal == self._wired

    def film_voltage(self, now: float) -> float:
        """Return the voltage in V at the film."""
        if not self._enabled[-1][1]:
            return 0.0
        return self._wiring.film_voltage(self.track.standing(now))

    def output_voltage(self, now: float) -> float:
        """Return the voltage in V at the output's terminal."""
        return self._wiring.output_volts(self.track.standing(now))

    def row(self, generation: Generation) -> int | None:
        """Return the row of ``generation`` on the wired output, or None."""
        if self._following is None or self._following[0] is not generation:
            return None
        return self._following[1]

    def begin(self, generation: Generation, terminals: Sequence[str], client: str) -> None:
        """Make the outputs ``terminals`` follow the rows of ``generation``."""
        for row, terminal in enumerate(terminals):
            self._tracks[terminal].follow(generation, row)
            if terminal == self._wired:
                self._following, self._traced, self.client = (generation, row), 0, client

    def end(self, generation: Generation) -> None:
        """Handle the end of ``generation``; its last sample is held."""
        if self.row(generation) is not None:
            self._following = None

    def set_output(self, terminal: str, counts: int, now: float, client: str = "") -> None:
        """Hold an output at ``counts``."""
        self._tracks[terminal].set(now, counts)
        if terminal == self._wired:
            self.client = client
            self._away = abs(counts - self._wiring.zero) > 1
            self._trace(now, counts)

    def set_line(self, line: str, level: bool, now: float) -> None:
        """Set a digital line."""
        self.levels[line] = level
        if line == self._enable and level is not self._enabled[-1][1]:
            self._enabled.append((now, level))
            self._trace(now, self.track.standing(now))

    def disable(self, now: float) -> None:
        """Set the line that enables the amplifier low, where there is one."""
        if self._enable is not None:
            self.set_line(self._enable, False, now)

    def follow(self, now: float) -> None:
        """Add the output up to ``now`` to the history."""
        if self._following is None:
            return
        generation, row = self._following
        ticks = generation.ticks(now)
        # the present sample is on the output too, unless the end has counted it
        end = ticks if generation.finished(now) else ticks + 1
        if end <= self._traced:
            return
        if generation.waveform.loops:
            # on a clock that jumps, a repeated waveform has no end of changes
            self._traced = max(self._traced, end - _TRACED_MOST)
        while self._traced < end:
            last = min(end, self._traced + _AT_ONCE)
            counts = generation.at_ticks(np.arange(self._traced, last))[row].astype(np.int64)
            away = np.abs(counts - self._wiring.zero) > 1
            for at in np.flatnonzero(np.diff(away, prepend=self._away)):
                self._trace(generation.due(self._traced + int(at)), int(counts[at]))
            self._away = bool(away[-1])
            self._traced = last
        generation.waveform.drop_before(max(0, min(self._traced - 1, self._oldest(generation))))

    def _oldest(self, generation: Generation) -> int:
        """Return the first tick of ``generation`` that a task may still read, or its last one."""
        oldest = generation.waveform.written
        for task in self._state.tasks.values():
            if task.ticks is None or not task.running:
                continue
            keeps = task.run.keeps if task.run is not None else 0
            if isinstance(task.ticks, SharedTicks):
                needed = task.ticks.needs(generation, keeps)
                if needed is not None:
                    oldest = min(oldest, needed)
            elif task.ticks.start is not None:
                time = float(task.ticks.times(keeps, keeps + 1)[0])
                oldest = min(oldest, math.floor((time - generation.start) * generation.rate) - 1)
        return oldest

    def forget(self, now: float) -> None:
        """Discard the outputs before the earliest time that a task may still read."""
        time = now
        for task in self._state.tasks.values():
            if task.ticks is not None and task.running and task.ticks.passed(now):
                keeps = task.run.keeps if task.run is not None else 0
                time = min(time, float(task.ticks.times(keeps, keeps + 1)[0]))
        for track in self._tracks.values():
            track.forget_before(time)
        while len(self._enabled) > 1 and self._enabled[1][0] <= time:
            del self._enabled[0]

    def gated(self, counts: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return ``counts`` (n,) of the output with those of 0 V while the amplifier is off."""
        if self._enable is None:
            return counts
        since = np.array([time for time, _ in self._enabled])
        level = np.array([level for _, level in self._enabled])
        enabled = level[np.searchsorted(since, times, side="right") - 1]
        return np.where(enabled, counts, np.int16(self._wiring.zero))

    def _trace(self, now: float, counts: int) -> None:
        output = self._wiring.output_volts(counts)
        wire = self._wiring.film_voltage(counts) if self._enabled[-1][1] else 0.0
        self.history.append(Change(self._state.born + now, output, wire))
