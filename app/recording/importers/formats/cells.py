"""Values of the cells of a table: numbers in the ways in which people write them, and moments."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import datetime

from dearig.recording.importers.formats.text_layout import TextColumn
from dearig.recording.importers.quantities.moments import OpenDatesError, day_first_of, moment_of
from dearig.recording.importers.quantities.text_numbers import GROUPED, MINUS
from dearig.recording.importers.source import NeedsOptionError

__all__ = ["cell_of", "complaint_about", "number_in", "with_order"]

#: A cell is quoted in messages up to this length.
SHOWN = 30


_MINUS = str.maketrans(dict.fromkeys(MINUS, "-"))
#: Sign before the exponent of a number of double precision in Fortran.
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d+$)")


def cell_of(cells: Sequence[str], column: TextColumn) -> str:
    """Return the cell of ``column``; of a time of day, with the date that stands next to it."""
    if column.date_place is None:
        return cells[column.place]
    return f"{cells[column.date_place].removesuffix(' 00:00:00')} {cells[column.place]}".strip()


def number_in(cell: str, column: TextColumn) -> float | None:
    """Return the number in ``cell``; of a date and time, seconds. None if it is neither."""
    if column.since is not None:
        return _seconds(cell, column.since, column.day_first)
    text = cell.translate(_MINUS)
    if column.thousands and column.thousands in text:
        if not GROUPED.fullmatch(text):
            return None
        text = text.replace(column.thousands, "")
    if column.decimal == ",":
        if "." in text:
            return None
        text = text.replace(",", ".")
    # float() also takes 1_000 and the digits of other scripts
    if "_" in text or not text.isascii():
        return None
    try:
        return float(_FORTRAN.sub("e", text))
    except ValueError:
        return None


def _seconds(cell: str, since: datetime, day_first: bool) -> float | None:
    moment = moment_of(cell, day_first)
    try:
        return None if moment is None else (moment - since).total_seconds()
    except TypeError:  # one has a time zone and the other has none
        return None


def with_order(column: TextColumn, cells: Iterable[str]) -> TextColumn:
    """Return ``column`` with the order of day and month that all its ``cells`` say.

    Raises ``NeedsOptionError`` where they leave it open.
    """
    cells, again = itertools.tee(cells)
    try:
        first = day_first_of(cells)
    except OpenDatesError as error:
        raise NeedsOptionError(
            f"column {column.name!r}: {error}, or give the rate if the samples are evenly spaced",
            answers={"rate_Hz": "RATE"},
        ) from error
    if first == column.day_first:
        return column
    since = next(filter(None, (moment_of(cell, first) for cell in again)), column.since)
    return replace(column, day_first=first, since=since)


def complaint_about(cell: str, number: float | None) -> str:
    """Return what is wrong with ``cell``, whose ``number`` is not finite or None."""
    if not cell:
        return "there is no value"
    shown = cell if len(cell) <= SHOWN else f"{cell[:SHOWN]}..."
    if number is not None and not math.isfinite(number):
        return f"{shown!r} is not a finite number"
    if "," in cell and "." in cell:
        return f"{shown!r} has both a comma and a point; write numbers without thousands separators"
    return f"{shown!r} is not a number"
