"""Lines and cells of a text: its encoding, comments, quotes, and cells between separators."""

from __future__ import annotations

import codecs
import csv
import itertools
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from dearig.errors import InputError
from dearig.recording.importers.quantities.labels import has_east_asian_name
from dearig.recording.importers.quantities.units import unit_of

__all__ = [
    "HEADER_LINES",
    "bare",
    "cells_of",
    "encoding_of",
    "holds_data",
    "joined",
    "rises",
    "scales_in",
    "with_brackets",
    "with_labels",
]

#: Lines above a table in which names are looked for, and lines of a name in quotes, at most.
HEADER_LINES = 8
_COMMENTS = ("#", "%", "//", ";#")
_MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF32_LE: "utf-32",  # before UTF-16, whose mark it begins with
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_EAST_ASIAN = ("gb18030", "cp932")  # taken where they give a name that is known


def encoding_of(raw: bytes, path: Path) -> str:
    """Return the encoding of a text that begins with ``raw``; ``InputError`` if it is none."""
    for mark, encoding in _MARKS.items():
        if raw.startswith(mark):
            return encoding
    raw = raw.rstrip(b"\0") or raw  # a logger that was cut off leaves zeros at the end
    if b"\0" in raw:
        # text of ASCII characters as UTF-16 has a zero in every other byte
        even, odd = raw[::2].count(0), raw[1::2].count(0)
        half = len(raw) / 2
        if odd > 0.8 * half and even < 0.1 * half:
            return "utf-16-le"
        if even > 0.8 * half and odd < 0.1 * half:
            return "utf-16-be"
        raise InputError(
            f"{path} is not a text file, and of no other kind that can be imported; export it as "
            f"text from the program that made it"
        )
    try:
        codecs.getincrementaldecoder("utf-8")().decode(raw)
    except UnicodeDecodeError:
        # numbers are ASCII in any case; only a name may be decoded wrongly
        for encoding in _EAST_ASIAN:
            text = codecs.getincrementaldecoder(encoding)("replace").decode(raw)
            if "\N{REPLACEMENT CHARACTER}" not in text and has_east_asian_name(text):
                return encoding
        return "cp1252" if not set(raw) & {0x81, 0x8D, 0x8F, 0x90, 0x9D} else "latin-1"
    return "utf-8"


def cells_of(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of ``line`` without quotes and surrounding blanks."""
    if delimiter is None:
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    reader = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
    return [cell.strip() for cell in next(reader)]


def joined(lines: list[str]) -> list[str]:
    """Return ``lines`` with names in quotes on one line each; their other lines are blank.

    A spreadsheet writes the line breaks of its names into the file.
    """
    found, at = list(lines), 0
    while at < len(lines) and not _DIGIT.match(lines[at]):
        last = at
        while found[at].count('"') % 2 and last + 1 < min(len(lines), at + HEADER_LINES):
            last += 1
            found[at], found[last] = f"{found[at]} {lines[last]}", ""
        if found[at].count('"') % 2:
            return list(lines)
        at = last + 1
    return found


#: The first cell of a row of numbers.
_DIGIT = re.compile(r'\s*"?[-+.]?\d')


def holds_data(line: str) -> bool:
    """Return True unless ``line`` is blank or a comment."""
    text = line.strip(" \t\r\n\f\v;,|")  # a row of empty cells is blank
    return bool(text) and not line.strip().startswith(_COMMENTS)


def with_brackets(cells: Sequence[str]) -> list[str]:
    """Return ``cells`` with those in brackets behind the cell before them."""
    found: list[str] = []
    for cell in cells:
        if found and cell[:1] in "[(":
            found[-1] += f" {cell}"
        else:
            found.append(cell)
    return found


def bare(line: str) -> str:
    """Return ``line`` without the sign of a comment before it."""
    return line.strip().lstrip("#%/;").strip() if line.strip().startswith(_COMMENTS) else line


#: A power of ten behind a sign of multiplication; other numbers behind an x are those of columns.
_TENS = re.compile(r"[xX*\N{MULTIPLICATION SIGN}]\s*(10*|0?\.0*1|1e[+-]?\d+)", re.I)
#: A number, and a word before cells with scales.
_PLAIN = re.compile(r"([+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)")
_SCALE_WORD = re.compile(
    r"(scale|scaling|gain|factor|multiplier|skalierung|faktor)s?( factors?)?:?", re.I
)


def scales_in(cells: Sequence[str], width: int) -> dict[int, str]:
    """Return the scales other than 1 by place that the ``cells`` of a line above a table give.

    They are x1000 in each cell, or numbers behind the word scale or gain, which stands above the
    first of ``width`` columns or before it.
    """
    first = cells[0] if cells and _SCALE_WORD.fullmatch(cells[0]) else ""
    if not first and not all(map(_TENS.fullmatch, filter(None, cells))):
        return {}
    shift = 1 if first and len(cells) > width else 0
    matches = ((_PLAIN if first else _TENS).fullmatch(cell) for cell in cells[shift:])
    return {
        place: f"{first} = {match[1]}" if first else match[0]
        for place, match in enumerate(matches)
        if match is not None and float(match[1]) != 1.0
    }


#: The first cell of a line with the labels that an oscilloscope's user gave the channels.
_LABELS = re.compile(r"(channel|curve|trace|kanal)?[ _-]?(labels?|bezeichnung(en)?):?", re.I)


def with_labels(
    above: Mapping[int, list[str]], line: int, names: list[str]
) -> tuple[int, list[str]]:
    """Return the line of the ``names``, and these with the labels that a line before them gives.

    ``above`` are the cells of the lines above a table. An oscilloscope writes ``Labels,HV,Laser``
    above ``TIME,CH1,CH2``.
    """
    labelled = next((i for i, cells in above.items() if _are_labels(cells)), line)
    below = next((i for i in above if i > line), line) if labelled == line else line
    if line < 0 or labelled >= below or not _are_labels(above[labelled]):
        return line, names
    labels, own = above[labelled], names if below == line else above[below]
    if len(own) < len(labels) or unit_of(own[1]) is not None:
        return line, names
    pairs = itertools.zip_longest(labels[1:], own[1:], fillvalue="")
    return below, [own[0], *(label or name for label, name in pairs)]


def _are_labels(cells: Sequence[str]) -> bool:
    """Return True if ``cells`` are the word label, and labels behind it that are no numbers."""
    return (
        len(cells) > 1
        and any(cells[1:])
        and _LABELS.fullmatch(cells[0]) is not None
        and not any(map(_PLAIN.fullmatch, cells[1:]))
    )


def rises(cells: Sequence[str]) -> bool:
    """Return True if ``cells`` are numbers each of which is larger than the one before."""
    try:
        numbers = [float(cell.replace(",", ".")) for cell in cells]
    except ValueError:
        return False
    return all(a < b for a, b in itertools.pairwise(numbers))
