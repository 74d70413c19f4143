"""Columns that are chosen for the quantities of a recording."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from dearig.errors import Remedy
from dearig.recording.importers.quantities.labels import Label, Target, label_of
from dearig.recording.importers.quantities.units import UnitScale
from dearig.recording.importers.source import Source

__all__ = [
    "HOLE",
    "LIKELY",
    "UNIT_HOLE",
    "Chosen",
    "Pick",
    "import_command",
    "label_in",
    "own_name",
    "take_channels",
]

#: What stands in a printed command for a column, and for a unit, that only the user knows.
HOLE, UNIT_HOLE = "COLUMN", "UNIT"

#: Unit of a column whose name has none, in a proposal, by dimension.
LIKELY = MappingProxyType(
    {"time": "s", "voltage": "kV", "length": "mm", "force": "N", "stress": "MPa", "current": "mA",
     "temperature": "C", "strain": "1", "stretch": "1"}
)  # fmt: skip


@dataclass(frozen=True)
class Pick:
    """A column that was chosen for a quantity, and the scale to the unit of a recording."""

    target: Target
    column: str
    scale: UnitScale
    behind: str = ""  # what stands behind the column in a command line, such as *FACTOR
    #: what of it is a guess: "column", "unit" or "scale"; "" where it is sure
    doubt: str = ""
    #: True where a printed command may not name the column, since only its place or a word of its
    #: name speaks for it
    is_open: bool = False
    #: True where its unit is a guess
    unit_open: bool = False

    @property
    def said(self) -> str:
        """What was taken for what, for a message."""
        target = self.target
        unit = "in V at the card" if target.raw else f"in {target.unit}"
        unit = "without unit" if target.unit == "1" else unit
        scaled = f", scaled {self.behind}" if self.behind else ""
        return f"{target.quantity.replace('_', ' ')} {unit} from {self.column!r}{scaled}"


@dataclass
class Chosen:
    """Columns of a source by quantity, and what was not sure.

    ``unsure`` are sentences: while there is one, nothing may be imported. ``notes`` say what was
    found without being asked for. ``optional`` are quantities that a recording can do without, and
    that no one asked for. ``table_choices`` are the tables of which one must be chosen. ``missing``
    are names of targets for which no column was found. ``channels`` has the name, unit and label of
    each declared channel, by its key in ``picked``.
    """

    source: Source
    picked: dict[str, Pick] = field(default_factory=dict)
    table: str | None = None
    table_choices: tuple[str, ...] = ()
    optional: set[str] = field(default_factory=set)
    unsure: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    channels: dict[str, tuple[str, str, str]] = field(default_factory=dict)

    @property
    def template(self) -> dict[str, str]:
        """Columns by target for a printed command, with holes for all that is not sure.

        Run as it is, the command imports nothing that was merely guessed.
        """
        found: dict[str, str] = {}
        for pick in self.picked.values():
            name, column = pick.target.name, pick.column + pick.behind
            if pick.unit_open:
                name = f"{pick.target.quantity}_{UNIT_HOLE}"
            found[name] = HOLE if pick.is_open else column
        return found | dict.fromkeys(self.missing, HOLE)

    @property
    def pairs(self) -> dict[str, str]:
        """Columns by target, with their scales."""
        return {pick.target.name: pick.column + pick.behind for pick in self.picked.values()}


def take_channels(chosen: Chosen, channels: Mapping[str, tuple[str, str, str]]) -> None:
    """Pick the columns of declared ``channels``: name, unit and label by column."""
    for column, (name, unit, label) in channels.items():
        if column in chosen.source.names:
            key = f"channel {name}"  # a channel may be called as a quantity is
            chosen.channels[key] = name, unit, label
            chosen.picked[key] = Pick(Target(column, name, unit), column, UnitScale())


def import_command(
    path: Path,
    out: Path,
    pairs: Mapping[str, str],
    table: str | None,
    more: Sequence[tuple[str, str | float]] = (),
) -> Remedy:
    """Return the command that imports the columns ``pairs`` of the file at ``path``.

    ``more`` are further options with their values.
    """
    values: list[tuple[str, str | float]] = [("out", str(out))]
    values += [("column", f"{target}={column}") for target, column in pairs.items()]
    if table is not None:
        values.append(("table", table))
    return Remedy(("import", str(path)), (*values, *more))


#: A name of several levels as pandas writes it: ('rig', 'voltage_kV').
_LEVELS = re.compile(r"\((?:['\"][^'\"]*['\"], )+['\"]([^'\"]*)['\"]\)")


def own_name(source: Source, column: str) -> str:
    """Return the name of ``column`` without the group or path that its format puts before it."""
    strip = getattr(source, "own_name", None)
    name = column if strip is None else strip(column)
    if levels := _LEVELS.fullmatch(name):
        name = levels[1]
    return re.sub(r" #\d+$", "", name)  # of a name that is there twice


def label_in(source: Source, column: str) -> Label:
    """Return what the name of ``column``, or else what its file says of it, tells."""
    units: Mapping[str, str] = getattr(source, "units", {})
    labels: Mapping[str, str] = getattr(source, "labels", {})
    unit = units.get(column, "")
    found = label_of(own_name(source, column), unit)
    if found.quantities or found.raw or not labels.get(column):
        return found
    stated = label_of(labels[column], unit)
    return stated if stated.quantities or stated.raw or not found.unit else found
