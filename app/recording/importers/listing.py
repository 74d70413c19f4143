"""Content of a file of measured data, for a person to choose from: columns, tables, guesses."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from dearig.errors import InputError
from dearig.progress import Progress, part, quiet
from dearig.recording.importers.columns.choose import choose
from dearig.recording.importers.columns.chosen import Chosen, label_in, own_name
from dearig.recording.importers.columns.specimen import Specimen, specimen_from_header
from dearig.recording.importers.formats.columns import ColumnOverview
from dearig.recording.importers.importing import OPENED, exported_from
from dearig.recording.importers.quantities.units import UnitScale
from dearig.recording.importers.registry import source_at
from dearig.recording.importers.source import Source, part_of, printable

__all__ = ["ColumnGuesses", "ColumnPreview", "Content", "Guessed", "content_of", "preview"]

_SHOWN = 5  # values of each column
#: Tables of a file for which columns are proposed.
PROPOSED_MAX = 500


@dataclass(frozen=True)
class ColumnPreview:
    """A column of a file: its name, what the name says of quantity and unit, and first values.

    ``table`` is the sheet, specimen or group that it belongs to, empty where it belongs to all.
    ``low`` and ``high`` are the least and the greatest of its ``count`` values, None without any.
    """

    number: int
    name: str
    quantities: tuple[str, ...]
    unit: str
    values: tuple[float, ...]
    count: int
    table: str = ""
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Guessed:
    """Guess for a column: ``unit`` is "" where it is not sure.

    ``doubt`` says what of it is not sure: "column", "unit" or "scale"; "" if nothing is. ``raw``:
    in volts at the card, which the rig file scales.
    """

    quantity: str
    unit: str
    doubt: str = ""
    raw: bool = False


@dataclass(frozen=True)
class ColumnGuesses:
    """Guesses for the columns of one table, by number, and what is not sure of them.

    ``signature`` is the same for tables of the same layout, names and units; ``numbers`` are those
    of its columns, in order.
    """

    guesses: Mapping[int, Guessed]
    numbers: tuple[int, ...]
    signature: str
    unsure: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Content:
    """Content of the file at ``path``.

    ``proposals`` are by table, "" for all columns; ``table`` is the one that is taken, None where
    the user must choose. ``stated`` is the size of the specimen by the file's head.
    """

    path: Path
    columns: tuple[ColumnPreview, ...]
    proposals: Mapping[str, ColumnGuesses]
    table: str | None
    is_text: bool = False
    stated: Specimen = field(default_factory=Specimen)
    block: tuple[str, ...] = ()


def preview(path: Path, names_line: int | None = None) -> list[ColumnPreview]:
    """Return the columns of the file at ``path``. Raises ``InputError``."""
    return _columns(source_at(path, names_line=names_line, skip_bad_rows=True), _SHOWN)


def content_of(
    path: Path,
    names_line: int | None = None,
    raw: Mapping[str, UnitScale] | None = None,
    *,
    shown: int = 12,
    progress: Progress = quiet,
) -> Content:
    """Return the content of the file at ``path``, with ``shown`` first values of each column.

    ``raw`` are the scales of a rig file from volts at the card, by quantity. Raises ``InputError``.
    """
    progress("opening", 0.0)
    source = source_at(path, names_line=names_line, skip_bad_rows=True)
    if hasattr(source, "progress"):
        reading = part(progress, OPENED, 0.9)
        source.progress = lambda done: reading("reading", done)
    columns = tuple(_columns(source, shown))
    numbers = {column.name: column.number for column in columns}
    progress("finding quantities", 0.9)
    tables: Mapping[str, Sequence[str]] = getattr(source, "tables", {})
    scales = raw or {}
    was, _ = exported_from(source)
    apart = {*was.channels, *was.computed}  # of an exported recording: no quantities of an import
    # without tables, and where several columns of several make up a recording
    proposals = {"": _proposal(source, None, scales, numbers, apart)}
    for name in list(tables)[:PROPOSED_MAX]:
        proposals[printable(name)] = _proposal(source, name, scales, numbers, apart)
    block: Sequence[Sequence[str]] = getattr(source, "block", ())
    return Content(
        path, columns, proposals, _taken(source, scales, apart),
        is_text=hasattr(source, "layout"), stated=specimen_from_header(block),
        block=tuple(printable(" ".join(row)) for row in block if row),
    )  # fmt: skip


def _taken(source: Source, raw: Mapping[str, UnitScale], apart: Collection[str]) -> str | None:
    """Return the table that is taken without being asked, "" for all columns; else None."""
    try:
        chosen = choose(source, {}, raw, timed=False, apart=apart)
    except InputError:
        return ""
    return None if chosen.table_choices else printable(chosen.table or "")


def _proposal(
    source: Source,
    table: str | None,
    raw: Mapping[str, UnitScale],
    numbers: Mapping[str, int],
    apart: Collection[str],
) -> ColumnGuesses:
    tables: Mapping[str, Sequence[str]] = getattr(source, "tables", {})
    names = list(source.names if table is None else tables[table])
    of_table = source if table is None else part_of(source, names)
    places = tuple(numbers[printable(name)] for name in names if printable(name) in numbers)
    digest = _signature(source, names)
    try:
        chosen = choose(of_table, {}, raw, timed=False, apart=apart)
    except InputError as error:
        return ColumnGuesses({}, places, digest, (str(error),))
    if chosen.table is not None:  # the columns of a table are proposed with that table
        return ColumnGuesses({}, places, digest)
    return ColumnGuesses(
        _guesses(chosen, numbers), places, digest, tuple(chosen.unsure), tuple(chosen.notes)
    )


def _guesses(chosen: Chosen, numbers: Mapping[str, int]) -> dict[int, Guessed]:
    found: dict[int, Guessed] = {}
    for quantity, pick in chosen.picked.items():
        number = numbers.get(printable(pick.column))
        if number is not None and number not in found:  # the monitor may be the voltage too
            unit = "" if pick.doubt else pick.target.unit
            found[number] = Guessed(quantity, unit, pick.doubt, pick.target.raw)
    return found


def _signature(source: Source, names: Sequence[str]) -> str:
    """Return what tables of the same layout, names and units have in common."""
    layout = getattr(source, "layout", None)
    units: Mapping[str, str] = getattr(source, "units", {})
    content = [
        type(source).__name__,
        getattr(layout, "delimiter", None),
        [[own_name(source, name), units.get(name, "")] for name in names],
    ]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:32]


def _columns(source: Source, shown: int) -> list[ColumnPreview]:
    units: Mapping[str, str] = getattr(source, "units", {})
    places: Mapping[int, str] = getattr(source, "places", None) or dict(enumerate(source.names, 1))
    tables: Mapping[str, Sequence[str]] = getattr(source, "tables", {})
    owners: dict[str, list[str]] = {}
    for table, names in tables.items():
        for name in names:
            owners.setdefault(name, []).append(table)
    overviews = _overviews(source, list(places.values()), shown)
    found = []
    for number, name in places.items():
        label = label_in(source, name)
        raw = (label.raw,) if label.raw and not label.quantities else ()
        seen = overviews[name]
        found.append(
            ColumnPreview(
                number,
                printable(name),
                label.quantities or raw,
                label.unit or label.unknown or units.get(name, ""),
                tuple(float(v) for v in seen.first),
                seen.count,
                owners[name][0] if len(owners.get(name, ())) == 1 else "",
                seen.low if math.isfinite(seen.low) else None,
                seen.high if math.isfinite(seen.high) else None,
            )
        )
    return found


def _overviews(source: Source, names: Sequence[str], shown: int) -> dict[str, ColumnOverview]:
    """Return first values, number and range of each column; none where it cannot be read."""
    whole = getattr(source, "overview", None)
    if whole is not None:
        overviews: dict[str, ColumnOverview] = whole(names, shown)
        return overviews
    found = {}
    for name in names:
        try:
            values = source.read([name])[name]
        except InputError:
            values = np.empty(0)
        seen = ColumnOverview().with_values(values[np.isfinite(values)], shown)
        found[name] = replace(seen, first=values[:shown], count=int(values.size))
    return found
