"""Electrical channels of a recording: which can be used, their noise, and why others cannot."""

from __future__ import annotations

import numpy as np

from dearig.analysis.readings.faults import clipped
from dearig.analysis.readings.scales import scale_errors
from dearig.model.readings.channels import (
    CURRENT,
    CURRENT_UNIT,
    VOLTAGE_MONITOR,
    ChannelRecord,
    ElectricRecord,
)
from dearig.model.readings.noise import noise_of
from dearig.model.simulation.actuator import Drive
from dearig.recording.content.rest_noise import MIN_QUIET
from dearig.recording.reading.recording import Recording

__all__ = ["electric_of"]


def electric_of(
    recording: Recording, voltage: Drive, displacement: np.ndarray, drive: str
) -> ElectricRecord | None:
    """Return the voltage monitor and the current of ``recording``; None where it has neither.

    ``voltage`` is the command, ``displacement`` (N,) m that from the rest state without masked
    readings. Where the monitor is the ``drive`` of the model it says nothing of the amplifier.
    """
    given = {
        VOLTAGE_MONITOR: (recording.voltage_monitor, "V"),
        CURRENT: (recording.current_monitor, CURRENT_UNIT),
    }
    if drive == "monitor":
        given[VOLTAGE_MONITOR] = (None, "V")
    if all(values is None for values, _ in given.values()):
        return None
    channels = tuple(
        _channel(recording, name, unit, values, voltage.voltage)
        for name, (values, unit) in given.items()
    )
    return ElectricRecord(
        recording.name,
        voltage,
        displacement,
        recording.quiet_samples,
        channels,
        means=recording.average > 1,
    )


def _channel(
    recording: Recording, name: str, unit: str, values: np.ndarray | None, command: np.ndarray
) -> ChannelRecord:
    """Return one channel; ``reason`` says why it cannot be used."""

    def unusable(reason: str) -> ChannelRecord:
        return ChannelRecord(name, unit, np.zeros(0), reason=reason)

    if values is None:
        return unusable("not recorded")
    if not np.isfinite(values).all():
        return unusable("a part of its readings is missing")
    if not np.ptp(values) > 0.0:
        return unusable("never changes: not wired, or not connected")
    rest = values[: recording.quiet_samples]
    # at rest a film draws nothing, whatever is slow there is noise
    noise = float(np.std(rest)) if rest.size >= MIN_QUIET else 0.0
    noise = noise or noise_of(values)
    if not noise > 0.0:
        return unusable("shows no noise: these are not readings of an instrument")
    if _is_clipped(values, command, noise):
        return unusable("clipped: the largest readings are all alike")
    skew = {c.name: c.skew for c in recording.channels}.get(
        VOLTAGE_MONITOR if name == VOLTAGE_MONITOR else "current_monitor", 0.0
    )
    error = scale_errors(recording).of_channel(name)
    return ChannelRecord(name, unit, values, noise, recording.quiet_samples, max(skew, 0.0), error)


def _is_clipped(values: np.ndarray, command: np.ndarray, noise: float) -> bool:
    """Whether readings stand at their largest or smallest value while the command moves."""
    return any(
        float(np.ptp(command[a:b])) > 0.0 and abs(values[a]) > 4.0 * noise
        for a, b in clipped(values, command)
    )
