"""What a file of measured data offers, whatever its format."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from dearig.errors import InputError
from dearig.recording.importers.columns import suggestion

__all__ = ["PARSER_FAILURES", "Source", "listing", "no_such_column", "printable"]

#: What the libraries that parse binary formats were seen to raise, or may, on damaged files.
PARSER_FAILURES = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    BufferError,
    EOFError,
    LookupError,
    MemoryError,
    NameError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
    struct.error,
    zlib.error,
)

#: More names than this do not help in a message.
LISTED = 12


class Source(Protocol):
    """Columns of numbers in a file."""

    @property
    def path(self) -> Path:
        """The file."""
        ...

    @property
    def about(self) -> Mapping[str, str]:
        """What a recording that was exported to it said of itself; empty for all others."""
        ...

    @property
    def names(self) -> Sequence[str]:
        """Every column there is, as it is called in ``--column NAME=SOURCE``."""
        ...

    def named(self, name: str) -> list[str]:
        """The columns whose own name (apart from where they lie) is ``name``."""
        ...

    def check(self, name: str) -> None:
        """Raise ``InputError`` unless ``name`` is one column that can be read."""
        ...

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Columns (n,) float64, by names that have been checked.

        Raises ``InputError`` for text or gaps among the numbers.
        """
        ...

    def row(self, index: int) -> str:
        """Where sample ``index`` (from 0) stands in the file, in words."""
        ...


def printable(name: str) -> str:
    """``name`` with a question mark for what would break a line or a terminal."""
    return "".join(c if c.isprintable() else "?" for c in name)


def listing(names: Sequence[str]) -> str:
    """``names`` for a message, the first dozen."""
    shown = ", ".join(printable(name) for name in names[:LISTED]) or "none"
    return shown if len(names) <= LISTED else f"{shown} and {len(names) - LISTED} more"


def no_such_column(source: Source, name: str) -> InputError:
    """The error for a column that was asked for by ``name`` and is not there."""
    return InputError(
        f"{source.path}: there is no column {name!r}; there are: {listing(source.names)}"
        f"{suggestion([name], source.names)}"
    )
