"""Columns of a MATLAB MAT file (version 5): variables, fields of structs, columns of matrices.

A column is called by its path: ``time_s``, ``data.xdata`` for a field, ``data.xdata[0]`` for the
first column of a matrix.
"""

from __future__ import annotations

import io
import re
import struct
import warnings
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from app.errors import InputError
from app.recording.importers.source import PARSER_FAILURES, no_such_column

__all__ = ["MatFile"]

#: MAT-File Format (The MathWorks): a header, then elements of kind, size and body.
HEADER = 128
VERSION_5, VERSION_7_3 = 0x0100, 0x0200
MATRIX, COMPRESSED = 14, 15
#: Fields of structs are followed to this depth.
DEEPEST = 8


class MatFile:
    """The MAT file at ``path``. Raises ``InputError`` if it cannot be read or holds no numbers."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._columns = {
            name: column for top, value in _load(path).items() for name, column in _walk(top, value)
        }
        if not self._columns:
            raise InputError(f"{path} holds no columns of numbers")

    @property
    def names(self) -> list[str]:
        """Paths of all columns."""
        return list(self._columns)

    def named(self, name: str) -> list[str]:
        """The columns whose path is ``name`` or ends with ``.name``."""
        return [n for n in self._columns if n == name or n.endswith(f".{name}")]

    def row(self, index: int) -> str:
        """The row of sample ``index``, counted from 1 as MATLAB does."""
        return f"row {index + 1}"

    def check(self, name: str) -> None:
        """See ``Source``."""
        if name in self._columns:
            return
        inside = [n for n in self._columns if re.match(re.escape(name) + r"[.\[]", n)]
        if inside:
            raise InputError(
                f"{self.path}: {name!r} holds several columns; say which: {', '.join(inside[:6])}"
            )
        raise no_such_column(self, name)

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Columns by name; see ``Source``."""
        return {name: self._columns[name] for name in names}


def _walk(name: str, value: np.ndarray, depth: int = 0) -> Iterator[tuple[str, np.ndarray]]:
    if depth > DEEPEST or not isinstance(value, np.ndarray) or value.size == 0:
        return
    if value.dtype.names:
        if value.size == 1:
            for field in value.dtype.names:
                yield from _walk(f"{name}.{field}", value.reshape(-1)[0][field], depth + 1)
    elif value.dtype.kind == "O":
        if value.size == 1:
            yield from _walk(name, value.reshape(-1)[0], depth + 1)
    elif value.dtype.kind in "fiu" and value.ndim <= 2:
        if value.ndim < 2 or 1 in value.shape:
            yield name, value.reshape(-1).astype(np.float64)
        else:
            for i in range(value.shape[1]):
                yield f"{name}[{i}]", value[:, i].astype(np.float64)


def _check_whole(path: Path, raw: bytes) -> None:
    """Raise ``InputError`` unless ``raw`` is a whole MAT file of version 5.

    SciPy's parser was seen to crash the interpreter on damaged files: what has been cut short or
    fails a checksum (compressed variables have one) never reaches it.
    """
    little = raw[126:HEADER] == b"IM"
    if not little and raw[126:HEADER] != b"MI":
        raise InputError(f"{path} cannot be read as a MAT file: it does not begin as one")
    version = struct.unpack_from("<H" if little else ">H", raw, 124)[0]
    if version == VERSION_7_3:
        raise InputError(
            f"{path} is a MAT file of version 7.3; save it in MATLAB with "
            f"save(..., '-v7') and import that"
        )
    if version != VERSION_5:
        raise InputError(f"{path} is a MAT file of unknown version {version:#06x}")
    at = HEADER
    while at < len(raw):
        if len(raw) < at + 8:
            raise InputError(f"{path} is truncated at byte {at}")
        kind, size = struct.unpack_from("<2I" if little else ">2I", raw, at)
        body = memoryview(raw)[at + 8 : at + 8 + size]
        if kind not in (MATRIX, COMPRESSED):
            raise InputError(f"{path} is damaged: at byte {at} there is no variable")
        if len(body) < size:
            raise InputError(f"{path} is truncated: the variable at byte {at} has no end")
        if kind == COMPRESSED:
            try:
                zlib.decompress(body)
            except zlib.error as error:
                raise InputError(
                    f"{path} is damaged: the variable at byte {at}: {error}"
                ) from error
        at += 8 + size


def _load(path: Path) -> dict[str, np.ndarray]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error}") from error
    _check_whole(path, raw)
    try:
        with warnings.catch_warnings():
            # of variables that are there twice the last one counts, as in MATLAB
            warnings.simplefilter("ignore")
            found = loadmat(io.BytesIO(raw), struct_as_record=True)
    except (*PARSER_FAILURES, MatReadError) as error:
        raise InputError(f"{path} cannot be read as a MAT file: {error}") from error
    return {name: value for name, value in found.items() if not name.startswith("__")}
