r"""Text for terminals and logs, in which nothing but visible characters is left.

Names, notes, titles and keys come from files of others. A terminal obeys control characters in
them: they move the cursor, rename the window, hide or rewrite what is already there, and change
the reading direction. Such a character is shown as its escape in Python (``\x1b``, ``\u202e``).
"""

from __future__ import annotations

import unicodedata
from typing import TextIO

__all__ = ["MESSAGE_MAX", "PrintableStream", "no_formula", "printable", "unmarked", "visible"]

#: Unicode categories that are shown as escapes: controls, formats (bidirectional overrides, tags,
#: zero-width space), lone surrogates, private use, unassigned, line and paragraph separators.
_ESCAPED = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
#: Zero-width joiners: without them Persian and Indian words and some emoji are spelled wrong.
_JOINERS = "\u200c\u200d"
#: Longest text of one message or line in characters: more than a path has on Linux (4096). Longer
#: ones are cut in the middle.
MESSAGE_MAX = 5000

#: First characters of a formula, and their full-width forms.
_FORMULA = "=+-@\t\r\n\uff1d\uff0b\uff0d\uff20"


def printable(text: str, keep: str = "", most: int | None = None) -> str:
    """Return ``text`` with every character that is not printable as an escape.

    The characters in ``keep`` stay. A text of more than ``most`` characters is cut in the middle.
    """
    if most is not None and len(text) > most:
        half = (most - 5) // 2
        text = f"{text[:half]} ... {text[-half:]}"
    if text.isprintable():  # the usual case, without a look at each character
        return text
    return "".join(c if c.isprintable() or c in keep or _is_shown(c) else _escape(c) for c in text)


def no_formula(text: str) -> str:
    """Return ``text`` for a cell of a table (CSV), so that a spreadsheet does not compute it.

    A cell that begins with one of ``= + - @``, a tab or an end of line can be a formula, which may
    start programs. The apostrophe before it is the mark for text. Numbers are not passed here.
    """
    return f"'{text}" if text[:1] in _FORMULA and text else text


def unmarked(cell: str) -> str:
    """Return the text of a ``cell`` that ``no_formula`` made."""
    return cell[1:] if cell[:1] == "'" and cell[1:2] in _FORMULA and cell[1:] else cell


def _is_shown(character: str) -> bool:
    return character in _JOINERS or unicodedata.category(character) not in _ESCAPED


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


class PrintableStream:
    """Text stream that passes to ``stream`` only printable characters, tabs and ends of lines.

    Consoles of rich write past it, to ``rich_proxied_file`` (rich's own name): they colour text
    with control characters, and clean the text themselves.
    """

    def __init__(self, stream: TextIO) -> None:
        self.rich_proxied_file = stream

    def write(self, text: str) -> int:
        """Write ``text``; returns its number of characters."""
        self.rich_proxied_file.write(printable(text, "\n\t"))
        return len(text)

    def writelines(self, lines: list[str]) -> None:
        """Write every one of ``lines``."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> object:
        return getattr(self.rich_proxied_file, name)


def visible(text: str) -> str:
    """Return ``text`` without spaces around it; "" where it has no visible character."""
    return text.strip() if any(c.isprintable() and not c.isspace() for c in text) else ""
