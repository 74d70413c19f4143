"""Interface of a file of measured data, whatever its format."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Protocol, cast

import numpy as np

from dearig.errors import InputError
from dearig.recording.importers.quantities.labels import suggestion

__all__ = [
    "LOST_MAX",
    "PARSER_FAILURES",
    "GapError",
    "NeedsOptionError",
    "Source",
    "listing",
    "no_such_column",
    "part_of",
    "printable",
    "skip_or_refuse",
]

#: Exceptions of the libraries that parse binary formats, on damaged files.
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


class NeedsOptionError(InputError):
    """A file needs something that only the user knows, or agrees to.

    ``answers`` are the options that give it, with their values; True for one without a value. The
    other options that help are in ``option``.
    """

    def __init__(
        self,
        message: str,
        *,
        answers: Mapping[str, str | float] | None = None,
        option: Iterable[str] = (),
    ) -> None:
        self.answers = tuple((answers or {}).items())
        super().__init__(message, option=[*(name for name, _ in self.answers), *option])


class GapError(InputError):
    """``column``, which a recording can do without, has no number in some place."""

    def __init__(self, message: str, column: str) -> None:
        super().__init__(message)
        self.column = column


#: Largest part of the rows that a printed command leaves out. Faults that are rarer are those of
#: single rows; where they are more frequent something else is wrong with the column.
LOST_MAX = 0.1
#: Names listed in a message, at most.
LISTED = 12


class Source(Protocol):
    """Columns of numbers in a file.

    A source may have more, which is used where it is there: ``units`` and ``labels``, what the file
    says of columns next to their names; ``own_name(column)``, its name without a group or path;
    ``places``, columns by their numbers from 1; ``tables``, the columns of each specimen, sheet or
    group; ``size(column)``, its number of values; ``step_s(columns)``, the time in s from row to
    row, or None, and ``step_from``, the name that it is from; ``cell(index, column)``, the text in
    the file for a value that is not a number; ``block``, the cells of the lines above a table;
    ``scales``, scales that stand next to the values of columns, which may contain them or not;
    ``rows(indices)``, the places of several samples at once;
    ``skipped``, the rows before each one that was left out, and its place in words;
    ``is_finite``, True if ``read`` returns finite numbers only; ``cut_short``, True if columns may
    end early; ``notes``, sentences on what was found; ``progress``, a callable that can be set,
    which gets the part of ``read`` that is done; ``optional``, columns that can be set, for which
    ``read`` raises ``GapError`` where a cell is not a number; ``measured``, the same, for which
    ``read`` returns NaN there and keeps the row; ``overview(names, count)``, the
    ``Overview`` of columns, in one reading; ``began(column)``, the date and time from which a
    column of time counts, or None; ``started``, that of the first row where no column has it.
    """

    @property
    def path(self) -> Path:
        """The file."""
        ...

    @property
    def about(self) -> Mapping[str, str]:
        """Metadata of a recording that was exported to it, as texts; empty for other files."""
        ...

    @property
    def names(self) -> Sequence[str]:
        """Names of all columns."""
        ...

    def named(self, name: str) -> list[str]:
        """Return the columns whose own name, without group or path, is ``name``."""
        ...

    def check(self, name: str) -> None:
        """Raise ``InputError`` unless ``name`` is one column that can be read."""
        ...

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return columns (n,) float64 by names that have been checked.

        Raises ``InputError`` for text or gaps among the numbers.
        """
        ...

    def row(self, index: int) -> str:
        """Return the place of sample ``index`` (from 0) in the file, for a message."""
        ...


class _Part:
    """The columns ``names`` of ``source``, and all else as it has it."""

    def __init__(self, source: Source, names: Sequence[str]) -> None:
        self._source = source
        self.names = list(names)

    def __getattr__(self, name: str) -> object:
        return getattr(self._source, name)

    def named(self, name: str) -> list[str]:
        return [n for n in self._source.named(name) if n in self.names]


def part_of(source: Source, names: Sequence[str]) -> Source:
    """Return ``source`` with the columns ``names`` only."""
    return cast(Source, _Part(source, names))


def printable(name: str) -> str:
    """Return ``name`` with a question mark in place of control characters."""
    return "".join(c if c.isprintable() else "?" for c in name)


def listing(names: Sequence[str]) -> str:
    """Return ``names`` for a message, the first dozen."""
    shown = ", ".join(printable(name) for name in names[:LISTED]) or "none"
    return shown if len(names) <= LISTED else f"{shown} and {len(names) - LISTED} more"


def skip_or_refuse(
    said: str, lost: int, rows: int, more: str = "", option: Sequence[str] = ()
) -> InputError:
    """Return the error for ``lost`` of some ``rows`` that cannot be used, the first one ``said``.

    An option leaves single rows out; it is not proposed where it would leave out what matters.
    ``more`` is said at the end, of further options.
    """
    if lost <= LOST_MAX * rows:
        counted = f"; {lost} of {rows} rows are so" if lost > 1 else ""
        return NeedsOptionError(
            f"{said}{counted}{more}", answers={"skip_bad_rows": True}, option=option
        )
    return InputError(
        f"{said}; {lost} of {rows} rows are so, too many to leave out: correct the file, or export "
        f"it again{more}",
        option=option,
    )


def no_such_column(source: Source, name: str) -> InputError:
    """Return the error for a column ``name`` that does not exist."""
    return InputError(
        f"{source.path}: there is no column {name!r}; there are: {listing(source.names)}"
        f"{suggestion([name], source.names)}"
    )
