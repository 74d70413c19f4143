"""Guess of the column for each quantity, from the names of the columns."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from dearig.errors import InputError
from dearig.recording.importers.columns.chosen import LIKELY, Chosen, Pick, own_name
from dearig.recording.importers.quantities.clock_numbers import by_sixties, epoch_unit
from dearig.recording.importers.quantities.labels import (
    DIMENSIONS,
    RAW,
    Label,
    Target,
    target_name,
    target_of,
)
from dearig.recording.importers.quantities.units import UNITS, Scale
from dearig.recording.importers.source import listing

__all__ = ["Guess", "use_monitor"]

#: Largest output in V of a monitor of an amplifier or of a laser: the range of the card's inputs.
MONITOR_MAX = 10.0
#: Largest voltage in kV of a film, and largest displacement in mm, in a proposal.
FILM_MAX = 30.0
#: Smallest and largest stretch of a film, and what its first value differs from 1, in a proposal.
STRETCH_MIN, STRETCH_MAX, AT_REST = 0.2, 15.0, 1e-3
#: Columns of one quantity whose values are compared, at most.
COMPARED_MAX = 8


class Guess:
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
            use_monitor(self._chosen)
            return
        if not {"stretch", "strain", "nominal_stress", "force"} & there.keys() and not any(
            self._like(q) for q in ("stretch", "strain", "nominal_stress", "force")
        ):
            self._propose()
            return
        self._take_one(("stretch", "strain", "displacement"))
        if not {"stretch", "strain"} & there.keys():
            self._take("displacement", by_unit=True)
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
        if "time" in there or timed:
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
        foreign = (
            output
            or bool(label.unknown)
            or (bool(label.unit) and DIMENSIONS[target.quantity] not in label.dimensions)
        )
        if label.unit and not foreign:
            target = target_of(target_name(target.quantity, label.unit))
        self._chosen.picked[target.quantity] = Pick(
            target, column, target.scale, behind="*FACTOR" if foreign else "", doubt="column"
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

        With ``by_unit`` a column is proposed whose unit alone says what it may be.
        """
        if quantity in self._chosen.picked:
            return
        own = [n for n in self._free if _is_own(self._own(n), quantity)]
        found = own or ([] if only_own else self._like(quantity))
        found = found if len(found) < 2 else self._different(found)
        doubt = ""
        if not found and by_unit:
            found, doubt = self._of_unit(quantity), "column"
        if not found:
            return
        if len(found) > 1:
            self._chosen.unsure.append(f"{quantity.replace('_', ' ')} may be {listing(found)}")
            doubt = "column"
        column = found[0]
        label = self._labels[column]
        if own:
            target = target_of(self._own(column))
            self._pick(target, column, target.scale, doubt)
        elif label.raw == quantity:
            self._pick_raw(quantity, column, label)
        elif label.unknown:
            likely = target_name(quantity, LIKELY[DIMENSIONS[quantity]])
            self._chosen.unsure.append(
                f"the unit {label.unknown!r} of {column!r} is not known: its scale is needed, as "
                f"{shlex.quote(f'{likely}={column}*FACTOR')}"
            )
            self._propose_scaled(target_of(likely), column)
        elif not label.unit and DIMENSIONS[quantity] not in ("strain", "stretch"):
            likely, why = self._unit_by_values(quantity, column)
            target = target_of(target_name(quantity, likely))
            if why:
                self._chosen.notes.append(f"{column!r} {why}")
            else:
                self._chosen.unsure.append(f"{column!r} names no unit")
            self._pick(target, column, target.scale, doubt or ("" if why else "unit"))
        else:
            target = target_of(target_name(quantity, label.unit or "1"))
            if quantity == "strain" and not label.unit:
                self._chosen.notes.append(
                    f"{column!r} names no unit: it is taken as a part of the length, not as %"
                )
            open_unit = quantity == "strain" and not label.unit
            self._pick(target, column, target.scale, doubt or ("unit" if open_unit else ""))

    def _unit_by_values(self, quantity: str, column: str) -> tuple[str, str]:
        """Return the likely unit of a column that names none, and why if it is sure."""
        likely = LIKELY[DIMENSIONS[quantity]]
        if quantity != "time":
            return likely, ""
        values = self._chosen.source.read([column])[column]
        if unit := epoch_unit(values):
            return unit, f"counts from 1970 in {unit}, by its values"
        return "min" if by_sixties(values) is not None else likely, ""

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
        likely = target_name(quantity, LIKELY[DIMENSIONS[quantity]])
        self._chosen.unsure.append(
            f"{column!r} is the output of an instrument in {label.unit}, up to {largest:.3g}: its "
            f"scale is needed, in --rig-file or as {shlex.quote(f'{likely}={column}*FACTOR')}"
        )
        self._propose_scaled(target_of(likely), column)

    def _propose_scaled(self, target: Target, column: str) -> None:
        """Propose ``column`` for ``target``, with a scale that only the user knows."""
        self._chosen.source.check(column)
        proposed = Pick(target, column, Scale(), behind="*FACTOR", doubt="scale")
        self._chosen.picked[target.quantity] = proposed
        self._free.remove(column)

    def _pick(self, target: Target, column: str, scale: Scale, doubt: str = "") -> None:
        self._chosen.source.check(column)
        self._chosen.picked[target.quantity] = Pick(target, column, scale, doubt=doubt)
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
