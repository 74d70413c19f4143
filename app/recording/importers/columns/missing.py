"""Readings that a file does not have: samples that stay, since what drove the film is known."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from dearig.errors import InputError
from dearig.recording.content.layout import PRESENT_MIN
from dearig.recording.importers.columns.chosen import Chosen, Pick
from dearig.recording.importers.columns.markers import markers_in
from dearig.units import counted

__all__ = ["without_readings", "without_rows"]

#: Quantities that an instrument measures, which writes a marker where it has no reading, and those
#: that a step may bring far off all other values.
_MARKED = frozenset(
    {"displacement", "force", "nominal_stress", "true_stress", "strain", "stretch", "current"}
)
_STEPPED = frozenset({"time", "voltage", "voltage_monitor", "temperature"})


def without_rows(
    chosen: Chosen,
    table: Mapping[str, np.ndarray],
    picked: Mapping[str, Pick],
    measured: Collection[str],
    warnings: list[str],
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return which rows of ``table`` can stay, (n,) bool, and where a marker is for no reading.

    The latter is (n,) bool by quantity, of those ``measured``: their rows stay. A marker in another
    quantity, which drives the film, takes its row with it. Adds to the ``warnings``.
    """
    good = np.ones(table["time"].size, dtype=bool)
    missing: dict[str, np.ndarray] = {}
    for quantity in (_MARKED | _STEPPED) & table.keys():
        marked, found = markers_in(table[quantity], codes_only=quantity in _STEPPED)
        if not found:
            continue
        count = int(marked.sum())
        one = count == 1
        if quantity in measured:
            missing[quantity] = marked
            follows = f"no fit uses {'it' if one else 'them'}"
        else:
            good &= ~marked
            follows = f"the row{' is' if one else 's are'} left out"
        shown = " and ".join(f"{value:.9g}" for value in found)
        where = chosen.source.row(int(np.argmax(marked)))
        warnings.append(
            f"{counted(count, 'reading')} of {picked[quantity].column!r} {'is' if one else 'are'} "
            f"{shown}, far off all others, {'' if one else 'first '}in {where}: that stands for no "
            f"reading, and {follows}"
        )
    return good, missing


def without_readings(
    chosen: Chosen,
    table: Mapping[str, np.ndarray],
    picked: Mapping[str, Pick],
    good: np.ndarray,
    missing: Mapping[str, np.ndarray],
    free: Collection[str],
    warnings: list[str],
) -> dict[str, np.ndarray]:
    """Return the ``good`` rows of ``table``, with NaN where a reading is ``missing``.

    A number that is not finite is missing too in the quantities that are ``free`` to miss some,
    which the ``warnings`` then say. Raises ``InputError`` for a column that has hardly a reading.
    """
    source = chosen.source
    found = {}
    for quantity, column in table.items():
        marked = missing.get(quantity)
        gaps = np.zeros(good.size, dtype=bool) if marked is None else good & marked
        other = good & ~gaps & ~np.isfinite(column) if quantity in free else np.False_
        if marked is None and not other.any():
            found[quantity] = column if good.all() else column[good]
            continue
        gaps |= other
        found[quantity] = np.where(gaps, np.nan, column)[good]
        name, rows = picked[quantity].column, int(good.sum())
        at = int(np.argmax(other if other.any() else gaps))
        cell = getattr(source, "cell", None)
        why = "" if cell is None else cell(at, name)
        if (left := rows - int(gaps.sum())) < PRESENT_MIN:
            raise InputError(
                f"{source.path}: column {name!r} has {counted(left, 'number')} in "
                f"{counted(rows, 'row')}, and at least {PRESENT_MIN} are needed"
                f"{why and f' ({source.row(at)}: {why})'}: is it the right column?"
            )
        if count := int(other.sum()):
            one = count == 1
            warnings.append(
                f"{count:,} of {counted(rows, 'reading')} of {name!r} {'is' if one else 'are'} "
                f"missing, {'' if one else 'first '}in {source.row(at)}{why and f' ({why})'}: no "
                f"fit uses {'it' if one else 'them'}"
            )
    return found
