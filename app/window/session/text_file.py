"""A text that is edited in the window: its file, and whether its changes are saved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dearig.config.toml_input import parse_toml, read_text
from dearig.errors import InputError
from dearig.recording.files import write_whole
from dearig.window.kit.fields import as_labelled
from dearig.window.kit.widgets import plain_tip

__all__ = ["EditedFile", "OverwriteQuestion", "Saved"]

_PARTS_MAX = 4  # changed parts that a question names


@dataclass(eq=False)
class EditedFile:
    """File of an edited text: its ``path``, None without one, and the text that is ``saved`` there.

    ``saved`` of a text without a file is where the editing began: a preset, a proposal.
    ``folder`` is where the files lie that the text names.
    """

    what: str
    saved: str
    path: Path | None = None
    folder: Path = field(default_factory=Path)

    def is_unsaved(self, text: str) -> bool:
        """Return True if ``text`` has changes that are in no file."""
        return text != self.saved

    def name(self, text: str) -> str:
        """Return the name to show, with a mark where changes are not saved."""
        name = "not in a file" if self.path is None else self.path.name
        return f"● {name} (not saved)" if self.is_unsaved(text) else name

    @property
    def tip(self) -> str:
        """The whole path, for a tooltip."""
        return "" if self.path is None else plain_tip(str(self.path))

    def changes(self, text: str) -> str:
        """Return what would be lost with ``text``, as "sequence mine.toml (tail_s, segment 2)"."""
        name = f"{self.what} {self.path.name}" if self.path is not None else f"new {self.what}"
        try:
            before, after = (parse_toml(t, self.what) for t in (self.saved, text))
        except InputError:
            return name
        parts = list(dict.fromkeys(_differences(before, after))) or ["comments"]
        more = len(parts) - _PARTS_MAX
        listed = ", ".join(parts[:_PARTS_MAX]) + (f" and {more} more" if more > 0 else "")
        return f"{name} (changed: {as_labelled(listed)})"

    def write(self, path: Path, text: str, replace: bool) -> Saved | OverwriteQuestion:
        """Write ``text`` to ``path`` as a whole; raises ``InputError`` where that is not possible.

        Nothing is written, and ``OverwriteQuestion`` is returned, where that is the file of this
        text and another program has changed it, unless ``replace``. May be called from any thread.
        """
        if path == self.path and not replace and path.exists():
            try:
                same = read_text(path, self.what) == self.saved
            except InputError:
                same = False
            if not same:
                return OverwriteQuestion(
                    path, f"{path} was changed by another program since it was opened here"
                )
        write_whole(path, text.encode("utf-8"))
        return Saved(self, path, text)

    def note(self, done: Saved) -> None:
        """Note that a text is in its file now."""
        self.path, self.saved = done.path, done.text


@dataclass(frozen=True)
class Saved:
    """A text that was written to its file."""

    file: EditedFile
    path: Path
    text: str


@dataclass(frozen=True)
class OverwriteQuestion:
    """A file that was not written: another program has changed it, as the ``sentence`` says."""

    path: Path
    sentence: str


def _differences(before: Any, after: Any, place: str = "") -> Iterator[str]:
    """Yield the places in which two TOML values differ, in words."""
    if isinstance(before, dict) or isinstance(after, dict):
        one, other = (value if isinstance(value, dict) else {} for value in (before, after))
        for key in dict.fromkeys([*one, *other]):
            inner = (
                key if not place else f"{place} {key}" if place[-1].isdigit() else f"{place}.{key}"
            )
            yield from _differences(one.get(key), other.get(key), inner)
    elif _are_tables(before) or _are_tables(after):
        rows = [value if isinstance(value, list) else [] for value in (before, after)]
        for i in range(max(map(len, rows))):
            if all(i < len(row) for row in rows):
                yield from _differences(rows[0][i], rows[1][i], f"{place} {i + 1}")
            else:
                yield f"{place} {i + 1}"
    elif before != after:
        yield place


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(part, dict) for part in value)
