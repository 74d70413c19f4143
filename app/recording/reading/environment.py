"""Temperature and humidity of the room during a run: /entry/environment, and their means.

A thermo-hygrometer gives a reading every few seconds, at its own times. They are rows of a table of
their own, and not repeated at the rate of the sample clock. An analog sensor at the card is a
channel like any other: ``temperature``, or a declared one of the name ``HUMIDITY``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType

import h5py
import numpy as np

from dearig.drivers.channels import HUMIDITY
from dearig.recording.content.layout import ENVIRONMENT_TYPE, make_own_scale
from dearig.recording.content.safe import item
from dearig.recording.reading.arrays import Overview

__all__ = [
    "MEANS",
    "Environment",
    "EnvironmentWriter",
    "mean_conditions",
    "read_environment",
    "stored_means",
]

#: Attributes of /entry with the means of a run, and the channels that they are of otherwise.
MEANS = MappingProxyType({"temperature_degC": "temperature", "relative_humidity_percent": HUMIDITY})

_POINTS = 2000  # bins of a channel whose mean is taken: it changes slowly


@dataclass(frozen=True, eq=False)
class Environment:
    """Readings of a thermo-hygrometer, (M,) each; NaN where it gave no value.

    ``sample`` is the number of the sample that followed the reading, ``time`` its time in s.
    """

    sample: np.ndarray
    time: np.ndarray
    temperature_degC: np.ndarray
    relative_humidity_percent: np.ndarray

    def until(self, end: float) -> Environment:
        """Return the readings up to ``end`` in s."""
        kept = int(np.searchsorted(self.time, end, side="right"))
        return Environment(
            self.sample[:kept], self.time[:kept], self.temperature_degC[:kept],
            self.relative_humidity_percent[:kept],
        )  # fmt: skip

    def at(self, name: str, time: np.ndarray) -> np.ndarray | None:
        """Return the readings of ``name``, one of ``MEANS``, on a line between them, at ``time``.

        (N,) s and (N,); None where there is no reading.
        """
        values = getattr(self, name)
        known = np.isfinite(values)
        if not known.any():
            return None
        return np.asarray(np.interp(time, self.time[known], values[known]))


class EnvironmentWriter:
    """The table ``entry/environment`` of a run that is written."""

    def __init__(self, entry: h5py.Group) -> None:
        self._rows = entry.create_dataset(
            "environment", shape=(0,), maxshape=(None,), chunks=(64,), dtype=ENVIRONMENT_TYPE
        )
        make_own_scale(self._rows)

    def move_to(self, entry: h5py.Group) -> None:
        """Write to the same table of another file from now on."""
        self._rows = entry["environment"]

    def append(self, sample: int, moment: float, temperature: float, humidity: float) -> None:
        """Append a reading at ``moment``, Unix time in s: degrees Celsius and per cent, or NaN."""
        row = self._rows.shape[0]
        self._rows.resize((row + 1,))
        self._rows[row] = (sample, moment, temperature, humidity)


def read_environment(entry: h5py.Group, rate: float) -> Environment | None:
    """Return the readings in ``entry`` of a sample clock of ``rate`` Hz; None without any.

    A kill or a full disk can leave space for readings that were never written; they are left out.
    """
    rows = item(entry, "environment", stored=False)
    if not isinstance(rows, h5py.Dataset) or rows.dtype != ENVIRONMENT_TYPE or rows.ndim != 1:
        return None
    there = rows[: rows.id.get_storage_size() // rows.dtype.itemsize]
    empty = there["unix_time"] == 0.0
    there = there[: int(np.argmax(empty))] if empty.any() else there
    if not there.size:
        return None
    sample = there["sample"].astype(np.int64)
    return Environment(
        sample, sample / rate, there["temperature"].copy(), there["relative_humidity"].copy()
    )


def mean_conditions(
    environment: Environment | None, channel: Callable[[str, int], Overview | None]
) -> dict[str, float]:
    """Return the means of a run by the names in ``MEANS``; what is not known is left out.

    ``channel`` returns the values of a channel in at most so many bins, None without that channel.
    A channel at the card counts before the thermo-hygrometer: it may be nearer to the film.
    """
    found = {}
    for name, of in MEANS.items():
        whole = channel(of, _POINTS)
        if whole is not None:
            values = 0.5 * (whole.low + whole.high)
        elif environment is not None:
            values = getattr(environment, name)
        else:
            continue
        values = values[np.isfinite(values)]
        if values.size:
            found[name] = float(values.mean())
    return found


def stored_means(entry: h5py.Group) -> dict[str, float]:
    """Return the means that a finished run has as attributes of ``entry``."""
    return {name: float(entry.attrs[name]) for name in MEANS if name in entry.attrs}
