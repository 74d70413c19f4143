"""Exporters: recordings written in other formats, with the columns that an import takes.

One file for each format, one line here. Another distribution adds a format through an entry point
in the group ``dearig.exporters``. ``README.md`` in the folder of the importers shows how.
"""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType
from typing import Any

from dearig.drivers.registry import Registry
from dearig.errors import InputError
from dearig.recording.content.table_description import description_path, write_description
from dearig.recording.exporters.table import Exporter, description_of, units_of
from dearig.recording.files import check_output, file_sha256, replaced_when_done
from dearig.recording.reading.reader import open_recording

__all__ = ["EXPORTS", "Exporter", "export_recording"]

_OWN = MappingProxyType(
    {
        "csv": "dearig.recording.exporters.csv_file:EXPORTER",
        "mat": "dearig.recording.exporters.mat_file:EXPORTER",
        "parquet": "dearig.recording.exporters.parquet_file:EXPORTER",
    }
)


def _check(name: str, exporter: Any) -> None:
    """Raise an error with a sentence unless ``exporter`` can be used under that name."""
    if not isinstance(exporter, Exporter):
        raise TypeError("it is not a dearig.recording.exporters.Exporter")
    if not name.isalnum() or name != name.lower():
        raise ValueError("its name must be the suffix of its files: small letters and digits")


#: Every format that recordings are exported to, by the suffix of its files.
EXPORTS: Registry[Exporter] = Registry("dearig.exporters", _OWN, _check)


def export_recording(
    path: str | Path, to: str, out: str | Path | None = None, overwrite: bool = False
) -> Path:
    """Write the recording at ``path`` in the format ``to``; return the path of the new file.

    ``to`` is a name in ``EXPORTS`` (csv, mat, parquet). ``out`` is by default the recording's own
    name with another suffix. Columns are named with their units and hold every number to the last
    bit. What the format has no place for is in a second file, ``out`` with ``-metadata.json``
    behind its name, which an import reads. Raises ``InputError``.
    """
    path = Path(path)
    if to not in EXPORTS:
        raise InputError(f"a recording is exported to {', '.join(EXPORTS)}, not to {to!r}")
    exporter = EXPORTS[to]
    out = check_output(path.with_suffix(f".{to}") if out is None else out, overwrite, path)
    described = None if exporter.describes else check_output(description_path(out), overwrite, path)
    recording = open_recording(path)
    with replaced_when_done(out, overwrite) as partial:
        exporter.write(recording, partial)
        if described is not None:
            digest = file_sha256(partial)
            with replaced_when_done(described, overwrite) as description:
                write_description(
                    description, out.name, digest, units_of(recording), description_of(recording)
                )
    return out
