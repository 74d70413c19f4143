"""A recording file, read back and checked."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np

from app.errors import InputError
from app.recording.clockwork import not_forward
from app.recording.files import in_words
from app.recording.layout import (
    FORMAT,
    FORMAT_NAME,
    KINDS,
    REQUIRED,
    UNITS,
    ZERO_ORDER,
    counts_name,
)
from app.recording.physical import physical_values, read_channels, resolution, sample_count
from app.recording.provenance import read_provenance
from app.recording.recording import RecordedEvent, Recording
from app.recording.sample import read_film, read_load
from app.recording.superblock import consistency_flags
from app.recording.text import text_of
from drivers.rig import Instrument
from model.errors import ModelError
from model.kinematics import KINEMATICS

__all__ = ["open_recording", "opened"]

#: What HDF5 raises for damage, and what items of another type than this layout's lead to.
UNREADABLE = (
    AttributeError,
    LookupError,
    MemoryError,
    OSError,
    OverflowError,
    RuntimeError,
    TypeError,
    ValueError,
)


def open_recording(path: str | Path) -> Recording:
    """Read the recording at ``path``, also one that was killed or is being written.

    Raises ``InputError`` with one sentence, what and where, for everything it does not understand.
    """
    path = Path(path)
    with opened(path) as file:
        try:
            return _Reader(path, file).read()
        except UNREADABLE as error:
            raise InputError(f"{path} is damaged: {error}") from error


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """The HDF5 file at ``path`` open for reading; ``InputError`` where it cannot be."""
    try:
        if not path.is_file():
            raise InputError(f"{path} is {'a folder' if path.is_dir() else 'not there'}")
        flags = consistency_flags(path)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {in_words(error)}") from error
    except ValueError as error:
        raise InputError(f"{path} is damaged: {error}") from error
    if flags is None:
        raise InputError(
            f"{path} is not an HDF5 file, as recordings are; bring data made elsewhere in with "
            f"dearig import"
        )
    try:
        # a plain open is refused after a kill and during a run; SWMR sees what was flushed. Not
        # SWMR always: it does not look whether the file has been cut short
        file = h5py.File(path, "r", swmr=flags != 0)
    except (OSError, RuntimeError) as error:
        if "truncated" in str(error):
            reason = "is truncated: it was not copied or downloaded to its end"
        elif flags:
            reason = "is being written by another program, or was killed before its first sample"
        else:
            reason = f"cannot be read: {error}"
        raise InputError(f"{path} {reason}") from error
    with file:
        yield file


class _Reader:
    """One open file, with its path for messages."""

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path = path
        self.file = file

    def read(self) -> Recording:
        self._check_format()
        entry = self._group(self.file, "entry")
        data = self._group(entry, "data")
        kind = text_of(entry.attrs.get("kind", ""))
        if kind not in KINDS:
            raise InputError(
                f"{self.path}: kind {kind!r} of /entry is not one of {', '.join(KINDS)}"
            )
        channels = read_channels(data)
        if "time" in data:
            values = self._stored_values(data)
            rest = (
                float(data["displacement"].attrs.get("rest_reading", 0.0))
                if (kind == "actuator" and "displacement" in data)
                else 0.0
            )
        elif channels:
            values, rest = self._values_of_counts(data)
        else:
            raise InputError(f"{self.path}: /entry/data/time is missing")
        self._check_values(kind, values)
        for array in values.values():
            array.setflags(write=False)

        sample = self._group(entry, "sample")
        try:
            film, load = read_film(sample), read_load(sample)
        except (ModelError, TypeError, ValueError) as error:
            raise InputError(f"{self.path}: /entry/sample cannot be used: {error}") from error
        kinematics = text_of(
            data.attrs.get("kinematics", film.kinematics if film else KINEMATICS[0])
        )
        if kinematics not in KINEMATICS:
            raise InputError(
                f"{self.path}: kinematics {kinematics!r} of /entry/data is not one of "
                f"{', '.join(KINEMATICS)}"
            )
        skew, delay = self._timing(data)
        expected = data.attrs.get("samples_expected")
        step = {c.name: resolution(c) for c in channels}.get("voltage_command", 0.0)
        complete = bool(entry.attrs.get("complete", False))
        return Recording(
            path=self.path,
            kind=kind,
            name=self.path.stem,
            title=self._text(entry, "title"),
            hold=kind == "actuator" and self._hold(data),
            kinematics=kinematics,
            complete=complete,
            displacement_skew=skew,
            displacement_delay=delay,
            rest_reading=rest,
            voltage_step=step,
            film=film,
            load=load,
            film_id=self._text(sample, "name"),
            notes=self._text(sample, "notes"),
            sequence_toml=self._text(entry, "sequence"),
            model_toml=self._text(entry, "model"),
            outcome=text_of(
                entry.attrs.get("outcome", "" if complete else "killed, or still running")
            ),
            samples_expected=None if expected is None else int(expected),
            events=self._events(entry),
            instruments=self._instruments(entry),
            channels=channels,
            provenance=read_provenance(entry["provenance"]) if "provenance" in entry else {},
            **values,
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

    def _group(self, parent: h5py.Group, name: str) -> h5py.Group:
        found = parent.get(name)
        if not isinstance(found, h5py.Group):
            where = f"{parent.name.rstrip('/')}/{name}"
            raise InputError(f"{self.path}: the group {where} is missing")
        return found

    def _text(self, parent: h5py.Group, name: str) -> str:
        found = parent.get(name)
        return text_of(found[()]) if isinstance(found, h5py.Dataset) else ""

    def _stored_values(self, data: h5py.Group) -> dict[str, np.ndarray]:
        values = {}
        for name, unit in UNITS.items():
            if name not in data:
                continue
            dataset = data[name]
            where = f"{self.path}: /entry/data/{name}"
            if (
                not isinstance(dataset, h5py.Dataset)
                or dataset.ndim != 1
                or dataset.dtype.kind not in "fiu"
            ):
                raise InputError(f"{where} is not a row of numbers")
            stored = text_of(dataset.attrs.get("units", unit))
            if stored != unit:
                raise InputError(f"{where} is in {stored!r}; {FORMAT} holds it in {unit!r}")
            values[name] = dataset[()].astype(np.float64)
        return values

    def _values_of_counts(self, data: h5py.Group) -> tuple[dict[str, np.ndarray], float]:
        channels = read_channels(data)
        samples = sample_count(data, channels)
        if samples == 0:
            raise InputError(f"{self.path} holds no samples: the run ended before its first block")
        rate = float(data.attrs["rate_Hz"])
        if not (np.isfinite(rate) and rate > 0.0):
            raise InputError(f"{self.path}: rate_Hz of /entry/data is {rate}, not above 0")
        physical = physical_values(data, rate, samples)
        return physical.values, physical.rest_reading

    def _check_values(self, kind: str, values: dict[str, np.ndarray]) -> None:
        for name in REQUIRED[kind]:
            if name not in values:
                raise InputError(f"{self.path}: /entry/data/{name} is missing")
        time = values["time"]
        if time.size == 0:
            raise InputError(f"{self.path} holds no samples")
        for name, array in values.items():
            if array.size != time.size:
                raise InputError(
                    f"{self.path}: /entry/data/{name} has {array.size} samples, time {time.size}"
                )
            # the overlay may have had nothing to show at times
            finite = np.isfinite(array)
            if not finite.all() and name != "displacement_model":
                at = int(np.argmin(finite))
                raise InputError(
                    f"{self.path}: /entry/data/{name} is {array[at]} at sample {at}, not a number"
                )
        if (back := not_forward(time)) is not None:
            at, how = back
            raise InputError(
                f"{self.path}: /entry/data/time {how} at sample {at} ({time[at]:.9g} s)"
            )
        if kind == "film" and not (values["stretch"] > 0.0).all():
            at = int(np.argmax(values["stretch"] <= 0.0))
            raise InputError(
                f"{self.path}: /entry/data/stretch is {values['stretch'][at]:.6g} at sample {at}; "
                f"a stretch is above 0"
            )

    def _timing(self, data: h5py.Group) -> tuple[float, float]:
        for name in ("displacement", counts_name("displacement")):
            if name in data:
                attrs = data[name].attrs
                return float(attrs.get("skew_s", 0.0)), float(attrs.get("delay_s", 0.0))
        return 0.0, 0.0

    def _hold(self, data: h5py.Group) -> bool:
        for name in ("voltage_command", counts_name("voltage_command")):
            if name in data and "hold" in data[name].attrs:
                return text_of(data[name].attrs["hold"]) == ZERO_ORDER
        return False

    def _events(self, entry: h5py.Group) -> tuple[RecordedEvent, ...]:
        rows = entry.get("events")
        if not isinstance(rows, h5py.Dataset):
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
            raise InputError(f"{self.path}: /entry/events cannot be read: {error}") from error

    def _instruments(self, entry: h5py.Group) -> tuple[Instrument, ...]:
        group = entry.get("instrument")
        found = []
        for item in group.values() if isinstance(group, h5py.Group) else ():
            if (
                not isinstance(item, h5py.Group)
                or text_of(item.attrs.get("NX_class", "")) != "NXinstrument"
            ):
                continue
            attrs = item.attrs
            settings = item["settings"].asstr()[()] if "settings" in item else ()
            found.append(
                Instrument(
                    role=text_of(attrs.get("role", "")),
                    model=text_of(attrs.get("model", "")),
                    serial=text_of(attrs.get("serial", "")),
                    settings=tuple((str(name), str(value)) for name, value in settings),
                )
            )
        return tuple(found)
