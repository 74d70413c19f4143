"""Columns of numbers in a Parquet file, without gaps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dearig.errors import InputError
from dearig.extras import import_extra
from dearig.recording.files import one_line
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.source import PARSER_FAILURES, no_such_column

__all__ = ["IMPORTER", "ParquetFile"]

#: Bytes that are unpacked at most: the first plus the second times the size of the file.
UNPACKED_MAX, PACKED_MAX = 2**28, 100


class ParquetFile:
    """The Parquet file at ``path``. Raises ``InputError`` if it is not one or has no numbers."""

    def __init__(self, path: Path) -> None:
        pyarrow, parquet = _library()

        self.path = path
        try:
            with parquet.ParquetFile(path) as file:
                schema, rows = file.schema_arrow, file.metadata.num_rows
        except (*PARSER_FAILURES, pyarrow.ArrowException) as error:
            raise self._unreadable(error) from error
        self.names = [
            field.name
            for field in schema
            if pyarrow.types.is_floating(field.type) or pyarrow.types.is_integer(field.type)
        ]
        if not self.names:
            raise InputError(f"{path} holds no columns of numbers")
        claimed, size = 8 * rows * len(self.names), path.stat().st_size
        if not 0 <= claimed <= UNPACKED_MAX + PACKED_MAX * size:
            raise InputError(f"{path} is not read: its {size} bytes claim {rows} rows")
        self.about = {
            name.decode("utf-8", "replace"): text.decode("utf-8", "replace")
            for name, text in (schema.metadata or {}).items()
        }

    def _unreadable(self, error: Exception) -> InputError:
        return InputError(f"{self.path} cannot be read as a Parquet file: {one_line(error)}")

    def named(self, name: str) -> list[str]:
        """Return the columns called ``name``."""
        return [n for n in self.names if n == name]

    def row(self, index: int) -> str:
        """Return the row of sample ``index``, counted from 1."""
        return f"row {index + 1}"

    def check(self, name: str) -> None:
        """See ``Source``."""
        count = self.names.count(name)
        if count == 0:
            raise no_such_column(self, name)
        if count > 1:
            raise InputError(f"{self.path}: {count} columns are called {name!r}; rename one")

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return columns by name; see ``Source``."""
        pyarrow, parquet = _library()

        wanted = list(dict.fromkeys(names))
        found = {}
        try:
            with parquet.ParquetFile(self.path, page_checksum_verification=True) as file:
                table = file.read(columns=wanted, use_threads=False)
            for name in wanted:
                column = table.column(name)
                if column.null_count:
                    empty = column.is_null().to_numpy()
                    raise InputError(
                        f"{self.path}, {self.row(int(np.argmax(empty)))}, column {name!r}: there "
                        f"is no value; fill it in or leave the row out"
                    )
                found[name] = column.to_numpy().astype(np.float64)
        except (*PARSER_FAILURES, pyarrow.ArrowException) as error:
            raise self._unreadable(error) from error
        return found


def _library() -> tuple[Any, Any]:
    purpose = "a Parquet file"
    return (
        import_extra("pyarrow", "parquet", purpose),
        import_extra("pyarrow.parquet", "parquet", purpose),
    )


def _sniff(head: bytes) -> bool:
    return head.startswith(b"PAR1")


IMPORTER = Importer("Parquet", (".parquet",), ParquetFile, _sniff)
