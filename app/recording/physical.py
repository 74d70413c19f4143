"""From the counts that a run wrote to physical values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import h5py
import numpy as np

from app.recording.layout import UNITS, counts_name
from app.recording.quiet import lead_in
from app.recording.text import fixed, text_of
from drivers.channels import CHANNEL_NAMES, Channel, Scaling

__all__ = [
    "TEMPERATURE_UNITS",
    "Physical",
    "physical_values",
    "read_channels",
    "sample_count",
    "write_channel",
]

#: Units in which a rig may give its temperature; recordings hold degrees Celsius.
TEMPERATURE_UNITS = ("degC", "°C", "C", "K")
KELVIN = 273.15


@dataclass(frozen=True, eq=False)
class Physical:
    """Physical ``values`` by name, (n,) each, ``time`` among them.

    ``rest_reading`` in m is the sensor's mean reading over the ``rest_samples`` of the lead-in,
    already subtracted from the displacement.
    """

    values: dict[str, np.ndarray]
    rest_reading: float
    rest_samples: int


def write_channel(counts: h5py.Dataset, channel: Channel) -> None:
    """Give a dataset of counts what is needed to read it without this program."""
    attrs = counts.attrs
    attrs["units"] = fixed("counts")
    attrs["physical_units"] = fixed(channel.unit)
    attrs["scaling"] = fixed("offset + gain * (coefficients[0] + coefficients[1]*counts + ...)")
    attrs["coefficients"] = np.asarray(channel.scaling.coefficients, dtype=np.float64)
    attrs["gain"] = float(channel.scaling.gain)
    attrs["offset"] = float(channel.scaling.offset)
    attrs["skew_s"] = float(channel.skew)
    attrs["delay_s"] = float(channel.delay)


def read_channels(data: h5py.Group) -> tuple[Channel, ...]:
    """Channels whose counts stand in /entry/data, in the order of ``CHANNEL_NAMES``."""
    found = []
    for name in CHANNEL_NAMES:
        if counts_name(name) not in data:
            continue
        attrs = data[counts_name(name)].attrs
        coefficients = tuple(float(c) for c in np.atleast_1d(attrs["coefficients"]))
        found.append(
            Channel(
                name=name,
                unit=text_of(attrs["physical_units"]),
                scaling=Scaling(coefficients, float(attrs["gain"]), float(attrs["offset"])),
                skew=float(attrs["skew_s"]),
                delay=float(attrs["delay_s"]),
            )
        )
    return tuple(found)


def sample_count(data: h5py.Group, channels: Sequence[Channel]) -> int:
    """Samples that every channel has: a kill may have left some one block ahead of others."""
    return min((int(data[counts_name(c.name)].shape[0]) for c in channels), default=0)


def resolution(channel: Channel) -> float:
    """What one count means, in the channel's unit."""
    ends = channel.scaling.physical(np.array([0, 1], dtype=np.int16))
    return float(abs(ends[1] - ends[0]))


def physical_values(data: h5py.Group, rate: float, samples: int) -> Physical:
    """Values of the first ``samples`` samples in /entry/data, clocked at ``rate`` Hz.

    Displacement is measured from the mean reading over the lead-in at 0 V, or from the first
    reading of a run that has none.
    """
    values = {"time": np.arange(samples) / rate}
    channels = {c.name: c for c in read_channels(data)}
    for name, channel in channels.items():
        counts = data[counts_name(name)][:samples]
        values[name] = channel.scaling.physical(counts)
        if name == "temperature" and channel.unit == "K":
            values[name] -= KELVIN
    rest, quiet = 0.0, 0
    if samples and {"voltage_command", "displacement"} <= channels.keys():
        quiet = lead_in(values["voltage_command"], resolution(channels["voltage_command"]))
        rest = float(values["displacement"][: max(quiet, 1)].mean())
        values["displacement"] -= rest
    return Physical({n: v for n, v in values.items() if n in UNITS}, rest, quiet)
