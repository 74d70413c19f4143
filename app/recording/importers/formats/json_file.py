"""Columns of a JSON file: arrays by their paths, tables of rows, or one row in each line."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import islice
from pathlib import Path

import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input, parse_json
from dearig.recording.files import system_text
from dearig.recording.importers.formats.cells import complaint_about, number_in, with_order
from dearig.recording.importers.formats.stored import StoredColumn, StoredColumns, stated_scale
from dearig.recording.importers.formats.text_layout import TextColumn
from dearig.recording.importers.formats.text_lines import encoding_of
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.quantities.moments import first_moment, is_open_date, moment_of
from dearig.recording.importers.source import printable

__all__ = ["IMPORTER", "JsonFile"]

#: Bytes of a file, at most: each becomes some ten bytes of objects.
SIZE_MAX = 2**28
#: Depth of objects, and columns, at most.
DEEPEST, COLUMNS_MAX = 8, 2000
#: Values or rows from which the kind of a column, and the names of a table, are found.
LOOKED_AT = 100

#: A value of a JSON file.
Json = Mapping[str, "Json"] | list["Json"] | str | float | int | bool | None
#: Names of the values, and of the name, of an object that describes one column.
_VALUES, _NAMES, _UNITS = (
    ("data", "values", "samples", "y"),
    ("name", "label", "channel", "title", "quantity"),
    ("unit", "units", "unit_string"),
)

#: Names of an object that gives each column its scale.
_SCALES = ("scale", "scales", "gain", "gains", "factor", "factors", "offset", "offsets")


class JsonFile(StoredColumns):
    """The JSON file at ``path``. Raises ``InputError`` if it is none or has no columns of numbers.

    A column is called by its path: ``run.voltage_V``. Columns may be arrays, objects with name,
    unit and values, the members of rows, or the items of rows below an array of names.
    """

    def __init__(self, path: Path) -> None:
        content, lines = _content(path)
        columns: dict[str, StoredColumn] = {}
        for name, column in islice(_columns(content, "", "", lines, 0), COLUMNS_MAX):
            columns.setdefault(printable(name), column)
        super().__init__(path, "a JSON file", columns, separator=".")


def _content(path: Path) -> tuple[Json, bool]:
    """Return what is in the file, and True if each line is a row."""
    try:
        with open_input(path) as file:
            raw = file.read(SIZE_MAX + 1)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {system_text(error)}") from error
    if len(raw) > SIZE_MAX:
        raise InputError(
            f"{path} is not read: a JSON file may have {SIZE_MAX / 1e6:.0f} MB; write CSV or "
            f"Parquet instead"
        )
    try:
        text = raw.decode(encoding_of(raw[: 2**16], path))
        try:
            return parse_json(text), False
        except json.JSONDecodeError:
            rows = [parse_json(line) for line in text.splitlines() if line.strip()]
            if len(rows) < 2:
                raise
            return rows, True
    except (ValueError, RecursionError) as error:  # a decoder's error is a ValueError
        said = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)
        raise InputError(f"{path} cannot be read as a JSON file: {said}") from error


def _columns(
    value: Json, path: str, table: str, lines: bool, depth: int
) -> Iterator[tuple[str, StoredColumn]]:
    """Yield the columns in ``value`` by their paths."""
    if depth > DEEPEST:
        return
    if isinstance(value, Mapping):
        yield from _in_object(value, path, table, depth)
    elif isinstance(value, list):
        if _is_column(value):
            yield path or "values", _stored(value, path.rpartition(".")[2] or "values", table)
        elif value and all(isinstance(row, Mapping) for row in value):
            yield from _in_objects(value, path, table, lines, depth)  # type: ignore[arg-type]
        elif value and _is_rows(value):
            yield from _in_rows(value, (), path, lines)  # type: ignore[arg-type]
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield path or "value", _stored([value], path.rpartition(".")[2], table)


def _in_object(
    value: Mapping[str, Json], path: str, table: str, depth: int
) -> Iterator[tuple[str, StoredColumn]]:
    names, rows = value.get("columns"), value.get("data")
    if isinstance(names, list) and isinstance(rows, list) and _is_text(names) and _is_rows(rows):
        units = value.get("units")
        stated = units if isinstance(units, list) and _is_text(units) else ()
        index = value.get("index")  # of a table that pandas splits, which may be the time
        if isinstance(index, list) and _is_column(index) and not _numbers_rows(index):
            own = "index" if "index" not in names else "index #2"
            yield f"{path}.{own}" if path else own, _stored(index, own, path)
        yield from _in_rows(rows, names, path, False, stated)  # type: ignore[arg-type]
        return
    if _is_rows_by_key(value):  # of rows that are numbered the keys say nothing
        rows = [*value.values()]
        if not _counts(value):
            yield f"{path}.index" if path else "index", _stored([*value], "index", path)
        yield from _in_objects(rows, path, table, False, depth)  # type: ignore[arg-type]
        return
    if _is_keyed(value):
        yield path, _stored([*value.values()], path.rpartition(".")[2], table)
        return
    units = value.get("units")
    keyed = next((inner for inner in value.values() if _is_keyed(inner)), None)
    if isinstance(keyed, Mapping) and not _counts(keyed):
        inside = f"{path}.index" if path else "index"
        yield inside, _stored([*keyed], "index", path)
    for key, inner in value.items():
        inside = f"{path}.{key}" if path else key
        unit = units.get(key) if isinstance(units, Mapping) else None
        unit = unit or value.get(f"{key}_unit") or value.get(f"{key}_units")
        scales = {
            word: by_name for word in _SCALES if isinstance(by_name := value.get(word), Mapping)
        }
        scaled = stated_scale(
            {word: by_name[key] for word, by_name in scales.items() if key in by_name}
        )
        one = _described(inner)
        if one is not None:
            yield inside, _stored(one.values, key, path, one.unit, one.name, one.scaled or scaled)
            continue
        for name, column in _columns(inner, inside, path, False, depth + 1):
            if name == inside and (isinstance(unit, str) or scaled):
                unit = unit if isinstance(unit, str) else ""
                yield name, _stored(_values(inner), key, path, unit, scaled=scaled)
            else:
                yield name, column


def _is_keyed(value: Json) -> bool:
    """Return True for a column whose values have numbers, or dates and times, for keys."""
    if not isinstance(value, Mapping) or len(value) < 2:
        return False
    keys = islice(value, LOOKED_AT)
    return all(_column_of(key) is not None for key in keys) and _is_column([*value.values()])


def _is_rows_by_key(value: Mapping[str, Json]) -> bool:
    """Return True for rows whose keys are numbers, or dates and times."""
    looked_at = [*islice(value.items(), LOOKED_AT)]
    return len(looked_at) > 1 and all(
        _column_of(key) is not None
        and isinstance(row, Mapping)
        and not any(isinstance(inner, (list, Mapping)) for inner in row.values())
        for key, row in looked_at
    )


def _counts(value: Mapping[str, Json]) -> bool:
    """Return True if the keys of a column number its values."""
    return all(key == str(number) for number, key in enumerate(value))


def _numbers_rows(index: list[Json]) -> bool:
    """Return True for an index that merely numbers the rows."""
    return all(type(value) is int and value == at for at, value in enumerate(index))


def _is_text(values: list[Json]) -> bool:
    return all(isinstance(value, str) for value in values)


def _is_rows(values: list[Json]) -> bool:
    return all(isinstance(value, list) for value in values)


def _values(value: Json) -> list[Json]:
    """Return the values of a column, which is an array or an object with numbered members."""
    return (
        [*value.values()]
        if isinstance(value, Mapping)
        else value
        if isinstance(value, list)
        else [value]
    )


@dataclass(frozen=True)
class _Described:
    """A column as an object with name, unit and values describes it."""

    values: list[Json]
    name: str
    unit: str
    scaled: str


def _described(value: Json) -> _Described | None:
    if not isinstance(value, Mapping):
        return None
    values = next((value[key] for key in _VALUES if key in value), None)
    if not isinstance(values, list) or not _is_column(values):
        return None
    name = next((value[key] for key in _NAMES if isinstance(value.get(key), str)), "")
    unit = next((value[key] for key in _UNITS if isinstance(value.get(key), str)), "")
    others = [key for key, inner in value.items() if isinstance(inner, list) and _is_column(inner)]
    if len(others) != 1:
        return None
    return _Described(values, str(name), str(unit), stated_scale(value))


def _in_objects(
    rows: list[Mapping[str, Json]], path: str, table: str, lines: bool, depth: int
) -> Iterator[tuple[str, StoredColumn]]:
    """Yield the columns of objects: each describes one, is a table of its own, or is a row."""
    looked_at = rows[:LOOKED_AT]
    described = [_described(row) for row in looked_at]
    if all(described):
        for number, one in enumerate(filter(None, described)):
            own = one.name or f"{path.rpartition('.')[2]}[{number}]"
            yield (
                (f"{path}.{own}" if path else own),
                _stored(one.values, own, table, one.unit, scaled=one.scaled),
            )
        return
    if any(isinstance(inner, list) for row in looked_at for inner in row.values()):
        for number, row in enumerate(looked_at):
            name = next((str(row[key]) for key in _NAMES if isinstance(row.get(key), str)), "")
            yield from _in_object(row, name or f"{path}[{number}]", table, depth + 1)
        return
    members: dict[tuple[str, ...], None] = {}
    for row in looked_at:
        members.update(dict.fromkeys(_members(row, 0)))
    for keys in islice(members, COLUMNS_MAX):
        if not _is_column([_member(row, keys) for row in looked_at]):
            continue
        inside = ".".join(filter(None, (path, *keys)))
        yield inside, _stored_rows(rows, _get(keys), keys[-1], path, lines)


def _members(row: Mapping[str, Json], depth: int) -> Iterator[tuple[str, ...]]:
    for key, value in row.items():
        if isinstance(value, Mapping) and depth < DEEPEST:
            yield from ((key, *inner) for inner in _members(value, depth + 1))
        else:
            yield (key,)


def _member(row: Json, keys: Sequence[str]) -> Json:
    for key in keys:
        row = row.get(key) if isinstance(row, Mapping) else None
    return row


def _get(keys: Sequence[str]) -> Callable[[Json], Json]:
    return lambda row: _member(row, keys)


def _in_rows(
    rows: list[list[Json]],
    names: Sequence[str],
    path: str,
    lines: bool,
    units: Sequence[str] = (),
) -> Iterator[tuple[str, StoredColumn]]:
    """Yield the columns of rows, whose first one may be the names."""
    if not rows:
        return
    if not names and all(isinstance(name, str) and moment_of(name) is None for name in rows[0]):
        names, rows = [str(name) for name in rows[0]], rows[1:]
    width = max((len(row) for row in rows[:LOOKED_AT]), default=0)
    if not names and len(rows) < width and not lines:  # each is a column, not a row
        for number, values in enumerate(rows):
            if _is_column(values):
                yield f"{path}[{number}]", _stored(values, "", path)
        return
    for place in range(min(width, COLUMNS_MAX)):
        if not _is_column([_item(row, place) for row in rows[:LOOKED_AT]]):
            continue
        own = names[place] if place < len(names) else f"{path.rpartition('.')[2]}[{place}]"
        inside = own if not path else f"{path}.{own}" if names else f"{path}[{place}]"
        unit = units[place] if len(units) == len(names) > place else ""
        yield inside, _stored_rows(rows, _at(place), own, path, lines, unit)


def _item(row: Json, place: int) -> Json:
    return row[place] if isinstance(row, list) and place < len(row) else None


def _at(place: int) -> Callable[[Json], Json]:
    return lambda row: _item(row, place)


def _stored_rows(
    rows: Sequence[Json],
    get: Callable[[Json], Json],
    own: str,
    table: str,
    lines: bool,
    unit: str = "",
) -> StoredColumn:
    dated, label, began = _dated([get(row) for row in rows[:LOOKED_AT]])
    unit = unit or dated
    return StoredColumn(
        lambda: _numbers([get(row) for row in rows]), len(rows), own, unit, label, table,
        cell=lambda index: _complaint(get(rows[index])),
        row=(lambda index: f"line {index + 1}") if lines else None, began=began,
    )  # fmt: skip


def _stored(
    values: list[Json], own: str, table: str, unit: str = "", label: str = "", scaled: str = ""
) -> StoredColumn:
    dated = _dated(values[:LOOKED_AT])
    unit, label = unit or dated[0], label or dated[1]
    return StoredColumn(
        lambda: _numbers(values), len(values), own, unit, label, table,
        cell=lambda index: _complaint(values[index]), began=dated[2], scaled=scaled,
    )  # fmt: skip


def _dated(values: Sequence[Json]) -> tuple[str, str, datetime | None]:
    """Return unit, label and first moment of dates and times of day; "" and None for numbers."""
    first = next((value for value in values if value is not None), None)
    column = None if first is None else _column_of(first)
    if column is None or column.since is None:
        return "", "", None
    return "s", "time", first_moment(column.since, is_open_date(str(first)))


def _is_column(values: Sequence[Json]) -> bool:
    """Return True for values most of which are numbers, or dates and times."""
    there = [value for value in islice(values, LOOKED_AT) if value is not None]
    if any(isinstance(value, (list, Mapping)) for value in there):
        return False
    return 2 * sum(_column_of(value) is not None for value in there) > len(there)


def _column_of(value: Json) -> TextColumn | None:
    """Return how a value is written that is a number, or a date and time; else None."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return _PLAIN
    if not isinstance(value, str) or len(value) > LOOKED_AT:
        return None
    if (since := moment_of(value)) is not None:
        return TextColumn("", 0, "s", since=since)
    return next((c for c in (_PLAIN, _COMMA) if number_in(value.strip(), c) is not None), None)


_PLAIN, _COMMA = TextColumn("", 0), TextColumn("", 0, decimal=",")


def _numbers(values: Sequence[Json]) -> np.ndarray:
    """Return ``values`` as numbers (n,), not a number for what is none."""
    if all(type(value) is float or type(value) is int for value in values):
        try:
            return np.array(values, dtype=np.float64)
        except OverflowError:
            pass  # of a whole number without end, which is found below
    column = next((c for value in values if (c := _column_of(value)) is not None), _PLAIN)
    if column.since is not None:
        column = with_order(column, (v.strip() for v in values if isinstance(v, str)))
    return np.array([_number(value, column) for value in values], dtype=np.float64)


def _number(value: Json, column: TextColumn) -> float:
    if isinstance(value, str):
        number = number_in(value.strip(), column)
        return math.nan if number is None else number
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    return math.nan


def _complaint(value: Json) -> str:
    if value is None:
        return "there is no value"
    text = value if isinstance(value, str) else json.dumps(value)[:LOOKED_AT]
    return complaint_about(text, _number(value, _PLAIN))


def _sniff(head: bytes) -> bool:
    text = head.replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \r\n\t")
    return bool(re.match(rb'\{\s*["}]|\[\s*([{\["\]]|-?\d|null|NaN)', text))


_SUFFIXES = (".json", ".jsonl", ".ndjson")

IMPORTER = Importer("JSON", _SUFFIXES, JsonFile, _sniff)
