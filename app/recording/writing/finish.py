"""Finishing a recording: physical values, overview, dimension scales and closing metadata."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from dearig.errors import InputError
from dearig.output_state import OutputState
from dearig.recording.content.checksums import complete_checksums
from dearig.recording.content.flushes import flush_notes
from dearig.recording.content.journal import Patched, changed_in_place, replaced
from dearig.recording.content.layout import (
    LIBVER,
    LINEAR,
    MESSAGE_BYTES,
    SIGNALS,
    ZERO_ORDER,
    attach_time,
    counts_name,
    create_field,
    describe_field,
    iso_time,
    name_dimensions,
    show_plot,
)
from dearig.recording.content.modelled import NAME as MODELLED
from dearig.recording.content.modelled import keep_modelled
from dearig.recording.content.physical import Counts
from dearig.recording.content.pyramid import complete_pyramid
from dearig.recording.content.text import clip_text, fixed, put_text
from dearig.recording.files import system_text
from dearig.recording.lock import FileLock, ReplacedError
from dearig.recording.reading.arrays import Overview
from dearig.recording.reading.environment import mean_conditions, read_environment
from dearig.recording.reading.opening import identifier_of, opened
from dearig.recording.writing.packing import Packer, packer

__all__ = ["OVERVIEW", "PHYSICAL_MAX", "finish"]

#: Longer runs hold counts and an overview in physical units: no viewer can plot as many values, and
#: the content of a file with physical values is made in memory.
PHYSICAL_MAX = 2**24
#: Bins of that overview; each is two points.
OVERVIEW = 2**13


def finish(
    path: Path,
    *,
    lock: FileLock,
    complete: bool,
    outcome: str,
    output_state: OutputState | None = None,
    ended: float | None,
    identifier: str = "",
    repair: Callable[[Patched], None] | None = None,
    fsync: bool = False,
) -> int:
    """Write physical values and closing metadata to the closed recording ``path``.

    All is written or nothing: outside SWMR mode a kill can make a file unreadable, and the disk can
    be full, but the counts stay safe. The caller holds ``lock`` on the file; ``identifier`` is that
    of the recording that should be in it, if known. ``repair`` is called with the file before HDF5
    opens it. ``ended`` is a Unix time in s, None if unknown. Returns the number of samples. Raises
    ``ReplacedError`` if another file has that name by now, and ``InputError`` if it cannot be
    written; then it is as it was.
    """

    def closing(entry: h5py.Group) -> None:
        if ended is not None:
            put_text(entry, "end_time", iso_time(ended))
        entry.attrs["outcome"] = fixed(clip_text(outcome, MESSAGE_BYTES).decode())
        if output_state is not None:
            _note_output(entry, output_state)
        entry.attrs["complete"] = complete

    try:
        if not lock.is_at(path):
            raise replaced(path)
        if identifier:
            _check_identifier(path, identifier)
        with changed_in_place(path, lock, fsync) as changes:
            if repair is not None:
                repair(changes)
            content = None
            with h5py.File(changes, "r+", libver=LIBVER) as file:
                counts = Counts(file["entry"])
                if counts.samples > PHYSICAL_MAX:
                    _trim_counts(counts)
                    _complete(file["entry"], counts, closing)
                else:
                    content = _packed(file, counts, closing)
            if content is not None:
                changes.replace(content.getbuffer())
    except (OSError, RuntimeError) as error:
        raise InputError(f"{path} cannot be written: {system_text(error)}") from error
    return counts.samples


def _note_output(entry: h5py.Group, state: OutputState) -> None:
    """Keep what was known of the rig's output after the run, as attributes of ``entry``."""
    entry.attrs["output_state"] = fixed(state.known.value)
    entry.attrs["output_state_time"] = fixed(iso_time(state.at))
    entry.attrs["output_set_by"] = fixed("guardian" if state.by_guardian else "run")
    if state.monitor is not None:
        entry.attrs["output_monitor_V"] = state.monitor


def _note_environment(entry: h5py.Group) -> None:
    """Keep the mean temperature and humidity, where there are any, as attributes of ``entry``."""
    counts = Counts(entry)

    def channel(name: str, points: int) -> Overview | None:
        if name not in counts.names:
            return None
        return Overview(*counts.overview(name, 0, counts.samples, points))

    readings = read_environment(entry, counts.rate)
    if readings is not None:
        entry["environment"].resize((readings.sample.size,))
    for name, value in mean_conditions(readings, channel).items():
        entry.attrs[name] = value


def _check_identifier(path: Path, identifier: str) -> None:
    """Raise ``InputError`` if another program has written another recording into the file."""
    with opened(path) as file:
        if "entry" not in file or identifier_of(file["entry"]) != identifier:
            raise ReplacedError(
                f"{path} has another content by now: another program wrote to it during the run; "
                f"it was not finished"
            )


def _complete(entry: h5py.Group, counts: Counts, closing: Callable[[h5py.Group], None]) -> None:
    """Write to ``entry`` all that a finished run with these ``counts`` has besides its rows."""
    samples, data, rest = counts.samples, entry["data"], counts.rest
    complete_pyramid(entry, samples, counts.raw)
    complete_checksums(entry, samples, counts.raw)
    _trim(entry, samples)
    raw = data[counts_name("displacement")]
    raw.attrs["rest_reading"], raw.attrs["rest_samples"] = rest.reading, rest.samples
    if "time" not in data:
        _write_overview(entry, counts)
    keep_modelled(entry, samples)
    _note_environment(entry)
    for plot in (data, entry.get("overview")):
        # a very long run has its physical values, and so its time, in counts only
        if plot is not None and "time" in plot:
            attach_time(plot)
    show_plot(data, "actuator", live=False)
    name_dimensions(entry)
    entry.attrs["samples"] = samples
    closing(entry)


def _trim_counts(counts: Counts) -> None:
    for channel in counts.channels:
        counts.data[counts_name(channel.name)].resize((counts.samples,))


def _packed(file: h5py.File, counts: Counts, closing: Callable[[h5py.Group], None]) -> io.BytesIO:
    """Return the content of a finished ``file``: rows are deflated, all else is copied.

    A new one, since HDF5 does not fill the gaps that chunks of other sizes leave.
    """
    content = io.BytesIO()
    with h5py.File(content, "w", libver=LIBVER) as new, packer() as pack:
        _copy_attributes(file, new)
        entry, live = new.create_group("entry"), file["entry"]
        _copy_attributes(live, entry)
        rows = {counts_name(channel.name) for channel in counts.channels}
        for name in live.keys() - {"data", MODELLED}:
            file.copy(live[name], entry)
        data = entry.create_group("data")
        _copy_attributes(counts.data, data)
        for name in counts.data.keys() - rows:
            file.copy(counts.data[name], data)
        for name in sorted(rows):
            _pack_row(pack, counts.data[name], counts.samples, data)
        if MODELLED in live:
            _pack_row(pack, live[MODELLED], counts.samples, entry)
        _write_physical(pack, data, counts)
        _complete(entry, counts, closing)
    return content


def _copy_attributes(source: h5py.HLObject, target: h5py.HLObject) -> None:
    for name, value in source.attrs.items():
        target.attrs.create(name, value, dtype=source.attrs.get_id(name).dtype)


def _pack_row(pack: Packer, row: h5py.Dataset, samples: int, group: h5py.Group) -> None:
    """Write the first ``samples`` values of ``row`` to ``group``, with its attributes."""

    def part(start: int, stop: int) -> np.ndarray:
        # after a kill the overlay can be behind the counts
        values = np.full(stop - start, row.fillvalue, dtype=row.dtype)
        there = row[start:stop]
        values[: there.size] = there
        return values

    stored = pack.pack(samples, part).store(group, row.name.rpartition("/")[2])
    _copy_attributes(row, stored)


def _write_physical(pack: Packer, data: h5py.Group, counts: Counts) -> None:
    """Write the physical values of ``counts`` to ``data``, with time."""
    for channel in counts.channels:
        name = channel.name
        raw, convert = counts.data[counts_name(name)], counts.conversion(name)
        field = pack.pack(counts.samples, lambda a, b: convert(raw[a:b])).store(data, name)  # noqa: B023
        describe_field(field, name, *counts.described(name))
        field.attrs["skew_s"] = channel.skew
        field.attrs["delay_s"] = channel.delay
        field.attrs["delay_error_s"] = channel.delay_error
    time = pack.pack(counts.samples, lambda a, b: counts.window("time", a, b)).store(data, "time")
    describe_field(time, "time")
    held = ZERO_ORDER if counts.average == 1 else LINEAR
    data["voltage_command"].attrs["hold"] = fixed(held)
    data["displacement"].attrs["rest_reading"] = counts.rest.reading
    data["displacement"].attrs["rest_samples"] = counts.rest.samples


def _trim(entry: h5py.Group, samples: int) -> None:
    """Remove empty events, and notes of flushes whose samples are missing; a kill leaves both."""
    notes = flush_notes(entry)
    if notes is not None:
        entry["wall_clock"].resize((int(np.sum(notes["sample"] <= samples)),))
    events = entry.get("events")
    if events is not None:
        empty = events[()]["level"] == b""
        if empty.any():
            events.resize((int(np.argmax(empty)),))


def _write_overview(entry: h5py.Group, counts: Counts) -> None:
    """Write the overview of a long run: its envelope, as a line between least and greatest."""
    group = entry.create_group("overview")
    group.attrs["NX_class"] = fixed("NXdata")
    group.attrs["signal"] = fixed(SIGNALS["actuator"])
    group.attrs["axes"] = fixed(["time"])
    entry.attrs["default"] = fixed("overview")
    for name in counts.names:
        if name == "time":
            continue
        time, low, high = counts.overview(name, 0, counts.samples, OVERVIEW)
        if "time" not in group:
            create_field(group, "time", 2 * time.size)[:] = np.repeat(time, 2)
        field = create_field(group, name, 2 * low.size, *counts.described(name))
        field[:] = np.stack((low, high), axis=1).reshape(-1)
