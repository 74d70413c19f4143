"""Channels of a rig, with the scaling of converter counts to physical values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

__all__ = ["BAND_ENDINGS", "CHANNEL_NAMES", "HUMIDITY", "RESERVED_NAMES", "Channel", "Scaling"]

#: Built-in channels in the order of a block's rows. Channels that a rig file declares follow them.
CHANNEL_NAMES = (
    "voltage_command",
    "voltage_monitor",
    "current_monitor",
    "displacement",
    "temperature",
)

#: Name of a declared channel that is the relative humidity near the film, in per cent.
HUMIDITY = "relative_humidity"

#: Endings of the names of a prediction's band next to its signal: both ends of 95 %, and the
#: standard deviations of its parts.
BAND_ENDINGS = ("low95", "high95", "sd_parameters", "sd_noise", "sd_law")

#: Reserved names: recordings use them otherwise, so a rig file cannot give them to a channel.
RESERVED_NAMES = (
    *CHANNEL_NAMES,
    "time",
    "displacement_model",
    "stretch",
    "nominal_stress",
    *(f"{signal}_{end}" for signal in ("displacement", "nominal_stress") for end in BAND_ENDINGS),
)

COUNT_MIN, COUNT_MAX = -32768, 32767

_BEND_MAX = 0.01
_INVERSION_TOLERANCE = 1e-3  # counts


@dataclass(frozen=True)
class Scaling:
    """Scaling of int16 counts to a value: offset + gain * volts, volts = polynomial(counts).

    ``coefficients`` are the card's own, lowest power first, in V; ``gain`` is in the channel's unit
    per volt and ``offset`` in its unit.
    """

    coefficients: tuple[float, ...]
    gain: float
    offset: float = 0.0

    def physical(self, counts: np.ndarray) -> np.ndarray:
        """Physical values (float64) of ``counts``, any shape."""
        return self.offset + self.gain * _polynomial(counts.astype(np.float64), self.coefficients)

    def counts(self, physical: np.ndarray) -> np.ndarray:
        """Return the nearest int16 counts of ``physical``, saturated at the converter's ends.

        Raises ``ValueError`` where the higher coefficients change the slope by more than 1 % of its
        first order: the iteration used here does not converge then, and no real converter is so
        nonlinear.
        """
        constant, first, *higher = self.coefficients
        # largest change of the slope by the higher terms, relative to the first order
        bend = sum(p * abs(c / first) * COUNT_MAX ** (p - 1) for p, c in enumerate(higher, start=2))
        if not bend <= _BEND_MAX:
            raise ValueError(
                f"only a nearly linear scaling can be inverted, not {self.coefficients}"
            )
        volts = (np.asarray(physical, dtype=np.float64) - self.offset) / self.gain
        raw = (volts - constant) / first
        linear, error = raw, bend * COUNT_MAX
        while error > _INVERSION_TOLERANCE:  # each iteration multiplies the error by this change
            raw = np.clip(raw, COUNT_MIN, COUNT_MAX)
            bent = _polynomial(raw, higher) * raw * raw
            raw = linear - bent / first
            error *= bend
        return np.clip(np.rint(raw), COUNT_MIN, COUNT_MAX).astype(np.int16)


def _polynomial(x: np.ndarray, coefficients: Sequence[float]) -> np.ndarray:
    """Return the polynomial in ``x`` with ``coefficients``, lowest power first.

    NumPy's own function takes several times as long for a block of samples.
    """
    value = np.full_like(x, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = coefficient + value * x
    return value


@dataclass(frozen=True)
class Channel:
    """Channel with its ``name``, SI ``unit``, scaling and timing.

    ``name`` is one of ``CHANNEL_NAMES`` or one that the rig file declares. ``label`` is the
    displayed name; where it is empty, ``name`` is displayed.

    ``skew`` is the time in s from the sample clock's tick to this channel's conversion, since a
    multiplexed converter takes one channel after another. ``delay`` is the known lag in s of the
    instrument itself, such as half a laser's averaging window; ``delay_error`` is the amount by
    which it may differ from run to run.
    """

    name: str
    unit: str
    scaling: Scaling
    skew: float = 0.0
    delay: float = 0.0
    delay_error: float = 0.0
    label: str = ""
