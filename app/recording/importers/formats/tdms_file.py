"""Columns of a TDMS file (LabVIEW): channels, called ``group/channel``."""

from __future__ import annotations

import logging
import re
import struct
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.files import one_line
from dearig.recording.importers.formats.stored import (
    StoredColumn,
    StoredColumns,
    is_thinned,
    rate_step,
    stated_scale,
)
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.quantities.units import UNITS, unit_of
from dearig.recording.importers.source import PARSER_FAILURES, printable

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile
    from nptdms.timestamp import TdmsTimestamp, TimestampArray

__all__ = ["IMPORTER", "TdmsChannels"]

#: Start of every segment: tag and contents, then version, size of the segment, size of its
#: metadata, in the byte order that the contents say.
LEAD_IN, SIZES = struct.Struct("<4sI"), {"<": struct.Struct("<IQQ"), ">": struct.Struct(">IQQ")}
LEAD_IN_BYTES = 28
BIG_ENDIAN = 1 << 6
#: Size that marks a segment whose writing was not completed.
NOT_ENDED = 2**64 - 1
#: Channels that are listed; measurements have fewer.
CHANNELS_MAX = 2000


class TdmsChannels(StoredColumns):
    """The TDMS file at ``path``. Raises ``InputError`` if it cannot be read or holds no numbers.

    Values are scaled as the file says. The waveform timing of the channels is the time where no
    channel has it. Of a file that was not closed, or cut short, what is whole is read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        columns: dict[str, StoredColumn] = {}
        with _opened(path) as file:
            size = path.stat().st_size
            claimed = sum(len(channel) for group in file.groups() for channel in group.channels())
            if claimed > size:
                raise InputError(
                    f"{path} is damaged: its channels claim {claimed} values, and it has {size} "
                    f"bytes"
                )
            self._groups = {
                group.name: {**file.properties, **group.properties} for group in file.groups()
            }
            channels = [channel for group in file.groups() for channel in group.channels()]
            starts = [s for c in channels if (s := _started(c)) is not None]
            first = min(starts, key=lambda s: (s.seconds, s.second_fractions), default=None)
            for channel in islice(channels, CHANNELS_MAX):
                if channel.dtype.kind not in "fiuM" or len(channel) == 0:
                    continue
                name = printable(f"{channel.group_name}/{channel.name}")
                columns[name] = self._stored(channel, first)
        if not columns:
            raise InputError(f"{path} holds no channels of numbers")
        super().__init__(path, "a TDMS file", columns, cut_short=_is_cut_short(path))
        #: date and time of the first sample of the waveforms
        self.started = None if first is None else _moment(first)
        self.warnings = _appended(path)

    def _stored(self, channel: TdmsChannel, first: TdmsTimestamp | None) -> StoredColumn:
        stated: Mapping[str, object] = channel.properties
        step, unit = _step(channel, self._groups.get(channel.group_name, {}))
        start, started = _number(stated.get("wf_start_offset")), _started(channel)
        if started is not None and first is not None:
            start += _seconds(started, first)
        dates = channel.dtype.kind == "M"
        return StoredColumn(
            _loader(self.path, channel.group_name, channel.name), len(channel), channel.name,
            "s" if dates else unit,
            "time" if dates else str(stated.get("description", "")),
            printable(channel.group_name), step, start,
            began=_moment(channel[0]) if dates else None, scaled=stated_scale(stated),
        )  # fmt: skip


def _step(channel: TdmsChannel, above: Mapping[str, object]) -> tuple[float | None, str]:
    """Return the time in s from row to row, None where nothing gives it, and the unit of a channel.

    ``above`` are the properties of its group and of the file.
    """
    stated: Mapping[str, object] = channel.properties
    unit = str(stated.get("unit_string", stated.get("NI_UnitDescription", "")))
    if (step := _number(stated.get("wf_increment"))) > 0.0:
        along = unit_of(str(stated.get("wf_xunit_string", "")) or "s")
        scale = UNITS["time"].get(along[0]) if along else None
        return None if scale is None else step * scale.times / scale.over, unit
    given = {name: _number(value) for name, value in {**above, **stated}.items()}
    if any(is_thinned(name, value) for name, value in given.items()):
        return None, unit
    steps = (rate_step(name, value) for name, value in given.items())
    return next((found for found in steps if found is not None), None), unit


def _loader(path: Path, group: str, channel: str) -> Callable[[], np.ndarray]:
    def load() -> np.ndarray:
        with _opened(path) as file:
            values = file[group][channel][:]
            if hasattr(values, "second_fractions"):
                return np.asarray(_seconds(values, values[0]))
            return np.asarray(values)

    return load


def _started(channel: TdmsChannel) -> TdmsTimestamp | None:
    """Return the date and time of the first sample of a waveform, or None."""
    start = channel.properties.get("wf_start_time")
    return start if hasattr(start, "second_fractions") else None


def _seconds(stamps: TdmsTimestamp | TimestampArray, first: TdmsTimestamp) -> Any:
    """Return the time in s since ``first`` of one time stamp or an array of them.

    npTDMS cuts its own dates off below a microsecond, so that some are a microsecond early.
    """
    fractions = np.asarray(stamps.second_fractions, np.float64) - float(first.second_fractions)
    return np.asarray(stamps.seconds) - np.int64(first.seconds) + fractions * 2.0**-64


def _moment(stamp: TdmsTimestamp) -> datetime | None:
    """Return a time stamp, which is of UTC; None for a year that has no date."""
    seconds = int(stamp.seconds) + float(stamp.second_fractions) * 2.0**-64
    try:
        return datetime(1904, 1, 1, tzinfo=UTC) + timedelta(seconds=seconds)
    except OverflowError:
        return None


def _number(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) else 0.0


@contextmanager
def _opened(path: Path) -> Iterator[TdmsFile]:
    """Give the file; raises ``InputError`` for what the library raises on damaged ones."""
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    # its messages go into the error, not to the terminal
    log_manager.set_level(logging.ERROR)
    with open_input(path) as stream:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                with TdmsFile.open(stream, raw_timestamps=True) as file:
                    yield file
        except PARSER_FAILURES as error:
            raise InputError(f"{path} cannot be read as a TDMS file: {one_line(error)}") from error


def _is_cut_short(path: Path) -> bool:
    """Return True unless every segment of the file is complete."""
    with open_input(path) as stream:
        return any(at + size > path.stat().st_size for at, size in _segments(stream, path))


def _segments(stream: BinaryIO, path: Path) -> Iterator[tuple[int, int]]:
    """Yield the place and the size of every segment."""
    at, end = 0, path.stat().st_size
    while at < end:
        stream.seek(at)
        lead_in = stream.read(LEAD_IN_BYTES)
        if len(lead_in) < LEAD_IN_BYTES or lead_in[:4] != b"TDSm":
            yield at, LEAD_IN_BYTES + end
            return
        contents = LEAD_IN.unpack_from(lead_in)[1]
        order = ">" if contents & BIG_ENDIAN else "<"
        size = SIZES[order].unpack_from(lead_in, LEAD_IN.size)[1]
        yield at, LEAD_IN_BYTES + size
        if size == NOT_ENDED:
            return
        at += LEAD_IN_BYTES + size


def _appended(path: Path) -> list[str]:
    """Return a sentence if a waveform begins again at another time, in a later session."""
    starts: dict[bytes, float] = {}
    found: list[str] = []
    size = path.stat().st_size
    with open_input(path) as stream:
        for at, length in _segments(stream, path):
            stream.seek(at)
            lead_in = stream.read(LEAD_IN_BYTES)
            if at + length > size or len(lead_in) < LEAD_IN_BYTES:
                break
            contents = LEAD_IN.unpack_from(lead_in)[1]
            order = ">" if contents & BIG_ENDIAN else "<"
            metadata = stream.read(min(SIZES[order].unpack_from(lead_in, LEAD_IN.size)[2], length))
            for channel, start in _starts(metadata, order):
                before = starts.get(channel)
                starts[channel] = start
                if before is not None and start != before and not found:
                    name = printable(channel.decode("utf-8", "replace"))
                    found.append(
                        f"the file was continued: the waveform {name} begins {start - before:g} "
                        f"s after its start again, and its rows follow here without a break; save "
                        f"the sessions as files of their own"
                    )
    return found


def _starts(metadata: bytes, order: str) -> Iterator[tuple[bytes, float]]:
    """Yield the path of each channel in the ``metadata`` of a segment, and its start in s.

    The property is looked for by its name: the data between have lengths that depend on their kind.
    The last path of a channel before it, ``/'group'/'channel'``, is its own.
    """
    key = struct.pack(order + "I", len(_START)) + _START
    at = metadata.find(key)
    while at >= 0:
        place = at + len(key)
        kind, *parts = struct.unpack_from(order + "IQq", metadata.ljust(place + 20, b"\0"), place)
        if order == ">":
            parts.reverse()  # seconds first
        paths = _CHANNEL.findall(metadata, 0, at)
        if kind == _TIMESTAMP and paths:
            yield paths[-1], parts[1] + parts[0] / 2.0**64
        at = metadata.find(key, place)


#: Name and type of the property with the start of a waveform, and the path of a channel.
_START, _TIMESTAMP, _CHANNEL = (
    b"wf_start_time",
    0x44,
    re.compile(rb"/'(?:[^']|'')*'/'(?:[^']|'')*'"),
)


def _sniff(head: bytes) -> bool:
    return head.startswith(b"TDSm")


IMPORTER = Importer("TDMS", (".tdms",), TdmsChannels, _sniff)
