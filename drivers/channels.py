"""Channels of a rig: what each count of a converter means."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["CHANNEL_NAMES", "Channel", "Scaling"]

#: Every channel a rig may deliver, in the order in which blocks hold them.
CHANNEL_NAMES = (
    "voltage_command",
    "voltage_monitor",
    "current_monitor",
    "displacement",
    "temperature",
)

COUNT_MIN, COUNT_MAX = -32768, 32767


@dataclass(frozen=True)
class Scaling:
    """From int16 counts to a physical value: volts = polynomial(counts), value = offset + gain volts.

    ``coefficients`` are the card's own, lowest power first, in V; ``gain`` is in the channel's unit
    per volt and ``offset`` in its unit.
    """

    coefficients: tuple[float, ...]
    gain: float
    offset: float = 0.0

    def physical(self, counts: np.ndarray) -> np.ndarray:
        """Physical values (float64) of ``counts``, any shape."""
        volts = np.polynomial.polynomial.polyval(counts.astype(np.float64), self.coefficients)
        return self.offset + self.gain * volts

    def counts(self, physical: np.ndarray) -> np.ndarray:
        """Nearest int16 counts of ``physical``, saturating at the converter's ends.

        Only for scalings of first order, as converters' ideal ones are.
        """
        if len(self.coefficients) != 2:
            raise ValueError(f"only a linear scaling can be inverted, not {self.coefficients}")
        volts = (np.asarray(physical, dtype=np.float64) - self.offset) / self.gain
        raw = np.rint((volts - self.coefficients[0]) / self.coefficients[1])
        return np.clip(raw, COUNT_MIN, COUNT_MAX).astype(np.int16)


@dataclass(frozen=True)
class Channel:
    """One channel: its ``name`` (of ``CHANNEL_NAMES``), SI ``unit``, scaling and timing.

    ``skew`` is the time in s after the sample clock's tick at which this channel is converted (a
    multiplexed converter takes one channel after another). ``delay`` is the known lag in s of the
    instrument itself, such as half a laser's averaging window.
    """

    name: str
    unit: str
    scaling: Scaling
    skew: float = 0.0
    delay: float = 0.0
