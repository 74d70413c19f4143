"""Columns of a MATLAB MAT file (version 5): variables, fields of structs, columns of matrices.

A column is called by its path: ``time_s``, ``data.xdata`` for a field, ``data.xdata[0]`` for the
first column of a matrix.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dearig.errors import InputError
from dearig.recording.files import in_words
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.mat5 import Damaged, Value, columns, variables
from dearig.recording.importers.source import no_such_column, printable

__all__ = ["IMPORTER", "MatFile"]


class MatFile:
    """The MAT file at ``path``. Raises ``InputError`` if it cannot be read or holds no numbers."""

    def __init__(self, path: Path) -> None:
        self.path = path
        found = _load(path)
        self._columns = {
            printable(name): column
            for top, value in found.items()
            for name, column in columns(top, value)
        }
        about = found.get("about")
        self.about = (
            {name: text for name, text in about.items() if isinstance(text, str)}
            if isinstance(about, dict)
            else {}
        )
        if not self._columns:
            raise InputError(f"{path} holds no columns of numbers")

    @property
    def names(self) -> list[str]:
        """Paths of all columns."""
        return list(self._columns)

    def named(self, name: str) -> list[str]:
        """Return the columns whose path is ``name`` or ends with ``.name``."""
        return [n for n in self._columns if n == name or n.endswith(f".{name}")]

    def own_name(self, name: str) -> str:
        """Return ``name`` without its path and its index."""
        return re.sub(r"\[\d+\]$", "", name.rpartition(".")[2])

    def row(self, index: int) -> str:
        """Return the row of sample ``index``, counted from 1 as in MATLAB."""
        return f"row {index + 1}"

    def check(self, name: str) -> None:
        """See ``Source``."""
        if name in self._columns:
            return
        inside = [n for n in self._columns if re.match(re.escape(name) + r"[.\[]", n)]
        if inside:
            raise InputError(
                f"{self.path}: {name!r} holds several columns; give one of them: "
                f"{', '.join(inside[:6])}"
            )
        raise no_such_column(self, name)

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return columns by name; see ``Source``."""
        return {name: self._columns[name] for name in names}


def _load(path: Path) -> dict[str, Value]:
    try:
        return variables(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path} cannot be read: {in_words(error)}") from error
    except Damaged as error:
        raise InputError(f"{path} {error}") from error


def _sniff(head: bytes) -> bool:
    return head.startswith(b"MATLAB 5.0 MAT-file")


IMPORTER = Importer("MATLAB MAT", (".mat",), MatFile, _sniff)
