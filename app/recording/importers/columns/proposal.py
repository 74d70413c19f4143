"""Proposal for columns whose names say nothing: what their units and values say, and holes."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from dearig.errors import InputError
from dearig.recording.importers.columns.chosen import LIKELY, Chosen, Pick
from dearig.recording.importers.quantities.labels import (
    DIMENSIONS,
    Label,
    target_name,
    target_of,
)
from dearig.recording.importers.source import listing

__all__ = ["ColumnProposal", "counts", "first_values", "is_even", "values_in"]

#: Smallest and largest stretch of a film, and what its first value differs from 1, in a proposal.
STRETCH_MIN, STRETCH_MAX, AT_REST = 0.2, 15.0, 1e-3
#: Columns that are read for a proposal, and whose first values are shown, at most; and values.
READ_MAX, SHOWN_MAX, SHOWN = 64, 12, 3
#: Part of a step by which steps of an even time may differ: rounded digits of a step of ten units.
EVEN = 0.11


class ColumnProposal:
    """Fills what ``chosen`` needs from units and values; its ``missing`` are what nothing says.

    The order of the columns counts for nothing.
    """

    def __init__(
        self, chosen: Chosen, labels: Mapping[str, Label], free: Sequence[str], timed: bool
    ) -> None:
        self._chosen, self._labels = chosen, labels
        values = values_in(chosen, [n for n in free if not re.search(r" #\d+$", n)][:READ_MAX])
        sizes = Counter(v.size for v in values.values())
        # a setting and a spectrum have other lengths than the signals
        common = max(sizes, key=lambda n: (sizes[n], n), default=0)
        self._values = {n: v for n, v in values.items() if v.size == common}
        step = getattr(chosen.source, "step_s", None)
        self._timed = timed or (step is not None and step(list(self._values)) is not None)

    def fill(self) -> None:
        """Propose what the kind of the data needs."""
        names, there = list(self._values), self._chosen.picked
        taken = {pick.column for pick in there.values()}
        free = [n for n in names if n not in taken and not self._labels[n].quantities]
        if len(free) + len(there) < 3 - self._timed:
            return  # the error that says which quantities there are not is clearer
        if "time" not in there and not self._timed:
            self._offer("time", [n for n in self._free("time") if is_even(self._values[n])])
        stress = [q for q in ("nominal_stress", "force") if self._in_unit(q)]
        if not self._in_unit("voltage") and (
            stress or any(map(_is_stretch, self._values.values()))
        ):
            lengths = [q for q in ("strain", "displacement") if self._in_unit(q)]
            wanted = [
                lengths[0] if lengths else "stretch",
                stress[0] if stress else "nominal_stress",
            ]
        else:
            wanted = ["voltage", "displacement"]
        for quantity in wanted:
            if quantity not in there:
                self._offer(quantity, self._in_unit(quantity))
        self._chosen.unsure.append(
            f"the names {listing(self._chosen.source.names)} do not say what the columns are"
        )
        if hint := getattr(self._chosen.source, "hint", ""):
            self._chosen.unsure.append(hint)

    def _free(self, quantity: str) -> list[str]:
        """Return the columns whose units do not exclude ``quantity``; no numbers of rows."""
        taken = {pick.column for pick in self._chosen.picked.values()}
        labels = {n: self._labels[n] for n in self._values if n not in taken}
        return [
            n for n, label in labels.items()
            if not label.unknown and not counts(self._values[n])
            and (not label.unit or DIMENSIONS[quantity] in label.dimensions)
        ]  # fmt: skip

    def _in_unit(self, quantity: str) -> list[str]:
        """Return the columns in a unit of ``quantity``."""
        return [n for n in self._free(quantity) if self._labels[n].unit not in ("", "1")]

    def _offer(self, quantity: str, found: Sequence[str]) -> None:
        """Propose the one column that was ``found``, or leave the quantity open."""
        different: list[str] = []
        for name in found:
            if not any(np.array_equal(self._values[name], self._values[n]) for n in different):
                different.append(name)
        likely = target_name(quantity, LIKELY[DIMENSIONS[quantity]])
        label = self._labels[different[0]] if different else None
        if (
            label is None
            or len(different) > 1
            or label.qualifier
            or (label.unexplained and quantity != "time")
        ):
            self._chosen.missing.append(likely)
            return
        unit = label.unit
        target = target_of(target_name(quantity, unit) if unit else likely)
        # a few volts may be the output of an instrument
        raw = quantity == "voltage" and unit == "V"
        self._chosen.picked[quantity] = Pick(
            target, different[0], target.scale, behind="*FACTOR" if raw else "", doubt="column",
            unit_open=not unit,
        )  # fmt: skip


def values_in(chosen: Chosen, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Return the columns ``names`` (n,) that can be read."""
    try:
        return {n: v for n, v in chosen.source.read(names).items() if v.size}
    except InputError:
        pass
    found = {}
    for name in names:
        try:
            values = chosen.source.read([name])[name]
        except InputError:
            continue
        if values.size:
            found[name] = values
    return found


def first_values(chosen: Chosen) -> str:
    """Return the first values of the columns of ``chosen``, for a message."""
    names = list(chosen.source.names)[:SHOWN_MAX]
    whole = getattr(chosen.source, "overview", None)
    if whole is not None:
        first = {name: seen.first for name, seen in whole(names, SHOWN).items()}
    else:
        first = values_in(chosen, names)
    more = len(chosen.source.names) - len(names)
    return "; ".join(
        f"{name!r}: {', '.join(f'{v:.6g}' for v in values[:SHOWN])}"
        for name, values in first.items()
    ) + (f" and {more} more columns" if more > 0 else "")


def is_even(values: np.ndarray) -> bool:
    """Return True if ``values`` (n,) rise in even steps, as a time does."""
    steps = np.diff(values)
    if not steps.size or not np.isfinite(steps).all() or steps.min() <= 0.0:
        return False
    return float(steps.max() - steps.min()) <= EVEN * float(steps.mean())


def _is_stretch(values: np.ndarray) -> bool:
    """Return True if ``values`` seem to be a stretch: 1 at the start, and some times 1 later."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    return abs(float(values[0]) - 1.0) < AT_REST and low > STRETCH_MIN and 1.0 < high < STRETCH_MAX


def counts(values: np.ndarray) -> bool:
    """Return True if ``values`` number the rows."""
    return bool((np.diff(values) == 1.0).all())
