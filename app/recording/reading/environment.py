"""Temperature and humidity of the room during a run: /entry/environment, and their means.

A thermo-hygrometer gives a reading every few seconds, at its own times. They are rows of a table of
their own, and not repeated at the rate of the sample clock. An analog sensor at the card is a
channel like any other, see ``CONDITIONS``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import h5py
import numpy as np

from dearig.recording.content.fields import CONDITIONS
from dearig.recording.content.layout import ENVIRONMENT_TYPE, make_own_scale
from dearig.recording.content.safe import item
from dearig.recording.reading.arrays import Overview

__all__ = [
    "Environment",
    "EnvironmentWriter",
    "mean_conditions",
    "read_environment",
    "stored_means",
]

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

    def of(self, name: str) -> np.ndarray | None:
        """Return the readings (M,) of a condition; None for one that it does not measure."""
        values: np.ndarray | None = getattr(self, name, None) if name in CONDITIONS else None
        return values

    def at(self, name: str, time: np.ndarray) -> np.ndarray | None:
        """Return the readings of a condition on a line between them, at ``time``.

        (N,) s and (N,); None where there is no reading.
        """
        values = self.of(name)
        known = np.isfinite(values) if values is not None else np.zeros(0, dtype=bool)
        if values is None or not known.any():
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
    """Return the means of a run by the keys of ``CONDITIONS``; what is not known is left out.

    ``channel`` returns the values of a channel in at most so many bins, None without that channel.
    A channel at the card counts before the thermo-hygrometer: it may be nearer to the film.
    """
    found = {}
    for name, condition in CONDITIONS.items():
        whole = channel(condition.channel, _POINTS)
        values = None if environment is None else environment.of(name)
        if whole is not None:
            values = 0.5 * (whole.low + whole.high)
        elif values is None:
            continue
        values = values[np.isfinite(values)]
        if values.size:
            found[name] = float(values.mean())
    return found


def stored_means(entry: h5py.Group) -> dict[str, float]:
    """Return the means that a finished run has as attributes of ``entry``."""
    return {name: float(entry.attrs[name]) for name in CONDITIONS if name in entry.attrs}
