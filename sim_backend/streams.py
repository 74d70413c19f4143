"""Random generators of the simulated instruments, all derived from the seed of a rig.

Each instrument, run and chunk has its own generator. A chunk can therefore be computed again, or
left out, and all other noise stays the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Streams"]

_INSTRUMENTS = ("card", "amplifier", "laser", "thermometer", "film", "channels", "laser_noise")


@dataclass(frozen=True)
class Streams:
    """Generators of one rig; ``seed`` is a sequence of whole numbers from 0 up."""

    seed: tuple[int, ...]

    def of_instrument(self, instrument: str) -> np.random.Generator:
        """Return the generator of an instrument's permanent properties, such as its calibration."""
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
