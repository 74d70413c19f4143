"""Columns of a text file of Octave, which ``save`` writes by default whatever the suffix is."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.files import system_text
from dearig.recording.importers.formats.stored import StoredColumn, StoredColumns
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.source import printable

__all__ = ["IMPORTER", "OctaveFile"]

#: Bytes of a file, columns of a matrix, and values of a range, at most.
SIZE_MAX, MATRIX_MAX, RANGE_MAX = 2**28, 256, 10**8
#: Rows of a matrix that are columns of it, at most: a measurement has more values.
ROWS_AS_COLUMNS = 16
_HEAD = re.compile(rb"(#|%) Created by Octave [^\n]*\n(#|%) name: ")
_LINE = re.compile(r"[#%] (name|type|rows|columns|ndims|length): ?(.*)")


class OctaveFile(StoredColumns):
    """The text file of Octave at ``path``. Raises ``InputError`` if it cannot be read.

    A column is called as in Octave: ``time_s``, ``run.force`` for a field of a struct, ``x[0]`` for
    the first column of a matrix.
    """

    def __init__(self, path: Path) -> None:
        try:
            with open_input(path) as file:
                raw = file.read(SIZE_MAX + 1)
        except OSError as error:
            raise InputError(f"{path} cannot be read: {system_text(error)}") from error
        if len(raw) > SIZE_MAX:
            raise InputError(
                f"{path} is not read: a text file of Octave may have {SIZE_MAX / 1e6:.0f} MB; save "
                f"it with -v7"
            )
        columns: dict[str, StoredColumn] = {}
        try:
            for name, column in _Reader(raw.decode("utf-8", "replace")).variables():
                columns[printable(name)] = column
        except (ValueError, IndexError, EOFError) as error:
            raise InputError(f"{path} cannot be read as a text file of Octave: {error}") from error
        super().__init__(path, "a text file of Octave", columns, separator=".")


class _Reader:
    """The lines of a text, read once from the first to the last."""

    def __init__(self, text: str) -> None:
        self._lines = text.splitlines()
        self._at = 0

    def _next(self) -> str:
        if self._at >= len(self._lines):
            raise EOFError("it ends in the middle of a variable")
        self._at += 1
        return self._lines[self._at - 1]

    def _word(self, key: str) -> str:
        """Return what the next line says of ``key``."""
        line = self._next()
        match = _LINE.fullmatch(line.rstrip())
        if match is None or match[1] != key:
            raise ValueError(f"line {self._at} does not say {key}")
        return match[2].strip()

    def variables(self) -> Iterator[tuple[str, StoredColumn]]:
        """Yield the columns of all variables."""
        while self._at < len(self._lines):
            match = _LINE.fullmatch(self._lines[self._at].rstrip())
            if match is not None and match[1] == "name":
                yield from self._variable("")
            else:
                self._at += 1

    def _variable(self, path: str) -> Iterator[tuple[str, StoredColumn]]:
        name = self._word("name")
        kind = self._word("type").removeprefix("global ")
        inside = f"{path}.{name}" if path else name
        if kind in ("matrix", "float matrix", "int16 matrix", "int32 matrix", "double_range",
                    "range"):  # fmt: skip
            yield from self._numbers(kind, name, inside, path)
        elif kind in ("scalar", "float scalar"):
            value = np.array([float(self._next())])
            yield inside, _stored(value, name, path)
        elif kind == "scalar struct":
            self._word("ndims")
            self._next()
            for _ in range(int(self._word("length"))):
                while not self._lines[self._at].strip():
                    self._next()
                yield from self._variable(inside)
        # texts and other kinds are passed over, line by line

    def _numbers(
        self, kind: str, name: str, path: str, table: str
    ) -> Iterator[tuple[str, StoredColumn]]:
        if kind.endswith("range"):
            self._next()  # # base, limit, increment
            base, limit, step = map(float, self._next().split()[:3])
            count = (limit - base) / step if step else 0.0
            if 0.0 < count < RANGE_MAX:
                values = base + step * np.arange(int(count * (1.0 + 1e-12) + 1e-9) + 1)
                yield path, _stored(values, name, table)
            return
        line = self._next()
        match = _LINE.fullmatch(line.rstrip())
        if match is None or match[1] not in ("rows", "ndims"):
            raise ValueError(f"line {self._at} does not say the size of {path}")
        if match[1] == "ndims":  # whole numbers, a line each, column by column
            sizes = [int(word) for word in self._next().split()]
            rows, width = (*sizes, 1)[:2]
            if len(sizes) > 2 or rows * width > len(self._lines) - self._at:
                raise ValueError(f"{path} has a size that is not in the file")
            cells = [float(self._next()) for _ in range(rows * width)]
            matrix = np.array(cells).reshape(width, rows).T
        else:
            rows, width = int(match[2]), int(self._word("columns"))
            if rows > len(self._lines) - self._at:
                raise EOFError("it ends in the middle of a variable")
            block = "\n".join(self._lines[self._at : self._at + rows])
            self._at += rows
            matrix = np.loadtxt(io.StringIO(block), ndmin=2) if rows * width else np.empty((0, 0))
            if matrix.shape != (rows, width):
                raise ValueError(f"{path} has {matrix.shape[0]} rows of {matrix.shape[1]} numbers")
        if 1 in matrix.shape:
            flat = matrix.reshape(-1)
            yield path, _stored(flat, name, table)
            return
        if matrix.shape[0] < min(matrix.shape[1], ROWS_AS_COLUMNS + 1):
            matrix = matrix.T
        for place in range(matrix.shape[1] if matrix.shape[1] <= MATRIX_MAX else 0):
            yield f"{path}[{place}]", _stored(matrix[:, place], f"{name}[{place}]", table)


def _stored(values: np.ndarray, own: str, table: str) -> StoredColumn:
    return StoredColumn(lambda: values, values.size, own, table=table)


def _sniff(head: bytes) -> bool:
    return _HEAD.match(head.replace(b"\r\n", b"\n")) is not None


IMPORTER = Importer("Octave text", (".mat", ".txt"), OctaveFile, _sniff)
