"""Outputs and digital lines of the card over time, and the voltage that reached the film."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dearig.drivers.settings import CardSettings
from dearig.sim_backend.daqmx.output import Generation, Track
from dearig.sim_backend.daqmx.wiring import Wiring

__all__ = ["Change", "Wire"]

_AT_ONCE = 1 << 20  # samples that are looked through


@dataclass(frozen=True)
class Change:
    """The output arrived at or left its zero at ``time`` s on the clock, or was set.

    ``output`` V stand at the card's terminal and ``wire`` V at the film from then on.
    """

    time: float
    output: float
    wire: float


class Wire:
    """The ``outputs`` and digital ``lines`` of a card with ``wiring`` at its terminals.

    Times are in s since ``born`` on the clock. ``client`` is who moved the wired output last.
    """

    def __init__(
        self,
        card: CardSettings,
        wiring: Wiring,
        outputs: Sequence[str],
        lines: Sequence[str],
        born: float,
    ) -> None:
        self._wired = card.ao_command
        self._wiring = wiring
        self._born = born
        self._tracks = {terminal: Track() for terminal in outputs}
        self.levels = dict.fromkeys(lines, False)
        self._enable = card.do_hv_enable
        self._enabled: list[tuple[float, bool]] = [(-math.inf, self._enable is None)]
        self.history: list[Change] = []
        self._following: tuple[Generation, int] | None = None
        self._traced = 0  # ticks of it that the history knows
        self._away = False  # from zero
        self.client = ""
        self._trace(0.0, 0)

    @property
    def switched(self) -> bool:
        """Whether a line enables the amplifier."""
        return self._enable is not None

    @property
    def track(self) -> Track:
        """The output that the amplifier is wired to."""
        return self._tracks[self._wired]

    def film_voltage(self, now: float) -> float:
        """V at the film."""
        if not self._enabled[-1][1]:
            return 0.0
        return self._wiring.film_voltage(self.track.standing(now))

    def output_voltage(self, now: float) -> float:
        """V at the output's terminal."""
        return self._wiring.output_volts(self.track.standing(now))

    def row(self, generation: Generation) -> int | None:
        """Row of ``generation`` that is on the wired output; None: it is not there."""
        if self._following is None or self._following[0] is not generation:
            return None
        return self._following[1]

    def begin(self, generation: Generation, terminals: Sequence[str], client: str) -> None:
        """Let the outputs ``terminals`` follow the rows of ``generation``."""
        for row, terminal in enumerate(terminals):
            self._tracks[terminal].follow(generation, row)
            if terminal == self._wired:
                self._following, self._traced, self.client = (generation, row), 0, client

    def end(self, generation: Generation) -> None:
        """``generation`` has ended, and its last sample stands."""
        if self.row(generation) is not None:
            self._following = None

    def set_output(self, terminal: str, counts: int, now: float, client: str = "") -> None:
        """Let an output stand at ``counts``."""
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
        """Take the line that enables the amplifier low, where there is one."""
        if self._enable is not None:
            self.set_line(self._enable, False, now)

    def follow(self, now: float, oldest: Callable[[Generation], int]) -> None:
        """Take into the history what was put out up to ``now``.

        ``oldest`` gives the first tick of a generation that a task may still read; what was
        before is forgotten.
        """
        if self._following is None:
            return
        generation, row = self._following
        ticks = generation.ticks(now)
        # the sample that stands is out as well, unless it was counted at the end
        end = ticks if generation.finished(now) else ticks + 1
        if end <= self._traced:
            return
        while self._traced < end:
            last = min(end, self._traced + _AT_ONCE)
            counts = generation.at_ticks(np.arange(self._traced, last))[row].astype(np.int64)
            away = np.abs(counts - self._wiring.zero) > 1
            for at in np.flatnonzero(np.diff(away, prepend=self._away)):
                self._trace(generation.due(self._traced + int(at)), int(counts[at]))
            self._away = bool(away[-1])
            self._traced = last
        generation.waveform.drop_before(max(0, min(self._traced - 1, oldest(generation))))

    def forget_before(self, time: float) -> None:
        """Nobody will ask for what the outputs were before ``time``."""
        for track in self._tracks.values():
            track.forget_before(time)

    def gated(self, counts: np.ndarray, times: np.ndarray) -> np.ndarray:
        """``counts`` (n,) on the output as the amplifier follows them: not, while not enabled."""
        if self._enable is None:
            return counts
        since = np.array([time for time, _ in self._enabled])
        level = np.array([level for _, level in self._enabled])
        enabled = level[np.searchsorted(since, times, side="right") - 1]
        return np.where(enabled, counts, np.int16(self._wiring.zero))

    def _trace(self, now: float, counts: int) -> None:
        output = self._wiring.output_volts(counts)
        wire = self._wiring.film_voltage(counts) if self._enabled[-1][1] else 0.0
        self.history.append(Change(self._born + now, output, wire))
