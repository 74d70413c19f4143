"""An importer: the interface of a file format of measured data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dearig.recording.importers.source import Source

__all__ = ["HEAD_BYTES", "Importer"]

#: Bytes from the start of a file by which an importer recognises its format.
HEAD_BYTES = 4096


@dataclass(frozen=True)
class Importer:
    """A file format that measured data are read from.

    Attributes
    ----------
    title : str
        Name of the format for messages.
    suffixes : tuple of str
        Endings of its files, in small letters, such as ``(".csv", ".txt")``.
    open : callable
        Returns the columns of the file at a path, as a ``Source``. Raises ``InputError`` with a
        sentence for a file that it cannot read; no other exception.
    sniff : callable
        Returns True if the first ``HEAD_BYTES`` of a file are of this format.
    text : bool
        True for text tables, which are tried last.
    takes : tuple of str
        Options that ``open`` takes by keyword too: ``names_line``, ``skip_bad_rows``.
    """

    title: str
    suffixes: tuple[str, ...]
    open: Callable[..., Source]
    sniff: Callable[[bytes], bool]
    text: bool = False
    takes: tuple[str, ...] = ()
