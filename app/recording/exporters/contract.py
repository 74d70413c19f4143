"""Contract of an exporter: what every exporter must do, as a check that tests can call."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from dearig.drivers.registry import EntryError
from dearig.recording.content.table_description import description_path
from dearig.recording.exporters import EXPORTS, export_recording
from dearig.recording.exporters.table import columns_of
from dearig.recording.importers import IMPORTERS, import_file
from dearig.recording.reading.reader import open_recording

__all__ = ["check_exporter"]

#: Columns that an import does not read, because they are not measured.
_NOT_IMPORTED = ("displacement_model",)


def check_exporter(
    name: str, recording: Path, folder: Path, now: Callable[[], float] = time.time
) -> None:
    """Check that the exporter ``name`` does what every exporter must do.

    ``recording`` is a recording that is exported, ``folder`` an empty folder. Where an importer
    takes the suffix, what was exported is imported again and every value compared, to the last
    bit. Raises ``EntryError`` with a sentence for the first thing that is wrong.
    """
    before = recording.read_bytes()
    out = export_recording(recording, name, folder / f"exported.{name}")
    written = {out.name} if EXPORTS[name].describes else {out.name, description_path(out).name}
    if {path.name for path in folder.iterdir()} != written:
        raise EntryError(f"{name}: it writes other files than the one asked for")
    if not out.stat().st_size:
        raise EntryError(f"{name}: it writes nothing")
    if recording.read_bytes() != before:
        raise EntryError(f"{name}: it changes the recording")
    if not any(f".{name}" in importer.suffixes for importer in IMPORTERS.values()):
        return
    again = folder / "again.h5"
    import_file(out, again, now=now)
    first, second = open_recording(recording), open_recording(again)
    if second.kind != first.kind:
        raise EntryError(f"{name}: a recording of kind {first.kind} comes back as {second.kind}")
    values, imported = columns_of(first), columns_of(second)
    for column in values:
        if column.startswith(_NOT_IMPORTED):
            continue
        if column not in imported:
            raise EntryError(f"{name}: the column {column} does not come back")
        # an import subtracts the rest from the displacement again, which is 0 within rounding
        atol = 1e-15 if column.startswith("displacement") else 0.0
        if not np.allclose(values[column], imported[column], rtol=0.0, atol=atol):
            raise EntryError(f"{name}: the column {column} comes back with other values")
