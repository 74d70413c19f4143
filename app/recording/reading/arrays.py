"""Values of a recording, read from its file on first use."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import h5py
import numpy as np

from dearig.errors import InputError
from dearig.recording.content.layout import PRESENT_MIN, UNITS, missing_in
from dearig.recording.content.physical import Counts, Rest
from dearig.recording.content.pyramid import reduced
from dearig.recording.content.rest_noise import lead_in
from dearig.recording.content.safe import dataset, group
from dearig.recording.content.timestamps import not_forward
from dearig.recording.lock import ReplacedError
from dearig.recording.reading.opening import identifier_of, read_from

__all__ = ["Arrays", "Overview"]

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Overview:
    """Least and greatest value, ``low`` and ``high`` (n,), of n bins that begin at ``time`` s."""

    time: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Arrays:
    """Values in the recording at ``path``: ``stored`` there, or ``derived`` from its counts.

    Arrays are float64 and read-only. They are checked when they are read: time increases, values
    are finite, and readings that are missing, as the file says, are NaN. Every method raises
    ``InputError`` for values that cannot be read or fail a check, and ``ReplacedError`` if another
    recording than that of ``identifier`` is there by now.
    """

    def __init__(
        self,
        path: Path,
        stored: tuple[str, ...],
        derived: tuple[str, ...],
        samples: int,
        rest: Rest | None = None,
        identifier: str = "",
    ) -> None:
        self.path = path
        self.samples = samples
        self._in_file = samples
        self.stored = stored
        known = tuple(n for n in UNITS if n in stored or n in derived)
        declared = dict.fromkeys(n for n in (*stored, *derived) if n not in UNITS)
        self.names = (*known, *declared)
        self._derived = derived
        self._rest = rest
        self._identifier = identifier
        self._read: dict[str, np.ndarray] = {}

    def read(self, name: str) -> np.ndarray:
        """Return all values (N,) of ``name``; they are read once and kept."""
        if name not in self._read:
            self.load((name,))
        return self._read[name]

    def load(self, names: Iterable[str]) -> None:
        """Read all values of ``names`` and keep them; the file is opened once."""
        self._of_entry(lambda entry: self.load_from(entry, names))

    def load_from(self, entry: h5py.Group, names: Iterable[str]) -> None:
        """Read all values of ``names`` in ``entry``, that of this recording, and keep them."""
        for name in names:
            values = self._cut(entry, name, 0, self.samples)
            if name in self.stored:
                self._check(name, values, missing_in(self._row(entry, name)))
            values.setflags(write=False)
            self._read[name] = values

    def window(self, name: str, start: int, stop: int) -> np.ndarray:
        """Return ``name`` from sample ``start`` to before ``stop``, (n,); only these are read."""
        start, stop = max(start, 0), min(stop, self.samples)
        if name in self._read:
            return self._read[name][start:stop]
        return self._of_entry(lambda entry: self._cut(entry, name, start, stop))

    def shortened(self, samples: int) -> Arrays:
        """Return the first ``samples`` of the same values."""
        short = copy(self)
        short.samples = min(samples, self.samples)
        short._read = {name: values[: short.samples] for name, values in self._read.items()}
        return short

    def overview(self, name: str, points: int, start: int, stop: int) -> Overview:
        """Return ``name`` between two samples in at most about ``points`` bins."""
        start, stop = max(start, 0), min(stop, self.samples)
        if name != "time" and name in self._derived:
            return self._of_entry(
                lambda entry: Overview(*self._counts(entry).overview(name, start, stop, points))
            )
        time, values = self.window("time", start, stop), self.window(name, start, stop)
        if time.size > points:
            time = time[(np.arange(points) * time.size) // points]
        return Overview(time, *reduced(values, values, points))

    def lead_in(self, step: float) -> int:
        """Count the samples at 0 V at the start; ``step`` V is the resolution of the voltage."""
        if "voltage_command" in self._derived:
            return min(self._of_entry(lambda entry: self._counts(entry).lead_in()), self.samples)
        return lead_in(self.read("voltage_command"), step)

    def _of_entry(self, look: Callable[[h5py.Group], T]) -> T:
        def look_at(file: h5py.File) -> T:
            entry = group(file, "entry")
            if entry is None:
                raise InputError(f"{self.path}: the group /entry is missing")
            if identifier_of(entry) != self._identifier:
                raise ReplacedError(
                    f"{self.path} has been replaced by another recording since it was opened"
                )
            return look(entry)

        return read_from(self.path, look_at)

    def _cut(self, entry: h5py.Group, name: str, start: int, stop: int) -> np.ndarray:
        if name in self.stored:
            values: np.ndarray = self._row(entry, name)[start:stop].astype(np.float64)
            return values
        return self._counts(entry).window(name, start, stop)

    def _row(self, entry: h5py.Group, name: str) -> h5py.Dataset:
        data = group(entry, "data")
        row = None if data is None else dataset(data, name)
        if row is None or row.shape != (self._in_file,):
            raise InputError(
                f"{self.path}: /entry/data/{name} has changed since the file was opened"
            )
        return row

    def _counts(self, entry: h5py.Group) -> Counts:
        counts = Counts(entry, self._in_file, self._rest)
        self._rest = counts.rest
        return counts

    def _check(self, name: str, values: np.ndarray, missing: int) -> None:
        # the overlay model has no value where it failed
        finite = np.isfinite(values)
        gaps = np.isnan(values) if missing else np.zeros_like(finite)
        count = int(np.count_nonzero(gaps))
        # the first part of a recording may have fewer gaps than all of it
        known = count == missing or (count < missing and self.samples < self._in_file)
        if known and finite.size - count >= PRESENT_MIN:
            finite |= gaps
        if not finite.all() and name != "displacement_model":
            at = int(np.argmin(finite))
            raise InputError(
                f"{self.path}: /entry/data/{name} is {values[at]} at sample {at}, not a number"
            )
        if name == "time" and (back := not_forward(values)) is not None:
            at, how = back
            raise InputError(
                f"{self.path}: /entry/data/time {how} at sample {at} ({values[at]:.9g} s)"
            )
        if name == "stretch" and not (values > 0.0).all():
            at = int(np.argmax(values <= 0.0))
            raise InputError(
                f"{self.path}: /entry/data/stretch is {values[at]:.6g} at sample {at}; "
                f"a stretch is above 0"
            )
