"""Readings of the voltage monitor and the current besides a displacement, and their noise."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.errors import ModelError
from dearig.model.simulation.actuator import Drive

__all__ = [
    "CURRENT",
    "CURRENT_UNIT",
    "GAIN_ERROR",
    "VOLTAGE_MONITOR",
    "ChannelRecord",
    "ElectricRecord",
]

#: Names of the channels, as results have them.
VOLTAGE_MONITOR, CURRENT = "voltage_monitor", "current"
CURRENT_UNIT = "A"
#: Relative standard uncertainty of a monitor's scale where the rig file states none: 0.1 to 1 % of
#: full scale is what makers of high-voltage amplifiers specify.
GAIN_ERROR = 0.01


@dataclass(frozen=True)
class ChannelRecord:
    """Readings ``values`` (N,) of one electrical channel, in V at the film or in A.

    ``noise`` is the standard deviation of one reading at rest, ``lead_in`` the number of readings
    before the voltage. ``skew`` s is the time from the sample to its conversion. ``gain_error`` is
    the relative standard uncertainty of the channel's scale; its offset is taken as unknown.
    ``reason`` says why the channel cannot be used, "" where it can; ``values`` may then be empty.
    """

    name: str
    unit: str
    values: np.ndarray
    noise: float = 0.0
    lead_in: int = 0
    skew: float = 0.0
    gain_error: float = GAIN_ERROR
    reason: str = ""

    def __post_init__(self) -> None:
        if self.reason:
            return
        if not np.isfinite(self.values).all():
            raise ModelError(f"{self.name}: a reading is not a finite number")
        if not (math.isfinite(self.noise) and self.noise > 0.0):
            raise ModelError(f"{self.name}: noise = {self.noise!r} must be a finite number above 0")

    @property
    def used(self) -> bool:
        """Whether the channel can be used."""
        return not self.reason


@dataclass(frozen=True)
class ElectricRecord:
    """Electrical ``channels`` of a recording with what their prediction takes.

    ``drive`` (N,) is the command, ``displacement`` (N,) m the measured one from the rest state,
    whose first ``lead_in`` are at rest. The stretch that it gives is imposed on the circuit: a
    noise of 1 um in it, smoothed over 10 ms, makes 0.1 uA of noise in the current of the thesis's
    film.
    Where rows are ``means`` each is the mean over the interval about its time, else a reading at an
    instant.
    """

    name: str
    drive: Drive
    displacement: np.ndarray
    lead_in: int
    channels: tuple[ChannelRecord, ...]
    means: bool = False

    def __post_init__(self) -> None:
        for channel in self.channels:
            if channel.used and channel.values.shape != self.drive.time.shape:
                raise ModelError(
                    f"{self.name}: {channel.values.size} readings of {channel.name} at "
                    f"{self.drive.time.size} times"
                )

    @property
    def used(self) -> tuple[ChannelRecord, ...]:
        """The channels that can be used."""
        return tuple(c for c in self.channels if c.used)

    def held(self) -> ElectricRecord:
        """Return the same record under a voltage that is held between samples."""
        return replace(self, drive=replace(self.drive, hold=True))
