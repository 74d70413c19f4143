"""Columns of a CSV file: comma, semicolon or tab, with a line of names.

NumPy parses the numbers. If a value is not a finite number, the text is read
again line by line, more slowly, to find the line, the column and the reason.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from itertools import repeat
from pathlib import Path

import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.files import in_words
from dearig.recording.importers.columns import TARGETS
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.source import no_such_column

__all__ = ["IMPORTER", "CsvFile"]

DELIMITERS = (";", "\t", ",")
#: A line without data: blank, or a comment. A plain first character makes the search fast.
NO_DATA = re.compile(r"\n[^\S\n]*[#\n]")
#: Columns, at most. Data loggers write some hundred; each name is compared with those known.
COLUMNS_MAX = 2000
#: A cell is quoted in messages up to this length.
SHOWN = 30


class CsvFile:
    """The CSV file at ``path``. Raises ``InputError`` if it has no line of names or no data."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.about: dict[str, str] = {}
        text = _decoded(path)
        if "\r" in text:
            text = text.replace("\r\n", "\n").replace("\r", "\n")
        lines = text.split("\n")
        while lines and not lines[-1].strip():
            lines.pop()
        #: number in the file, from 1, of every line that is neither blank nor comment
        self._numbers: Sequence[int] = range(1, len(lines) + 1)
        if NO_DATA.search(text) or not all(map(_holds_data, lines[:1])):
            self._numbers = [n for n, line in enumerate(lines, 1) if _holds_data(line)]
            lines = [lines[number - 1] for number in self._numbers]
        if not lines:
            raise InputError(f"{path} is empty")
        header, self._lines = lines[0], lines[1:]
        self._delimiter = max(DELIMITERS, key=header.count)
        if header.count(self._delimiter) == 0:
            self._delimiter = ","
        columns = header.count(self._delimiter) + 1
        if columns > COLUMNS_MAX:
            raise InputError(
                f"{path} has {columns:,} columns; {COLUMNS_MAX:,} are read at most: see that it is "
                f"the right file"
            )
        self.names = [name.strip() for name in self._cells(self._numbers[0], header)]
        if all(_number(name, False) is not None for name in self.names):
            raise InputError(
                f"{path}, line {self._numbers[0]}: there are numbers where the names of the "
                f"columns should be; put a line such as time_s,voltage_V,displacement_mm above"
            )
        if not self._lines:
            raise InputError(f"{path} has a line of names and no data")

    def _cells(self, number: int, line: str) -> list[str]:
        try:
            return next(csv.reader([line], delimiter=self._delimiter))
        except (csv.Error, StopIteration) as error:
            raise InputError(f"{self.path}, line {number}: it cannot be split: {error}") from error

    def named(self, name: str) -> list[str]:
        """Return the columns called ``name``."""
        return [n for n in self.names if n == name]

    def row(self, index: int) -> str:
        """Return the line of sample ``index``."""
        return f"line {self._numbers[index + 1]}"

    def check(self, name: str) -> None:
        """See ``Source``."""
        count = self.names.count(name)
        if count == 0:
            raise no_such_column(self, name)
        if count > 1:
            raise InputError(f"{self.path}: {count} columns are called {name!r}; rename one")

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return columns by name; see ``Source``."""
        wanted = list(dict.fromkeys(names))
        columns = self._read_fast(wanted)
        return columns if columns is not None else self._read_slowly(wanted)

    def _read_fast(self, names: list[str]) -> dict[str, np.ndarray] | None:
        """Return the columns as NumPy parses them; None if the slow reader is needed."""
        lines, places = self._lines, [self.names.index(name) for name in names]
        if set(places) == set(range(len(self.names))):
            wanted = None
        else:
            wanted = places
            # NumPy skips the other columns, so it would not notice a row of another length
            separators = {len(self.names) - 1}
            if set(map(str.count, lines, repeat(self._delimiter))) != separators:
                return None
        if self._delimiter != "," and any("," in line for line in lines):
            # decimal commas; where there are points too, the slow reader decides
            if any("." in line for line in lines):
                return None
            lines = [line.replace(",", ".") for line in lines]
        try:
            table = np.loadtxt(
                lines,
                delimiter=self._delimiter,
                comments=None,
                usecols=wanted,
                ndmin=2,
            )
        except ValueError:
            return None
        columns = np.ascontiguousarray(table.T)
        if wanted is None:
            if len(columns) != len(self.names):
                return None
            columns = columns[places]
        if columns.shape[1] != len(lines) or not np.isfinite(columns).all():
            return None
        return dict(zip(names, columns, strict=True))

    def _read_slowly(self, names: list[str]) -> dict[str, np.ndarray]:
        places = [self.names.index(name) for name in names]
        columns = np.empty((len(names), len(self._lines)))
        comma = self._delimiter != ","
        for index, line in enumerate(self._lines):
            number = self._numbers[index + 1]
            cells = self._cells(number, line)
            if len(cells) != len(self.names):
                raise InputError(
                    f"{self.path}, line {number}: {len(cells)} values under {len(self.names)} "
                    f"column names; every line must have one for each column"
                )
            for i, place in enumerate(places):
                value = _number(cells[place], comma)
                if value is None or not math.isfinite(value):
                    raise InputError(
                        f"{self.path}, line {number}, column {names[i]!r}: "
                        f"{_complaint(cells[place], comma)}"
                    )
                columns[i, index] = value
        return dict(zip(names, columns, strict=True))


def _holds_data(line: str) -> bool:
    text = line.strip()
    return bool(text) and not text.startswith("#")


def _number(cell: str, decimal_comma: bool) -> float | None:
    text = cell.strip()
    if decimal_comma and "." not in text:
        text = text.replace(",", ".")
    # float() also takes 1_000 and the digits of other scripts
    if "_" in text or not text.isascii():
        return None
    try:
        return float(text)
    except ValueError:
        return None


def _complaint(cell: str, decimal_comma: bool) -> str:
    text = cell.strip()
    if not text:
        return "there is no value; fill it in or leave the line out"
    shown = text if len(text) <= SHOWN else f"{text[:SHOWN]}..."
    if _number(cell, decimal_comma) is not None:
        return f"{shown!r} is not a finite number; leave the line out or correct it"
    if decimal_comma and "," in text and "." in text:
        return f"{shown!r} has both a comma and a point; write numbers without thousands separators"
    return f"{shown!r} is not a number"


def _decoded(path: Path) -> str:
    try:
        with open_input(path) as file:
            raw = file.read()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {in_words(error)}") from error
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        try:
            return raw.decode("utf-16")
        except UnicodeDecodeError as error:
            raise InputError(
                f"{path} begins as UTF-16 text but is not valid UTF-16: {error}"
            ) from error
    if b"\0" in raw:
        raise InputError(f"{path} is not a text file; CSV, MAT and TDMS files can be imported")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        # numbers are ASCII in any case; only a column name may be decoded wrongly
        return raw.decode("latin-1")


def _sniff(head: bytes) -> bool:
    """Return True for text whose first line of data has the name of a column of recordings."""
    text = head.decode("utf-16" if head[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8", "replace")
    line = next((line for line in text.splitlines() if _holds_data(line)), "")
    return "\0" not in text and not TARGETS.keys().isdisjoint(
        name.strip(' "\ufeff') for name in re.split(r"[;,\t]", line)
    )


IMPORTER = Importer("CSV", (".csv", ".txt", ".tsv"), CsvFile, _sniff)
