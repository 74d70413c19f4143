"""Output counts of a run: those of its waveform, and after a stop those of the ramp to 0 V."""

from __future__ import annotations

import numpy as np

from dearig.drivers.channels import Scaling
from dearig.drivers.gate import GatedWaveform, ramp_down

__all__ = ["Command"]


class Command:
    """Output counts of a run that plays ``waveform``, with the ``scaling`` of the output.

    They are computed on request: a long waveform is never held whole. Of a waveform
    that grows, only the first ``available`` samples can be had.
    """

    def __init__(self, waveform: GatedWaveform, scaling: Scaling) -> None:
        self._waveform = waveform
        self._scaling = scaling
        self._played = waveform.samples  # of the waveform
        self._ramp = np.empty(0, dtype=np.int16)
        self._left = False  # True once a ramp has replaced the rest of the waveform

    @property
    def samples(self) -> int:
        """Return the number of samples, with the ramp."""
        return self._played + self._ramp.size

    @property
    def available(self) -> int:
        """Return the number of samples that may be output now: all, unless the waveform grows."""
        return self.samples if self._left else self._waveform.admitted

    @property
    def block(self) -> int:
        """Return the samples that become available together, 0 where all are from the start."""
        return self._waveform.block

    def window(self, start: int, stop: int) -> np.ndarray:
        """Return the counts (n,) int16 of the samples ``start`` to ``stop``, a slice.

        Raises ``ChangedWaveform`` as ``GatedWaveform.window`` does.
        """
        played = self._scaling.counts(self._waveform.window(start, min(stop, self._played)))
        if stop <= self._played:
            return played
        ramp = self._ramp[max(0, start - self._played) : stop - self._played]
        return np.concatenate((played, ramp))

    def ramp_from(self, played: int, duration: float) -> tuple[float, int]:
        """Leave the waveform after its first ``played`` samples, with a ramp to 0 V.

        ``duration`` in s is that of ``ramp_down``. Returns the voltage in V at which the ramp
        begins, and its samples.
        """
        ramp = ramp_down(self._waveform, played - 1, duration)
        begins = float(self._waveform.window(played - 1, played)[0])
        self._left = True
        self._played, self._ramp = played, self._scaling.counts(ramp)
        return begins, ramp.size
