"""State of a rig's output at the end of a run, as far as it was measured."""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import Enum

__all__ = ["Known", "OutputState"]


class Known(Enum):
    """How the output is known; the values are those of the recording's ``output_state``."""

    CONFIRMED = "confirmed"  #: 0 V was set, and the voltage monitor reads 0 within its tolerance
    COMMANDED = "commanded"  #: 0 V was set; the rig has no reading of the monitor after that
    UNKNOWN = "unknown"  #: 0 V could not be set, or the voltage monitor reads another voltage


@dataclass(frozen=True)
class OutputState:
    """State of the output at ``at`` s since 1970.

    ``monitor`` is the reading of the voltage monitor in V at the film, None where it was not read,
    and ``tolerance`` the V within which it counts as 0 V (``limits.zero_tolerance_kV``).
    With ``by_guardian`` the guardian set 0 V, not the run.
    """

    known: Known
    at: float
    monitor: float | None = None
    by_guardian: bool = False
    tolerance: float | None = None

    @property
    def confirmed(self) -> bool:
        """True where the voltage monitor showed 0 V."""
        return self.known is Known.CONFIRMED

    @property
    def time(self) -> str:
        """Time of day, as 14:03:22."""
        return time.strftime("%H:%M:%S", time.localtime(self.at))

    @property
    def sentence(self) -> str:
        """What is known, with the time of day, and what to do where that is not 0 V."""
        if self.known is Known.CONFIRMED:
            by = "set by the guardian, confirmed" if self.by_guardian else "confirmed"
            return f"0 V {by} by the monitor at {self.time}{self._within}"
        if self.known is Known.COMMANDED:
            return f"0 V commanded at {self.time}, not confirmed"
        if self.monitor is not None:
            kilovolts = round(self.monitor * 1e-3, 2) + 0.0  # no -0.00
            return f"the monitor read {kilovolts:.2f} kV at {self.time}: switch the amplifier off"
        return f"unknown since {self.time}: switch the amplifier off"

    @property
    def _within(self) -> str:
        """What was read, and what counts as 0 V, for the end of a sentence."""
        if self.monitor is None or self.tolerance is None:
            return ""
        kilovolts = round(self.monitor * 1e-3, 2) + 0.0  # no -0.00
        return f" ({kilovolts:.2f} kV, within {self.tolerance * 1e-3:g} kV of 0)"
