"""Sequence that is being edited: its tables, with undo and redo."""

from __future__ import annotations

import copy
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from dearig.config.segments import SEGMENT_KINDS
from dearig.config.toml_input import parse_toml
from dearig.errors import InputError

__all__ = ["Draft", "Place", "has_comments", "place_of", "relative_csv"]

_STEPS_MAX = 200


class Draft:
    """Tables of a sequence file, with undo and redo.

    ``data`` holds ``name``, ``lead_in_s``, ``tail_s`` and the list ``segment``.
    """

    def __init__(self, toml: str) -> None:
        self._states: list[tuple[dict[str, Any], str]] = [(_tables(toml), toml)]
        self._at = 0
        self._last: tuple[object, ...] = ()

    @property
    def data(self) -> dict[str, Any]:
        """Current tables; only the methods of this class change them."""
        return self._states[self._at][0]

    @property
    def segments(self) -> list[dict[str, Any]]:
        """Current tables [[segment]]."""
        found: list[dict[str, Any]] = self.data["segment"]
        return found

    @property
    def toml(self) -> str:
        """Text of the sequence file: as it was given, or written from the tables after a change."""
        return self._states[self._at][1]

    @property
    def can_undo(self) -> bool:
        """True if there is a change to undo."""
        return self._at > 0

    @property
    def can_redo(self) -> bool:
        """True if there is a change to redo."""
        return self._at < len(self._states) - 1

    def undo(self) -> None:
        """Undo the last change."""
        self._at = max(self._at - 1, 0)
        self._last = ()

    def redo(self) -> None:
        """Redo the change that was undone last."""
        self._at = min(self._at + 1, len(self._states) - 1)
        self._last = ()

    def replace(self, toml: str) -> None:
        """Replace the whole sequence. Raises ``InputError`` if ``toml`` is not TOML."""
        self._push(_tables(toml), toml)

    def set_head(self, key: str, value: Any) -> None:
        """Set ``name``, ``lead_in_s`` or ``tail_s``; None leaves the key out."""
        self._change(("head", key), lambda data: _put(data, key, value))

    def set_value(self, row: int, key: str, value: Any) -> None:
        """Set a key of a segment; None leaves it out.

        Consecutive changes of one key are one change, so that typing is undone at once.
        """
        self._change((row, key), lambda data: _put(data["segment"][row], key, value))

    def add(self, kind: str, row: int, **given: Any) -> None:
        """Insert a new segment of ``kind`` at ``row``; ``given`` replaces default values."""
        table = {"kind": kind, **copy.deepcopy(dict(SEGMENT_KINDS[kind].example)), **given}
        self._change((), lambda data: data["segment"].insert(row, table))

    def duplicate(self, row: int) -> None:
        """Insert a copy of the segment in ``row`` after it."""
        table = copy.deepcopy(self.segments[row])
        self._change((), lambda data: data["segment"].insert(row + 1, table))

    def remove(self, row: int) -> None:
        """Remove the segment in ``row``."""
        self._change((), lambda data: data["segment"].pop(row))

    def move(self, row: int, to: int) -> None:
        """Move the segment in ``row`` to the row ``to``."""
        self._change((), lambda data: data["segment"].insert(to, data["segment"].pop(row)))

    def _change(self, what: tuple[object, ...], change: Any) -> None:
        data = copy.deepcopy(self.data)
        change(data)
        if data == self.data:
            return
        if what and what == self._last and not self.can_redo:
            self._states[self._at] = (data, tomli_w.dumps(data))
            return
        self._push(data, tomli_w.dumps(data))
        self._last = what

    def _push(self, data: dict[str, Any], toml: str) -> None:
        self._states = [*self._states[: self._at + 1], (data, toml)][-_STEPS_MAX:]
        self._at = len(self._states) - 1
        self._last = ()


def _put(table: dict[str, Any], key: str, value: Any) -> None:
    if value is None:
        table.pop(key, None)
    else:
        table[key] = value


def _tables(toml: str) -> dict[str, Any]:
    data = parse_toml(toml, "the sequence")
    segments = data.get("segment", [])
    if not (isinstance(segments, list) and all(isinstance(s, dict) for s in segments)):
        raise InputError(
            "the sequence has no list of segments: write [[segment]], in double brackets, above "
            "the keys of each"
        )
    return {"name": "", **{k: v for k, v in data.items() if k != "segment"}, "segment": segments}


# strings are matched first: a # inside a string begins no comment, and a quotation mark inside a
# comment begins no string
_TEXT_OR_COMMENT = re.compile(
    r'''"""(?:\\.|[^\\])*?"""|"(?:\\.|[^"\\\n])*"''' r"|'''.*?'''|'[^'\n]*'|#[^\n]*", re.DOTALL
)


def has_comments(toml: str) -> bool:
    """Return True if ``toml`` has comments; text written from the tables has none."""
    return any(found[0].startswith("#") for found in _TEXT_OR_COMMENT.finditer(toml))


@dataclass(frozen=True)
class Place:
    """Place of a fault: ``row`` of the segment from 0, and ``key``; None outside of segments."""

    row: int | None = None
    key: str | None = None


def place_of(sentence: str) -> Place:
    """Return the place of the fault that ``sentence`` of ``dearig.config.sequencefile`` names."""
    kinds = "|".join(SEGMENT_KINDS)
    key = r"(?:: (\w+?)(?:\[\d+\])? (?:=|is))?"
    found = re.search(rf"segment (\d+)(?: \((?:{kinds})\))?{key}", sentence)
    if found:
        return Place(int(found[1]) - 1, found[2])
    found = re.search(r": (name|lead_in_s|tail_s) (?:=|is)", sentence)
    return Place(None, found[1] if found else None)


def relative_csv(path: Path, folder: Path) -> str:
    """Return the name of the CSV file ``path`` in a sequence that lies in ``folder``.

    The whole path is returned for a file outside of ``folder``: a sequence reads only files of its
    own folder, and its check says so.
    """
    inside = path.is_relative_to(folder)
    return (path.relative_to(folder) if inside else path).as_posix()
