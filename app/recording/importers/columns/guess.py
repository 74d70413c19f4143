"""Guess of the column for each quantity, from the names of the columns."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from dearig.errors import InputError, Note
from dearig.recording.importers.columns.chosen import LIKELY, Chosen, Pick, own_name
from dearig.recording.importers.columns.proposal import ColumnProposal, counts, is_even, values_in
from dearig.recording.importers.quantities.clock_numbers import by_sixties, counts_days, epoch_unit
from dearig.recording.importers.quantities.labels import (
    DIMENSIONS,
    RAW,
    Label,
    Target,
    target_name,
    target_of,
)
from dearig.recording.importers.quantities.qualifiers import SHEAR
from dearig.recording.importers.quantities.units import UNITS, UnitScale
from dearig.recording.importers.source import listing

__all__ = ["Guess", "use_monitor"]

#: Largest output in V of a monitor of an amplifier or of a laser: the range of the card's inputs.
MONITOR_MAX = 10.0
#: Quantities from which a film's stretch comes, and those from which its stress does.
LENGTHS = ("stretch", "strain", "true_strain", "displacement")
PULLS = ("nominal_stress", "true_stress", "force")
#: Quantities that only film data have.
FILM = (*LENGTHS[:-1], *PULLS)
#: Columns of one quantity whose values are compared, at most.
COMPARED_MAX = 8
#: Name of the time of a group of channels in a MAT file of asammdf.
_OF_ASAMMDF = re.compile(r"DGM?\d+_timestamps")
#: Columns of one quantity that a message says to be open, at most.
ASKED_MAX = 3


class Guess:
    """Fills what ``chosen`` still needs from the names of the columns."""

    def __init__(
        self, chosen: Chosen, labels: Mapping[str, Label], raw: Mapping[str, UnitScale], timed: bool
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
        film = any(self._like(q) for q in FILM)
        if not film and not {"voltage", "voltage_monitor"} & there.keys():
            self._take_asked("voltage")
        if {"voltage", "voltage_monitor"} & there.keys():
            self._take("displacement", by_unit=True)
            for quantity in ("current", "temperature"):
                self._take_if_sure(quantity)
            if not {"stretch", "strain", "nominal_stress"} & there.keys():
                for quantity in ("stretch", "nominal_stress", "force"):
                    self._take(quantity, only_own=True)
            use_monitor(self._chosen)
            return
        if not set(FILM) & there.keys() and not film and not any(map(self._asked, FILM)):
            ColumnProposal(self._chosen, self._labels, self._free, self._timed).fill()
            return
        self._check_sheared()
        self._take_one(LENGTHS, ("strain", "displacement"))
        self._take_one(PULLS, PULLS)
        self._take_if_sure("temperature")
        _as_compression(self._chosen, self._labels)

    def _check_sheared(self) -> None:
        """Raise ``InputError`` if all columns of strain and stress are of shear."""
        found = [n for n in self._free if set(FILM) & set(self._labels[n].asked)]
        sheared = [n for n in found if self._labels[n].qualifier in SHEAR]
        lengths = any(self._like(q) for q in (*FILM, "displacement"))
        if sheared and sheared == found and not lengths and not self._chosen.picked.keys() & FILM:
            raise InputError(
                f"{self._chosen.source.path} has {listing(sheared)}: shear is not modelled here; "
                f"film data are of tension or compression"
            )

    def _take_one(self, quantities: Sequence[str], by_unit: Sequence[str]) -> None:
        """Pick the first of ``quantities`` that a name says, or one ``by_unit``, or an open one."""
        ways: list[tuple[str, Callable[[str], None]]] = [(q, self._take) for q in quantities]
        ways += [(q, self._take_by_unit) for q in by_unit]
        ways += [(q, self._take_asked) for q in quantities]
        for quantity, take in ways:
            if any(q in self._chosen.picked for q in quantities):
                return
            take(quantity)

    def _take_asked(self, quantity: str, instead: Sequence[str] = ()) -> None:
        """Propose the columns that may be ``quantity`` but for a word of their names."""
        asked = self._asked(quantity)
        if quantity in self._chosen.picked or not asked:
            return
        what = quantity.replace("_", " ")
        for name in asked[:ASKED_MAX]:
            self._chosen.unsure.append(
                f"{name!r} was not taken for the {what}: {self._labels[name].qualifier!r} in its "
                f"name leaves open whether it was measured, along the film and in time"
            )
        column = next(iter(instead), asked[0])
        target = target_of(target_name(quantity, self._labels[column].unit or _likely(quantity)))
        self._pick(target, column, target.scale, "column", is_open=True)

    def _take_by_unit(self, quantity: str) -> None:
        """Propose the columns whose unit alone says that they may be ``quantity``."""
        found = self._of_unit(quantity)
        if not found:
            return
        strange = quantity != "time" and self._labels[found[0]].unexplained
        # what is in % may be a stretch, a stroke, a humidity
        is_open = len(found) > 1 or bool(strange) or quantity == "strain"
        self._accept(quantity, found, "column", several=is_open)

    def _take_if_sure(self, quantity: str) -> None:
        """Pick the column of a quantity that a recording can do without, if it is sure."""
        chosen, before = self._chosen, len(self._chosen.unsure)
        if quantity in chosen.picked:
            return
        self._take(quantity)
        if quantity in chosen.picked:
            chosen.optional.add(quantity)
        if len(chosen.unsure) > before:
            why = "; ".join(chosen.unsure[before:])
            del chosen.unsure[before:]
            self._free.append(chosen.picked.pop(quantity).column)
            chosen.notes.append(f"the {quantity.replace('_', ' ')} was not imported: {why}")

    def _take(self, quantity: str, only_own: bool = False, by_unit: bool = False) -> None:
        """Pick the one column that is ``quantity``, or note why none is sure.

        With ``by_unit`` a column is proposed whose unit alone says what it may be, or one that is
        it but for a word of its name.
        """
        if quantity in self._chosen.picked:
            return
        own = [n for n in self._free if _is_own(self._own(n), quantity)]
        found = own or ([] if only_own else self._like(quantity))
        found = found if len(found) < 2 else self._different(found)
        if not found:
            if by_unit and self._asked(quantity):
                self._take_asked(quantity, self._of_unit(quantity, left=False))
            elif by_unit:
                self._take_by_unit(quantity)
            if quantity == "time" and quantity not in self._chosen.picked:
                self._take_even()
            return
        if len(found) > 1:
            self._chosen.unsure.append(f"{quantity.replace('_', ' ')} may be {listing(found)}")
        self._accept(quantity, found, "column" if len(found) > 1 else "", several=len(found) > 1)

    def _take_even(self) -> None:
        """Propose the one column without a quantity that rises in even steps for the time."""
        source = self._chosen.source
        step = getattr(source, "step_s", None)
        free = [
            n for n in self._free
            if replace(self._labels[n], name="", unexplained="") == Label("")
        ]  # fmt: skip
        if not free or len(free) > COMPARED_MAX or len(free) == len(self._labels):
            return
        if step is not None and step(list(source.names)) is not None:
            return
        values = values_in(self._chosen, free)
        even = [n for n in values if is_even(values[n]) and not counts(values[n])]
        if len(even) == 1:
            self._chosen.unsure.append(
                f"{even[0]!r} may be the time, since its values rise in even steps"
            )
            self._accept("time", even, "column", several=False)

    def _accept(self, quantity: str, found: Sequence[str], doubt: str, several: bool) -> None:
        """Pick the first of ``found``, in the unit that it names."""
        column = found[0]
        label = self._labels[column]
        scaled: Mapping[str, str] = getattr(self._chosen.source, "scales", {})
        if column in scaled:
            target = target_of(target_name(quantity, label.unit or _likely(quantity)))
            self._chosen.unsure.append(
                f"next to {column!r} stands {scaled[column]}, and it is not known whether its "
                f"values contain it: its scale is needed, as "
                f"{shlex.quote(f'{target.name}={column}*FACTOR')} or *1"
            )
            self._propose_scaled(target, column, several)
        elif _is_own(self._own(column), quantity) and not label.conflict:
            target = target_of(self._own(column))
            self._pick(target, column, target.scale, doubt, is_open=several)
        elif label.raw == quantity:
            self._pick_raw(quantity, column, label, several)
        elif label.unknown:
            likely = target_name(quantity, _likely(quantity))
            self._chosen.unsure.append(
                f"the unit {label.unknown!r} of {column!r} is not known: its scale is needed, as "
                f"{shlex.quote(f'{likely}={column}*FACTOR')}"
            )
            self._propose_scaled(target_of(likely), column, several)
        elif label.conflict:
            self._chosen.unsure.append(
                f"{column!r} is in {label.unit} by its name and in {label.conflict} by the unit "
                f"that the file gives next to it"
            )
            target = target_of(target_name(quantity, label.unit))
            self._pick(target, column, target.scale, doubt or "unit", is_open=several, unit=True)
        elif not label.unit and DIMENSIONS[quantity] not in ("strain", "stretch"):
            likely, why = self._unit_by_values(quantity, column)
            target = target_of(target_name(quantity, likely))
            if why:
                self._chosen.notes.append(f"{column!r} {why}")
            else:
                written = "; its values seem to be minutes and seconds" if likely == "min" else ""
                self._chosen.unsure.append(f"{column!r} names no unit{written}")
            self._pick(
                target, column, target.scale, doubt or ("" if why else "unit"), is_open=several,
                unit=not why,
            )  # fmt: skip
        else:
            target = target_of(target_name(quantity, label.unit or "1"))
            open_unit = DIMENSIONS[quantity] == "strain" and not label.unit
            if open_unit:
                self._chosen.notes.append(
                    f"{column!r} names no unit: it is taken as a part of the length, not as %"
                )
            self._pick(
                target, column, target.scale, doubt or ("unit" if open_unit else ""),
                is_open=several, unit=open_unit,
            )  # fmt: skip

    def _unit_by_values(self, quantity: str, column: str) -> tuple[str, str]:
        """Return the likely unit of a column that names none, and why if it is sure."""
        likely = _likely(quantity)
        if quantity != "time":
            return likely, ""
        values = self._chosen.source.read([column])[column]
        if _OF_ASAMMDF.fullmatch(self._own(column)):
            return "s", "is in s, as asammdf writes it"
        if unit := epoch_unit(values):
            return unit, f"counts from 1970 in {unit}, by its values"
        if counts_days(values):
            return "d", "counts days from 1900, by its values"
        return "min" if by_sixties(values) is not None else likely, ""

    def _of_unit(self, quantity: str, left: bool = True) -> list[str]:
        """Return the free columns with a unit of ``quantity``, or the only one that is ``left``.

        Says that it is a guess.
        """
        labels = {
            n: label for n in self._free
            if not (label := self._labels[n]).quantities and not label.qualifier
        }  # fmt: skip
        found = [
            n for n, label in labels.items()
            if DIMENSIONS[quantity] in label.dimensions and label.unit != "1"
        ]  # fmt: skip
        found = found if len(found) < 2 else self._different(found)
        why = "by its unit alone"
        if not found and quantity not in ("time", "strain") and left:
            found = [n for n, label in labels.items() if not label.unit]
            why = "because no other column is left"
            found = found if len(found) == 1 else []
        what = quantity.replace("_", " ")
        if len(found) == 1:
            self._chosen.unsure.append(f"{found[0]!r} may be the {what}, {why}")
        elif found:
            self._chosen.unsure.append(f"the {what} may be {listing(found)}, by their unit alone")
        return found

    def _asked(self, quantity: str) -> list[str]:
        """Return the columns that are ``quantity`` but for a word of their names."""
        return [n for n in self._free if quantity in self._labels[n].asked]

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
        # in its own unit, and not in the volts of an instrument
        own = [n for n in with_unit if quantity in self._labels[n].quantities]
        return own or with_unit or found

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

    def _pick_raw(self, quantity: str, column: str, label: Label, several: bool) -> None:
        """Pick an instrument's output in volts; without a rig file its scale is not known."""
        volts = self._chosen.source.read([column])[column]
        largest = float(np.nanmax(np.abs(volts))) if volts.size else 0.0
        at_film = UNITS["voltage"][label.unit].times * largest > MONITOR_MAX
        if quantity == "voltage_monitor" and at_film:
            target = target_of(target_name(quantity, label.unit))
            self._pick(target, column, target.scale, is_open=several)
            return
        target = target_of(next(name for name, q in RAW.items() if q == quantity))
        if quantity in self._raw and label.unit == "V":
            self._chosen.notes.append(f"the rig file scales {column!r} from volts at the card")
            self._pick(target, column, self._raw[quantity], is_open=several)
            return
        likely = target_name(quantity, _likely(quantity))
        self._chosen.unsure.append(
            Note(
                f"{column!r} is the output of an instrument in {label.unit}, up to {largest:.3g}: "
                f"its scale is needed, from a rig file or as "
                f"{shlex.quote(f'{likely}={column}*FACTOR')}",
                option="rig_file",
            )
        )
        self._propose_scaled(target_of(likely), column, several)

    def _propose_scaled(self, target: Target, column: str, several: bool) -> None:
        """Propose ``column`` for ``target``, with a scale that only the user knows."""
        self._chosen.source.check(column)
        proposed = Pick(
            target, column, UnitScale(), behind="*FACTOR", doubt="scale", is_open=several
        )
        self._chosen.picked[target.quantity] = proposed
        self._free.remove(column)

    def _pick(
        self, target: Target, column: str, scale: UnitScale, doubt: str = "", *,
        is_open: bool = False, unit: bool = False,
    ) -> None:  # fmt: skip
        self._chosen.source.check(column)
        self._chosen.picked[target.quantity] = Pick(
            target, column, scale, doubt=doubt, is_open=is_open, unit_open=unit
        )
        self._free.remove(column)


def use_monitor(chosen: Chosen) -> None:
    """Take the voltage from its monitor where ``chosen`` has no other."""
    there = chosen.picked
    if "voltage" in there or "voltage_monitor" not in there:
        return
    pick = there["voltage_monitor"]
    name = pick.target.name.replace("voltage_monitor", "voltage")
    there["voltage"] = replace(pick, target=replace(pick.target, name=name, quantity="voltage"))
    if pick.behind:
        del there["voltage_monitor"]
    chosen.notes.append(
        f"there is no voltage command; the voltage is that of the monitor {pick.column!r}"
    )


def _likely(quantity: str) -> str:
    return LIKELY[DIMENSIONS[quantity]]


def _is_own(name: str, quantity: str) -> bool:
    """Return True if ``name`` is this program's name of a column of ``quantity``."""
    return any(name == target_name(quantity, unit) for unit in UNITS[DIMENSIONS[quantity]])


_LENGTHS, _PULLS = ("strain", "true_strain", "displacement"), ("nominal_stress", "true_stress",
                                                               "force")  # fmt: skip


def _as_compression(chosen: Chosen, labels: Mapping[str, Label]) -> None:
    """Make compression that ``chosen`` has as positive numbers negative, and say so.

    Where only one of the two columns says that it is of compression and the other one is positive
    too, its sign is asked for. Changes ``chosen``.
    """
    length = next((chosen.picked[q] for q in _LENGTHS if q in chosen.picked), None)
    pull = next((chosen.picked[q] for q in _PULLS if q in chosen.picked), None)
    picks = [pick for pick in (length, pull) if pick is not None]
    named = [p for p in picks if labels[p.column].compressive and not p.behind and not p.is_open]
    turned = [pick for pick in named if _is_positive(chosen, pick)]
    for pick in turned:
        scale = pick.scale
        chosen.picked[pick.target.quantity] = replace(
            pick, scale=UnitScale(-scale.times, scale.over, -scale.plus), behind="*-1"
        )
        chosen.notes.append(f"{pick.column!r} is positive in compression: its sign was changed")
    for pick in picks if turned else ():
        if pick not in named and not pick.behind and _is_positive(chosen, pick):
            chosen.unsure.append(
                f"{turned[0].column!r} is of compression, and {pick.column!r} is positive too and "
                f"does not say so: give its sign, as "
                f"{shlex.quote(f'{pick.target.name}={pick.column}*-1')} or *1"
            )
            chosen.picked[pick.target.quantity] = replace(
                pick, behind="*FACTOR", doubt=pick.doubt or "scale"
            )


def _is_positive(chosen: Chosen, pick: Pick) -> bool:
    """Return True if the largest value of a column is farther above 0 than the least is below."""
    values = chosen.source.read([pick.column])[pick.column]
    values = values[np.isfinite(values)]
    return bool(values.size) and float(values.max()) > -float(values.min())
