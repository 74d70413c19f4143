"""Layout of a table of numbers in a text file, found from its first lines.

The lines of data decide: several in a row with as many numbers each. What stands above them are
names, units, or a block of parameters of the machine.
"""

from __future__ import annotations

import csv
import functools
import itertools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from dearig.errors import InputError
from dearig.recording.importers.formats.text_lines import (
    HEADER_LINES,
    bare,
    cells_of,
    holds_data,
    joined,
    rises,
    scales_in,
    with_brackets,
    with_labels,
)
from dearig.recording.importers.quantities.labels import label_of
from dearig.recording.importers.quantities.moments import (
    MIDNIGHT,
    day_first_or_open,
    is_date,
    is_open_date,
    moment_of,
)
from dearig.recording.importers.quantities.text_numbers import Signs, is_number, signs_of
from dearig.recording.importers.quantities.units import unit_of

__all__ = [
    "HEAD_CHARACTERS",
    "TextColumn",
    "TextLayout",
    "is_line_of_names",
    "is_row",
    "layout_of",
]

#: Characters from the start in which the layout is looked for: blocks of parameters are short.
HEAD_CHARACTERS = 2**16
#: Columns, at most. Data loggers write some hundred; each name is compared with those known.
COLUMNS_MAX = 2000

_DELIMITERS = ("\t", ";", ",", "|", None)  # None: any white space
_RULE = re.compile(r"[\s|+:=_*-]+")  # a line that is drawn below the names
_SAMPLE = 400  # lines of data that are looked at
#: Names of quantities in a line of names that names fewer columns than there are, at least.
NAMED_MIN = 2
#: What a Campbell logger writes as the units of time stamps and of numbers of rows.
_NO_UNITS = frozenset({"TS", "RN"})
_LEAST = 2  # lines of data in a row that begin a table


@dataclass(frozen=True)
class TextColumn:
    """A column of a text table: its name, the unit below the name, and its place from 0.

    ``own`` is its name without ``group``, the specimen or table that it belongs to where there are
    several side by side, and without the place behind a repeated name. ``decimal`` is the sign
    before decimals, ``thousands`` that between groups of digits, or empty. ``since`` is the first
    moment of a column of dates and times of day, which is read in s from it; ``date_place`` is the
    place of the dates that belong to times of day. ``day_first`` is the order in its dates, which
    ``is_open`` where their form does not say it: then all of them do. ``undecided``: the sample
    does not say what a point or a comma in its numbers means. ``mixed`` are two cells in which it
    has two meanings. ``scaled`` is a scale that a line above the numbers gives it: ``x1000``.
    """

    name: str
    place: int
    unit: str = ""
    decimal: str = "."
    thousands: str = ""
    since: datetime | None = None
    group: str = ""
    own: str = ""
    day_first: bool = True
    is_open: bool = False
    date_place: int | None = None
    undecided: bool = False
    mixed: tuple[str, str] | None = None
    scaled: str = ""


@dataclass(frozen=True)
class TextLayout:
    """Layout of a text table.

    ``first`` is the number, from 0, of the first line of data; ``names_line`` that of the names,
    -1 if there is none. ``cells`` are the cells of a line of data, ``block`` those of the lines
    above the names, ``step_s`` the time from row to row where the file says it. ``notes`` are
    sentences on what could be read in another way.
    """

    encoding: str
    delimiter: str | None
    first: int
    names_line: int
    cells: int
    columns: tuple[TextColumn, ...]
    block: tuple[tuple[str, ...], ...] = ()
    step_s: float | None = None
    notes: tuple[str, ...] = ()


def layout_of(
    head: str,
    encoding: str,
    path: Path,
    names_line: int | None = None,
    delimiters: Sequence[str | None] = _DELIMITERS,
) -> TextLayout:
    """Return the layout of the text that begins with ``head``.

    ``names_line`` is the number of the line of names, from 1, where the user says it; one of
    ``delimiters`` separates the cells. Raises ``InputError`` if there is no table of numbers.
    """
    lines = joined(head.replace("\r\n", "\n").replace("\r", "\n").split("\n"))
    if not any(map(str.strip, lines)):
        raise InputError(f"{path} is empty")
    forced = re.fullmatch(r'"?sep=(.)"?\s*', lines[0])
    start = 1 if forced else 0
    labview = lines[0].startswith("LabVIEW Measurement")
    blank = re.search(r"\S[ \t]+\S", head) is not None
    there = [d for d in delimiters if (blank if d is None else d in head)]
    options = (forced[1],) if forced else there or delimiters
    found = [t for d in options if (t := _Table.find(lines, start, d, labview))]
    if not found:
        raise _no_table(lines, start, path)
    table = max(found, key=lambda t: (t.rows > 0, t.cells > 1, t.strict, t.rows * t.cells, t.cells))
    return table.layout(encoding, path, None if names_line is None else names_line - 1)


def _too_wide(path: Path, columns: int) -> InputError:
    return InputError(
        f"{path} has {columns:,} columns or more; {COLUMNS_MAX:,} are read at most: see that it is "
        f"the right file"
    )


def _no_table(lines: Sequence[str], start: int, path: Path) -> InputError:
    data = [line for line in lines[start:] if holds_data(line)]
    if not data:
        return InputError(f"{path} is empty")
    widest = max(line.count(mark) + 1 for line in data for mark in _DELIMITERS if mark)
    if widest > COLUMNS_MAX:
        return _too_wide(path, widest)
    if len(data) == 1:
        return InputError(f"{path} has a line of names and no data")
    return InputError(
        f"{path}: no two lines in a row are numbers; name the line of names, and see that it is "
        f"the right file",
        option="names_line",
    )


@dataclass(frozen=True)
class _Table:
    """Lines of data from ``first`` on: ``rows`` lines of ``cells`` cells in the sample."""

    lines: Sequence[str]
    start: int
    delimiter: str | None
    labview: bool
    first: int
    cells: int
    rows: int
    sample: tuple[tuple[str, ...], ...]
    strict: bool  # all cells of its first lines are numbers

    @classmethod
    def find(
        cls, lines: Sequence[str], start: int, delimiter: str | None, labview: bool
    ) -> _Table | None:
        """Return the table that ``delimiter`` splits ``lines`` into; None if there is none."""
        places = [i for i in range(start, len(lines)) if holds_data(lines[i])]

        @functools.cache  # most lines are never split
        def row(number: int) -> list[str]:
            return cells_of(lines[places[number]], delimiter)

        # numbers only, then mostly numbers, then one row of numbers below a line of names
        for strict, least in ((True, _LEAST), (False, _LEAST), (True, 1)):
            good = functools.partial(_is_data, strict=strict)
            for at in range(0 if least > 1 else 1, len(places) - least + 1):
                run = [row(i) for i in range(at, at + least)]
                all_rows = run if least > 1 else [row(at - 1), *run]
                if len({len(cells) for cells in all_rows}) > 1 or not all(map(good, run)):
                    continue
                width = len(run[0])
                # rows with a cell that is not a number may stand first
                while strict and least > 1 and at > 0 and places[at - 1] == places[at] - 1:
                    if len(row(at - 1)) != width or not _is_data(row(at - 1), strict=False):
                        break
                    at -= 1
                every = map(row, range(at, len(places)))
                below = (cells for cells in every if len(cells) == width and good(cells))
                like = tuple(tuple(cells) for cells in itertools.islice(below, _SAMPLE))
                return cls(
                    lines, start, delimiter, labview, places[at], width, len(like), like, strict
                )
        return None

    def layout(self, encoding: str, path: Path, names_line: int | None) -> TextLayout:
        """Return the layout of the file, with the names that stand above the table."""
        if self.cells > COLUMNS_MAX:
            raise _too_wide(path, self.cells)
        line, names, units = self._names(path, names_line)
        if names_line is None:
            above = [i for i in range(self.start, self.first) if self.lines[i].strip()]
            line, names = with_labels({i: self._split(i) for i in above}, line, names)
        self._check_commas(path, line, names)
        names = self._behind_row_names(path, names)
        if self.labview:
            units = units or self._labview_units(names)
        groups = self._groups(line, names)
        columns, notes = self._columns(names, units, groups)
        used = self.first if line < 0 else line
        block = tuple(
            tuple(c for c in cells_of(bare(text), self.delimiter) if c)
            for text in self.lines[self.start : used]
            if text.strip()
        )
        return TextLayout(
            encoding, self.delimiter, self.first, line, self.cells,
            _unique(self._scaled(line, columns)), block,
            self._step(names, units, block), (*notes, *self._passed_over(line)),
        )  # fmt: skip

    def _behind_row_names(self, path: Path, names: list[str]) -> list[str]:
        """Return ``names``, moved by one where the first column has the names of rows, as R writes.

        There is a name less than columns, and the first one counts the rows. Raises ``InputError``
        where it may be the time as well, and the last column have no name.
        """
        if not names or len(names) != self.cells - 1:
            return names
        first = [row[0] for row in self.sample]
        counts = any(first == [str(i + at) for i in range(len(first))] for at in (0, 1))
        # names of rows are texts, and in quotation marks; a time that counts is not
        quoted = re.match(r'"\d+"[^"]', self.lines[self.first].strip()) is not None
        is_time = "time" in label_of(names[0]).quantities
        if not counts or (is_time and not quoted and not rises([row[1] for row in self.sample])):
            return names
        if is_time and not quoted:
            raise InputError(
                f"{path}: there are {len(names)} names for {self.cells} columns, and both the "
                f"first and the second one may be the time: write a name above each column"
            )
        return ["", *names]

    def _names(self, path: Path, given: int | None) -> tuple[int, list[str], list[str]]:
        """Return the line of the names, the names, and the units below them."""
        above = [
            i
            for i in range(self.first - 1, self.start - 1, -1)
            if self.lines[i].strip() and not _RULE.fullmatch(self.lines[i])
        ]
        if given is not None:
            if given not in above:
                raise InputError(
                    f"{path}: line {given + 1} is not a line of names: the numbers begin in line "
                    f"{self.first + 1}"
                )
            between = [i for i in above if i > given]
            units = self._split(between[0]) if between else []
            return given, self._split(given), units if _are_units(units) else []
        if not above:
            return -1, [], []
        cells = self._split(above[0])
        if len(above) > 1 and "increment" in map(str.lower, names := self._split(above[1])):
            return above[1], names, cells  # an oscilloscope's: start and increment below the names
        if len(above) > 1 and _are_units(cells):
            names = self._split(above[1])
            if not any(map(_says, names)) and (better := self._named_above(above[:HEADER_LINES])):
                return better
            if self._are_names(names) or (len(names) == len(cells) and _are_all_units(cells)):
                return above[1], names, cells
        said = sum(map(_says, cells)) if self._are_names(cells) else 0
        better = self._named_above(above[:HEADER_LINES]) if said < len(cells) else None
        if better is not None and sum(map(_says, better[1])) > said:
            return better
        if not self._are_names(cells):
            return -1, [], []
        units = self._split(above[1]) if len(above) > 1 else []
        # some programs write the units above the names
        return above[0], cells, units if len(units) == len(cells) and _are_all_units(units) else []

    def _named_above(self, above: Sequence[int]) -> tuple[int, list[str], list[str]] | None:
        """Return the line of ``above`` that names the most quantities, its names, and units.

        Loggers write further lines: kinds of values, sensors, numbers of channels. What the line
        leaves empty, another one names. None if no line names a quantity.
        """
        lines = {
            i: cells for i in above
            if (len(cells := self._split(i)) >= self._used or sum(map(_says, cells)) >= NAMED_MIN)
            and (self.delimiter is not None or len(cells) == self.cells)
        }  # fmt: skip
        said = {
            i: 0 if _are_all_units(cells) else sum(map(_says, cells)) for i, cells in lines.items()
        }
        best = max(lines, key=lambda i: (said[i], i), default=-1)
        if best < 0 or not said[best]:
            return None
        names = (lines[best] + [""] * self.cells)[: max(self.cells, len(lines[best]))]
        units: list[str] = []
        for number, cells in lines.items():
            if number != best and not units and (_are_units(cells) or _are_all_units(cells)):
                units = cells
        for place, name in enumerate(names):
            others = (
                cells[place] for i, cells in lines.items()
                if not name and i != best and cells is not units and place < len(cells)
            )  # fmt: skip
            names[place] = name or next((c for c in others if c and not is_number(c)), "")
        below = self._split(best + 1) if best + 1 in above and lines.get(best + 1) != units else []
        return best, _merged(lines[best], below, names), units

    @property
    def _used(self) -> int:
        """Number of cells of a row up to the last one that any row has."""
        return max(i for row in self.sample for i, cell in enumerate(row) if cell) + 1

    def _check_commas(self, path: Path, line: int, names: Sequence[str]) -> None:
        """Raise ``InputError`` if the comma stands both between columns and before decimals."""
        named = len([name for name in names if name])
        whole = all(re.fullmatch(r"[+-]?\d*", cell) for row in self.sample for cell in row)
        if self.delimiter == "," and 1 < named < self.cells <= 2 * named and whole:
            raise InputError(
                f"{path}: line {line + 1} has {named} names, and the rows below it have "
                f"{self.cells} numbers: the comma stands between columns and before decimals; "
                f"export it again with another sign between columns, such as a semicolon"
            )

    def _labview_units(self, names: Sequence[str]) -> list[str]:
        """Return the units that the head of a LabVIEW file gives, by the place of the column."""
        rows = (self._split(line) for line in range(self.start, self.first))
        stated = iter(next((row for row in rows if row[:1] == ["Y_Unit_Label"]), [""])[1:])
        # where each signal has times of its own, these have no unit there
        return ["" if name == "X_Value" else next(stated, "") for name in names]

    def _scaled(self, line: int, columns: Sequence[TextColumn]) -> list[TextColumn]:
        """Return ``columns`` with the scales that a line above the numbers gives them.

        Such a line has x1000 in each column, or numbers behind the word scale or gain.
        """
        found: dict[int, str] = {}
        for number in range(self.start, self.first):
            if number != line and self.lines[number].strip():
                found |= scales_in(self._split(number), self.cells)
        return [replace(column, scaled=found.get(column.place, "")) for column in columns]

    def _split(self, line: int) -> list[str]:
        text = self.lines[line]
        if not self.delimiter or not text.startswith(self.delimiter):  # its first cell is empty
            text = bare(text)
        cells = cells_of(text, self.delimiter)
        if text is not self.lines[line] and len(cells) != self.cells:
            if len(whole := cells_of(self.lines[line], self.delimiter)) == self.cells:
                return whole  # a column of numbers of rows is called #
            # names in a comment may be separated in another way
            for other in _DELIMITERS:
                if len(split := cells_of(text, other)) == self.cells:
                    return split
        if self.delimiter is None and len(cells) != self.cells:
            # names have single blanks in them, or units in brackets behind them
            for wide in (re.split(r"\s{2,}|\t", text.strip()), with_brackets(cells)):
                if len(wide) == self.cells:
                    return wide
        return cells

    def _are_names(self, cells: list[str]) -> bool:
        if self.delimiter is None and len(cells) != self.cells:
            return False  # which is above which column cannot be told
        named = [cell for cell in cells if cell]
        numbers = sum(is_number(cell) for cell in named)
        # a column at the end may have no name: a counter, or a note next to the table
        whole = len(cells) >= self._used or (
            sum(map(_says, cells)) >= NAMED_MIN and not _are_all_units(cells)
        )
        return whole and len(named) > 0 and numbers == 0

    def _groups(self, line: int, names: list[str]) -> list[str]:
        """Return the specimen or table of each column; empty where there is only one.

        A line above the names may say it, each at its first column, as merged cells of a
        spreadsheet do; without one, names that repeat as a whole are numbered.
        """
        none = [""] * self.cells
        named = [name for name in names[: self.cells] if name]
        above = next((i for i in range(line - 1, self.start - 1, -1) if self.lines[i].strip()), -1)
        if line >= 0 and above >= 0:
            titles = (self._split(above) + none)[: self.cells]
            starts = [i for i, title in enumerate(titles) if title]
            blocks = [
                set(filter(None, names[a:b])) for a, b in itertools.pairwise([*starts, self.cells])
            ]
            words = not any(is_number(titles[i]) for i in starts)
            if len(starts) > 1 and words and all(blocks) and blocks[0] & blocks[1]:
                found = list(none)
                for a, b in itertools.pairwise([*starts, self.cells]):
                    found[a:b] = [titles[a]] * (b - a)
                return found
        once = len(set(named))
        if once < 2 or once == len(named) or named != named[:once] * (len(named) // once):
            return none
        found, seen = list(none), 0
        for place, name in enumerate(names[: self.cells]):
            if name:
                found[place] = str(seen // once + 1)
                seen += 1
        return found

    def _columns(
        self, names: list[str], units: list[str], groups: list[str]
    ) -> tuple[list[TextColumn], list[str]]:
        """Return the columns with values in the sample, and notes on their numbers."""
        cells = {
            place: there
            for place in range(self.cells)
            if (there := [row[place] for row in self.sample if row[place]])
        }
        moments = {p: next(filter(None, map(moment_of, column)), None) for p, column in
                   cells.items()}  # fmt: skip
        timed = {place: moment for place, moment in moments.items() if moment is not None}
        dated = self._dates(cells, timed)
        numbers = {p: c for p, c in cells.items() if p not in timed and p not in dated.values()}
        signs = dict(zip(numbers, signs_of([*numbers.values()]), strict=True))
        found: list[TextColumn] = []
        notes: list[str] = []
        for place, column in cells.items():
            name = names[place] if place < len(names) and names[place] else f"#{place + 1}"
            unit = units[place] if place < len(units) else ""
            group, of = groups[place], signs.get(place, Signs())
            if place in dated.values():
                continue
            if place in timed and place in dated:
                days = [row[dated[place]].removesuffix(" 00:00:00") for row in self.sample]
                column = [f"{day} {row[place]}" for day, row in zip(days, self.sample, strict=True)]
            if place in timed:
                first = day_first_or_open(column)
                since = next(filter(None, (moment_of(cell, first) for cell in column)), None)
                found.append(
                    TextColumn(
                        name, place, "s", since=since or timed[place], group=group,
                        day_first=first, is_open=any(map(is_open_date, column)),
                        date_place=dated.get(place),
                    )
                )  # fmt: skip
                continue
            if of.open and of.decimal == ",":
                cell = next(cell for cell in column if "," in cell)
                notes.append(
                    f"{cell!r} in column {name!r} is read as {cell.replace(',', '.')}: nothing in "
                    f"the file says whether the comma is of decimals"
                )
            found.append(
                TextColumn(
                    name, place, unit, of.decimal, of.thousands, group=group,
                    undecided=not of.is_sure, mixed=of.mixed,
                )
            )  # fmt: skip
        return found, notes

    def _dates(
        self, cells: Mapping[int, list[str]], timed: Mapping[int, datetime]
    ) -> dict[int, int]:
        """Return the place of the dates by that of their times of day, where both stand apart."""
        clocks = [place for place, moment in timed.items() if moment.date() == MIDNIGHT.date()]
        days = [
            place for place, column in cells.items()
            if all(is_date(cell) or cell.endswith(" 00:00:00") for cell in column)
        ]  # fmt: skip
        return {clocks[0]: days[0]} if len(clocks) == len(days) == 1 else {}

    def _passed_over(self, line: int) -> list[str]:
        """Return a note on rows of numbers between the names and the first row that is read."""
        begin = self.start if line < 0 else line + 1
        rows = [
            number for number in range(begin, self.first)
            if holds_data(self.lines[number]) and any(map(is_number, self._split(number)))
            and len(self._split(number)) == self.cells
        ]  # fmt: skip
        if not rows:
            return []
        return [
            f"the table begins in line {self.first + 1}: line {rows[0] + 1}"
            + (f" and {len(rows) - 1} more" if len(rows) > 1 else "")
            + " above it were not taken for rows"
        ]

    def _step(
        self, names: list[str], units: list[str], block: tuple[tuple[str, ...], ...]
    ) -> float | None:
        """Return the time from row to row that the head of an instrument's file gives."""
        lowered = [name.lower() for name in names]
        if "increment" in lowered and (at := lowered.index("increment")) < len(units):
            return _positive(units[at])
        stated = {row[0]: row[1:] for row in block if len(row) > 1}
        steps, starts = stated.get("Delta_X", ()), stated.get("X0", ())
        one = len(set(map(_positive, steps))) == 1 and len(set(starts)) < 2
        return _positive(steps[0]) if self.labview and one else None


def _positive(text: str) -> float | None:
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        return None
    return value if 0.0 < value < float("inf") else None


def _merged(titles: Sequence[str], below: Sequence[str], names: list[str]) -> list[str]:
    """Return ``names`` with the title before each where merged cells of ``titles`` are over them.

    A merged cell has its text in the first place, and the line ``below`` a text in each.
    """
    found, title = list(names), ""
    for place, name in enumerate(below[: len(names)]):
        over = titles[place] if place < len(titles) else ""
        after = titles[place + 1] if place + 1 < len(titles) else ""
        starts = bool(over and name and not after and place + 1 < len(below) and below[place + 1])
        title = over if starts else "" if over or not name else title
        if title:
            found[place] = f"{title} {name}"
    return found


def _says(cell: str) -> bool:
    """Return True if ``cell`` names a quantity."""
    label = label_of(cell)
    return bool(label.quantities or label.raw or label.asked)


def _are_units(cells: Sequence[str]) -> bool:
    """Return True if ``cells`` are a line of units; an oscilloscope has numbers next to them."""
    named = [c for c in cells if c and not is_number(c) and c not in _NO_UNITS]
    known = [c for c in named if unit_of(c) is not None]
    return len(known) > 0 and len(known) >= len(named) - 1


def _are_all_units(cells: Sequence[str]) -> bool:
    """Return True if ``cells`` are units and nothing else; numbers above them name channels."""
    return all(not c or (not is_number(c) and unit_of(c) is not None) for c in cells)


def _unique(columns: Sequence[TextColumn]) -> tuple[TextColumn, ...]:
    """Return ``columns`` with the group before their names, and the place behind repeated ones."""
    seen: Counter[str] = Counter()
    found = []
    for column in columns:
        name = f"{column.group}/{column.name}" if column.group else column.name
        seen[name] += 1
        if seen[name] > 1:
            name = f"{name} #{column.place + 1}"
        found.append(replace(column, name=name, own=column.name))
    return tuple(found)


def is_row(line: str, layout: TextLayout) -> bool:
    """Return True if ``line`` is one of the table's rows, most of whose cells are numbers."""
    if not holds_data(line):
        return False
    try:
        cells = cells_of(line, layout.delimiter)
    except csv.Error:
        return False
    return len(cells) == layout.cells and _is_data(cells, strict=False)


def is_line_of_names(line: str, layout: TextLayout) -> bool:
    """Return True if ``line`` names quantities in several columns, others than the layout's."""
    try:
        cells = cells_of(bare(line), layout.delimiter)
    except csv.Error:
        return False
    again = all(c.place < len(cells) and cells[c.place] == c.own for c in layout.columns)
    return sum(map(_says, cells)) >= NAMED_MIN and not any(map(is_number, cells)) and not again


def _is_data(cells: Sequence[str], strict: bool) -> bool:
    """Return True if ``cells`` are a row of numbers; if not ``strict``, mostly numbers."""
    numbers = sum(is_number(c) or moment_of(c) is not None or is_date(c) for c in cells)
    words = sum(bool(cell) for cell in cells) - numbers
    return numbers > words if not strict else numbers > 0 and words == 0
