"""Contract of an importer: what every importer must do, as a check that tests can call."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dearig.drivers.registry import EntryError
from dearig.errors import InputError
from dearig.recording.importers.importer import HEAD_BYTES, Importer
from dearig.recording.importers.source import Source

__all__ = ["check_importer"]

#: Parts of a file that damaged copies keep.
_KEPT = (0.0, 0.01, 0.25, 0.5, 0.75, 0.9, 0.99)


def check_importer(name: str, importer: Importer, sample: Path, folder: Path) -> None:
    """Check that ``importer`` does what every importer must do.

    ``name`` is its name in the registry, ``sample`` a sound file of its format with at least one
    column, ``folder`` an empty folder for damaged copies. Raises ``EntryError`` with a sentence
    for the first thing that is wrong.
    """
    content = sample.read_bytes()
    if sample.suffix.lower() not in importer.suffixes:
        raise EntryError(f"{name}: {sample.name} has none of its suffixes {importer.suffixes}")
    _check_sniff(name, importer, content)
    _check_source(name, importer.open(sample), sample)
    if sample.read_bytes() != content:
        raise EntryError(f"{name}: it changes the file that it reads")
    for kept in _KEPT:
        damaged = folder / f"damaged{sample.suffix}"
        damaged.write_bytes(content[: int(kept * len(content))])
        _check_damaged(name, importer, damaged, f"the first {kept:.0%} of {sample.name}")
    _check_damaged(name, importer, folder / f"absent{sample.suffix}", "a file that is not there")


def _check_sniff(name: str, importer: Importer, content: bytes) -> None:
    if not importer.sniff(content[:HEAD_BYTES]):
        raise EntryError(f"{name}: sniff() does not recognise the sample")
    for what, head in (("an empty file", b""), ("zeros", bytes(HEAD_BYTES)), ("text", b"abc\n")):
        if importer.sniff(head):
            raise EntryError(f"{name}: sniff() takes {what} for its format")


def _check_source(name: str, source: Source, path: Path) -> None:
    names = list(source.names)
    if source.path != path:
        raise EntryError(f"{name}: the source has the path {source.path}, not {path}")
    if not names or not all(isinstance(n, str) and n.isprintable() for n in names):
        raise EntryError(f"{name}: the columns {names} must have printable names")
    columns = source.read(names)
    for column in names:
        source.check(column)
        values = columns[column]
        if values.ndim != 1 or values.dtype != np.float64 or values.size == 0:
            raise EntryError(
                f"{name}: column {column!r} is {values.dtype} {values.shape}, not float64 (n,)"
            )
        if not set(source.named(column)) <= set(names):
            raise EntryError(f"{name}: named({column!r}) returns columns that do not exist")
        if not source.row(0):
            raise EntryError(f"{name}: row(0) does not say where the first sample is")
    absent = "no such column"
    if source.named(absent):
        raise EntryError(f"{name}: named({absent!r}) finds a column")
    try:
        source.check(absent)
    except InputError:
        return
    raise EntryError(f"{name}: check({absent!r}) raises no InputError")


def _check_damaged(name: str, importer: Importer, path: Path, what: str) -> None:
    """A damaged file is an ``InputError``; one that is sound by chance may be read."""
    try:
        source = importer.open(path)
        source.read([n for n in source.names if source.names.count(n) == 1])
    except InputError:
        return
    except Exception as error:
        raise EntryError(f"{name}: {what} raises {type(error).__name__}: {error}") from error
    if not path.exists():
        raise EntryError(f"{name}: {what} raises no InputError")
