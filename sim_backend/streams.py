"""Random numbers of the simulated instruments, all from the one seed of a rig.

Every draw has its own place (instrument, run, chunk), so that a chunk of a run can be computed
again, or not at all, without shifting the noise of anything else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Streams"]

_INSTRUMENTS = ("card", "amplifier", "laser", "thermometer", "film", "channels")


@dataclass(frozen=True)
class Streams:
    """The generators of one rig; ``seed`` is any row of whole numbers from 0 up."""

    seed: tuple[int, ...]

    def of_instrument(self, instrument: str) -> np.random.Generator:
        """Return the generator of what an instrument always has, such as its calibration."""
        return self._generator(_INSTRUMENTS.index(instrument))

    def before_run(self, instrument: str, run: int) -> np.random.Generator:
        """Return the generator of an instrument's state at the start of a run."""
        return self._generator(_INSTRUMENTS.index(instrument), run, 0)

    def of_chunk(self, instrument: str, run: int, chunk: int) -> np.random.Generator:
        """Return the generator of the noise in chunk 0, 1, 2, .. of a run."""
        return self._generator(_INSTRUMENTS.index(instrument), run, 1 + chunk)

    def _generator(self, *place: int) -> np.random.Generator:
        return np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(self.seed, spawn_key=place))
        )
