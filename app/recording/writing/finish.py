"""Finishing a recording: physical values, overview, dimension scales and closing metadata."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
    iso_time,
    name_dimensions,
    show_plot,
)
from dearig.recording.content.modelled import keep_modelled
from dearig.recording.content.physical import SLICE, Counts
from dearig.recording.content.pyramid import complete_pyramid
from dearig.recording.content.text import clip_text, fixed, put_text
from dearig.recording.files import in_words
from dearig.recording.lock import FileLock, ReplacedError
from dearig.recording.reading.arrays import Overview
from dearig.recording.reading.environment import mean_conditions, read_environment
from dearig.recording.reading.opening import identifier_of, opened

__all__ = ["OVERVIEW", "PHYSICAL_MAX", "finish"]

#: Longer runs hold counts and an overview in physical units: their physical values would take four
#: times the space, and no viewer can plot as many.
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
    try:
        if not lock.is_at(path):
            raise replaced(path)
        if identifier:
            _check_identifier(path, identifier)
        with changed_in_place(path, lock, fsync) as changes:
            if repair is not None:
                repair(changes)
            with h5py.File(changes, "r+", libver=LIBVER) as file:
                entry = file["entry"]
                samples = _write_physical(entry)
                keep_modelled(entry, samples)
                _note_environment(entry)
                for plot in (entry["data"], entry.get("overview")):
                    # a very long run has its physical values, and so its time, in counts only
                    if plot is not None and "time" in plot:
                        attach_time(plot)
                show_plot(entry["data"], "actuator", live=False)
                name_dimensions(entry)
                if ended is not None:
                    put_text(entry, "end_time", iso_time(ended))
                entry.attrs["samples"] = samples
                entry.attrs["outcome"] = fixed(clip_text(outcome, MESSAGE_BYTES).decode())
                if output_state is not None:
                    _note_output(entry, output_state)
                entry.attrs["complete"] = complete
    except (OSError, RuntimeError) as error:
        raise InputError(f"{path} cannot be written: {in_words(error)}") from error
    return samples


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


def _write_physical(entry: h5py.Group) -> int:
    counts = Counts(entry)
    data, samples = counts.data, counts.samples
    for channel in counts.channels:
        data[counts_name(channel.name)].resize((samples,))
    complete_pyramid(entry, samples, counts.raw)
    complete_checksums(entry, samples, counts.raw)
    _trim(entry, samples)
    rest = counts.rest
    raw = data[counts_name("displacement")]
    raw.attrs["rest_reading"], raw.attrs["rest_samples"] = rest.reading, rest.samples
    if samples > PHYSICAL_MAX:
        _write_overview(entry, counts)
        return samples
    timing = {
        c.name: {"skew_s": c.skew, "delay_s": c.delay, "delay_error_s": c.delay_error}
        for c in counts.channels
    }
    for name in counts.names:
        field = _write_field(data, name, samples, timing.get(name, {}), *counts.described(name))
        for start in range(0, samples, SLICE):
            stop = min(start + SLICE, samples)
            field[start:stop] = counts.window(name, start, stop)
    held = ZERO_ORDER if counts.average == 1 else LINEAR
    data["voltage_command"].attrs["hold"] = fixed(held)
    data["displacement"].attrs["rest_reading"] = rest.reading
    data["displacement"].attrs["rest_samples"] = rest.samples
    return samples


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
            _write_field(group, "time", 2 * time.size, {})[:] = np.repeat(time, 2)
        field = _write_field(group, name, 2 * low.size, {}, *counts.described(name))
        field[:] = np.stack((low, high), axis=1).reshape(-1)


def _write_field(
    data: h5py.Group,
    name: str,
    samples: int,
    attributes: Mapping[str, float],
    unit: str = "",
    label: str = "",
) -> h5py.Dataset:
    dataset = create_field(data, name, samples, unit, label)
    for key, value in attributes.items():
        dataset.attrs[key] = value
    return dataset
