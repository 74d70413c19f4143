"""Size of a film's specimen: as it is given, and as the lines above a table tell it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType

from dearig.recording.importers.quantities.units import UNITS, unit_of

__all__ = ["Specimen", "specimen_from_header"]

_NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?")
_IN_NAME = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]+)[\])]\s*:?\s*")
#: mm^2 in units of an area.
_AREAS = MappingProxyType({"mm": 1.0, "cm": 1e2, "m": 1e6})
_SQUARE = re.compile(r"(?P<unit>mm|cm|m)(\^2|2|²)")
_WORDS = MappingProxyType(
    {
        "area": re.compile(r"cross.?section|\barea\b|querschnitt|\bsection\b", re.I),
        "width": re.compile(r"width|breite|largeur", re.I),
        "thickness": re.compile(r"thickness|dicke|épaisseur|epaisseur", re.I),
        "length": re.compile(
            r"ga(u)?ge.?length|(initial|original|specimen|sample|free).?length|^length"
            r"|messlänge|einspannlänge|anfangslänge|longueur",
            re.I,
        ),
    }
)


@dataclass(frozen=True)
class Specimen:
    """Size of a film's specimen at rest, to convert displacement and force; None: not given."""

    gauge_length_mm: float | None = None
    area_mm2: float | None = None


def specimen_from_header(block: Sequence[Sequence[str]]) -> Specimen:
    """Return the size that the cells ``block`` of the lines above a table tell.

    It is a proposal: the lines may be those of another specimen. Sizes without a unit are left out.
    """
    sizes: dict[str, float] = {}
    for row in block:
        for kind, words in _WORDS.items():
            if row and words.search(row[0]):
                value = _size(row, square=kind == "area")
                if value is not None:
                    sizes.setdefault(kind, value)
                break
    area = sizes.get("area")
    if area is None and {"width", "thickness"} <= sizes.keys():
        area = sizes["width"] * sizes["thickness"]
    return Specimen(sizes.get("length"), area)


def _size(row: Sequence[str], square: bool) -> float | None:
    """Return the length in mm, or the area in mm^2, that a line tells; None if it tells none."""
    name, _, behind = row[0].partition(":")
    cells = [*filter(None, (behind.strip(),)), *row[1:]]
    match = _IN_NAME.fullmatch(name)
    unit = match["unit"] if match else ""
    words = " ".join(cells).split()
    if not words or not _NUMBER.fullmatch(words[0]):
        return None
    value = float(words[0].replace(",", "."))
    unit = unit or (words[1].strip("[]()") if len(words) > 1 else "")
    if square:
        squared = _SQUARE.fullmatch(unit)
        factor = _AREAS[squared["unit"]] if squared else None
    else:
        known = unit_of(unit)
        factor = (
            UNITS["length"][known[0]].times / UNITS["length"][known[0]].over * 1e3
            if known and "length" in known[1]
            else None
        )
    return None if factor is None or not value > 0.0 else float(f"{value * factor:.9g}")
