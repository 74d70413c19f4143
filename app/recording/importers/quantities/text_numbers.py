"""Numbers as people write them: signs of decimals and of thousands, found from whole columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

__all__ = ["GROUPED", "MINUS", "Signs", "is_number", "signs_of"]

#: The minus of typography, and the dash that spreadsheets make of a hyphen.
MINUS = "\N{MINUS SIGN}\N{EN DASH}"
#: Signs between groups of digits that are not a decimal sign anywhere.
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

    ``open`` is True where nothing in the file tells whether the sign is of decimals. It ``is_sure``
    where a cell decides it. ``mixed`` are two cells in which a sign has both meanings.
    """

    decimal: str = "."
    thousands: str = ""
    open: bool = False
    is_sure: bool = field(default=False, compare=False)
    mixed: tuple[str, str] | None = None


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
        return replace(one, is_sure=sure)
    if not one.open or one.decimal == common:
        return Signs(common, one.thousands, is_sure=True)
    return Signs(common, one.decimal, is_sure=True)  # what seemed to be decimals is a group


def _in_column(cells: Sequence[str]) -> tuple[Signs, bool]:
    """Return the signs in ``cells`` by themselves, and True if the decimal sign is sure."""
    grouped = {cell: match for cell in cells if (match := GROUPED.fullmatch(cell))}
    thousands = next((match[1] for match in grouped.values() if match[1] in _BETWEEN), "")
    both = next((cell for cell in grouped if "," in cell and "." in cell), None)
    if both is not None:
        decimal = max(",.", key=both.rfind)
        between = "." if decimal == "," else ","
        alone = (cell for cell in cells if between in cell and decimal not in cell)
        odd = next((cell for cell in alone if not _is_group(cell, between, grouped)), None)
        return Signs(decimal, between, mixed=None if odd is None else (odd, both)), True
    opened = ""
    for sign in ",.":
        there = [cell for cell in cells if sign in cell]
        other = "." if sign == "," else ","
        several = next((cell for cell in there if cell.count(sign) > 1), None)
        decimals = next((cell for cell in there if not _is_group(cell, sign, grouped)), None)
        if several is not None:
            mixed = None if decimals is None else (decimals, several)
            return Signs(other, sign, mixed=mixed), True
        if decimals is not None:
            return Signs(sign, thousands), True
        if _are_thousands(cells, there, sign):
            return Signs(other, sign), True
        opened = opened or (sign if there else "")
    return Signs(opened or ".", thousands, open=bool(opened)), False


def _are_thousands(cells: Sequence[str], grouped: Sequence[str], sign: str) -> bool:
    """Return True if ``sign`` stands between thousands: 998 has none and 1.002 has it.

    Decimals would end in a zero one time in ten, and then have fewer digits.
    """
    if len(set(grouped)) < _GROUPS_MIN:
        return False
    plain = [cell.lstrip(f"+-{MINUS}") for cell in cells if sign not in cell]
    return bool(plain) and all(cell.isdigit() and len(cell) <= _GROUP for cell in plain)


#: Digits of a group, and numbers with a group from which it is sure that they are not decimals:
#: of so many with three decimals all would end in another digit than 0 one time in ten.
_GROUP, _GROUPS_MIN = 3, 22


def _is_group(cell: str, sign: str, grouped: dict[str, re.Match[str]]) -> bool:
    """Return True if the digits behind ``sign`` may be a group of thousands."""
    match = grouped.get(cell)
    if match is None or match[1] != sign:
        return False
    return not cell.lstrip(f"+-{MINUS}").startswith("0")
