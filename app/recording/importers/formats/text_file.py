"""Columns of a table of numbers in a text file: CSV and its many relatives.

pandas parses the numbers, a block of lines at a time. A block that it refuses is halved until few
lines are left, which are read one by one, to say which cell is wrong, or to leave that row out.
"""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from datetime import datetime
from io import BytesIO
from pathlib import Path
from types import MappingProxyType

import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.files import system_text
from dearig.recording.importers.formats.cells import (
    cell_of,
    complaint_about,
    number_in,
    with_order,
)
from dearig.recording.importers.formats.columns import ColumnOverview, NamedColumns
from dearig.recording.importers.formats.text_blocks import (
    BytesReader,
    blocks_of,
    halves_of,
)
from dearig.recording.importers.formats.text_layout import (
    HEAD_CHARACTERS,
    TextColumn,
    TextLayout,
    is_line_of_names,
    layout_of,
)
from dearig.recording.importers.formats.text_lines import cells_of, encoding_of, holds_data
from dearig.recording.importers.formats.text_sections import TextSection, sections_of
from dearig.recording.importers.formats.text_table import GrowingColumns
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.quantities.moments import first_moment
from dearig.recording.importers.quantities.text_numbers import GROUPED, signs_of
from dearig.recording.importers.source import GapError, no_such_column, skip_or_refuse

__all__ = ["IMPORTER", "TextFile"]

#: Bytes of a block that is read line by line where it is not whole.
SHORT = 2**15
#: Threads that parse blocks.
THREADS = 2
#: A number with something behind it that is not a comment: 1.#IND is how some programs write NaN.
_NOT_COMMENT = re.compile(rb"[\d.]#")
#: Bytes of an ASCII character in encodings where it has several.
_WIDTHS = MappingProxyType({"utf-16": 2, "utf-32": 4})
#: The first lines of a universal file: a separator, and the number of a kind of data.
_UNIVERSAL = re.compile(r"\s*-1[ \t]*\r?\n[ \t]{0,5}(\d{1,4}b?)\s")
#: Name of a file that QCoDeS exports, and what is known of it.
_OF_QCODES = re.compile(r"qcodes_\d+_[0-9a-f]{8}-[0-9a-f-]{27}")
_QCODES = (
    "QCoDeS sorts the measured parameters by their names, and writes these only into its .nc "
    "files: import that one"
)
_HEAD = 4 * HEAD_CHARACTERS  # bytes: a character has four at most

#: Wrong rows after which the rest of a file is not looked at, if there were more wrong than right
#: ones until then: a second's work.
_LOST_MAX = 20_000


class TextFile(NamedColumns[TextColumn]):
    """The text file at ``path``. Raises ``InputError`` if it holds no table of numbers.

    ``names_line`` is the number of the line of names, from 1, where it is not found on its own.
    With ``skip_bad_rows`` rows that cannot be read are left out; ``skipped`` then has their lines.
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
            raise InputError(f"{path} cannot be read: {system_text(error)}") from error
        encoding = encoding_of(raw, path)
        try:
            head = codecs.getincrementaldecoder(encoding)().decode(raw, len(raw) < _HEAD)
        except UnicodeDecodeError as error:
            raise InputError(f"{path} begins as {encoding} text but is not: {error}") from error
        head = head[:HEAD_CHARACTERS]
        if len(head) == HEAD_CHARACTERS:
            head = head.rpartition("\n")[0] or head
        if match := _UNIVERSAL.match(head):
            raise InputError(
                f"{path} is a universal file (it begins with a dataset {match[1]}), which is not "
                f"read: export the signals as text or MAT from the program that made it"
            )
        self.layout: TextLayout = layout_of(head, encoding, path, names_line)
        #: what is known of the program that wrote a table without names
        self.hint = _QCODES if self.layout.names_line < 0 and _OF_QCODES.match(path.name) else ""
        columns = {column.name: column for column in self.layout.columns}
        self._section_of: dict[str, TextSection] = {}
        lines = head.replace("\r\n", "\n").replace("\r", "\n").split("\n")
        sections = sections_of(path, self.layout, lines[self.layout.names_line])
        if sections:
            columns = {}
            for section in sections:
                for column in self.layout.columns:
                    name = f"{section.title}/{column.name}"
                    group = f"{section.title}/{column.group}" if column.group else section.title
                    columns[name] = replace(column, name=name, group=group)
                    self._section_of[name] = section
        super().__init__(columns)
        #: columns that are given up, with ``GapError``, where a cell is not a number
        self.optional: frozenset[str] = frozenset()
        #: columns that are NaN where a cell is not a number
        self.measured: frozenset[str] = frozenset()
        self._skip = skip_bad_rows
        # it costs a third of the parsing
        self._is_spaced = f"{self.layout.delimiter} " in head
        self._side_by_side = any(column.group for column in self.layout.columns)
        self._wanted: list[TextColumn] = []  # columns that were read last
        #: places of columns of whole numbers in the sample, in which a block has a point or comma
        self._pointed: set[int] = set()
        self._decided: set[str] = set()  # columns whose signs the whole file has decided
        self._said: list[str] = []
        self._leaves_out, self._counts, self._grouped = skip_bad_rows, False, False
        self._section = TextSection("", self.layout.first, None)  # and the table that they are of
        #: rows before each row that was left out, and its line, in words
        self.skipped: list[tuple[int, str]] = []
        self._spans: list[_Span] = []

    @property
    def is_finite(self) -> bool:
        """True where other cells are refused, or their rows left out."""
        return not self.measured

    @property
    def labels(self) -> dict[str, str]:
        """What columns are that do not say it by their names: dates and times of day are times."""
        return {name: "time" for name, column in self._columns.items() if column.since is not None}

    @property
    def scales(self) -> dict[str, str]:
        """Scales that a line above the numbers gives, by column."""
        return {name: column.scaled for name, column in self._columns.items() if column.scaled}

    @property
    def places(self) -> dict[int, str]:
        """Names by the number of the column in the file, from 1, or by their order in tables."""
        if self._section_of:
            return dict(enumerate(self._columns, 1))
        return {column.place + 1: name for name, column in self._columns.items()}

    @property
    def tables(self) -> dict[str, list[str]]:
        """Columns of each specimen or table, where several stand side by side."""
        found: dict[str, list[str]] = {}
        for name, column in self._columns.items():
            if column.group:
                found.setdefault(column.group, []).append(name)
        return found

    @property
    def notes(self) -> Sequence[str]:
        """Sentences on what could be read in another way."""
        return (*self.layout.notes, *self._said)

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
        found: dict[str, np.ndarray] = {}
        for section in dict.fromkeys(self._section_of.get(name) for name in names):
            self._section = section or self._section
            found |= self._read_section([n for n in names if self._section_of.get(n) == section])
        return found

    def _read_section(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        while True:
            wanted = [self._ordered(name) for name in dict.fromkeys(names)]
            wrong: _WrongCellError | None = None
            try:
                table = self._read_rows(wanted, self._skip)
            except _WrongCellError as error:
                wrong = error.with_traceback(None)  # which would keep the rows that were read
            if wrong is not None:
                if wrong.is_open and (self._decide(wrong.column) or self._skip):
                    continue
                if wrong.column in self.optional:
                    raise GapError(wrong.place, wrong.column) from wrong
                needed = [c for c in wanted if c.name not in self.optional]
                try:
                    rows = self._read_rows(needed, skip=True, counts=True).rows
                except _HopelessError:
                    rows = 0
                lost = len(self.skipped)
                raise skip_or_refuse(f"{self.path}, {wrong.place}", lost, rows + lost) from wrong
            pointed = [c.name for c in wanted if c.place in self._pointed]
            if not sum(map(self._decide, pointed)):
                break
        return {column.name: values for column, values in zip(wanted, table.values, strict=True)}

    def _read_rows(
        self, wanted: list[TextColumn], skip: bool, counts: bool = False
    ) -> GrowingColumns:
        """Return the rows of the columns ``wanted``; leave wrong ones out if ``skip``.

        With ``counts`` it is only asked how many are wrong: raises ``_HopelessError`` once most
        are.
        """
        self.skipped, self._spans, self._wanted, self._pointed = [], [], wanted, set()
        self._leaves_out, self._counts = skip, counts
        table = GrowingColumns(0 if counts else len(wanted))
        size = left = self._size
        for line, block, values in self._parsed():
            self._keep(line, block, values, table, left)
            left -= len(block)
            self.progress(1.0 - max(left, 0) / size)
        return table

    def _decide(self, name: str) -> bool:
        """Find the signs in the numbers of a column from all its cells; return if they changed.

        The sample may end before the first number that has a group of thousands.
        """
        column = self._columns[name]
        if name in self._decided or column.since is not None:
            return False
        self._decided.add(name)
        found = signs_of([list(dict.fromkeys(self._cells(column)))])[0]
        if (found.decimal, found.thousands) == (column.decimal, column.thousands) or not (
            found.is_sure
        ):
            return False
        self._columns[name] = replace(
            column, decimal=found.decimal, thousands=found.thousands, mixed=found.mixed,
            undecided=False,
        )  # fmt: skip
        self._said.append(f"{found.thousands!r} in column {name!r} stands between thousands")
        return True

    def began(self, name: str) -> datetime | None:
        """Return the date and time from which the column ``name`` counts, once it is read."""
        is_open = any(c.name == name and c.is_open for c in self.layout.columns)
        return first_moment(self._columns[name].since, is_open)

    def _ordered(self, name: str) -> TextColumn:
        """Return the column ``name``, with the order of day and month that the whole file says."""
        column = self._columns[name]
        if column.mixed is not None:
            one, other = column.mixed
            raise InputError(
                f"{self.path}: the cells {one!r} and {other!r} of column {name!r} cannot both be "
                f"right: a sign stands before decimals in one and between thousands in the other; "
                f"write the numbers without thousands separators"
            )
        if column.is_open:
            column = replace(with_order(column, self._cells(column)), is_open=False)
            self._columns[name] = column
        return column

    def _cells(self, column: TextColumn) -> Iterator[str]:
        """Yield the cells of ``column`` in all lines of the table."""
        last = max(column.place, column.date_place or 0)
        for _, block in self._blocks():
            for line in block.decode("utf-8", "replace").split("\n"):
                if not holds_data(line):  # an empty line has an empty first cell
                    continue
                try:
                    cells = cells_of(line, self.layout.delimiter)
                except csv.Error:
                    continue
                if last < len(cells):
                    yield cell_of(cells, column)

    def overview(self, names: Sequence[str], count: int) -> dict[str, ColumnOverview]:
        """Return the first ``count`` values of columns, how many there are, and their range.

        All are read at once. Cells that are not numbers are passed over, in each column on its own.
        """
        found: dict[str, ColumnOverview] = {}
        for section in dict.fromkeys(self._section_of.get(name) for name in names):
            self._section = section or self._section
            self._wanted = [self._columns[n] for n in names if self._section_of.get(n) == section]
            seen = [ColumnOverview() for _ in self._wanted]
            size, done = self._size, 0
            for _, block, values in self._parsed():
                columns = self._apart(block) if values is None else values
                seen = [o.with_values(v, count) for o, v in zip(seen, columns, strict=True)]
                done += len(block)
                self.progress(min(done / size, 1.0))
            found |= {column.name: o for column, o in zip(self._wanted, seen, strict=True)}
        return found

    @property
    def _size(self) -> int:
        """Size of the file in bytes, if it were in UTF-8 as the blocks are; 1 at least."""
        return max(self.path.stat().st_size // _WIDTHS.get(self.layout.encoding[:6], 1), 1)

    def row(self, index: int) -> str:
        """Return the line of sample ``index`` of what was read last."""
        return self.rows([index])[0]

    def rows(self, indices: Sequence[int]) -> list[str]:
        """Return the lines of the samples ``indices``, which go up, of what was read last."""
        skipped = {where for _, where in self.skipped}
        spans = iter(self._spans)
        span = next(spans)
        found: list[str] = []
        for first, block in self._blocks():
            lines = block.removesuffix(b"\n").split(b"\n")
            while span.line < first + len(lines):
                left = [i - span.before for i in indices[len(found) :] if i < span.end]
                count = -1
                for number in range(span.line, first + len(lines)) if left else ():
                    if f"line {number}" in skipped or not self._is_row(lines[number - first]):
                        continue
                    count += 1
                    if count == left[0]:
                        found.append(f"line {number}")
                        if not left[1:]:
                            break
                        del left[0]
                if len(found) == len(indices):
                    return found
                span = next(spans)
        raise IndexError(indices[len(found)])

    def _is_row(self, line: bytes) -> bool:
        return self._holds_data(line.decode("utf-8", "replace"))

    def _blocks(self) -> Iterator[tuple[int, bytes]]:
        section = self._section
        return blocks_of(self.path, self.layout.encoding, section.first, section.end)

    def _parsed(self) -> Iterator[tuple[int, bytes, list[np.ndarray] | None]]:
        """Yield the blocks of the file, each with what ``_read_fast`` makes of it, in order.

        pandas parses outside of Python's lock, so two threads take half the time.
        """
        import pandas as pd  # noqa: F401  (once, before threads do)

        waiting: deque[tuple[int, bytes, Future[list[np.ndarray] | None]]] = deque()
        with ThreadPoolExecutor(THREADS) as threads:
            for line, block in self._blocks():
                waiting.append((line, block, threads.submit(self._read_fast, block)))
                if len(waiting) > THREADS:
                    first, whole, found = waiting.popleft()
                    yield first, whole, found.result()
            for first, whole, found in waiting:
                yield first, whole, found.result()

    def _keep(
        self,
        line: int,
        block: bytes,
        values: list[np.ndarray] | None,
        table: GrowingColumns,
        left: int,
    ) -> None:
        """Append the rows of ``block`` to ``table``; of ``left`` bytes of the file, it is a part.

        A block that is not whole is halved until the lines that are wrong stand alone.
        """
        if values is None:
            halves = halves_of(line, block) if self._is_plain and len(block) > SHORT else []
            if len(halves) > 1:
                for first, half in halves:
                    self._keep(first, half, self._read_fast(half), table, left)
                return
            values = self._read_slowly(table.rows, line, block)
        before = table.rows
        table.append(values, left / len(block))
        self._spans.append(_Span(before, line, table.rows))

    @property
    def _is_plain(self) -> bool:
        """True if pandas can parse the columns that are read."""
        plain = self._wanted[0].decimal if self._wanted else ""
        return all(c.since is None and not c.thousands and c.decimal == plain for c in self._wanted)

    def _read_fast(self, block: bytes) -> list[np.ndarray] | None:
        """Return the columns (rows,) as pandas parses them; None if they are not whole."""
        import pandas as pd  # takes a second to import, and most commands read no table

        layout, wanted = self.layout, self._wanted
        if not self._is_plain or not wanted or (b"#" in block and _NOT_COMMENT.search(block)):
            return None
        if self._is_too_long(block):  # pandas would leave out the last cells of all rows
            return None
        undecided = {c.place for c in wanted if c.undecided and c.name not in self._decided}
        try:
            table = pd.read_csv(
                BytesReader(block), header=None, names=range(layout.cells), index_col=False,
                sep=r"\s+" if layout.delimiter is None else layout.delimiter, comment="#",
                decimal=wanted[0].decimal,
                dtype=dict.fromkeys({c.place for c in wanted} - undecided, np.float64),
                skipinitialspace=self._is_spaced, na_filter=False, engine="c", low_memory=False,
            )  # fmt: skip
        except (ValueError, OverflowError):  # a parser's error is a ValueError
            return None
        if undecided:
            kinds = {place: table[place].dtype.kind for place in undecided}
            if not set(kinds.values()) <= set("iuf"):
                return None
            self._pointed |= {place for place, kind in kinds.items() if kind == "f"}
        values = [table[c.place].to_numpy().astype(np.float64, copy=False) for c in wanted]
        # a row that is too short has no last cell
        last = table[layout.cells - 1]
        whole = last.dtype.kind == "f" or bool((last.astype(str) != "").all())
        return values if whole and all(np.isfinite(v).all() for v in values) else None

    def _is_too_long(self, block: bytes) -> bool:
        """Return whether the first row of ``block`` has more cells than the table."""
        lines = (line.decode("utf-8", "replace").rstrip("\r\n") for line in BytesIO(block))
        row = next(filter(holds_data, lines), "")
        try:
            return any(cells_of(row, self.layout.delimiter)[self.layout.cells :])
        except csv.Error:
            return True

    def _apart(self, block: bytes) -> list[np.ndarray]:
        """Return the numbers of each column of ``block``, without cells that are none."""
        import pandas as pd

        layout = self.layout
        places = {c.place for c in self._wanted}
        places |= {c.date_place for c in self._wanted if c.date_place is not None}
        try:
            table = pd.read_csv(
                BytesReader(block), header=None, names=range(layout.cells), index_col=False,
                sep=r"\s+" if layout.delimiter is None else layout.delimiter, comment="#",
usecols=sorted(places), dtype=str, na_filter=False,
                skipinitialspace=self._is_spaced, on_bad_lines="skip", engine="c",
                low_memory=False,
            )  # fmt: skip
        except (ValueError, OverflowError):  # nothing is left of it
            return [np.empty(0) for _ in self._wanted]
        found = []
        for column in self._wanted:
            cells = table[column.place].astype(str)
            if column.date_place is not None:
                cells = table[column.date_place].astype(str) + " " + cells
            if self._is_plain and column.decimal == ".":
                numbers = pd.to_numeric(cells, errors="coerce").to_numpy(np.float64)
            else:
                read = (number_in(cell.strip(), column) for cell in cells)
                numbers = np.array([math.nan if n is None else n for n in read], dtype=np.float64)
            found.append(numbers[np.isfinite(numbers)])
        return found

    def _read_slowly(self, before: int, line: int, block: bytes) -> list[np.ndarray]:
        """Return the columns (rows,), read line by line; ``before`` are the rows above.

        Raises ``InputError`` for a wrong cell, or leaves its row out.
        """
        rows: list[list[float]] = []
        for number, content in enumerate(block.decode("utf-8", "replace").split("\n"), line):
            if not self._holds_data(content):
                continue
            fault, values, column = self._row(content, self._wanted)
            if not fault:
                rows.append(values)
            elif is_line_of_names(content, self.layout):
                raise InputError(
                    f"{self.path}, line {number}: here are names of columns again, others than "
                    f"those above: the rows behind them may be of another order and other units; "
                    f"make two files of it"
                )
            elif self._leaves_out and column not in self.optional and not self._is_open(column):
                self.skipped.append((before + len(rows), f"line {number}"))
                lost = len(self.skipped)
                if self._counts and lost > _LOST_MAX and lost > before + len(rows):
                    raise _HopelessError
            else:
                is_open = self._is_open(column)
                raise _WrongCellError(f"line {number}{fault}", column, is_open)
        return list(np.array(rows, dtype=np.float64).reshape(len(rows), len(self._wanted)).T)

    def _is_open(self, name: str) -> bool:
        """Return True for a wrong cell that the signs of its column, not decided yet, may right."""
        column = self._columns.get(name)
        return (
            self._grouped
            and column is not None
            and not (name in self._decided or column.since is not None)
        )

    def _holds_data(self, content: str) -> bool:
        """Return True if a line has a row of the columns that are read.

        Of specimens side by side, one may be shorter than another.
        """
        if not holds_data(content) or not self._side_by_side:
            return holds_data(content)
        cells = cells_of(content, self.layout.delimiter)
        return any(c.place < len(cells) and cells[c.place] for c in self._wanted)

    def _row(self, content: str, wanted: Sequence[TextColumn]) -> tuple[str, list[float], str]:
        """Return what is wrong with a line, empty if nothing is, its values, and in which column.

        The column is "" where the whole line is wrong.
        """
        try:
            cells = cells_of(content, self.layout.delimiter)
        except csv.Error as error:
            return f": it cannot be split: {error}", [], ""
        if not any(cells[self.layout.cells :]):  # each line may end with a delimiter
            cells = cells[: self.layout.cells]
        if len(cells) != self.layout.cells:
            said = f": {len(cells)} values, and the table has {self.layout.cells} columns"
            return said, [], ""
        values = []
        self._grouped = False
        for column in wanted:
            cell = cell_of(cells, column)
            value = number_in(cell, column)
            if value is None or not math.isfinite(value):
                wrong = complaint_about(cell, value)
                self._grouped = GROUPED.fullmatch(cell) is not None
                if column.name in self.measured and not self._is_open(column.name):
                    values.append(math.nan)
                    continue
                return f", column {column.name!r}: {wrong}", [], column.name
            values.append(value)
        return "", values, ""


class _HopelessError(Exception):
    """Most rows are wrong: no one wants the rest."""


class _WrongCellError(Exception):
    """A cell is not a number, or a line is not a row, at a ``place`` in words.

    ``column`` is its name, "" where the whole line is wrong; ``is_open`` if digits of the cell
    stand in groups, of which the file has not decided yet.
    """

    def __init__(self, place: str, column: str, is_open: bool) -> None:
        super().__init__(place)
        self.place, self.column, self.is_open = place, column, is_open


@dataclass(frozen=True)
class _Span:
    """Rows of the table from ``before`` to ``end``, which begin in ``line`` of the file."""

    before: int
    line: int
    end: int


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
