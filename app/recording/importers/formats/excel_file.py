"""Columns of an Excel workbook (.xlsx): the tables of its sheets, laid out as text tables are."""

from __future__ import annotations

import io
import itertools
import math
import re
import warnings
import zipfile
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from datetime import time as time_of_day
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.files import one_line, system_text
from dearig.recording.importers.formats.cells import complaint_about, number_in, with_order
from dearig.recording.importers.formats.columns import unseen
from dearig.recording.importers.formats.stored import StoredColumn, StoredColumns
from dearig.recording.importers.formats.text_layout import TextColumn, TextLayout, layout_of
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.quantities.moments import first_moment
from dearig.recording.importers.quantities.units import unit_of
from dearig.recording.importers.source import PARSER_FAILURES, listing, printable

if TYPE_CHECKING:
    from openpyxl import Workbook

__all__ = ["IMPORTER", "ExcelFile"]

#: Rows of a sheet in which its layout is looked for.
HEAD_ROWS = 600
#: Rows and columns of a sheet that are read, at most: those that Excel has, and those of a text.
ROWS_MAX, COLUMNS_MAX = 2**20, 2000
#: Sheets and parts of a workbook, at most.
SHEETS_MAX, PARTS_MAX = 100, 5000
#: Bytes that a sheet unpacks to at most: the first plus the second times the size of the file.
UNPACKED_MAX, PACKED_MAX = 2**25, 40
#: The same of all shared texts, each of which becomes an object.
TEXTS_MAX, TEXTS_PACKED_MAX = 2**22, 10
#: Bytes that any other part, and that a row of a sheet, unpacks to at most.
PART_MAX, ROW_MAX = 2**20, 2**20
#: Cells without a number whose content is kept for messages.
TOLD_MAX = 1000
#: Rows between two reports of progress.
REPORTED = 2000
_ZIP, _OLD = b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_NO_VALUE = (
    "a formula without its value: open the workbook in a spreadsheet program, save it, and import "
    "it again"
)

#: What a cell holds.
Cell = str | float | int | bool | datetime | date | time_of_day | timedelta | None


class ExcelFile(StoredColumns):
    """The workbook at ``path``. Raises ``InputError`` if it cannot be read or has no numbers.

    ``names_line`` is the row of the names, from 1, where it is not found on its own. Formulas have
    the values that were saved with them.
    """

    def __init__(self, path: Path, names_line: int | None = None) -> None:
        _check_parts(path)
        sheets, why = [], []
        for name in _names_of_sheets(path):
            try:
                sheets.append(_Sheet(path, name, names_line))
            except InputError as error:
                why.append(str(error))
        if not sheets:
            raise InputError(why[0] if why else f"{path} has no sheet with a table of numbers")
        columns: dict[str, StoredColumn] = {}
        for sheet in sheets:
            before = f"{printable(sheet.name)}/" if len(sheets) > 1 else ""
            for column in sheet.layout.columns:
                table = "/".join(filter(None, (before.rstrip("/"), column.group)))
                lasts = column.place in sheet.durations
                shown = sheet.shown.get(column.place, NumberFormat())
                columns[before + printable(column.name)] = StoredColumn(
                    _load(sheet, column, shown.times), None, column.own,
                    "s" if lasts else column.unit or shown.unit,
                    "time" if lasts or column.since is not None else "", table,
                    cell=_cell(sheet, column), row=sheet.row,
                    began=first_moment(column.since, column.is_open),
                )  # fmt: skip
        notes = [note for sheet in sheets for note in (*sheet.layout.notes, *sheet.notes())]
        super().__init__(path, "an Excel workbook", columns, notes=notes)
        for sheet in sheets:
            sheet.report = lambda part: self.progress(part)
        self.block = [row for sheet in sheets for row in sheet.layout.block]


def _load(sheet: _Sheet, column: TextColumn, times: float) -> Callable[[], np.ndarray]:
    return lambda: sheet.values(column) if times == 1.0 else sheet.values(column) * times


@dataclass(frozen=True)
class NumberFormat:
    """What a number format makes of a number: it shows it ``times`` as large, with a ``unit``."""

    times: float = 1.0
    unit: str = ""


def shown_by(number_format: str) -> NumberFormat:
    """Return what the number format of a cell makes of a number.

    ``0.0%`` shows 0.125 as 12.5%, ``0.000,`` 3200 as 3.200, and ``0.0" kV"`` adds a unit.
    """
    first = number_format.split(";")[0]
    texts = [text.strip() for text in _QUOTED.findall(first)]
    plain = _QUOTED.sub("", first)
    unit = next((text for text in texts if unit_of(text)), "")
    thousands = _THOUSANDS.search(plain)
    times = 1000.0 ** -len(thousands[1]) if thousands else 1.0
    percent = plain.count("%")
    return NumberFormat(times * 100.0**percent, "%" if percent == 1 else unit)


_QUOTED = re.compile(r'"([^"]*)"')
#: Commas behind the last digit of a number format, each of which divides by a thousand.
_THOUSANDS = re.compile(r"[0#?](,+)(?![0#?,])")


def _cell(sheet: _Sheet, column: TextColumn) -> Callable[[int], str]:
    return lambda index: sheet.complaint(column, index)


class _Sheet:
    """The table of the sheet ``name``; its numbers are read when the first column is asked for."""

    def __init__(self, path: Path, name: str, names_line: int | None) -> None:
        self.path, self.name = path, name
        self.report: Callable[[float], None] = unseen
        head = list(self._rows(HEAD_ROWS, values=True))
        self._formulas = self._empty_formulas(head)
        #: places of columns of durations, which a workbook marks by their format
        self.durations = frozenset(
            place for row in head for place, cell in enumerate(row) if isinstance(cell, timedelta)
        )
        lines = ["\t".join(_texts(row, self._formulas, _has_number(row))) for row in head]
        self.layout: TextLayout = layout_of("\n".join(lines), "utf-8", path, names_line, ("\t",))
        self.shown = self._formats()
        self._numbers: dict[int, array[float]] | None = None
        self._wrong: dict[tuple[int, int], str] = {}  # by place of the column and row of the sheet
        self._kept = np.empty(0, dtype=np.int64)  # rows of the sheet of what was read last

    def values(self, column: TextColumn) -> np.ndarray:
        """Return the numbers (n,) of ``column``, not a number where a cell has none.

        Rows that are blank in the columns of the same table are left out.
        """
        if self._numbers is None:
            self._numbers = self._read()
        of_group = [
            np.frombuffer(self._numbers[c.place])
            for c in self.layout.columns
            if c.group == column.group
        ]
        there = np.zeros(of_group[0].size, dtype=bool)
        for numbers in of_group:
            there |= ~np.isnan(numbers)
        for place, row in self._wrong:
            if any(c.place == place and c.group == column.group for c in self.layout.columns):
                there[row] = True
        self._kept = np.flatnonzero(there)
        return np.frombuffer(self._numbers[column.place])[self._kept]

    def row(self, index: int) -> str:
        """Return the place of the sample ``index`` of what was read last."""
        return (
            f"sheet {printable(self.name)!r}, row {self.layout.first + int(self._kept[index]) + 1}"
        )

    def complaint(self, column: TextColumn, index: int) -> str:
        """Return why the value ``index`` of ``column`` is not a number."""
        row = int(self._kept[index])
        if column.place in self._formulas and (column.place, row) not in self._wrong:
            return _NO_VALUE
        return self._wrong.get((column.place, row), "there is no value")

    def _formats(self) -> dict[int, NumberFormat]:
        """Return what the number formats of the first rows make of their numbers, by place.

        Raises ``InputError`` for a column that shows some numbers as they are and others not.
        """
        at = self.layout.first + 1
        formats: dict[int, set[NumberFormat]] = {}
        with _opened(self.path, values=True) as book:
            sheet = book[self.name]
            sheet.reset_dimensions()
            for row in sheet.iter_rows(min_row=at, max_row=at + HEAD_ROWS):
                for place, cell in enumerate(row):
                    if isinstance(cell.value, (int, float)):
                        shown = shown_by(str(getattr(cell, "number_format", "")))
                        formats.setdefault(place, set()).add(shown)
        for column in self.layout.columns:
            if len({shown.times for shown in formats.get(column.place, ())}) > 1:
                raise InputError(
                    f"{self.path}, sheet {printable(self.name)!r}: some cells of column "
                    f"{column.name!r} show their numbers in per cent or in thousands, and others "
                    f"as they are: give them one format"
                )
        return {place: max(shown, key=lambda one: one.unit) for place, shown in formats.items()}

    def notes(self) -> Iterator[str]:
        """Yield a sentence for each column whose numbers are taken as its cells show them."""
        for column in self.layout.columns:
            shown = self.shown.get(column.place, NumberFormat())
            if shown.times != 1.0:
                yield (
                    f"{column.name!r} is taken as its cells show it, {shown.times:g} times the "
                    f"number in them"
                )

    def _empty_formulas(self, head: Sequence[Sequence[Cell]]) -> frozenset[int]:
        """Return the places of columns with formulas that have no values."""
        found: set[int] = set()
        if not any(cell is None for row in head for cell in row):
            return frozenset()
        for row, formulas in zip(head, self._rows(HEAD_ROWS, values=False), strict=False):
            for place, formula in enumerate(formulas):
                empty = place >= len(row) or row[place] is None
                if empty and isinstance(formula, str) and formula.startswith("="):
                    found.add(place)
        return frozenset(found)

    def _read(self) -> dict[int, array[float]]:
        columns = [self._ordered(column) for column in self.layout.columns]
        numbers = {column.place: array("d") for column in columns}
        for index, row in enumerate(self._rows(ROWS_MAX, values=True)):
            if (at := index - self.layout.first) < 0:
                continue
            for column in columns:
                number, wrong = _number(_cell_of(row, column), column)
                numbers[column.place].append(number)
                if wrong and len(self._wrong) < TOLD_MAX:
                    self._wrong[column.place, at] = wrong
        return numbers

    def _ordered(self, column: TextColumn) -> TextColumn:
        """Return ``column`` with the order of day and month that all its texts say."""
        if not column.is_open:
            return column
        cells = (_cell_of(row, column) for row in self._rows(ROWS_MAX, values=True))
        return with_order(column, (cell.strip() for cell in cells if isinstance(cell, str)))

    def _rows(self, most: int, values: bool) -> Iterator[Sequence[Cell]]:
        """Yield the first ``most`` rows; of formulas, their ``values`` or themselves."""
        with _opened(self.path, values) as book:
            sheet = book[self.name]
            stated = max(sheet.max_row or 0, 1)
            sheet.reset_dimensions()  # what a file says of them may be wrong
            rows = iter(sheet.iter_rows(values_only=True))
            for number in itertools.count(1):
                row = next(rows, None)
                if row is None or number > most:
                    break
                if len(row) > COLUMNS_MAX:
                    raise InputError(
                        f"{self.path}, sheet {printable(self.name)!r}, row {number}: there are "
                        f"{len(row):,} columns; {COLUMNS_MAX:,} are read at most"
                    )
                yield row
                if number % REPORTED == 0:
                    self.report(min(number / stated, 1.0))
        if row is not None and most == ROWS_MAX:
            raise InputError(
                f"{self.path}, sheet {printable(self.name)!r}: there are more than {ROWS_MAX:,} "
                f"rows, and no workbook has as many; export it as CSV"
            )


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turn what the libraries raise on damaged workbooks into a sentence."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of formats of cells that it does not keep
            yield
    except (*PARSER_FAILURES, SyntaxError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path} cannot be read as an Excel workbook: {one_line(error)}"
        ) from error


def _number(cell: Cell, column: TextColumn) -> tuple[float, str]:
    """Return the number in ``cell`` and, where there is none, NaN and what is wrong."""
    if isinstance(cell, float):
        return cell, "" if math.isfinite(cell) else f"{cell} is not a finite number"
    if cell is None or cell == "":
        return math.nan, ""
    if isinstance(cell, bool):
        return math.nan, f"{cell} is not a number"
    if isinstance(cell, int):
        try:
            return float(cell), ""
        except OverflowError:
            return math.nan, "it is not a finite number"
    if isinstance(cell, timedelta):
        return cell.total_seconds(), ""
    if isinstance(cell, datetime) and column.since is not None and column.since.tzinfo is None:
        return (cell - column.since).total_seconds(), ""
    text = _text(cell)
    number = number_in(text, column)
    if number is None or not math.isfinite(number):
        stated = cell if isinstance(cell, str) else text
        return math.nan, complaint_about(stated.strip(), number)
    return number, ""


def _cell_of(row: Sequence[Cell], column: TextColumn) -> Cell:
    """Return the cell of ``column``; of a time of day, with the date that stands next to it."""
    cell = row[column.place] if column.place < len(row) else None
    if column.date_place is None or cell is None:
        return cell
    day = row[column.date_place] if column.date_place < len(row) else None
    return f"{_text(day).removesuffix(' 00:00:00')} {_text(cell)}"


def _has_number(row: Sequence[Cell]) -> bool:
    return any(isinstance(cell, (int, float, datetime, time_of_day)) for cell in row)


def _texts(row: Sequence[Cell], formulas: frozenset[int], data: bool) -> list[str]:
    """Return ``row`` as the cells of a text table; ``data`` if formulas may be numbers in it."""
    texts = [_text(cell) for cell in row]
    for place in formulas if data else ():
        texts += [""] * (place + 1 - len(texts))
        texts[place] = texts[place] or "nan"
    return texts


def _text(cell: Cell) -> str:
    """Return ``cell`` as a cell of a text table."""
    if cell is None:
        return ""
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, datetime):
        return cell.isoformat(" ")
    if isinstance(cell, date):
        return f"{cell.isoformat()} 00:00:00"
    if isinstance(cell, time_of_day):
        return cell.isoformat()
    if isinstance(cell, str):
        # a formula's error (#DIV/0!) is a missing number; # does not begin a comment here
        return "nan" if cell.startswith("#") else re.sub(r'[\s"]+', " ", cell).strip()
    return repr(cell)


@contextmanager
def _opened(path: Path, values: bool) -> Iterator[Workbook]:
    from openpyxl import load_workbook

    # opened here, because the library takes no path with another ending
    with _reading(path), open_input(path) as file:
        with redirect_stdout(io.StringIO()):  # it prints what is wrong with styles
            book = load_workbook(file, read_only=True, data_only=values, keep_links=False)
        try:
            yield book
        finally:
            book.close()


def _names_of_sheets(path: Path) -> list[str]:
    with _opened(path, values=True) as book:
        names = [sheet.title for sheet in book.worksheets]
    if len(names) > SHEETS_MAX:
        raise InputError(f"{path} has {len(names)} sheets; {SHEETS_MAX} are read at most")
    return names


def _check_parts(path: Path) -> None:
    """Raise ``InputError`` unless the file at ``path`` is a workbook of a size that is safe."""
    try:
        with path.open("rb") as file:
            old = file.read(len(_OLD)) == _OLD
    except OSError as error:
        raise InputError(f"{path} cannot be read: {system_text(error)}") from error
    if old:
        raise InputError(
            f"{path} is a workbook of Excel 97 to 2003, or one with a password: open it in a "
            f"spreadsheet program and save it as .xlsx without a password, or as CSV"
        )
    with _reading(path), zipfile.ZipFile(path) as archive:
        parts = archive.infolist()
        if len(parts) > PARTS_MAX:
            raise InputError(f"{path} is not read: it has {len(parts):,} parts")
        _check_kind(path, [part.filename for part in parts])
        for part in parts:
            _check_part(path, archive, part)


def _check_kind(path: Path, parts: Sequence[str]) -> None:
    if any(part.endswith("workbook.xml") for part in parts):
        return
    advice = "open it in a spreadsheet program and save it as .xlsx, or as CSV"
    if any(part.endswith("workbook.bin") for part in parts):
        raise InputError(f"{path} is a binary workbook (.xlsb): {advice}")
    if "content.xml" in parts:
        raise InputError(f"{path} is an OpenDocument file: {advice}")
    raise InputError(
        f"{path} is an archive of {listing(parts)} and no workbook: unpack it, and import the "
        f"files in it"
    )


def _check_part(path: Path, archive: zipfile.ZipFile, part: zipfile.ZipInfo) -> None:
    name = part.filename
    if not name.endswith((".xml", ".rels")):
        return  # pictures and macros are not unpacked
    most, size = PART_MAX, path.stat().st_size
    if is_sheet := "sheets/" in name and name.endswith(".xml"):
        most = UNPACKED_MAX + PACKED_MAX * size
    elif name.lower().endswith("sharedstrings.xml"):
        most = TEXTS_MAX + TEXTS_PACKED_MAX * size
    if part.file_size > most:
        raise InputError(
            f"{path} is not read: {printable(name)} unpacks to {part.file_size:,} bytes, and "
            f"{most:,} are read at most; export it as CSV"
        )
    with archive.open(part) as file:
        head = file.read(2048).lstrip(b"\xef\xbb\xbf \r\n\t")
        # a document type may define entities that expand to anything
        if not re.match(rb"(<\?xml[^>]*\?>\s*)?(<!--[^>]*-->\s*)*<[A-Za-z]", head):
            raise InputError(
                f"{path} is not read: {printable(name)} does not begin as a part of a workbook"
            )
        if is_sheet and not _has_short_rows(file):
            raise InputError(
                f"{path} is not read: {printable(name)} has a row of more than {ROW_MAX:,} bytes"
            )


def _has_short_rows(file: IO[bytes]) -> bool:
    """Return True unless a row, which the library keeps as a whole, is larger than ``ROW_MAX``."""
    since = 0  # bytes from the last row's beginning
    while piece := file.read(2**16):
        rows = [match.start() for match in _ROW.finditer(piece)]
        if since + (rows[0] if rows else len(piece)) > ROW_MAX:
            return False
        since = len(piece) - rows[-1] if rows else since + len(piece)
    return True


_ROW = re.compile(rb"<(\w+:)?row[\s/>]")


def _sniff(head: bytes) -> bool:
    return head.startswith((_ZIP, _OLD))


_SUFFIXES = (".xlsx", ".xlsm", ".xltx", ".xls", ".xlsb", ".ods")

IMPORTER = Importer("Excel", _SUFFIXES, ExcelFile, _sniff, takes=("names_line",))
