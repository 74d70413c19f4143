"""Reading and checking a recording file."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from dearig.drivers.rig import Instrument
from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.model.film.specimen import KINEMATICS, Film, Load
from dearig.recording.content.fields import read_texts
from dearig.recording.content.layout import (
    FORMAT,
    FORMAT_NAME,
    KINDS,
    REQUIRED,
    TIMING,
    UNITS,
    ZERO_ORDER,
    counts_name,
    declared_channels,
)
from dearig.recording.content.physical import (
    Counts,
    Rest,
    average_of,
    read_channels,
    resolution,
)
from dearig.recording.content.provenance import read_provenance
from dearig.recording.content.safe import dataset, group, item
from dearig.recording.content.sample import read_film, read_load
from dearig.recording.content.text import text_of
from dearig.recording.files import old_of
from dearig.recording.reading.arrays import Arrays
from dearig.recording.reading.environment import read_environment
from dearig.recording.reading.opening import identifier_of, opened, read_from
from dearig.recording.reading.recording import RecordedEvent, Recording

__all__ = ["is_finished", "open_recording", "opened", "read_events"]

#: Up to this number of samples, stored values are read and checked when a recording is opened;
#: those of longer recordings on first use, so that they open without delay.
EAGER = 2**20


def open_recording(path: str | Path) -> Recording:
    """Read the recording at ``path``, also one that was killed or is being written.

    Raises ``InputError`` for every file that is not a valid recording; it says what and where.
    """
    path = Path(path)

    def look(file: h5py.File) -> Recording:
        recording = _Reader(path, file).read()
        if recording.samples <= EAGER:
            recording.arrays.load_from(file["entry"], recording.arrays.stored)
        return recording

    return read_from(path, look)


def is_finished(path: Path) -> bool:
    """Return True if the run at ``path`` was closed, or has been recovered."""
    with opened(path) as file:
        return "samples" in file["entry"].attrs or "time" in file["entry/data"]


def read_events(path: Path, entry: h5py.Group) -> tuple[RecordedEvent, ...]:
    """Return the events in ``entry``; ``path`` is for messages."""
    # after a full disk there may be no events; the rest can still be read
    rows = item(entry, "events", stored=False)
    if not isinstance(rows, h5py.Dataset) or rows.id.get_storage_size() == 0:
        return ()
    rows = dataset(entry, "events")
    if rows is None:
        return ()
    try:
        return tuple(
            RecordedEvent(
                int(row["sample"]),
                float(row["time"]),
                text_of(row["level"]),
                text_of(row["message"]),
            )
            for row in rows[()]
        )
    except (ValueError, IndexError, TypeError) as error:
        raise InputError(f"{path}: /entry/events cannot be read: {error}") from error


class _Reader:
    """One open file, with its path for messages."""

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path = path
        self.file = file

    def read(self) -> Recording:
        self._check_format()
        entry = self._group(self.file, "entry")
        data = self._group(entry, "data")
        kind = self._kind(entry)
        finished = "samples" in entry.attrs
        for name in data:
            # counts may be cut short by a kill or a full disk; ``Counts`` finds how many there are
            item(data, name, stored=finished or not name.endswith(counts_name("")))
        channels = read_channels(data)
        stored = self._stored(data)
        rest: Rest | None = None
        derived: tuple[str, ...] = ()
        rate: float | None = None
        if channels:
            rate = self._rate(data)
            counts = Counts(entry, self._stored_samples(data, stored), channels=channels)
            derived, rest = counts.names, counts.rest
            samples = counts.samples
        elif "time" not in stored:
            raise InputError(f"{self.path}: /entry/data/time is missing")
        else:
            samples = int(data["time"].shape[0])
        self._check_rows(data, stored, samples)
        if "time" in stored:  # a very long run stores the overlay model only
            derived = tuple(n for n in derived if n in stored or n == "time")
        for name in REQUIRED[kind]:
            if name not in stored and name not in derived:
                raise InputError(f"{self.path}: /entry/data/{name} is missing")

        sample = self._group(entry, "sample")
        film, load = self._film_and_load(sample)
        kinematics = self._kinematics(data, film)
        skew, delay, delay_error = self._timing(data)
        expected = data.attrs.get("samples_expected")
        average = average_of(data)
        step = {c.name: resolution(c, average) for c in channels}.get("voltage_command", 0.0)
        complete = bool(entry.attrs.get("complete", False))
        return Recording(
            path=self.path,
            kind=kind,
            name=self.path.stem,
            arrays=Arrays(self.path, stored, derived, samples, rest, identifier_of(entry)),
            rate=rate,
            average=average,
            title=self._text(entry, "title"),
            hold=kind == "actuator" and self._hold(data),
            kinematics=kinematics,
            complete=complete,
            displacement_skew=skew,
            displacement_delay=delay,
            displacement_delay_error=delay_error,
            rest_reading=self._rest_reading(data, rest),
            voltage_step=step,
            film=film,
            load=load,
            texts=read_texts(entry),
            sequence_toml=self._text(entry, "sequence"),
            model_toml=self._text(entry, "model"),
            outcome=text_of(
                entry.attrs.get("outcome", "" if complete else "killed, or still running")
            ),
            samples_expected=None if expected is None else int(expected),
            events=read_events(self.path, entry),
            instruments=self._instruments(entry),
            channels=channels,
            declared_channels=declared_channels(data),
            provenance=self._provenance(entry),
            environment=None if rate is None else read_environment(entry, rate),
        )

    def _check_format(self) -> None:
        form = self.file.attrs.get("format")
        if form is None:
            raise InputError(
                f"{self.path} is an HDF5 file but not a recording: it has no attribute format"
            )
        form = text_of(form)
        if form == FORMAT:
            return
        if form.startswith(f"{FORMAT_NAME}/"):
            raise InputError(
                f"{self.path} has format {form}, which this version does not know (it reads "
                f"{FORMAT}); open it with a newer dearig"
            )
        raise InputError(f"{self.path} has format {form!r}, not {FORMAT}")

    def _kind(self, entry: h5py.Group) -> str:
        kind = text_of(entry.attrs.get("kind", ""))
        if kind not in KINDS:
            raise InputError(
                f"{self.path}: kind {kind!r} of /entry is not one of {', '.join(KINDS)}"
            )
        return kind

    def _film_and_load(self, sample: h5py.Group) -> tuple[Film | None, Load | None]:
        try:
            return read_film(sample), read_load(sample)
        except (ModelError, TypeError, ValueError) as error:
            raise InputError(f"{self.path}: /entry/sample cannot be used: {error}") from error

    def _kinematics(self, data: h5py.Group, film: Film | None) -> str:
        kinematics = text_of(
            data.attrs.get("kinematics", film.kinematics if film else KINEMATICS[0])
        )
        if kinematics not in KINEMATICS:
            raise InputError(
                f"{self.path}: kinematics {kinematics!r} of /entry/data is not one of "
                f"{', '.join(KINEMATICS)}"
            )
        return kinematics

    def _group(self, parent: h5py.Group, name: str) -> h5py.Group:
        found = group(parent, name)
        if found is None:
            where = f"{parent.name.rstrip('/')}/{name}"
            raise InputError(f"{self.path}: the group {where} is missing")
        return found

    def _text(self, parent: h5py.Group, name: str) -> str:
        found = dataset(parent, name)
        return "" if found is None else text_of(found[()])

    def _provenance(self, entry: h5py.Group) -> dict[str, object]:
        found = group(entry, "provenance")
        if found is None:
            return {}
        for name in found:
            item(found, name)
        return read_provenance(found)

    def _rate(self, data: h5py.Group) -> float:
        rate = float(data.attrs["rate_Hz"])
        if not (np.isfinite(rate) and rate > 0.0):
            raise InputError(f"{self.path}: rate_Hz of /entry/data is {rate}, not above 0")
        return rate

    def _stored(self, data: h5py.Group) -> tuple[str, ...]:
        """Return the names of the physical values that are stored."""
        found = []
        declared = {name: unit for name, (unit, _) in declared_channels(data).items()}
        for name, unit in {**UNITS, **declared}.items():
            row = item(data, name)
            if row is None:
                continue
            where = f"{self.path}: /entry/data/{name}"
            if not isinstance(row, h5py.Dataset) or row.ndim != 1 or row.dtype.kind not in "fiu":
                raise InputError(f"{where} is not a row of numbers")
            stored = text_of(row.attrs.get("units", unit))
            if stored != unit:
                raise InputError(f"{where} is in {stored!r}; {FORMAT} holds it in {unit!r}")
            found.append(name)
        return tuple(found)

    def _stored_samples(self, data: h5py.Group, stored: tuple[str, ...]) -> int | None:
        return int(data["time"].shape[0]) if "time" in stored else None

    def _check_rows(self, data: h5py.Group, stored: tuple[str, ...], samples: int) -> None:
        """Refuse a recording without samples, and rows of different lengths."""
        if samples == 0:
            old = old_of(self.path)
            raise InputError(
                f"{self.path} holds no samples"
                + ("" if stored else ": the run ended before its first block")
                + (f"; the recording that it would have replaced is {old}" if old.exists() else "")
            )
        for name in stored:
            size = data[name].shape[0]
            if size != samples:
                raise InputError(
                    f"{self.path}: /entry/data/{name} has {size} samples, time {samples}"
                )

    def _rest_reading(self, data: h5py.Group, rest: Rest | None) -> float:
        if "displacement" in data:
            return float(data["displacement"].attrs.get("rest_reading", 0.0))
        return 0.0 if rest is None else rest.reading

    def _timing(self, data: h5py.Group) -> tuple[float, float, float]:
        for name in ("displacement", counts_name("displacement")):
            if name in data:
                attrs = data[name].attrs
                skew, delay, error = (float(attrs.get(key, 0.0)) for key in TIMING)
                return skew, delay, error
        return 0.0, 0.0, 0.0

    def _hold(self, data: h5py.Group) -> bool:
        for name in ("voltage_command", counts_name("voltage_command")):
            if name in data and "hold" in data[name].attrs:
                return text_of(data[name].attrs["hold"]) == ZERO_ORDER
        return False

    def _instruments(self, entry: h5py.Group) -> tuple[Instrument, ...]:
        instruments = group(entry, "instrument")
        found = []
        for name in instruments or ():
            one = group(instruments, name)
            if one is None or text_of(one.attrs.get("NX_class", "")) != "NXinstrument":
                continue
            attrs = one.attrs
            rows = dataset(one, "settings")  # of versions up to 0.2
            said = one.attrs.get("settings", ()) if rows is None else rows[()]
            texts = [text_of(text) for text in np.ravel(said)]
            found.append(
                Instrument(
                    role=text_of(attrs.get("role", "")),
                    model=text_of(attrs.get("model", "")),
                    serial=text_of(attrs.get("serial", "")),
                    settings=tuple(zip(texts[::2], texts[1::2], strict=False)),
                )
            )
        return tuple(found)
