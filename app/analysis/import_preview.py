"""What an import would bring in, without writing it: curves, and what is said of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dearig.analysis.decimate import decimate
from dearig.progress import Progress, part, quiet
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.importers import Imported, ImportOptions, import_file
from dearig.recording.importers.importing import WRITING, prepare
from dearig.recording.importers.listing import Content, content_of
from dearig.recording.importers.quantities.units import UnitScale

__all__ = ["ImportTrial", "preview_file", "try_import", "write_import"]

_COLUMNS = 4000  # of a plot


@dataclass(frozen=True)
class ImportTrial:
    """A recording that an import would write.

    ``curves`` are (time s, value) in the units of a recording, by name, with their extremes kept.
    """

    kind: str
    samples: int
    duration: float
    curves: Mapping[str, tuple[np.ndarray, np.ndarray]]
    said: Imported


def preview_file(
    path: Path,
    names_line: int | None,
    raw: Mapping[str, UnitScale],
    progress: Progress = quiet,
) -> Content:
    """Return the content of the file at ``path``. Raises ``InputError``."""
    return content_of(path, names_line, raw, progress=progress)


def try_import(
    path: Path, options: ImportOptions, metadata: RunMetadata, progress: Progress = quiet
) -> ImportTrial:
    """Return what the import of the file at ``path`` would bring in. Raises ``InputError``."""
    found = prepare(path, options, metadata=metadata, progress=part(progress, 0.0, 1.0 / WRITING))
    columns = found.values.columns
    time = columns["time"]
    curves = {
        name: decimate(time, values, _COLUMNS) for name, values in columns.items() if name != "time"
    }
    return ImportTrial(
        found.values.kind, time.size, float(time[-1] - time[0]), curves, found.imported
    )  # fmt: skip


def write_import(
    path: Path,
    out: Path,
    options: ImportOptions,
    metadata: RunMetadata,
    overwrite: bool,
    progress: Progress = quiet,
) -> Imported:
    """Import the file at ``path`` as the recording ``out``. Raises ``InputError``."""
    return import_file(
        path, out, options, metadata=metadata, overwrite=overwrite, progress=progress
    )
