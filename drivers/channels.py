"""Channels of a rig: what each count of a converter means."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["CHANNEL_NAMES", "RESERVED_NAMES", "Channel", "Scaling"]

#: The channels that this program knows, in the order in which blocks hold them. Those that a rig
#: file declares come after them.
CHANNEL_NAMES = (
    "voltage_command",
    "voltage_monitor",
    "current_monitor",
    "displacement",
    "temperature",
)

#: Names that a rig file cannot give a channel: recordings use them for something else.
RESERVED_NAMES = (*CHANNEL_NAMES, "time", "displacement_model", "stretch", "nominal_stress")

COUNT_MIN, COUNT_MAX = -32768, 32767

_BEND_MAX = 0.01
_INVERSION_TOLERANCE = 1e-3  # counts


@dataclass(frozen=True)
class Scaling:
    """From int16 counts to a physical value: offset + gain volts, volts = polynomial(counts).

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

        Raises ``ValueError`` where the higher coefficients bend the scaling by more than 1 % of its
        first order: then the counts are not found by the iteration used here, and no converter is
        that crooked.
        """
        constant, first, *higher = self.coefficients
        # how much the higher terms can bend the slope, of the first order
        bend = sum(p * abs(c / first) * COUNT_MAX ** (p - 1) for p, c in enumerate(higher, start=2))
        if not bend <= _BEND_MAX:
            raise ValueError(
                f"only a nearly linear scaling can be inverted, not {self.coefficients}"
            )
        volts = (np.asarray(physical, dtype=np.float64) - self.offset) / self.gain
        raw = (volts - constant) / first
        linear, error = raw, bend * COUNT_MAX
        while error > _INVERSION_TOLERANCE:  # each round shrinks the error by the bend
            raw = np.clip(raw, COUNT_MIN, COUNT_MAX)
            bent = np.polynomial.polynomial.polyval(raw, higher) * raw * raw
            raw = linear - bent / first
            error *= bend
        return np.clip(np.rint(raw), COUNT_MIN, COUNT_MAX).astype(np.int16)


@dataclass(frozen=True)
class Channel:
    """One channel: its ``name``, SI ``unit``, scaling and timing.

    ``name`` is one of ``CHANNEL_NAMES`` or one that the rig file declares; ``label`` is what a
    person reads, and empty where the name does.

    ``skew`` is the time in s after the sample clock's tick at which this channel is converted (a
    multiplexed converter takes one channel after another). ``delay`` is the known lag in s of the
    instrument itself, such as half a laser's averaging window; ``delay_error`` that by which it may
    be more or less, in one run as against another.
    """

    name: str
    unit: str
    scaling: Scaling
    skew: float = 0.0
    delay: float = 0.0
    delay_error: float = 0.0
    label: str = ""
