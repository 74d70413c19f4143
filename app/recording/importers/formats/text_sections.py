"""Tables that stand one below another in a text file, each below the same line of names."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.files import system_text
from dearig.recording.importers.formats.text_layout import TextLayout, is_row
from dearig.recording.importers.formats.text_lines import cells_of
from dearig.recording.importers.source import printable

__all__ = ["TextSection", "sections_of"]

#: Bytes of a file in which further tables are looked for; specimens one below another are short.
SIZE_MAX = 2**26
#: Tables of a file, at most, and characters of a title.
SECTIONS_MAX, TITLE_MAX = 500, 60
#: Characters near a line of names in which rows, and above it in which titles are looked for.
NEAR, TITLES_MAX = 10_000, 10_000
_SPECIMEN = re.compile(
    r"specimen|sample|probe|prüfling|éprouvette|\b(test|run|cycle|versuch)\b", re.I
)


@dataclass(frozen=True)
class TextSection:
    """A table: its title, and the numbers, from 0, of its first line and of the one behind it.

    ``end`` is None for the last table, which ends with the file.
    """

    title: str
    first: int
    end: int | None


def sections_of(path: Path, layout: TextLayout, names: str) -> tuple[TextSection, ...]:
    """Return the tables of the file, whose line of names is ``names``; none if there is only one.

    Raises ``InputError`` if the file cannot be read.
    """
    if layout.names_line < 0 or path.stat().st_size > SIZE_MAX:
        return ()
    try:
        with open_input(path) as file:
            raw = file.read()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {system_text(error)}") from error
    encoding = {"utf-8-sig": "utf-8", "utf-16": "utf-16-le"}.get(layout.encoding, layout.encoding)
    if raw.count(names.strip().encode(encoding, "replace")) < 2:
        return ()
    text = raw.decode(layout.encoding, "replace").replace("\r\n", "\n").replace("\r", "\n")
    places = _places(text, names.strip())
    found: list[TextSection] = []
    number, counted, before = 0, 0, 0  # lines above the place ``counted``; end of the table above
    for place, following in itertools.pairwise([*places, len(text)]):
        number += text.count("\n", counted, place)
        counted = place
        below = _near(text, place, following)
        first = next((i for i, line in enumerate(below) if is_row(line, layout)), None)
        if first is None:
            continue
        end, behind = None, following
        if following < len(text):
            above = _near(text, place, following, last=True)
            left = next((i for i, ln in enumerate(reversed(above)) if is_row(ln, layout)), None)
            if left is None:
                continue
            end = number + text.count("\n", place, following) - left
            behind = following - sum(len(line) + 1 for line in above[len(above) - left :])
        title = _title(text[max(before, place - TITLES_MAX) : place].split("\n"), layout)
        title = title or str(len(found) + 1)
        if any(section.title == title for section in found):
            title = f"{title} #{len(found) + 1}"
        found.append(TextSection(title, number + first, end))
        before = behind
    return tuple(found) if len(found) > 1 else ()


def _places(text: str, names: str) -> list[int]:
    """Return the places of the lines ``names``; none if there are more than tables can be."""
    found: list[int] = []
    at = text.find(names)
    for _ in range(10 * SECTIONS_MAX):
        if at < 0:
            return found if len(found) <= SECTIONS_MAX else []
        start = text.rfind("\n", 0, at) + 1
        end = text.find("\n", at)
        if text[start : end if end >= 0 else len(text)].strip() == names:
            found.append(start)
        at = text.find(names, at + len(names))
    return []


def _near(text: str, start: int, end: int, last: bool = False) -> list[str]:
    """Return the lines between two places, the first or the last ones."""
    if last:
        return text[max(start, end - NEAR) : end].removesuffix("\n").split("\n")
    return text[start : min(end, start + NEAR)].split("\n")


def _title(above: Sequence[str], layout: TextLayout) -> str:
    """Return what the lines ``above`` a table call it; empty if there are none."""
    stated = [line for line in above if line.strip()]
    line = next((line for line in stated if _SPECIMEN.search(line)), stated[-1] if stated else "")
    cells = [cell for cell in cells_of(line, layout.delimiter) if cell] if line else []
    return printable(" ".join(cells))[:TITLE_MAX]
