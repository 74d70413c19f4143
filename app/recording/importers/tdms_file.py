"""Columns of a TDMS file (LabVIEW): channels, called ``group/channel``."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from app.errors import InputError
from app.recording.files import one_line
from app.recording.importers.source import PARSER_FAILURES, no_such_column, printable

if TYPE_CHECKING:
    from nptdms import TdmsFile

__all__ = ["TdmsChannels"]


#: What the library says of a file that was not written to its end.
CUT_SHORT = "Last segment"


class TdmsChannels:
    """The TDMS file at ``path``. Raises ``InputError`` if it cannot be read or holds no numbers.

    Where no channel is called ``time_s``, one is made from the waveform timing of the channels, if
    they have it and it is the same for all.
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
        """The channels called ``name``, in whichever group."""
        return [n for n in self._columns if n == name or n.endswith(f"/{name}")]

    def row(self, index: int) -> str:
        """The sample, counted from 1."""
        return f"row {index + 1}"

    def check(self, name: str) -> None:
        """See ``Source``."""
        if name not in self._columns:
            raise no_such_column(self, name)

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Columns by name; see ``Source``."""
        return {name: self._columns[name] for name in names}


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

    columns: dict[str, np.ndarray] = {}
    timing: set[tuple[float, float, int]] = set()
    try:
        with path.open("rb") as stream, warnings.catch_warnings(), _told() as told:
            warnings.simplefilter("ignore")
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
    cut = [text for text in told if CUT_SHORT in text]
    if cut:
        raise InputError(f"{path} is truncated: {cut[0]}")
    return columns, timing


@contextmanager
def _told() -> Iterator[list[str]]:
    """What the library says in its log, meanwhile kept from the terminal."""
    told: list[str] = []

    def keep(record: logging.LogRecord) -> bool:
        told.append(one_line(Exception(record.getMessage())))
        return False

    handlers = logging.getLogger("nptdms").handlers
    for handler in handlers:
        handler.addFilter(keep)
    try:
        yield told
    finally:
        for handler in handlers:
            handler.removeFilter(keep)
