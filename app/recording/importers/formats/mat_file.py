"""Columns of a MATLAB MAT file (version 5): variables, fields, cells, columns of matrices.

A column is called by its path as in MATLAB: ``time_s``, ``data.xdata`` for a field,
``run(2).force`` for a field of the second struct, ``c{1}`` for a cell; ``data.xdata[0]`` is the
first column of a matrix.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from dearig.errors import InputError
from dearig.recording.files import system_text
from dearig.recording.importers.formats.mat5 import (
    FIELDS_MAX,
    ITEMS_MAX,
    Cells,
    Damaged,
    Opaque,
    Value,
    variables,
)
from dearig.recording.importers.formats.stored import StoredColumn, StoredColumns
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.source import printable

__all__ = ["IMPORTER", "OBJECTS", "MatFile"]

#: What is said of a file whose values are objects of MATLAB's classes.
OBJECTS = (
    "keeps its values as objects of MATLAB (tables, timetables, time series), which only MATLAB "
    "reads: save their columns with s = table2struct(t, 'ToScalar', true) and "
    "save(..., '-struct', 's'), or write them with writetable"
)
#: Fields that say nothing by their names: the text in a field next to them names them.
_GENERIC, _NAMES = frozenset({"data", "values", "value", "y", "signal"}), ("label", "name", "title")
_UNITS = ("unit", "units")
#: Signature of HDF5, and its place behind the block of text of a MAT file of version 7.3.
_HDF5, _BEHIND = b"\x89HDF\r\n\x1a\n", 512


class MatFile(StoredColumns):
    """The MAT file at ``path``. Raises ``InputError`` if it cannot be read or holds no numbers."""

    def __init__(self, path: Path) -> None:
        found = _load(path)
        columns: dict[str, StoredColumn] = {}
        for top, value in found.items():
            for name, column in islice(_columns(value, top, top, ""), ITEMS_MAX):
                columns[printable(name)] = column
        about = found.get("about")
        texts = about if isinstance(about, dict) else {}
        if not columns and any(isinstance(value, Opaque) for value in found.values()):
            raise InputError(f"{path} {OBJECTS}")
        super().__init__(
            path, "a MAT file", columns, separator=".",
            about={name: text for name, text in texts.items() if isinstance(text, str)},
        )  # fmt: skip


def _columns(value: Value, path: str, own: str, table: str) -> Iterator[tuple[str, StoredColumn]]:
    """Yield the columns in ``value``, which is called ``path``."""
    if isinstance(value, dict):
        stated = {name.lower(): text for name, text in value.items() if isinstance(text, str)}
        label = next((stated[name] for name in _NAMES if name in stated), "")
        unit = next((stated[name] for name in _UNITS if name in stated), "")
        for name, inner in value.items():
            called = (label or own) if name.lower() in _GENERIC else name
            for place, column in _columns(inner, f"{path}.{name}", called, path):
                plain = isinstance(inner, np.ndarray) and unit and name.lower() in _GENERIC
                yield place, column if not plain else _with_unit(column, unit)
    elif isinstance(value, Cells):
        yield from _in_cells(value, path, own, table)
    elif isinstance(value, list):
        for number, inner in enumerate(value, 1):
            yield from _columns(inner, f"{path}({number})", own, table)
    elif isinstance(value, np.ndarray) and value.size and value.ndim <= 2:
        if 1 in value.shape or value.ndim < 2:
            yield path, _stored(value.reshape(-1), own, table)
        elif value.shape[1] <= FIELDS_MAX:
            for i in range(value.shape[1]):
                yield f"{path}[{i}]", _stored(value[:, i], f"{own}[{i}]", table)


def _in_cells(cells: Cells, path: str, own: str, table: str) -> Iterator[tuple[str, StoredColumn]]:
    """Yield the columns in ``cells``: each is one or more, or a number or text of a table."""
    if len(cells) == 1:
        yield from _columns(cells[0], path, own, table)
        return
    if any(not _is_single(cell) for cell in cells):
        for number, inner in enumerate(cells, 1):
            yield from _columns(inner, f"{path}{{{number}}}", own, table)
        return
    rows = [cells[i :: cells.rows] for i in range(cells.rows)]
    names: Sequence[Value] = rows[0] if all(isinstance(cell, str) for cell in rows[0]) else ()
    below = rows[1:] if names else rows
    for place in range(len(rows[0])):
        values = np.array([_number(row[place]) for row in below])
        if np.isnan(values).all():
            continue
        name = str(names[place]) if names else f"{own}[{place}]"
        yield f"{path}.{name}" if names else f"{path}[{place}]", _stored(values, name, path)


def _is_single(cell: Value) -> bool:
    return cell is None or isinstance(cell, str) or (isinstance(cell, np.ndarray) and cell.size < 2)


def _number(cell: Value) -> float:
    if isinstance(cell, np.ndarray) and cell.size:
        return float(cell.reshape(-1)[0])
    return float("nan")


def _stored(values: np.ndarray, own: str, table: str) -> StoredColumn:
    return StoredColumn(lambda: values, int(values.size), own, table=table)


def _with_unit(column: StoredColumn, unit: str) -> StoredColumn:
    return StoredColumn(column.load, column.size, column.own, unit, table=column.table)


def _load(path: Path) -> dict[str, Value]:
    try:
        return variables(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path} cannot be read: {system_text(error)}") from error
    except Damaged as error:
        raise InputError(f"{path} {error}") from error


def _sniff(head: bytes) -> bool:
    # some programs write this text over a file of version 7.3, which is HDF5 behind it
    return head.startswith(b"MATLAB 5.0 MAT-file") and not head.startswith(_HDF5, _BEHIND)


IMPORTER = Importer("MATLAB MAT", (".mat",), MatFile, _sniff)
