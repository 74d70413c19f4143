"""List of the columns of a file of measured data, for a person to choose from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dearig.errors import InputError
from dearig.recording.importers.chosen import label_in
from dearig.recording.importers.registry import source_at
from dearig.recording.importers.source import printable

__all__ = ["ColumnPreview", "preview"]

_SHOWN = 5  # values of each column


@dataclass(frozen=True)
class ColumnPreview:
    """A column of a file: its name, what the name says of quantity and unit, and first values.

    ``table`` is the sheet, specimen or group that it belongs to, empty where it belongs to all.
    """

    number: int
    name: str
    quantities: tuple[str, ...]
    unit: str
    values: tuple[float, ...]
    count: int
    table: str = ""


def preview(path: Path, names_line: int | None = None) -> list[ColumnPreview]:
    """Return the columns of the file at ``path``. Raises ``InputError``."""
    source = source_at(path, names_line=names_line, skip_bad_rows=True)
    units: Mapping[str, str] = getattr(source, "units", {})
    places: Mapping[int, str] = getattr(source, "places", None) or dict(enumerate(source.names, 1))
    tables: Mapping[str, Sequence[str]] = getattr(source, "tables", {})
    owners: dict[str, list[str]] = {}
    for table, names in tables.items():
        for name in names:
            owners.setdefault(name, []).append(table)
    found = []
    for number, name in places.items():
        try:
            values = source.read([name])[name]
        except InputError:
            values = np.empty(0)
        label = label_in(source, name)
        raw = (label.raw,) if label.raw and not label.quantities else ()
        found.append(
            ColumnPreview(
                number,
                printable(name),
                label.quantities or raw,
                label.unit or units.get(name, ""),
                tuple(float(v) for v in values[:_SHOWN]),
                int(values.size),
                owners[name][0] if len(owners.get(name, ())) == 1 else "",
            )
        )
    return found
