"""Limits of the voltage that control may ask for, and the nearest waveform within them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dearig.model.errors import ModelError

__all__ = ["VoltageLimits"]

_INSIDE = 1e-6  # of a limit: rounding of the waveform on its way to the output stays within it
_INSIDE_FIELD = 0.01  # of the field: two models of one film differ by less in its thickness


@dataclass(frozen=True)
class VoltageLimits:
    """Limits of the voltage at the film, in SI units.

    ``voltage`` in V is the highest; the lowest is 0 V, because the film is pulled either way.
    ``slew`` in V/s bounds the change from sample to sample, ``field`` in V/m the true field.
    """

    voltage: float
    slew: float = np.inf
    field: float = np.inf

    def __post_init__(self) -> None:
        for name in ("voltage", "slew", "field"):
            if not getattr(self, name) > 0.0:
                raise ModelError(f"limits: {name} = {getattr(self, name)!r} must be above 0")

    @property
    def highest_field(self) -> float:
        """The highest true field in V/m that a voltage is computed for."""
        return self.field * (1.0 - _INSIDE_FIELD)

    def ceiling(self, thickness: np.ndarray) -> np.ndarray:
        """Return the highest voltage (N,) in V for a film of ``thickness`` (N,) m."""
        return np.minimum(self.voltage * (1.0 - _INSIDE), self.highest_field * thickness)

    def nearest(self, voltage: np.ndarray, ceiling: np.ndarray, rate: float) -> np.ndarray:
        """Return a waveform (N,) V within the limits from ``voltage`` (N,), whatever that is.

        It starts and ends at 0 V. ``ceiling`` (N,) is the highest voltage, ``rate`` in Hz that of
        the samples. Where the slope is too steep, the voltage is lowered, never raised. A value
        that is not a number becomes 0 V.
        """
        top = np.clip(np.nan_to_num(ceiling, nan=0.0), 0.0, self.voltage * (1.0 - _INSIDE))
        wanted = np.nan_to_num(voltage, nan=0.0, posinf=self.voltage, neginf=0.0)
        inside = np.clip(wanted, 0.0, top)
        inside[0] = inside[-1] = 0.0
        if not np.isfinite(self.slew):
            return inside
        # the greatest function below it that is nowhere steeper, from either side
        most = self.slew * (1.0 - _INSIDE) / rate
        if np.abs(np.diff(inside)).max(initial=0.0) <= most:
            return inside
        steps = most * np.arange(inside.size)
        inside = np.minimum.accumulate(inside - steps) + steps
        back = steps[::-1]
        inside = (np.minimum.accumulate((inside - back)[::-1]))[::-1] + back
        inside[0] = inside[-1] = 0.0
        return np.maximum(inside, 0.0)
