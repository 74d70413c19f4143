"""Numbers that people type: decimal points and commas, lists, and what is ambiguous.

The rules, which the window's guide states too:

- A number has a decimal point or a decimal comma: ``6.5`` or ``6,5``. It has no thousands
  separators; ``1,500`` may be one, so it is refused.
- The values of a list stand between semicolons, or between spaces, or between commas that a space
  follows. A comma between two digits never separates values: ``3,5; 6,5`` is 3.5 and 6.5.
- A list that can be read in two ways is refused with both: ``3,5`` alone, ``1,2,3``, ``100 200``.
"""

from __future__ import annotations

import re
from itertools import pairwise

__all__ = ["NumberTextError", "read_number", "read_numbers"]

# strict and in ASCII: float() takes nan, 1_000 and the digits of other scripts too
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?:([.,'\u2019_\s])[0-9]{3}(?:\1[0-9]{3})*)(?:[.,][0-9]*)?")
#: Characters between the digits of one number, in some country.
_BETWEEN = re.compile(r"(?<=[0-9])[.,'\u2019_\s](?=[0-9])")
_COMMA = re.compile(r"(?<=[0-9]),(?=[0-9])")
#: Characters of a typed text in a message, at most.
_SHOWN = 40


class NumberTextError(ValueError):
    """A typed text that is not a number, or more than one; the message says how to write it."""


def read_number(text: str, whole: bool = False) -> float:
    """Return the number in ``text``. Raises ``NumberTextError``.

    ``whole``: the field takes whole numbers, so that ``10.000`` may be ten thousand.
    """
    text = _cleaned(text)
    if _NUMBER.fullmatch(text):
        if _may_be_thousands(text, whole):
            one, other = f"{float(text.replace(',', '.')):.10g}", _BETWEEN.sub("", text)
            raise NumberTextError(
                f"{_shown(text)} may be {one} or {other}: write {one}, or {other} without a "
                f"thousands separator"
            )
        value = float(text.replace(",", "."))
        if value in (float("inf"), float("-inf")):
            raise NumberTextError(f"{_shown(text)} is too large: write a smaller number")
        return value
    if _GROUPED.fullmatch(text):
        raise NumberTextError(
            f"{_shown(text)} has a thousands separator: write {_without_groups(text)}"
        )
    raise NumberTextError(f"{_shown(text)} is not a number: write it as 6.5 or 6,5")


def read_numbers(text: str) -> list[float]:
    """Return the numbers of the list in ``text``. Raises ``NumberTextError``."""
    text = _cleaned(text)
    if not text:
        return []
    if ";" in text:
        return [read_number(item) for item in _between_semicolons(text)]
    items = _between_spaces(text)
    values = [read_number(item) for item in items]
    points = [item for item in items if "." in item]
    commas = [item for item in items if _COMMA.search(item)]
    if points and commas:  # 6.5,7 8 and the like
        raise NumberTextError(
            f"{_shown(points[0])} has a decimal point and {_shown(commas[0])} a decimal comma: "
            f"write all values with one of the two, between semicolons"
        )
    return values


def _between_semicolons(text: str) -> list[str]:
    items = [item.strip() for item in text.split(";")]
    if items[-1] == "":  # the next value is not typed yet
        items.pop()
    for item in items:
        if not item:
            raise NumberTextError("a value is missing next to a semicolon: write 6.5; 7")
        if not _NUMBER.fullmatch(item) and re.search(r"[\s,]", item):
            if _GROUPED.fullmatch(item):
                continue  # read_number says more
            raise NumberTextError(
                f"{_shown(item)} between semicolons is not one number: separate all values by "
                f"semicolons"
            )
    return items


def _between_spaces(text: str) -> list[str]:
    words = re.sub(r"\s+,(?=\s|$)", ",", text).split()
    if len(words) == 1 and _COMMA.search(text):
        raise NumberTextError(_two_readings(text))
    if len(words) > 1 and _GROUPED.fullmatch(text) and "," not in text:
        joined = re.sub(r"\s", "", text)
        raise NumberTextError(
            f"{_shown(text)} may be {len(words)} values or one ({joined}): separate values by "
            f"semicolons, and write a number without a thousands separator"
        )
    for word in words:
        if word.startswith(","):
            raise NumberTextError(
                f"{_shown(word)}: this comma may be a decimal comma or separate two values: write "
                f"0{word}, or separate the values by semicolons"
                if word[1:2].isdigit()
                else "a value is missing next to a comma: write 6.5; 7"
            )
        if len(words) > 1 and len(_COMMA.findall(word)) > 1:
            raise NumberTextError(_two_readings(word))
        if word.endswith(",,"):
            raise NumberTextError("a value is missing between two commas: write 6.5; 7")
    return [word.removesuffix(",") for word in words]


def _two_readings(text: str) -> str:
    """Return the sentence for ``text`` with commas between digits that separate, or do not."""
    parts = text.rstrip(",").split(",")
    several = "; ".join(parts)
    if len(parts) == 2:
        one = ".".join(parts)
        return f"{_shown(text)} may be {one} or {several}: write one of the two so"
    pairs = [".".join(pair) for pair in list(pairwise(parts))[::2]]
    one = "; ".join([*pairs, *parts[2 * len(pairs) :]])
    return (
        f"{_shown(text)} may be {several} or, with decimal commas, {one}: separate the values by "
        f"semicolons"
    )


def _may_be_thousands(text: str, whole: bool) -> bool:
    """Return True for ``1,500``: three digits follow a comma, and one to three precede it."""
    mark = "[.,]" if whole else ","
    return bool(re.fullmatch(rf"[+-]?[1-9][0-9]{{0,2}}{mark}[0-9]{{3}}", text))


def _without_groups(text: str) -> str:
    """Return ``1234567.5`` for ``1.234.567,5`` and for ``1,234,567.5``."""
    marks = [match[0] for match in _BETWEEN.finditer(text)]
    grouping = marks[0]
    decimal = marks[-1] if marks[-1] != grouping else ""
    head, _, tail = text.partition(decimal) if decimal else (text, "", "")
    digits = head.replace(grouping, "")
    return f"{digits}.{tail}" if tail else digits


def _cleaned(text: str) -> str:
    return text.strip().replace("\N{MINUS SIGN}", "-")


def _shown(text: str) -> str:
    return f'"{text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."}"'
