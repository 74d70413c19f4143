"""The segment ``csv``: a waveform read from a file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any, ClassVar, Literal

from pydantic import Field

from dearig.config.segments.base import KV, SegmentTable
from dearig.config.toml_input import NAME_MAX, shown
from dearig.errors import InputError
from dearig.model.simulation import excitation
from dearig.model.simulation.excitation import Segment
from dearig.recording.content.timestamps import not_forward
from dearig.recording.importers.formats.text_file import TextFile
from dearig.recording.importers.source import listing

__all__ = ["Csv"]


class Csv(SegmentTable):
    """A waveform from a CSV file next to the sequence; straight lines between its points."""

    example: ClassVar[dict[str, Any]] = {"file": "waveform.csv"}
    #: Columns that may hold the values, and V in a unit of each.
    columns: ClassVar[Mapping[str, float]] = {"voltage_kV": KV, "voltage_V": 1.0}

    kind: Literal["csv"]
    file: str = Field(
        min_length=1,
        max_length=NAME_MAX,
        description="name of the file, with the columns time_s and voltage_kV",
    )

    @property
    def files(self) -> tuple[str, ...]:
        """The CSV file."""
        return (self.file,)

    def build(self, folder: Path) -> Segment:
        """Return the waveform. Raises ``InputError`` for a file that holds none."""
        # a sequence may come from anyone, inside a recording too: it reads only from its own folder
        place = PurePath(self.file)
        if place.is_absolute() or place.drive or ".." in place.parts:
            raise InputError(
                f"file = {shown(self.file)} leads out of the sequence's folder; put the waveform "
                f"next to the sequence, and name it without a path"
            )
        # a name with a zero byte has no real path; its reading says what is wrong with it
        if "\0" not in self.file and not Path(os.path.realpath(folder / place)).is_relative_to(
            os.path.realpath(folder)
        ):
            raise InputError(
                f"file = {shown(self.file)} is a link that leads out of the sequence's folder; "
                f"put the waveform itself next to the sequence"
            )
        source = TextFile(folder / place)
        # a name that comes again has its place behind it: voltage_kV #3
        times, scales = (
            [n for n in source.names if n.partition(" #")[0] in wanted]
            for wanted in (("time_s",), self.columns)
        )
        if not scales or not times:
            raise InputError(
                f"{source.path} has the columns {listing(source.names)}; a waveform takes time_s "
                f"and {' or '.join(self.columns)}"
            )
        for several in (times, scales):
            if len(several) > 1:
                raise InputError(
                    f"{source.path} has the columns {' and '.join(several)}, which may contradict "
                    f"each other; keep the one that is to be played"
                )
        scale = scales[0]
        for column in ("time_s", scale):
            source.check(column)
        columns = source.read(["time_s", scale])
        time = columns["time_s"]
        if time.size < 2:
            raise InputError(f"{source.path} has one line of data; a waveform takes at least 2")
        if (back := not_forward(time)) is not None:
            at, how = back
            raise InputError(
                f"{source.path}, {source.row(at)}: time {how}, from {time[at - 1]:.9g} s to "
                f"{time[at]:.9g} s; a step takes two lines with a little time between them"
            )
        return excitation.Sampled(time, columns[scale] * self.columns[scale])
