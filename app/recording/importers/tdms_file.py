"""Columns of a TDMS file (LabVIEW): channels, called ``group/channel``."""

from __future__ import annotations

import logging
import struct
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from dearig.errors import InputError
from dearig.recording.files import one_line
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.source import PARSER_FAILURES, no_such_column, printable

if TYPE_CHECKING:
    from nptdms import TdmsFile

__all__ = ["IMPORTER", "TdmsChannels"]


#: Start of every segment: tag, contents, version, size of the segment, size of its metadata.
LEAD_IN = struct.Struct("<4sIIQQ")
#: Size that marks a segment whose writing was not completed.
NOT_ENDED = 2**64 - 1


class TdmsChannels:
    """The TDMS file at ``path``. Raises ``InputError`` if it cannot be read or holds no numbers.

    Where no channel is called ``time_s``, one is made from the waveform timing of the channels, if
    it exists and is the same for all.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.about: dict[str, str] = {}
        self._columns, timing = _load(path)
        if not self._columns:
            raise InputError(f"{path} holds no channels of numbers")
        if len(timing) == 1 and not self.named("time_s"):
            ((start, step, size),) = timing
            self._columns["time_s"] = start + step * np.arange(size)

    @property
    def names(self) -> list[str]:
        """All channels as ``group/channel``."""
        return list(self._columns)

    def named(self, name: str) -> list[str]:
        """Return the channels called ``name``, in any group."""
        return [n for n in self._columns if n == name or n.endswith(f"/{name}")]

    def own_name(self, name: str) -> str:
        """Return ``name`` without its group."""
        return name.partition("/")[2] or name

    def row(self, index: int) -> str:
        """Return the row of sample ``index``, counted from 1."""
        return f"row {index + 1}"

    def check(self, name: str) -> None:
        """See ``Source``."""
        if name not in self._columns:
            raise no_such_column(self, name)

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return columns by name; see ``Source``."""
        return {name: self._columns[name] for name in names}


def _check_whole(path: Path, stream: BinaryIO) -> None:
    """Raise ``InputError`` unless every segment is complete: the library accepts a cut file."""
    end, at = path.stat().st_size, 0
    while at < end:
        stream.seek(at)
        lead_in = stream.read(LEAD_IN.size)
        if len(lead_in) < LEAD_IN.size or lead_in[:4] != b"TDSm":
            break  # the library reports this
        size = LEAD_IN.unpack(lead_in)[3]
        if size == NOT_ENDED or at + LEAD_IN.size + size > end:
            raise InputError(
                f"{path} is truncated: its segment at byte {at} is incomplete; copy it again, or "
                f"save it again with the program that made it"
            )
        at += LEAD_IN.size + size


def _check_claims(path: Path, metadata: TdmsFile) -> None:
    """Raise ``InputError`` where the channels claim more values than the file has bytes."""
    claimed = sum(len(channel) for group in metadata.groups() for channel in group.channels())
    if claimed > path.stat().st_size:
        raise InputError(
            f"{path} is damaged: its channels claim {claimed} values, and it has "
            f"{path.stat().st_size} bytes"
        )


def _load(path: Path) -> tuple[dict[str, np.ndarray], set[tuple[float, float, int]]]:
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    # its messages go into the error, not to the terminal
    log_manager.set_level(logging.ERROR)
    columns: dict[str, np.ndarray] = {}
    timing: set[tuple[float, float, int]] = set()
    try:
        with path.open("rb") as stream, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _check_whole(path, stream)
            stream.seek(0)
            _check_claims(path, TdmsFile.read_metadata(stream))
            stream.seek(0)
            for group in TdmsFile.read(stream).groups():
                for channel in group.channels():
                    values = np.asarray(channel[:])
                    if values.dtype.kind not in "fiu" or values.size == 0:
                        continue
                    columns[printable(f"{group.name}/{channel.name}")] = values.astype(np.float64)
                    step = float(channel.properties.get("wf_increment", 0.0))
                    if step > 0.0:
                        start = float(channel.properties.get("wf_start_offset", 0.0))
                        timing.add((start, step, values.size))
    except PARSER_FAILURES as error:
        raise InputError(f"{path} cannot be read as a TDMS file: {one_line(error)}") from error
    return columns, timing


def _sniff(head: bytes) -> bool:
    return head.startswith(b"TDSm")


IMPORTER = Importer("TDMS", (".tdms",), TdmsChannels, _sniff)
