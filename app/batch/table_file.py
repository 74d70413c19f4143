"""Tables of plain values by the names of their columns, as CSV and as Parquet."""

from __future__ import annotations

import csv
import importlib.util
import io
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dearig.errors import InputError
from dearig.extras import import_extra
from dearig.input_file import read_input
from dearig.printable import no_formula, unmarked
from dearig.recording.content.fields import TEXTS
from dearig.recording.files import replaced_when_done, system_text, write_whole

__all__ = ["columns_of", "read_table", "write_csv", "write_parquet"]

#: Bytes of a table that is read, at most: 100,000 rows of 200 columns.
_TABLE_BYTES = 2**29
_TRUTHS = {"True": True, "False": False}
#: Columns that are names, also where they look like numbers.
_NAMES = frozenset(
    {"recording", "title", "run", "reason", "sha256", *(f.column for f in TEXTS.values())}
)


def columns_of(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the names of all columns, in the order in which they occur."""
    return list(dict.fromkeys(name for row in rows for name in row))


def write_csv(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write the rows to ``path``; a number is the shortest text that is read as the same number.

    Text that a spreadsheet would take for a formula is marked as text, see ``no_formula``.
    """
    text = io.StringIO()
    columns = columns_of(rows)
    table = csv.writer(text, lineterminator="\n")
    table.writerow(map(no_formula, columns))
    cells = ([row.get(name) for name in columns] for row in rows)
    table.writerows(
        [no_formula(cell) if isinstance(cell, str) else _cell(cell) for cell in line]
        for line in cells
    )
    write_whole(path, text.getvalue().encode())


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, list | dict):
        return json.dumps(value)
    return repr(float(value)) if isinstance(value, float) else str(value)


def write_parquet(rows: Sequence[Mapping[str, Any]], path: Path) -> Path | None:
    """Write the rows as Parquet to ``path`` and return it; None where pyarrow is not installed."""
    if importlib.util.find_spec("pyarrow") is None:
        return None
    pyarrow = import_extra("pyarrow", "parquet", "a table in Parquet")
    parquet = import_extra("pyarrow.parquet", "parquet", "a table in Parquet")
    columns = {}
    for name in columns_of(rows):
        values = [row.get(name) for row in rows]
        kinds = {type(value) for value in values if value is not None}
        if kinds <= {int, float} and float in kinds:
            values = [None if value is None else float(value) for value in values]
        elif len(kinds) > 1 or kinds & {list, dict}:
            values = [None if value is None else _cell(value) for value in values]
        columns[name] = pyarrow.array(values, type=pyarrow.string() if not kinds else None)
    with replaced_when_done(path, overwrite=True) as partial:
        parquet.write_table(pyarrow.table(columns), partial)
    return path


def read_table(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a table in CSV or Parquet, with numbers and truths as such.

    Raises ``InputError`` for a file that cannot be read, or that is none of these tables.
    """
    if path.suffix.lower() == ".parquet":
        return _read_parquet(path)
    try:
        text = read_input(path, "table", _TABLE_BYTES).decode("utf-8-sig")
        rows = list(csv.reader(io.StringIO(text), strict=True))
    except UnicodeDecodeError as error:
        raise InputError(f"table {path}: not UTF-8 text; save the file in UTF-8") from error
    except csv.Error as error:
        raise InputError(f"table {path}: not CSV ({error})") from error
    rows = [[unmarked(cell) for cell in row] for row in rows]
    head = rows[0] if rows else []
    if len(set(head)) != len(head):
        raise InputError(f"table {path}: two columns have the same name")
    for i, row in enumerate(rows[1:], start=2):
        if len(row) not in (0, len(head)):
            raise InputError(f"table {path}, row {i}: {len(row)} cells for {len(head)} columns")
    columns = [
        _typed([row[i] for row in rows[1:] if row], is_name=name in _NAMES)
        for i, name in enumerate(head)
    ]
    return [dict(zip(head, values, strict=True)) for values in zip(*columns, strict=True)]


def _typed(cells: list[str], is_name: bool) -> list[Any]:
    """Return the cells of a column as truths or numbers, where all of them are; "" is None."""
    values = [cell or None for cell in cells]
    if is_name:
        return list(values)
    if all(value is None or value in _TRUTHS for value in values):
        return [None if value is None else _TRUTHS[value] for value in values]
    try:
        numbers = [None if value is None else float(value) for value in values]
    except ValueError:
        return list(values)
    return [_finite(value) for value in numbers]


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _read_parquet(path: Path) -> list[dict[str, Any]]:
    parquet = import_extra("pyarrow.parquet", "parquet", "a table in Parquet")
    pyarrow = import_extra("pyarrow", "parquet", "a table in Parquet")
    try:
        rows: list[dict[str, Any]] = parquet.read_table(path).to_pylist()
    except OSError as error:
        raise InputError(f"table {path} cannot be read: {system_text(error)}") from error
    except (pyarrow.ArrowException, ValueError) as error:
        raise InputError(f"table {path}: not Parquet ({error})") from error
    return [{name: _finite(value) for name, value in row.items()} for row in rows]
