"""Question about columns that are not sure, with a command that names only what is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from dearig.errors import InputError
from dearig.recording.importers.columns.chosen import HOLE, UNIT_HOLE, Chosen, command_line
from dearig.recording.importers.columns.proposal import first_values

__all__ = ["UnsureError", "question"]

_TABLE_HOLE, _FACTOR = "TABLE", "*FACTOR"


class UnsureError(InputError):
    """It is not sure which columns are ``chosen`` for what."""

    def __init__(self, chosen: Chosen) -> None:
        super().__init__(
            f"{chosen.source.path}: it is not sure what its columns are "
            f"({'; '.join(chosen.unsure)})"
        )
        self.chosen = chosen


def question(
    error: UnsureError, path: Path, out: Path, given: Mapping[str, str], more: Sequence[str]
) -> str:
    """Return the message for ``error``: what is not sure, first values, and a command to complete.

    ``given`` are the columns that the user named, ``more`` further words of the command line.
    """
    chosen = error.chosen
    if chosen.table_choices:
        line = command_line(path, out, given, _TABLE_HOLE, more)
        return f"{error}. Put one of them for {_TABLE_HOLE}, and run: {line}"
    pairs = chosen.template
    holes = [
        hole for hole, is_there in (
            (HOLE, HOLE in pairs.values()),
            (UNIT_HOLE, any(name.endswith(f"_{UNIT_HOLE}") for name in pairs)),
            (_FACTOR[1:], any(column.endswith(_FACTOR) for column in pairs.values())),
        ) if is_there
    ]  # fmt: skip
    line = command_line(path, out, pairs, chosen.table, more)
    if not holes:
        return f"{error}. If this is right, or after correcting it, run: {line}"
    return (
        f"{error}. The columns begin with {first_values(chosen)}. Put what is right for "
        f"{' and '.join(holes)}, and run: {line}"
    )
