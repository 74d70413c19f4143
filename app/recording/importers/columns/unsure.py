"""Question about columns that are not sure, with a command that names only what is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from dearig.errors import InputError, hints_of
from dearig.recording.importers.columns.chosen import HOLE, UNIT_HOLE, Chosen, import_command
from dearig.recording.importers.columns.proposal import first_values

__all__ = ["UnsureError", "question"]

_TABLE_HOLE, _FACTOR = "TABLE", "*FACTOR"


class UnsureError(InputError):
    """It is not sure which columns are ``chosen`` for what."""

    def __init__(self, chosen: Chosen) -> None:
        super().__init__(
            f"{chosen.source.path}: it is not sure what its columns are "
            f"({'; '.join(chosen.unsure)})",
            option=[o for why in chosen.unsure for hint in hints_of(why) for o in hint.options],
        )
        self.chosen = chosen


def question(
    error: UnsureError,
    path: Path,
    out: Path,
    given: Mapping[str, str],
    more: Sequence[tuple[str, str | float]],
) -> InputError:
    """Return the error to show for ``error``: what is not sure, first values, and the command.

    ``given`` are the columns that the user named, ``more`` further options with their values.
    """
    chosen = error.chosen
    if chosen.table_choices:
        command = import_command(path, out, given, _TABLE_HOLE, more)
        return InputError(str(error), remedy=replace(command, holes=(_TABLE_HOLE,)))
    pairs = chosen.template
    holes = tuple(
        hole for hole, is_there in (
            (HOLE, HOLE in pairs.values()),
            (UNIT_HOLE, any(name.endswith(f"_{UNIT_HOLE}") for name in pairs)),
            (_FACTOR[1:], any(column.endswith(_FACTOR) for column in pairs.values())),
        ) if is_there
    )  # fmt: skip
    command = import_command(path, out, pairs, chosen.table, more)
    if not holes:
        return InputError(str(error), remedy=replace(command, is_guess=True))
    return InputError(
        f"{path}: the columns begin with {first_values(chosen)}. It is not sure what they are "
        f"({'; '.join(chosen.unsure)})",
        remedy=replace(command, holes=holes),
    )
