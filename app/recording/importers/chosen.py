"""Choice of the column for each quantity: as the user says it, or as the names say it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from dearig.errors import InputError
from dearig.recording.importers.labels import (
    DIMENSIONS,
    RAW,
    Label,
    Target,
    label_of,
    suggestion,
    target_name,
    target_of,
)
from dearig.recording.importers.source import Source, listing, no_such_column, part_of
from dearig.recording.importers.units import UNITS, Scale

__all__ = ["Chosen", "Pick", "choose", "label_in", "own_name"]

#: Largest output in V of a monitor of an amplifier or of a laser: the range of the card's inputs.
MONITOR_MAX = 10.0
#: Largest voltage in kV of a film, and largest displacement in mm, in a proposal.
FILM_MAX = 30.0
#: Tables of a file in which columns are looked for; measurements have fewer specimens.
TABLES_TRIED = 64
#: Smallest and largest stretch of a film, and what its first value differs from 1, in a proposal.
STRETCH_MIN, STRETCH_MAX, AT_REST = 0.2, 15.0, 1e-3
#: Columns of one quantity whose values are compared, at most.
COMPARED_MAX = 8
#: Unit of a column whose name has none, in a proposal.
_LIKELY = MappingProxyType(
    {"time": "s", "voltage": "kV", "length": "mm", "force": "N", "stress": "MPa", "current": "mA",
     "temperature": "C", "strain": "1", "stretch": "1"}
)  # fmt: skip
_SCALE = re.compile(
    r"(?P<column>.+?)\s*(?:(?P<sign>[*/])\s*(?P<factor>[\d.]+(?:[eE][+-]?\d+)?))?"
    r"\s*(?P<plus>[+-]\s*[\d.]+(?:[eE][+-]?\d+)?)?"
)


@dataclass(frozen=True)
class Pick:
    """A column that was chosen for a quantity, and the scale to the unit of a recording."""

    target: Target
    column: str
    scale: Scale
    behind: str = ""  # what stands behind the column in a command line, such as *FACTOR

    @property
    def said(self) -> str:
        """What was taken for what, for a message."""
        target = self.target
        unit = "V at the card" if target.raw else "no unit" if target.unit == "1" else target.unit
        return f"{target.quantity.replace('_', ' ')} in {unit} from {self.column!r}"


@dataclass
class Chosen:
    """Columns of a source by quantity, and what was not sure.

    ``unsure`` are sentences: while there is one, nothing may be imported. ``notes`` say what was
    found without being asked for.
    """

    source: Source
    picked: dict[str, Pick] = field(default_factory=dict)
    table: str | None = None
    unsure: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def command(self, out: Path, more: Sequence[str] = ()) -> str:
        """Return the command line that imports what was chosen."""
        words = ["dearig", "import", str(self.source.path), "--out", str(out)]
        given = dict.fromkeys(
            f"{pick.target.name}={pick.column}{pick.behind}" for pick in self.picked.values()
        )
        for pair in given:
            words += ["--column", pair]
        if self.table is not None:
            words += ["--table", self.table]
        return shlex.join([*words, *more])


def own_name(source: Source, column: str) -> str:
    """Return the name of ``column`` without the group or path that its format puts before it."""
    strip = getattr(source, "own_name", None)
    name = column if strip is None else strip(column)
    return re.sub(r" #\d+$", "", name)  # of a name that is there twice


def label_in(source: Source, column: str) -> Label:
    """Return what the name of ``column``, or else what its file says of it, tells."""
    units: Mapping[str, str] = getattr(source, "units", {})
    labels: Mapping[str, str] = getattr(source, "labels", {})
    unit = units.get(column, "")
    found = label_of(own_name(source, column), unit)
    if found.quantities or found.raw or not labels.get(column):
        return found
    told = label_of(labels[column], unit)
    return told if told.quantities or told.raw or not found.unit else found


def choose(
    source: Source,
    mapping: Mapping[str, str],
    raw: Mapping[str, Scale],
    *,
    timed: bool,
    table: str | None = None,
) -> Chosen:
    """Return the columns of ``source`` that a recording needs.

    ``mapping`` has the column, with its scale if need be, by the name of the target; ``raw`` the
    scales of the rig file from volts at the card, by quantity, empty without one. A time column is
    not looked for if ``timed``. Only the columns of ``table`` are used if it is given. Of several
    tables, the only one with all the needed columns is used. Raises ``InputError`` for a wrong
    ``mapping`` or ``table``.
    """
    tables: Mapping[str, Sequence[str]] = getattr(source, "tables", {})
    if table is not None:
        if table not in tables:
            raise InputError(
                f"{source.path}: there is no table {table!r}; there are: {listing(list(tables))}"
                f"{suggestion([table], tables)}"
            )
        chosen = _choose(part_of(source, tables[table]), mapping, raw, timed)
        chosen.table = table
        return chosen
    whole = _whole(source, mapping, raw, timed)
    if isinstance(whole, Chosen) and _suffices(whole, timed):
        return whole
    parts: dict[str, Chosen] = {}
    for name in list(tables)[:TABLES_TRIED]:
        try:
            one = _choose(part_of(source, tables[name]), mapping, raw, timed)
        except InputError:
            continue
        if _suffices(one, timed):
            one.table, parts[name] = name, one
    if not parts:
        if isinstance(whole, InputError):
            raise whole
        return whole
    default = getattr(source, "default_table", None)
    name = default if default in parts else next(iter(parts))
    found = parts[name]
    if len(parts) > 1 and name != default:
        found.unsure.append(f"there are several tables, and --table takes one: {listing([*parts])}")
    elif len(tables) > 1:
        found.notes.append(f"of {len(tables)} tables, {name!r} was taken")
    return found


def _whole(
    source: Source, mapping: Mapping[str, str], raw: Mapping[str, Scale], timed: bool
) -> Chosen | InputError:
    """Return the choice among all columns, or why there is none."""
    try:
        return _choose(source, mapping, raw, timed)
    except InputError as error:
        return error


def _choose(
    source: Source, mapping: Mapping[str, str], raw: Mapping[str, Scale], timed: bool
) -> Chosen:
    chosen = Chosen(source)
    labels = {name: label_in(source, name) for name in source.names}
    for name, text in mapping.items():
        pick = _asked(source, labels, raw, target_of(name), text)
        before = chosen.picked.get(pick.target.quantity)
        if before is not None:
            raise InputError(
                f"{pick.target.quantity} is given twice, as {before.target.name} and as {name}"
            )
        chosen.picked[pick.target.quantity] = pick
    asked = set(chosen.picked)
    _Guess(chosen, labels, raw, timed).fill()
    _leave_other_sizes(chosen, asked)
    return chosen


def _suffices(chosen: Chosen, timed: bool) -> bool:
    """Return True if ``chosen`` has every column of a recording, each without a doubt."""
    there, step = chosen.picked, getattr(chosen.source, "step_s", None)
    columns = [pick.column for pick in there.values()]
    if chosen.unsure or not (
        timed or "time" in there or (step is not None and step(columns) is not None)
    ):
        return False
    if len(set(_sizes(chosen).values()) - {None}) > 1:
        return getattr(chosen.source, "cut_short", False)
    film = there.keys() & {"stretch", "strain", "displacement"} and there.keys() & {
        "nominal_stress", "force"
    }  # fmt: skip
    return {"voltage", "displacement"} <= there.keys() or bool(film)


def _sizes(chosen: Chosen) -> dict[str, int | None]:
    """Return the number of values by quantity; None where the source does not tell."""
    size = getattr(chosen.source, "size", None)
    return {q: None if size is None else size(p.column) for q, p in chosen.picked.items()}


def _leave_other_sizes(chosen: Chosen, asked: set[str]) -> None:
    """Leave out guessed columns that a recording can do without and that have another length."""
    sizes = _sizes(chosen)
    wanted = next((sizes[q] for q in ("displacement", "stretch", "strain") if q in sizes), None)
    if wanted is None:
        return
    # columns of a file that was not closed differ by the values of one write
    least = wanted // 2 if getattr(chosen.source, "cut_short", False) else wanted
    for quantity in ("voltage_monitor", "current", "temperature"):
        size = sizes.get(quantity)
        if quantity not in asked and size is not None and (size > wanted or size < least):
            column = chosen.picked.pop(quantity).column
            chosen.notes.append(
                f"the {quantity.replace('_', ' ')} was not imported: {column!r} has "
                f"{size} values and the displacement has {wanted}; columns at several "
                f"rates are not resampled"
            )


def _asked(
    source: Source, labels: Mapping[str, Label], raw: Mapping[str, Scale], target: Target, text: str
) -> Pick:
    """Return the pick of ``--column target=text``. Raises ``InputError`` if it cannot be."""
    column, own = _column(source, text)
    source.check(column)
    if target.raw and target.quantity not in raw:
        raise InputError(
            f"{target.name} takes volts at the card: give their scaling with --rig-file, or as "
            f"{target_name(target.quantity, _LIKELY[DIMENSIONS[target.quantity]])}={column}*FACTOR"
        )
    scale = raw[target.quantity] if target.raw else target.scale
    if own is not None:
        return Pick(target, column, _both(own, scale))
    label = labels[column]
    if not label.unit:
        return Pick(target, column, scale)
    wanted = "voltage" if target.raw else DIMENSIONS[target.quantity]
    if wanted not in label.dimensions:
        raise InputError(
            f"{source.path}: {column!r} is in {label.unit} by its name, and {target.name} asks for "
            f"{target.unit}; if it is the output of an instrument, give its scale, such as "
            f"{shlex.quote(f'{target.name}={column}*4')}, or --rig-file"
        )
    if label.unit != target.unit:
        right = target.name if target.raw else target_name(target.quantity, label.unit)
        raise InputError(
            f"{source.path}: {column!r} is in {label.unit} by its name, and {target.name} asks for "
            f"{target.unit}; give {shlex.quote(f'{right}={column}')}, or a scale if its name is "
            f"wrong, such as {shlex.quote(f'{target.name}={column}*1')}"
        )
    return Pick(target, column, scale)


def _column(source: Source, text: str) -> tuple[str, Scale | None]:
    """Return the column that ``text`` names, and the scale behind its name if there is one."""
    if (found := _place(source, text)) is not None:
        return found, None
    match = _SCALE.fullmatch(text.strip())
    if match and (match["factor"] or match["plus"]):
        column = _place(source, match["column"])
        if column is not None:
            try:
                factor = float(match["factor"] or 1.0)
                plus = float((match["plus"] or "0").replace(" ", ""))
            except ValueError as error:
                raise InputError(f"{text!r}: {error}") from error
            if factor == 0.0:
                raise InputError(f"{text!r}: a scale of 0 leaves nothing")
            divides = match["sign"] == "/"
            return column, Scale(1.0 if divides else factor, factor if divides else 1.0, plus)
    source.check(text)  # its error may say more
    raise no_such_column(source, text)


def _place(source: Source, text: str) -> str | None:
    if text in source.names:
        return text
    if text.startswith("#") and text[1:].isdigit():
        places = getattr(source, "places", None) or dict(enumerate(source.names, 1))
        return places.get(int(text[1:]))
    named = source.named(text)
    if len(named) > 1:
        raise InputError(
            f"{source.path}: {len(named)} columns are called {text!r}: {listing(named)}; give one"
        )
    return named[0] if named else None


def _both(first: Scale, then: Scale) -> Scale:
    """Return the scale that applies ``first`` and ``then``."""
    return Scale(
        first.times * then.times,
        first.over * then.over,
        first.plus * then.times / then.over + then.plus,
    )


class _Guess:
    """Fills what ``chosen`` still needs from the names of the columns."""

    def __init__(
        self, chosen: Chosen, labels: Mapping[str, Label], raw: Mapping[str, Scale], timed: bool
    ) -> None:
        self._chosen, self._labels, self._raw, self._timed = chosen, labels, raw, timed
        taken = {pick.column for pick in chosen.picked.values()}
        self._free = [name for name in labels if name not in taken]

    def fill(self) -> None:
        """Choose a column for every quantity that the kind of the data needs."""
        there = self._chosen.picked
        if not self._timed:
            self._take("time", by_unit=True)
        self._take("voltage")
        if "voltage" in there:
            self._take_if_sure("voltage_monitor")
        else:
            self._take("voltage_monitor")
        actuator = "voltage" in there or "voltage_monitor" in there
        if actuator:
            self._take("displacement", by_unit=True)
            for quantity in ("current", "temperature"):
                self._take_if_sure(quantity)
            if not {"stretch", "strain", "nominal_stress"} & there.keys():
                for quantity in ("stretch", "nominal_stress", "force"):
                    self._take(quantity, only_own=True)
            if "voltage" not in there:
                pick = there["voltage_monitor"]
                name = pick.target.name.replace("voltage_monitor", "voltage")
                there["voltage"] = replace(
                    pick, target=replace(pick.target, name=name, quantity="voltage")
                )
                if pick.behind:
                    del there["voltage_monitor"]
                self._chosen.notes.append(
                    f"there is no voltage command; the voltage is that of the monitor "
                    f"{pick.column!r}"
                )
            return
        if not {"stretch", "strain", "nominal_stress", "force"} & there.keys() and not any(
            self._like(q) for q in ("stretch", "strain", "nominal_stress", "force")
        ):
            self._propose()
            return
        self._take_one(("stretch", "strain", "displacement"))
        self._take_one(("nominal_stress", "force"))
        self._take_one(("nominal_stress", "force"), by_unit=True)
        self._take_if_sure("temperature")

    def _propose(self) -> None:
        """Propose columns by their order, for an actuator: time, voltage, displacement."""
        source, there = self._chosen.source, self._chosen.picked
        names = [n for n in self._free if not re.search(r" #\d+$", n)]
        if not names:
            return
        try:
            values = source.read(names)
        except InputError:
            return
        names = [n for n in names if values[n].size]
        step = getattr(source, "step_s", None)
        timed = self._timed or (step is not None and step(names) is not None)
        if "time" not in there and timed:
            names = [n for n in names if not _counts(values[n])]
        elif "time" not in there:
            rising = [n for n in names if bool((np.diff(values[n]) > 0.0).all())]
            if rising:
                self._offer("time_s", rising[0])
                names.remove(rising[0])
        if "displacement" not in there and len(names) > 1 and _is_stretch(values[names[0]]):
            self._offer("stretch", names[0])
            self._offer("nominal_stress_kPa", names[1])
            names = []
        wanted = [q for q in ("voltage", "displacement") if q not in there and names]
        if len(names) < len(wanted):
            return
        for quantity, column in zip(wanted, names, strict=False):
            largest = float(np.nanmax(np.abs(values[column])))
            small, large = ("kV", "V") if quantity == "voltage" else ("mm", "um")
            # a film takes some kV and moves some mm
            name = f"{quantity}_{small if largest < FILM_MAX else large}"
            output = quantity == "voltage" and self._labels[column].unit == "V"
            self._offer(name, column, output and largest <= MONITOR_MAX)
        self._chosen.unsure.append(
            f"the names {listing(source.names)} do not say what the columns are; the order does, "
            f"perhaps"
        )

    def _offer(self, name: str, column: str, output: bool = False) -> None:
        """Propose ``column`` for the target ``name``; ``output``: in volts of an instrument."""
        target = target_of(name)
        label = self._labels[column]
        foreign = output or (
            bool(label.unit) and DIMENSIONS[target.quantity] not in label.dimensions
        )
        if label.unit and not foreign:
            target = target_of(target_name(target.quantity, label.unit))
        self._chosen.picked[target.quantity] = Pick(
            target, column, target.scale, behind="*FACTOR" if foreign else ""
        )
        self._free.remove(column)

    def _take_one(self, quantities: Sequence[str], by_unit: bool = False) -> None:
        if any(q in self._chosen.picked for q in quantities):
            return
        for quantity in quantities:
            self._take(quantity, by_unit=by_unit)
            if quantity in self._chosen.picked:
                return

    def _take_if_sure(self, quantity: str) -> None:
        """Pick the column of a quantity that a recording can do without, if it is sure."""
        chosen, before = self._chosen, len(self._chosen.unsure)
        self._take(quantity)
        if len(chosen.unsure) > before:
            why = "; ".join(chosen.unsure[before:])
            del chosen.unsure[before:]
            self._free.append(chosen.picked.pop(quantity).column)
            chosen.notes.append(f"the {quantity.replace('_', ' ')} was not imported: {why}")

    def _take(self, quantity: str, only_own: bool = False, by_unit: bool = False) -> None:
        """Pick the one column that is ``quantity``, or note why none is sure.

        With ``by_unit`` a column is proposed whose unit alone says what it may be.
        """
        if quantity in self._chosen.picked:
            return
        own = [n for n in self._free if _is_own(self._own(n), quantity)]
        found = own or ([] if only_own else self._like(quantity))
        found = found if len(found) < 2 else self._different(found)
        if not found and by_unit:
            found = self._of_unit(quantity)
        if not found:
            return
        if len(found) > 1:
            self._chosen.unsure.append(f"{quantity.replace('_', ' ')} may be {listing(found)}")
        column = found[0]
        label = self._labels[column]
        if own:
            target = target_of(self._own(column))
            self._pick(target, column, target.scale)
        elif label.raw == quantity:
            self._pick_raw(quantity, column, label)
        elif not label.unit and DIMENSIONS[quantity] not in ("strain", "stretch"):
            likely = _LIKELY[DIMENSIONS[quantity]]
            target = target_of(target_name(quantity, likely))
            self._chosen.unsure.append(f"{column!r} names no unit")
            self._pick(target, column, target.scale)
        else:
            target = target_of(target_name(quantity, label.unit or "1"))
            if quantity == "strain" and not label.unit:
                self._chosen.notes.append(
                    f"{column!r} names no unit: it is taken as a part of the length, not as %"
                )
            self._pick(target, column, target.scale)

    def _of_unit(self, quantity: str) -> list[str]:
        """Return the one free column with a unit of ``quantity``, or the only one that is left.

        Says that it is a guess.
        """
        labels = {n: self._labels[n] for n in self._free if not self._labels[n].quantities}
        found = [n for n, label in labels.items() if DIMENSIONS[quantity] in label.dimensions]
        why = "by its unit alone"
        if not found and quantity != "time":
            found = [n for n, label in labels.items() if not label.unit]
            why = "because no other column is left"
        if len(found) != 1:
            return []
        what = quantity.replace("_", " ")
        self._chosen.unsure.append(f"{found[0]!r} may be the {what}, {why}")
        return found

    def _own(self, name: str) -> str:
        return own_name(self._chosen.source, name)

    def _like(self, quantity: str) -> list[str]:
        """Return the columns whose names are like ``quantity``; those with a unit come first."""
        found = [
            n
            for n in self._free
            if quantity in self._labels[n].quantities or self._labels[n].raw == quantity
        ]
        with_unit = [n for n in found if self._labels[n].unit]
        return with_unit or found

    def _different(self, names: list[str]) -> list[str]:
        """Return ``names`` without columns that repeat another one's values, if they are few."""
        if len(names) > COMPARED_MAX:
            return names
        try:
            values = self._chosen.source.read(names)
        except InputError:
            return names
        kept: list[str] = []
        for name in names:
            if not any(np.array_equal(values[name], values[k], equal_nan=True) for k in kept):
                kept.append(name)
        return kept

    def _pick_raw(self, quantity: str, column: str, label: Label) -> None:
        """Pick an instrument's output in volts; without a rig file its scale is not known."""
        volts = self._chosen.source.read([column])[column]
        largest = float(np.nanmax(np.abs(volts))) if volts.size else 0.0
        at_film = UNITS["voltage"][label.unit].times * largest > MONITOR_MAX
        if quantity == "voltage_monitor" and at_film:
            target = target_of(target_name(quantity, label.unit))
            self._pick(target, column, target.scale)
            return
        target = target_of(next(name for name, q in RAW.items() if q == quantity))
        if quantity in self._raw and label.unit == "V":
            self._chosen.notes.append(f"the rig file scales {column!r} from volts at the card")
            self._pick(target, column, self._raw[quantity])
            return
        likely = target_name(quantity, _LIKELY[DIMENSIONS[quantity]])
        self._chosen.unsure.append(
            f"{column!r} is the output of an instrument in {label.unit}, up to {largest:.3g}: its "
            f"scale is needed, in --rig-file or as {shlex.quote(f'{likely}={column}*FACTOR')}"
        )
        self._chosen.source.check(column)
        proposed = Pick(target_of(likely), column, Scale(), behind="*FACTOR")
        self._chosen.picked[quantity] = proposed
        self._free.remove(column)

    def _pick(self, target: Target, column: str, scale: Scale) -> None:
        self._chosen.source.check(column)
        self._chosen.picked[target.quantity] = Pick(target, column, scale)
        self._free.remove(column)


def _is_stretch(values: np.ndarray) -> bool:
    """Return True if ``values`` seem to be a stretch: 1 at the start, and some times 1 later."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    return abs(float(values[0]) - 1.0) < AT_REST and low > STRETCH_MIN and 1.0 < high < STRETCH_MAX


def _counts(values: np.ndarray) -> bool:
    """Return True if ``values`` number the rows."""
    return bool((np.diff(values) == 1.0).all())


def _is_own(name: str, quantity: str) -> bool:
    """Return True if ``name`` is this program's name of a column of ``quantity``."""
    return any(name == target_name(quantity, unit) for unit in UNITS[DIMENSIONS[quantity]])
