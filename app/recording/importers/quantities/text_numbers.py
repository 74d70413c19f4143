"""Numbers as people write them: signs of decimals and of thousands, found from whole columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["GROUPED", "MINUS", "Signs", "is_number", "signs_of"]

#: The minus of typography, which some programs write.
MINUS = "\N{MINUS SIGN}"
#: Signs between groups of digits that are no decimal sign anywhere.
_BETWEEN = "' \N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}\N{RIGHT SINGLE QUOTATION MARK}"
_TAIL = r"(?:[eEdD][+-]?\d+)?|[+\-−]?(?:nan|inf|infinity)"  # noqa: RUF001
_POINT = re.compile(rf"[+\-{MINUS}]?(?:\d+\.?\d*|\.\d+){_TAIL}", re.I)
_COMMA = re.compile(rf"[+\-{MINUS}]?(?:\d+,?\d*|,\d+){_TAIL}", re.I)
#: A number whose digits stand in groups of three.
GROUPED = re.compile(
    rf"[+\-{MINUS}]?\d{{1,3}}(?:([.,{_BETWEEN}])\d{{3}})(?:\1\d{{3}})*(?:[.,]\d+)?"
)


@dataclass(frozen=True)
class Signs:
    """Signs in the numbers of a column: before decimals, and between groups of digits or "".

    ``open`` is True where nothing in the file tells whether the sign is of decimals.
    """

    decimal: str = "."
    thousands: str = ""
    open: bool = False


def is_number(cell: str) -> bool:
    """Return True if ``cell`` is a number in one of the ways in which people write it."""
    return bool(_POINT.fullmatch(cell) or _COMMA.fullmatch(cell) or GROUPED.fullmatch(cell))


def signs_of(columns: Sequence[Sequence[str]]) -> list[Signs]:
    """Return the signs in the cells of each of ``columns``.

    What one column leaves open (1.234 may be a group of digits), another one of the file decides.
    """
    found = [_in_column(cells) for cells in columns]
    decided = {one.decimal for one, sure in found if sure}
    common = next(iter(decided)) if len(decided) == 1 else ""
    return [_settled(one, sure, common) for one, sure in found]


def _settled(one: Signs, sure: bool, common: str) -> Signs:
    """Return the signs of a column, with the decimal sign ``common`` to the others, or ""."""
    if sure or not common:
        return one
    if not one.open or one.decimal == common:
        return Signs(common, one.thousands)
    return Signs(common, one.decimal)  # what seemed to be decimals is a group


def _in_column(cells: Sequence[str]) -> tuple[Signs, bool]:
    """Return the signs in ``cells`` by themselves, and True if the decimal sign is sure."""
    grouped = {cell: match for cell in cells if (match := GROUPED.fullmatch(cell))}
    thousands = next((match[1] for match in grouped.values() if match[1] in _BETWEEN), "")
    both = next((cell for cell in grouped if "," in cell and "." in cell), None)
    if both is not None:
        decimal = max(",.", key=both.rfind)
        return Signs(decimal, "." if decimal == "," else ","), True
    opened = ""
    for sign in ",.":
        there = [cell for cell in cells if sign in cell]
        if any(cell.count(sign) > 1 for cell in there):
            return Signs("." if sign == "," else ",", sign), True
        if any(not _is_group(cell, sign, grouped) for cell in there):
            return Signs(sign, thousands), True
        opened = opened or (sign if there else "")
    return Signs(opened or ".", thousands, open=bool(opened)), False


def _is_group(cell: str, sign: str, grouped: dict[str, re.Match[str]]) -> bool:
    """Return True if the digits behind ``sign`` may be a group of thousands."""
    match = grouped.get(cell)
    return match is not None and match[1] == sign and not cell.lstrip(f"+-{MINUS}").startswith("0")
