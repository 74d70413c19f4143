"""Columns of a table of numbers in a text file: CSV and its many relatives.

pandas parses the numbers, a block of lines at a time. A block that it refuses is read again line by
line, to say which cell of which line is wrong, or to leave that row out.
"""

from __future__ import annotations

import codecs
import csv
import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.files import in_words
from dearig.recording.importers.cells import complaint_about, number_in
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.source import no_such_column
from dearig.recording.importers.text_layout import (
    HEAD_CHARACTERS,
    Column,
    Layout,
    cells_of,
    encoding_of,
    holds_data,
    layout_of,
)

__all__ = ["IMPORTER", "TextFile"]

#: Characters of a block: so short that a block with a wrong cell is read again in no time, and so
#: long that what is done once for each block does not count.
BLOCK = 2**21
_HEAD = 4 * HEAD_CHARACTERS  # bytes: a character has four at most


class TextFile:
    """The text file at ``path``. Raises ``InputError`` if it holds no table of numbers.

    ``names_line`` is the number of the line of names, from 1, where it is not found by itself. With
    ``skip_bad_rows`` rows that cannot be read are left out; ``skipped`` has their lines afterwards.
    """

    def __init__(
        self, path: Path, names_line: int | None = None, skip_bad_rows: bool = False
    ) -> None:
        self.path = path
        self.about: dict[str, str] = {}
        try:
            with open_input(path) as file:
                raw = file.read(_HEAD)
        except OSError as error:
            raise InputError(f"{path} cannot be read: {in_words(error)}") from error
        encoding = encoding_of(raw, path)
        try:
            head = codecs.getincrementaldecoder(encoding)().decode(raw, len(raw) < _HEAD)
        except UnicodeDecodeError as error:
            raise InputError(f"{path} begins as {encoding} text but is not: {error}") from error
        head = head[:HEAD_CHARACTERS]
        if len(head) == HEAD_CHARACTERS:
            head = head.rpartition("\n")[0] or head
        self.layout: Layout = layout_of(head, encoding, path, names_line)
        self._columns = {column.name: column for column in self.layout.columns}
        self._skip = skip_bad_rows
        self._side_by_side = bool(self.tables)
        self._wanted: list[Column] = []  # columns that were read last
        #: rows before each row that was left out, and its line, in words
        self.skipped: list[tuple[int, str]] = []
        self._spans: list[tuple[int, int, int]] = []  # rows before, first line, rows of a block

    @property
    def names(self) -> list[str]:
        """Names of all columns; ``#2`` for the second one if it has none."""
        return list(self._columns)

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns from the line below the names; of a date, s."""
        return {name: column.unit for name, column in self._columns.items() if column.unit}

    @property
    def places(self) -> dict[int, str]:
        """Names by the number of the column in the file, from 1."""
        return {column.place + 1: name for name, column in self._columns.items()}

    @property
    def tables(self) -> dict[str, list[str]]:
        """Columns of each specimen or table, where several stand side by side."""
        found: dict[str, list[str]] = {}
        for name, column in self._columns.items():
            if column.group:
                found.setdefault(column.group, []).append(name)
        return found

    def own_name(self, name: str) -> str:
        """Return ``name`` without its specimen or table."""
        return self._columns[name].own

    @property
    def block(self) -> Sequence[Sequence[str]]:
        """Cells of the lines above the names."""
        return self.layout.block

    def step_s(self, names: Sequence[str]) -> float | None:  # noqa: ARG002
        """Return the time from row to row that the file's head gives; None if it gives none."""
        return self.layout.step_s

    def named(self, name: str) -> list[str]:
        """Return the columns called ``name``."""
        return [n for n, column in self._columns.items() if name in (n, column.own)]

    def check(self, name: str) -> None:
        """See ``Source``."""
        if name not in self._columns:
            raise no_such_column(self, name)

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return columns by name; see ``Source``."""
        wanted = [self._columns[name] for name in dict.fromkeys(names)]
        self.skipped, self._spans, self._wanted = [], [], wanted
        pieces: list[np.ndarray] = []
        rows = 0
        for line, text in self._blocks():
            fast = self._read_fast(text, wanted)
            piece = self._read_slowly(rows, line, text, wanted) if fast is None else fast
            pieces.append(piece)
            self._spans.append((rows, line, piece.shape[1]))
            rows += piece.shape[1]
        table = np.concatenate(pieces, axis=1) if pieces else np.empty((len(wanted), 0))
        return {column.name: table[i] for i, column in enumerate(wanted)}

    def row(self, index: int) -> str:
        """Return the line of sample ``index`` of what was read last."""
        before, first, _ = next(span for span in self._spans if index < span[0] + span[2])
        left, skipped = index - before, {where for _, where in self.skipped}
        for line, text in self._blocks():
            if line != first:
                continue
            for number, content in enumerate(text.splitlines(), line):
                if self._holds_data(content) and f"line {number}" not in skipped:
                    if left == 0:
                        return f"line {number}"
                    left -= 1
        raise IndexError(index)

    def _blocks(self) -> Iterator[tuple[int, str]]:
        """Yield the number, from 1, of a block's first line, and the block."""
        try:
            with (
                open_input(self.path) as raw,
                io.TextIOWrapper(raw, self.layout.encoding, newline=None) as stream,
            ):
                yield from _pieces(stream, self.layout.first)
        except (OSError, UnicodeDecodeError) as error:
            said = in_words(error) if isinstance(error, OSError) else str(error)
            raise InputError(f"{self.path} cannot be read: {said}") from error

    def _read_fast(self, text: str, wanted: Sequence[Column]) -> np.ndarray | None:
        """Return the columns as pandas parses them, (columns, rows); None if they are not whole."""
        import pandas as pd  # takes a second to import, and most commands read no table

        layout = self.layout
        plain = wanted[0].decimal
        if any(c.since or c.thousands or c.decimal != plain for c in wanted):
            return None
        try:
            table = pd.read_csv(
                io.StringIO(text), header=None, names=range(layout.cells), index_col=False,
                sep=r"\s+" if layout.delimiter is None else layout.delimiter, comment="#",
                decimal=plain, dtype=dict.fromkeys((c.place for c in wanted), np.float64),
                skipinitialspace=True, na_filter=False, engine="c", low_memory=False,
            )  # fmt: skip
        except (ValueError, OverflowError):  # a parser's error is a ValueError
            return None
        values = np.empty((len(wanted), len(table)))
        for i, column in enumerate(wanted):
            values[i] = table[column.place].to_numpy()
        # a row that is too short has no last cell
        last = table[layout.cells - 1]
        whole = last.dtype.kind == "f" or bool((last.astype(str) != "").all())
        return values if np.isfinite(values).all() and whole else None

    def _read_slowly(
        self, before: int, line: int, text: str, wanted: Sequence[Column]
    ) -> np.ndarray:
        """Return the columns, read line by line; ``before`` are the rows above.

        Raises ``InputError`` for a wrong cell, or leaves its row out.
        """
        rows: list[list[float]] = []
        for number, content in enumerate(text.splitlines(), line):
            if not self._holds_data(content):
                continue
            fault, values = self._row(content, wanted)
            if not fault:
                rows.append(values)
            elif self._skip:
                self.skipped.append((before + len(rows), f"line {number}"))
            else:
                raise InputError(
                    f"{self.path}, line {number}{fault}; --skip-bad-rows leaves such rows out"
                )
        return np.array(rows, dtype=np.float64).reshape(len(rows), len(wanted)).T

    def _holds_data(self, content: str) -> bool:
        """Return True if a line has a row of the columns that are read.

        Of specimens side by side, one may be shorter than another.
        """
        if not holds_data(content) or not self._side_by_side:
            return holds_data(content)
        cells = cells_of(content, self.layout.delimiter)
        return any(c.place < len(cells) and cells[c.place] for c in self._wanted)

    def _row(self, content: str, wanted: Sequence[Column]) -> tuple[str, list[float]]:
        """Return what is wrong with a line, empty if nothing is, and its values."""
        try:
            cells = cells_of(content, self.layout.delimiter)
        except csv.Error as error:
            return f": it cannot be split: {error}", []
        if len(cells) != self.layout.cells:
            return f": {len(cells)} values, and the table has {self.layout.cells} columns", []
        values = []
        for column in wanted:
            value = number_in(cells[column.place], column)
            if value is None or not math.isfinite(value):
                wrong = complaint_about(cells[column.place], value)
                return f", column {column.name!r}: {wrong}", []
            values.append(value)
        return "", values


def _pieces(stream: TextIO, first: int) -> Iterator[tuple[int, str]]:
    for _ in range(first):
        stream.readline()
    line = first + 1
    while text := stream.read(BLOCK):
        if not text.endswith("\n"):
            text += stream.readline()
        yield line, text
        line += text.count("\n")


def _sniff(head: bytes) -> bool:
    """Return True for the beginning of a text with a table of numbers."""
    path = Path("file")
    try:
        encoding = encoding_of(head, path)
        text = head.decode(encoding, "replace")
        return bool(layout_of(text.rpartition("\n")[0] or text, encoding, path).columns)
    except InputError:
        return False


_SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".asc", ".prn", ".tra", ".lvm")

IMPORTER = Importer(
    "text table", _SUFFIXES, TextFile, _sniff, True, ("names_line", "skip_bad_rows")
)
