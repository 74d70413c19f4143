"""What is known of a rig's output after a run: from its own reading, its guardian, or the samples.

A driver need not read the monitor after it has set 0 V. Then the last samples of the run decide,
where their command is 0 V.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from dearig.drivers.channels import Channel
from dearig.drivers.rig import Block, Rig
from dearig.drivers.zero_reading import ZeroReading
from dearig.output_state import Known, OutputState

__all__ = ["LastSamples", "after_run", "unknown"]

_AVERAGED = 10  # samples whose mean is one reading; a driver averages as many


class LastSamples:
    """The newest samples of a run with these ``channels``; ``tolerance`` in V counts as 0 V."""

    def __init__(self, channels: Sequence[Channel], tolerance: float) -> None:
        self._channels = {channel.name: (i, channel) for i, channel in enumerate(channels)}
        self.tolerance = tolerance
        self._counts: np.ndarray | None = None  # of the newest samples
        self._at = 0.0

    def take(self, block: Block) -> None:
        """Note the newest samples."""
        self._counts, self._at = block.counts[:, -_AVERAGED:].copy(), time.time()

    def zero_reading(self) -> ZeroReading | None:
        """Return the monitor's reading where the command is 0 V, else None."""
        if self._counts is None or self._counts.shape[1] == 0:
            return None
        command, monitor = self._values("voltage_command"), self._values("voltage_monitor")
        if command is None or monitor is None:
            return None
        if np.abs(command).max() > self.tolerance:
            return None
        voltage = float(monitor.mean())
        return ZeroReading(voltage, self._at, abs(voltage) <= self.tolerance)

    def _values(self, name: str) -> np.ndarray | None:
        if self._counts is None or name not in self._channels:
            return None
        row, channel = self._channels[name]
        return channel.scaling.physical(self._counts[row])


def after_run(rig: Rig, last: LastSamples | None = None, *, failed: bool = False) -> OutputState:
    """Return the state of the output after ``make_safe``, which has ``failed`` or not."""
    acted = getattr(rig, "taken_over", None)
    tolerance = None if last is None else last.tolerance
    reading = None if failed else getattr(rig, "zero_reading", None)
    if reading is None and acted is not None and acted.confirmed:
        at = acted.at + acted.seconds
        return OutputState(Known.CONFIRMED, at, acted.monitor, True, tolerance)
    if failed:
        return unknown(rig)
    if reading is None and last is not None:
        reading = last.zero_reading()
    if reading is None:
        return OutputState(Known.COMMANDED, time.time())
    known = Known.CONFIRMED if reading.confirmed else Known.UNKNOWN
    return OutputState(known, reading.at, reading.voltage, tolerance=tolerance)


def unknown(rig: Rig | None = None, monitor: float | None = None) -> OutputState:
    """Return the state of an output that may carry a voltage, with the last ``monitor`` reading."""
    reading = getattr(rig, "zero_reading", None)
    acted = getattr(rig, "taken_over", None)
    if reading is not None:
        monitor = reading.voltage
    elif acted is not None:
        monitor = acted.monitor
    return OutputState(Known.UNKNOWN, time.time(), monitor)
