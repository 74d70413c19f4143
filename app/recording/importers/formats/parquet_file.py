"""Columns of numbers, dates and durations in a Parquet file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from dearig.errors import InputError
from dearig.extras import import_extra
from dearig.recording.files import one_line
from dearig.recording.importers.formats.stored import StoredColumn, StoredColumns, stated_scale
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.source import PARSER_FAILURES, printable

__all__ = ["IMPORTER", "ParquetFile"]

#: Bytes that are unpacked at most: the first plus the second times the size of the file.
UNPACKED_MAX, PACKED_MAX = 2**28, 100
#: Columns, and depth of structs, at most.
COLUMNS_MAX, DEEPEST = 2000, 8
_UNITS = (b"unit", b"units")


class ParquetFile(StoredColumns):
    """The Parquet file at ``path``. Raises ``InputError`` if it is not one or has no numbers.

    A field of a struct is called ``run.voltage_V``. What is null is not a number.
    """

    def __init__(self, path: Path) -> None:
        pyarrow, parquet = _library()
        self.path = path
        self._nulls: dict[str, np.ndarray] = {}
        try:
            with parquet.ParquetFile(path) as file:
                schema, rows = file.schema_arrow, file.metadata.num_rows
            found = list(islice(_fields(pyarrow.types, schema, (), 0), COLUMNS_MAX))
        except (*PARSER_FAILURES, pyarrow.ArrowException) as error:
            raise self._unreadable(error) from error
        claimed, size = 8 * rows * len(found), path.stat().st_size
        if not 0 <= claimed <= UNPACKED_MAX + PACKED_MAX * size:
            raise InputError(f"{path} is not read: its {size} bytes claim {rows} rows")
        columns = {}
        for place, unit, is_date, scaled in found:
            name = ".".join(place)
            if printable(name) in columns:
                raise InputError(f"{path}: two columns are called {name!r}; rename one")
            columns[printable(name)] = StoredColumn(
                self._loader(place), rows, place[-1], unit, "time" if is_date else "",
                ".".join(place[:-1]),
                cell=self._cell(name),
                is_utc=getattr(schema.field(place[0]).type, "tz", None) is not None,
                scaled=scaled,
            )  # fmt: skip
        super().__init__(
            path, "a Parquet file", columns, separator=".",
            about={
                name.decode("utf-8", "replace"): text.decode("utf-8", "replace")
                for name, text in (schema.metadata or {}).items()
            },
        )  # fmt: skip

    def _unreadable(self, error: Exception) -> InputError:
        return InputError(f"{self.path} cannot be read as a Parquet file: {one_line(error)}")

    def _cell(self, name: str) -> Callable[[int], str]:
        def cell(index: int) -> str:
            nulls = self._nulls.get(name)
            return "there is no value" if nulls is not None and nulls[index] else ""

        return cell

    def _loader(self, place: tuple[str, ...]) -> Callable[[], np.ndarray]:
        def load() -> np.ndarray:
            pyarrow, parquet = _library()
            try:
                with parquet.ParquetFile(self.path, page_checksum_verification=True) as file:
                    table = file.read(columns=[".".join(place)], use_threads=False)
                values = table.column(place[0])
                for name in place[1:]:
                    values = pyarrow.chunked_array(
                        [chunk.field(name) for chunk in values.chunks], values.type.field(name).type
                    )
                if values.null_count:
                    self._nulls[".".join(place)] = values.is_null().to_numpy()
                return _as_array(pyarrow, values)
            except pyarrow.ArrowException as error:
                raise self._unreadable(error) from error

        return load


def _as_array(pyarrow: Any, values: Any) -> np.ndarray:
    """Return a column (n,) of a table; what is null becomes not a number, or not a time."""
    kind = values.type
    if pyarrow.types.is_decimal(kind):
        values = values.cast(pyarrow.float64())
    elif pyarrow.types.is_time(kind):  # of day
        whole = pyarrow.int32() if pyarrow.types.is_time32(kind) else pyarrow.int64()
        values = values.cast(whole).cast(pyarrow.duration(kind.unit))
    return np.asarray(values.to_numpy())


def _fields(
    types: Any, fields: Any, path: tuple[str, ...], depth: int
) -> Iterator[tuple[tuple[str, ...], str, bool, str]]:
    """Yield the path of every column of numbers, its unit, if it has times, and a stated scale."""
    for field in fields:
        kind, inside = field.type, (*path, field.name)
        if types.is_struct(kind) and depth < DEEPEST:
            yield from _fields(types, [kind.field(i) for i in range(kind.num_fields)], inside,
                               depth + 1)  # fmt: skip
        elif types.is_temporal(kind) and not types.is_interval(kind):
            yield inside, "s", not types.is_duration(kind), ""
        elif types.is_floating(kind) or types.is_integer(kind) or types.is_decimal(kind):
            stated = field.metadata or {}
            unit = next((stated[name] for name in _UNITS if name in stated), b"")
            texts = {n.decode("utf-8", "replace"): v for n, v in stated.items()}
            yield inside, unit.decode("utf-8", "replace"), False, stated_scale(texts)


def _library() -> tuple[Any, Any]:
    purpose = "a Parquet file"
    return (
        import_extra("pyarrow", "parquet", purpose),
        import_extra("pyarrow.parquet", "parquet", purpose),
    )


def _sniff(head: bytes) -> bool:
    return head.startswith(b"PAR1")


IMPORTER = Importer("Parquet", (".parquet",), ParquetFile, _sniff)
