"""The importers that are installed, and the choice of one for a file."""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType
from typing import Any

from dearig.drivers.registry import Registry
from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.files import system_text
from dearig.recording.importers.importer import HEAD_BYTES, Importer
from dearig.recording.importers.source import Source

__all__ = ["IMPORTERS", "source_at"]

_OWN = MappingProxyType(
    {
        "csv": "dearig.recording.importers.formats.text_file:IMPORTER",
        "xlsx": "dearig.recording.importers.formats.excel_file:IMPORTER",
        "json": "dearig.recording.importers.formats.json_file:IMPORTER",
        "h5": "dearig.recording.importers.formats.hdf5_file:IMPORTER",
        "mat": "dearig.recording.importers.formats.mat_file:IMPORTER",
        "octave": "dearig.recording.importers.formats.octave_file:IMPORTER",
        "parquet": "dearig.recording.importers.formats.parquet_file:IMPORTER",
        "tdms": "dearig.recording.importers.formats.tdms_file:IMPORTER",
    }
)

#: First bytes of formats that are known and not read: what each is, and what leads on.
_NOT_READ = (
    (b"MDF     ", "an MDF measurement file", "export the signals as CSV or MAT, with asammdf say"),
    (b"UnFinMF ", "an unfinished MDF file", "export the signals as CSV or MAT, with asammdf say"),
    (b"SQLite format 3\0", "an SQLite database", "export the run as CSV or netCDF (QCoDeS does)"),
    (b"CDF\x01", "a netCDF file of the classic format", "nccopy -k nc4 makes an HDF5 file of it"),
    (b"CDF\x02", "a netCDF file of the classic format", "nccopy -k nc4 makes an HDF5 file of it"),
    (b"<html", "a page of HTML", "open it in a spreadsheet program and save it as .xlsx or CSV"),
    (b"<table", "a page of HTML", "open it in a spreadsheet program and save it as .xlsx or CSV"),
    (b"ARROW1", "a Feather or Arrow file", "save the table as Parquet (pandas: to_parquet)"),
    (b"\x93NUMPY", "a NumPy array", "it has no names: save the columns as CSV or HDF5"),
    (b"\x1f\x8b", "compressed (gzip)", "unpack it first"),
    (b"BZh91AY&SY", "compressed (bzip2)", "unpack it first"),
    (b"\xfd7zXZ", "compressed (xz)", "unpack it first"),
    (b"7z\xbc\xaf", "an archive (7-Zip)", "unpack it first"),
)


def _check(name: str, importer: Any) -> None:  # noqa: ARG001  (one signature for all registries)
    """Raise an error with a sentence unless ``importer`` can be used."""
    if not isinstance(importer, Importer):
        raise TypeError("it is not a dearig.recording.importers.Importer")
    wrong = [s for s in importer.suffixes if not s.startswith(".") or s != s.lower()]
    if wrong or not importer.suffixes:
        raise ValueError(f"its suffixes {importer.suffixes} must be small letters after a point")


#: Every importer by name.
IMPORTERS: Registry[Importer] = Registry("dearig.importers", _OWN, _check)


def _is_text(importer: Importer) -> bool:
    return importer.text


def source_at(path: Path, **options: object) -> Source:
    """Return the columns of the file at ``path``. Raises ``InputError``.

    The importer is the one that recognises the first bytes; those that take the suffix come
    first. It gets those ``options`` that it takes: ``names_line`` and ``skip_bad_rows``.
    """
    try:
        with open_input(path) as stream:
            head = stream.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {system_text(error)}") from error
    if not head:
        raise InputError(f"{path} is empty")
    for first, what, remedy in _NOT_READ:
        if head.startswith(first):
            raise InputError(f"{path} is {what}, which is not read: {remedy}")
    suffix = path.suffix.lower()
    named = [importer for importer in IMPORTERS.values() if suffix in importer.suffixes]
    others = [importer for importer in IMPORTERS.values() if importer not in named]
    # text comes last: it is what is no other format
    candidates = sorted([*named, *others], key=_is_text)
    chosen = next((importer for importer in candidates if importer.sniff(head)), None)
    if chosen is None and named:
        chosen = named[0]  # its error says what is wrong with the file
    if chosen is None:
        *most, last = dict.fromkeys(importer.suffixes[0] for importer in IMPORTERS.values())
        raise InputError(
            f"{path}: files named {', '.join(most)} and {last} can be imported, not {suffix!r}"
        )
    return chosen.open(path, **{name: options[name] for name in chosen.takes if name in options})
