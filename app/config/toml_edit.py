"""TOML files edited in place: comments, order and the letters of what no one changed stay.

tomlkit edits one table at a time. The segments of a sequence are kept as separate texts, so that
the comments above a segment go with it when it is moved or removed, and so that a keystroke in a
long sequence takes no longer than in a short one. Every edit is read again and compared with the
tables that are wanted; a file whose form cannot be edited in place is written again below its
comments.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import tomli_w

__all__ = ["SegmentTexts", "split_segments", "with_key", "written_anew"]

_HEADER = re.compile(r"^[ \t]*\[\[[ \t]*segment[ \t]*\]\]", re.MULTILINE)
_TABLE = "segment"
_EMPTY_LINES = re.compile(r"^(?:[ \t]*\r?\n)+", re.MULTILINE)
_KEYS_AS_COMMENTS = re.compile(r"(?:[ \t]*#[ \t]*[\w-]+[ \t]*=[^\n]*\n)*")


def with_key(text: str, table: str, key: str, value: Any) -> str:
    """Return the TOML ``text`` with ``key`` of ``table`` set to ``value``; None removes the key.

    The table "" is the top level. A new key stands below the comment ``# key =`` where the table
    has one, else below its last key; a new table stands at the end.
    """
    before, wanted = tomllib.loads(text), tomllib.loads(text)
    here = wanted.setdefault(table, {}) if table else wanted
    if not isinstance(here, dict):
        return text  # the check of the file says that it is not a table
    _put(here, key, value)
    if value is None and key not in (before.get(table, {}) if table else before):
        return text
    if table and table not in before:
        return text + _newlines(f"{_gap(text)}[{table}]\n{_line(key, value)}", text)
    edited = _in_document(text, lambda doc: doc[table] if table else doc, key, value)
    return _checked(edited, wanted, text)


@dataclass(frozen=True)
class SegmentTexts:
    """A sequence file in pieces: ``head``, one text for each [[segment]], and ``foot``.

    The comments right above a header belong to its segment, those below its last key to the segment
    before up to the first empty line.
    """

    head: str
    segments: tuple[str, ...]
    foot: str = ""

    @property
    def toml(self) -> str:
        """The whole text."""
        return self.head + "".join(self.segments) + self.foot

    def with_head(self, key: str, value: Any) -> SegmentTexts:
        """Return the texts with a key of the head changed."""
        return SegmentTexts(with_key(self.head, "", key, value), self.segments, self.foot)

    def with_value(self, row: int, key: str, value: Any) -> SegmentTexts:
        """Return the texts with a key of one segment changed."""
        text = self.segments[row]
        table = tomllib.loads(text)[_TABLE][0]
        _put(table, key, value)
        edited = _in_document(text, lambda doc: doc[_TABLE][0], key, value)
        edited = _checked(edited, {_TABLE: [table]}, text)
        return self._replaced((*self.segments[:row], edited, *self.segments[row + 1 :]))

    def with_segment(self, row: int, table: Mapping[str, Any]) -> SegmentTexts:
        """Return the texts with a new segment before the present segment ``row``."""
        empty = any(re.search(r"\n\s*\n$", text) for text in (self.head, *self.segments))
        new = "[[segment]]\n" + tomli_w.dumps(dict(table)) + ("\n" if empty else "")
        return self._with_text(row, _newlines(new, self.toml))

    def with_copy(self, row: int) -> SegmentTexts:
        """Return the texts with a copy of segment ``row`` below it."""
        return self._with_text(row + 1, self.segments[row])

    def without(self, row: int) -> SegmentTexts:
        """Return the texts without segment ``row``."""
        return self._replaced((*self.segments[:row], *self.segments[row + 1 :]))

    def moved(self, row: int, to: int) -> SegmentTexts:
        """Return the texts with segment ``row`` moved to the row ``to``."""
        return self.without(row)._with_text(to, self.segments[row])

    def _with_text(self, row: int, text: str) -> SegmentTexts:
        return self._replaced((*self.segments[:row], text, *self.segments[row:]))

    def _replaced(self, segments: Iterable[str]) -> SegmentTexts:
        """Return the texts with other ``segments``, each on lines of its own."""
        return SegmentTexts(_ended(self.head), tuple(map(_ended, segments)), self.foot)


def split_segments(text: str) -> SegmentTexts | None:
    """Return the pieces of a sequence file; None where its segments are not written [[segment]]."""
    starts = [_start_of_segment(text, match.start()) for match in _HEADER.finditer(text)]
    if starts:
        foot = _start_of_foot(text)
        segments = tuple(text[a:b] for a, b in pairwise([*starts, foot]))
        pieces = SegmentTexts(text[: starts[0]], segments, text[foot:])
    else:
        pieces = SegmentTexts(text, ())
    return pieces if _are_whole(pieces, text) else None


def _start_of_segment(text: str, header: int) -> int:
    """Return where the comments begin that belong to the segment with this ``header``."""
    start = _start_of_gap(text, header)
    gap = text[start:header]
    empty = _EMPTY_LINES.search(gap)
    if empty:
        return start + empty.end()
    if start == 0:
        return header  # comments on the file
    keys = _KEYS_AS_COMMENTS.match(gap)
    return start + (keys.end() if keys else 0)


def _start_of_foot(text: str) -> int:
    """Return where the comments begin that stand at the end, below an empty line."""
    start = _start_of_gap(text, len(text))
    empty = _EMPTY_LINES.search(text, start)
    return empty.end() if empty and "#" in text[empty.end() :] else len(text)


def _start_of_gap(text: str, at: int) -> int:
    """Return where the comments and empty lines above ``at`` begin."""
    while at > 0:
        line = text.rfind("\n", 0, at - 1) + 1
        content = text[line:at].strip()
        if content and not content.startswith("#"):
            break
        at = line
    return at


def _are_whole(pieces: SegmentTexts, text: str) -> bool:
    """Return True where each piece is TOML on its own and together they mean what ``text`` does."""
    try:
        data = tomllib.loads(pieces.head + pieces.foot)
        tables = [tomllib.loads(piece) for piece in pieces.segments]
    except tomllib.TOMLDecodeError:
        return False
    if any(set(table) != {_TABLE} or len(table[_TABLE]) != 1 for table in tables):
        return False
    whole = tomllib.loads(text)
    if _TABLE in data:  # an array in the head
        return False
    return {**data, **({_TABLE: [t[_TABLE][0] for t in tables]} if tables else {})} == whole


def _in_document(text: str, find: Callable[[Any], Any], key: str, value: Any) -> str:
    """Return ``text`` with a key of the table that ``find`` finds in it changed, by tomlkit."""
    import tomlkit  # here: reading a file needs no editor

    try:
        document = tomlkit.parse(_ended(text))
        table = find(document)
        body = getattr(getattr(table, "value", table), "body", None)
        if value is None:
            table.pop(key, None)
        elif key in table or body is None:
            table[key] = value
        else:
            body.insert(
                _place_for(key, body), tomlkit.parse(_newlines(_line(key, value), text)).body[0]
            )
        return tomlkit.dumps(document)
    except (tomlkit.exceptions.TOMLKitError, KeyError, IndexError, TypeError, ValueError):
        return ""  # it is written again


def _place_for(key: str, body: list[tuple[Any, Any]]) -> int:
    """Return where a new key is put among the lines ``body`` of its table."""
    place = 0
    for i, (there, item) in enumerate(body):
        if there is None and re.match(rf"[ \t]*#[ \t]*{re.escape(key)}[ \t]*=", item.as_string()):
            return i + 1
        if there is not None and not isinstance(item.unwrap(), dict):
            place = i + 1
    return place


def written_anew(tables: dict[str, Any], text: str) -> str:
    """Return the ``tables`` as TOML, below the comments of ``text``; segments as [[segment]]."""
    found = [match[0].rstrip() for match in _TEXT_OR_COMMENT.finditer(text)]
    comments = "".join(f"{comment}\n" for comment in found if comment.startswith("#"))
    head = {key: value for key, value in tables.items() if key != _TABLE}
    segments = tables.get(_TABLE, [])
    if isinstance(segments, list) and all(isinstance(table, dict) for table in segments):
        # tomli-w writes short tables into one array
        body = "".join(f"[[{_TABLE}]]\n{tomli_w.dumps(table)}" for table in segments)
        new = comments + tomli_w.dumps(head) + body
        if tomllib.loads(new) == tables:
            return _newlines(new, text)
    return _newlines(comments + tomli_w.dumps(tables), text)


def _checked(edited: str, wanted: dict[str, Any], text: str) -> str:
    """Return ``edited`` where it means ``wanted``, else ``wanted`` written again."""
    try:
        same = tomllib.loads(edited) == wanted
    except tomllib.TOMLDecodeError:
        same = False
    return edited if same else written_anew(wanted, text)


def _put(table: dict[str, Any], key: str, value: Any) -> None:
    if value is None:
        table.pop(key, None)
    else:
        table[key] = value


# strings are matched first: a # inside a string begins no comment, and a quotation mark inside a
# comment begins no string
_TEXT_OR_COMMENT = re.compile(
    r'''"""(?:\\.|[^\\])*?"""|"(?:\\.|[^"\\\n])*"''' r"|'''.*?'''|'[^'\n]*'|#[^\n]*", re.DOTALL
)


def _line(key: str, value: Any) -> str:
    return tomli_w.dumps({key: value})


def _ended(text: str) -> str:
    return text if not text or text.endswith("\n") else text + _newlines("\n", text)


def _newlines(new: str, like: str) -> str:
    """Return ``new`` with the line ends of ``like``."""
    return new.replace("\n", "\r\n") if "\r\n" in like else new


def _gap(text: str) -> str:
    return "" if not text else "\n" if text.endswith("\n") else "\n\n"
