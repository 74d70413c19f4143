"""Sequence or target that is being edited: its tables, with undo and redo."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dearig.config.toml_edit import SegmentTexts, split_segments, written_anew
from dearig.config.toml_input import parse_toml
from dearig.errors import InputError
from dearig.window.session.text_file import EditedFile

__all__ = ["Draft", "relative_csv"]

_STEPS_MAX = 200


@dataclass(frozen=True)
class _State:
    """Tables of a sequence, its text in pieces or whole, and its file; tables stay as they are."""

    data: dict[str, Any]
    text: SegmentTexts | str
    file: EditedFile

    @property
    def toml(self) -> str:
        return self.text if isinstance(self.text, str) else self.text.toml


class Draft:
    """Tables of a sequence file and its text, with undo and redo.

    ``data`` holds ``name``, ``lead_in_s``, ``tail_s`` and the list ``segment``. The text is edited
    in place: comments stay, and what no one changes stays to the letter. ``undo`` goes back to the
    file that was open before, too.
    """

    def __init__(self, toml: str, file: EditedFile | None = None) -> None:
        self._states = [_state(toml, file or EditedFile("sequence", toml))]
        self._at = 0
        self._last: tuple[object, ...] = ()

    @property
    def data(self) -> dict[str, Any]:
        """Current tables; only the methods of this class change them."""
        return self._states[self._at].data

    @property
    def segments(self) -> list[dict[str, Any]]:
        """Current tables [[segment]]."""
        found: list[dict[str, Any]] = self.data["segment"]
        return found

    @property
    def toml(self) -> str:
        """Text of the sequence file."""
        return self._states[self._at].toml

    @property
    def file(self) -> EditedFile:
        """File of the sequence."""
        return self._states[self._at].file

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

    def replace(self, toml: str, file: EditedFile | None = None) -> None:
        """Replace the whole sequence by that of another file, None of no file.

        Raises ``InputError`` if ``toml`` is not TOML.
        """
        self._push(_state(toml, file or EditedFile("sequence", toml)))

    def set_head(self, key: str, value: Any) -> None:
        """Set ``name``, ``lead_in_s`` or ``tail_s``; None leaves the key out."""
        if self.data.get(key) != value:
            data = _with(self.data, key, value)
            self._change(data, lambda text: text.with_head(key, value), ("head", key))

    def set_value(self, row: int, key: str, value: Any) -> None:
        """Set a key of a segment; None leaves it out.

        Consecutive changes of one key are one change, so that typing is undone at once.
        """
        segments = list(self.segments)
        if segments[row].get(key) != value:
            segments[row] = _with(segments[row], key, value)
            self._change_segments(
                segments, lambda text: text.with_value(row, key, value), (row, key)
            )

    def add(self, row: int, kind: str, keys: Mapping[str, Any]) -> None:
        """Insert a new segment of ``kind`` with ``keys`` at ``row``."""
        table = {"kind": kind, **copy.deepcopy(dict(keys))}
        self._change_segments(
            [*self.segments[:row], table, *self.segments[row:]],
            lambda text: text.with_segment(row, table),
        )

    def duplicate(self, row: int) -> None:
        """Insert a copy of the segment in ``row`` after it."""
        rows = self.segments
        self._change_segments(
            [*rows[: row + 1], rows[row], *rows[row + 1 :]], lambda text: text.with_copy(row)
        )

    def remove(self, row: int) -> None:
        """Remove the segment in ``row``."""
        self._change_segments(
            [*self.segments[:row], *self.segments[row + 1 :]], lambda text: text.without(row)
        )

    def move(self, row: int, to: int) -> None:
        """Move the segment in ``row`` to the row ``to``."""
        segments = list(self.segments)
        segments.insert(to, segments.pop(row))
        if to != row:
            self._change_segments(segments, lambda text: text.moved(row, to))

    def _change_segments(
        self,
        segments: list[dict[str, Any]],
        edit: Callable[[SegmentTexts], SegmentTexts],
        what: tuple[object, ...] = (),
    ) -> None:
        self._change({**self.data, "segment": segments}, edit, what)

    def _change(
        self,
        data: dict[str, Any],
        edit: Callable[[SegmentTexts], SegmentTexts],
        what: tuple[object, ...],
    ) -> None:
        text = self._states[self._at].text
        if isinstance(text, str):  # not written as [[segment]]: from now on it is
            text = split_segments(written_anew(self.data, text)) or text
        edited = written_anew(data, text) if isinstance(text, str) else edit(text)
        state = _State(data, edited, self.file)
        if what and what == self._last and not self.can_redo:
            self._states[self._at] = state
            return
        self._push(state)
        self._last = what

    def _push(self, state: _State) -> None:
        self._states = [*self._states[: self._at + 1], state][-_STEPS_MAX:]
        self._at = len(self._states) - 1
        self._last = ()


def _with(table: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Return a copy of ``table`` with ``key`` set; None leaves it out."""
    if value is None:
        return {k: v for k, v in table.items() if k != key}
    return {**table, key: value}


def _state(toml: str, file: EditedFile) -> _State:
    return _State(_tables(toml), split_segments(toml) or toml, file)


def _tables(toml: str) -> dict[str, Any]:
    data = parse_toml(toml, "the sequence")
    segments = data.get("segment", [])
    if not (isinstance(segments, list) and all(isinstance(s, dict) for s in segments)):
        raise InputError(
            "the sequence has no list of segments: write [[segment]], in double brackets, above "
            "the keys of each"
        )
    return {"name": "", **{k: v for k, v in data.items() if k != "segment"}, "segment": segments}


def relative_csv(path: Path, folder: Path) -> str:
    """Return the name of the CSV file ``path`` in a sequence that lies in ``folder``.

    The whole path is returned for a file outside of ``folder``: a sequence reads only files of its
    own folder, and its check says so.
    """
    inside = path.is_relative_to(folder)
    return (path.relative_to(folder) if inside else path).as_posix()
