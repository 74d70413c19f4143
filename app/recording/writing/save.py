"""Write a recording from arrays: imported data, or the prediction of a model."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

import h5py
import numpy as np

from dearig.drivers.channels import RESERVED_NAMES
from dearig.drivers.rig import Event
from dearig.progress import Progress, quiet
from dearig.recording.content.layout import (
    EVENT_TYPE,
    KINDS,
    LIBVER,
    LINEAR,
    MESSAGE_BYTES,
    MISSING,
    REQUIRED,
    TIMING,
    UNITS,
    ZERO_ORDER,
    attach_time,
    counts_name,
    create_field,
    lay_out,
    name_dimensions,
)
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.content.physical import write_average
from dearig.recording.content.provenance import gather, write_provenance
from dearig.recording.content.sample import write_sample
from dearig.recording.content.text import clip_text, fixed, put_text
from dearig.recording.files import check_output, replaced_when_done
from dearig.recording.reading.arrays import Overview
from dearig.recording.reading.environment import mean_conditions

__all__ = ["save_recording"]

#: Samples that are written at once: a multiple of a chunk, and some tens of milliseconds.
WRITTEN = 2**22
_COUNTS = counts_name("")


def save_recording(
    path: str | Path,
    kind: str,
    values: Mapping[str, np.ndarray],
    metadata: RunMetadata,
    *,
    hold: bool = False,
    average: int = 1,
    kinematics: str | None = None,
    rest_reading: float = 0.0,
    events: Iterable[Event] = (),
    channels: Mapping[str, tuple[str, str]] = MappingProxyType({}),
    missing: Collection[str] = (),
    timing: tuple[float, float, float] = (0.0, 0.0, 0.0),
    started: float | None = None,
    overwrite: bool = False,
    now: Callable[[], float] = time.time,
    progress: Progress = quiet,
) -> Path:
    """Write arrays as a recording.

    ``values`` are (N,) each, by their names in ``layout.UNITS`` and in those units, or of further
    ``channels``, which have unit and label by name. Where those in ``missing`` are NaN, there was
    no reading. ``timing`` are skew, delay and the delay's
    error of the displacement in s. ``kind`` is actuator or film, ``hold``, ``average`` and
    ``kinematics`` are as in ``Recording``, ``rest_reading`` in m has been subtracted from the
    displacement. ``started`` is the Unix time in s of the first sample, by default ``now()``.
    ``progress`` gets the part that is written. The file appears complete or not at all. Raises
    ``InputError`` if it may not be written, and ``ValueError`` for values that no recording of that
    kind has.
    """
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r} is not one of {', '.join(KINDS)}")
    absent = [name for name in REQUIRED[kind] if name not in values]
    unknown = [name for name in values if name not in UNITS and name not in channels]
    if taken := [name for name in channels if name in RESERVED_NAMES or name.endswith(_COUNTS)]:
        raise ValueError(f"recordings use the names {taken} themselves")
    if absent or unknown:
        raise ValueError(f"a recording of kind {kind}: missing {absent}, unknown {unknown}")
    size = np.asarray(values["time"]).size
    shapes = {name: np.shape(array) for name, array in values.items()}
    if set(shapes.values()) != {(size,)}:
        raise ValueError(f"values must be rows of one length, not {shapes}")
    path = check_output(path, overwrite)

    started = now() if started is None else started
    noted = gather(started, metadata)
    with (
        replaced_when_done(path, overwrite) as partial,
        h5py.File(partial, "w", libver=LIBVER, locking=False) as file,
    ):
        entry = lay_out(file, kind, metadata.title, started)
        data = entry["data"]
        for number, (name, array) in enumerate(values.items()):
            unit, label = channels.get(name, ("", ""))
            field = create_field(data, name, size, unit, label)
            numbers = np.asarray(array, dtype=np.float64)
            if name in channels:
                field.attrs["declared"] = number
                field.attrs["label"] = fixed(label)
            if name in missing and (gaps := int(np.count_nonzero(np.isnan(numbers)))):
                field.attrs[MISSING] = gaps
            for first in range(0, size, WRITTEN):
                progress("writing", (number + first / size) / len(values))
                field[first : first + WRITTEN] = numbers[first : first + WRITTEN]
        attach_time(data)
        write_average(data, average)
        if kinematics is not None:
            data.attrs["kinematics"] = fixed(kinematics)
        if kind == "actuator":
            data["voltage_command"].attrs["hold"] = fixed(ZERO_ORDER if hold else LINEAR)
            data["displacement"].attrs["rest_reading"] = rest_reading
            if any(timing):
                data["displacement"].attrs.update(zip(TIMING, timing, strict=True))
        write_sample(entry, metadata)
        for name, text in (("sequence", metadata.sequence_toml), ("model", metadata.model_toml)):
            if text:
                put_text(entry, name, text)
        _write_events(entry, tuple(events), np.asarray(values["time"], dtype=np.float64))
        write_provenance(entry, noted)
        entry.create_group("instrument").attrs["NX_class"] = fixed("NXcollection")
        name_dimensions(entry)
        entry.attrs["samples"] = size
        means = mean_conditions(None, lambda channel, _: _whole(values, channel))
        for name, value in means.items():
            entry.attrs[name] = value
        entry.attrs["outcome"] = fixed("finished")
        entry.attrs["complete"] = True
        progress("writing", 1.0)
    return path


def _whole(values: Mapping[str, np.ndarray], channel: str) -> Overview | None:
    if channel not in values:
        return None
    row = np.asarray(values[channel], dtype=np.float64)
    return Overview(np.asarray(values["time"]), row, row)


def _write_events(entry: h5py.Group, events: tuple[Event, ...], time_s: np.ndarray) -> None:
    rows = np.zeros(len(events), dtype=EVENT_TYPE)
    for i, event in enumerate(events):
        rows[i] = (
            event.sample,
            time_s[event.sample],
            event.level.encode(),
            clip_text(event.message, MESSAGE_BYTES),
        )
    entry.create_dataset("events", data=rows, dtype=EVENT_TYPE)
