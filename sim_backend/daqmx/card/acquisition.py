"""One run of the card's inputs: the times of the samples and the counts at each."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dearig.sim_backend.daqmx.card.output import TICK_TOLERANCE, Generation, Track
from dearig.sim_backend.daqmx.card.triggers import SampleTicks
from dearig.sim_backend.signal_path import CHUNK, PathState, SignalPath

__all__ = ["OwnTicks", "Run", "SharedTicks", "Ticks"]


class OwnTicks:
    """Samples on their own clock of ``rate`` Hz that starts at ``start`` s; None: not started."""

    def __init__(self, rate: float, start: float | None) -> None:
        self.rate = rate
        self.start = start

    def passed(self, now: float) -> int:
        """Return the number of samples that are complete at ``now``."""
        if self.start is None:
            return 0
        return max(0, math.floor((now - self.start) * self.rate + TICK_TOLERANCE))

    def due(self, samples: int, now: float) -> float | None:  # noqa: ARG002
        """Return the time in s at which ``samples`` are complete, or None where it is unknown."""
        return None if self.start is None else self.start + samples / self.rate

    def times(self, first: int, last: int) -> np.ndarray:
        """Return the times (n,) s of the samples from ``first`` to before ``last``."""
        return (self.start or 0.0) + np.arange(first, last) / self.rate

    def commands(
        self,
        first: int,
        last: int,
        track: Track,
        *,
        wired: bool = True,  # noqa: ARG002
    ) -> np.ndarray:
        """Return the counts (n,) on the output of ``track`` at these samples."""
        return track.at(self.times(first, last))


@dataclass(frozen=True)
class _Piece:
    """Piece of a record: from sample ``first`` on, one at each tick of ``generation``."""

    first: int
    generation: Generation
    tick: int
    row: int | None  # of the output that is wired to the rig


class SharedTicks:
    """Samples on the output's sample clock, which runs while an output task generates."""

    def __init__(self) -> None:
        self._pieces: list[_Piece] = []

    def follow(self, generation: Generation, tick: int, row: int | None, now: float) -> None:
        """Take samples from now on at the ticks of ``generation``, the first at its ``tick``."""
        self._pieces.append(_Piece(self.passed(now), generation, tick, row))

    @property
    def start(self) -> float | None:
        """Return None: it has no start of its own."""
        return None

    @property
    def rate(self) -> float:
        """Return the rate in Hz of the output on whose clock it started."""
        return self._pieces[0].generation.rate

    def passed(self, now: float) -> int:
        """Return the number of samples that are complete at ``now``."""
        if not self._pieces:
            return 0
        piece = self._pieces[-1]
        return piece.first + max(0, piece.generation.ticks(now) - piece.tick)

    def due(self, samples: int, now: float) -> float | None:
        """Return the time in s at which ``samples`` are complete, or None where it is unknown."""
        if not self._pieces:
            return None
        piece = self._pieces[-1]
        tick = piece.tick + samples - piece.first
        generation = piece.generation
        if generation.finished(now) or (generation.total is not None and tick > generation.total):
            return None
        # it may run out of samples before that; a reader then checks again at this time
        return generation.due(tick)

    def times(self, first: int, last: int) -> np.ndarray:
        """Return the times (n,) s of the samples from ``first`` to before ``last``."""
        parts = [p.generation.start + t / p.generation.rate for p, t in self._split(first, last)]
        return np.concatenate(parts)

    def commands(self, first: int, last: int, track: Track, *, wired: bool = True) -> np.ndarray:
        """Return the counts (n,) on the output of ``track`` at these samples.

        ``wired`` is True for the output to the amplifier.
        """
        parts = []
        for piece, ticks in self._split(first, last):
            if piece.row is None or not wired:
                start, rate = piece.generation.start, piece.generation.rate
                parts.append(track.at(start + ticks / rate))
            else:
                parts.append(piece.generation.at_ticks(ticks)[piece.row])
        return np.concatenate(parts)

    def needs(self, generation: Generation, sample: int) -> int | None:
        """Return the first tick of ``generation`` needed from ``sample`` on, or None."""
        ticks = [
            piece.tick + max(0, sample - piece.first)
            for piece in self._pieces
            if piece.generation is generation
        ]
        return min(ticks) if ticks else None

    def _split(self, first: int, last: int) -> list[tuple[_Piece, np.ndarray]]:
        parts = []
        for i, piece in enumerate(self._pieces):
            end = self._pieces[i + 1].first if i + 1 < len(self._pieces) else last
            samples = np.arange(max(first, piece.first), min(last, end))
            if samples.size:
                parts.append((piece, piece.tick + samples - piece.first))
        return parts


Ticks = OwnTicks | SharedTicks | SampleTicks


class Run:
    """Run of the rig from rest, sample by sample, under the counts of ``command``.

    ``command(first, last)`` returns the counts (n,) of these samples. Counts of past samples are
    final; later ones are expected values. A chunk is computed again from its start where an
    expected value was wrong. The result therefore does not depend on the sizes of reads and writes.
    """

    def __init__(
        self, path: SignalPath, state: PathState, command: Callable[[int, int], np.ndarray]
    ) -> None:
        self._path = path
        self._command = command
        self._chunk = -1
        self._before = state  # before the newest chunk
        self._after = state  # after the newest chunk
        self._used = np.empty(0, dtype=np.int16)  # commands from which it was computed
        self._checked = 0  # number of them that are known to be final
        self._counts = np.empty((0, 0), dtype=np.int16)

    @property
    def keeps(self) -> int:
        """Return the first sample whose command may be needed again."""
        return max(0, self._chunk) * CHUNK

    def read(self, first: int, last: int) -> np.ndarray:
        """Return counts (channels, n) int16 from ``first`` to before ``last``, in rising order."""
        parts = []
        while first < last:
            chunk = first // CHUNK
            end = min(last, (chunk + 1) * CHUNK)
            while self._chunk < chunk:
                # the next chunk must start from final commands
                if self._chunk >= 0:
                    self._confirm(CHUNK)
                self._chunk += 1
                self._before = self._after
                self._compute()
            self._confirm(end - chunk * CHUNK)
            parts.append(self._counts[:, first - chunk * CHUNK : end - chunk * CHUNK])
            first = end
        return np.concatenate(parts, axis=1) if len(parts) != 1 else parts[0]

    def _confirm(self, samples: int) -> None:
        """Ensure that the first ``samples`` of the chunk were computed from final commands."""
        if samples <= self._checked:
            return
        start = self._chunk * CHUNK
        true = self._command(start + self._checked, start + samples)
        if not np.array_equal(true, self._used[self._checked : samples]):
            self._compute()
        self._checked = samples

    def _compute(self) -> None:
        start = self._chunk * CHUNK
        self._used = self._command(start, start + CHUNK)
        self._checked = 0
        self._counts, _, self._after = self._path.advance(self._chunk, self._used, self._before)
