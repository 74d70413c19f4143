"""Choice of the column for each quantity: as the user says it, or as the names say it."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from dearig.errors import InputError, Note
from dearig.recording.importers.columns.chosen import LIKELY, Chosen, Pick, label_in
from dearig.recording.importers.columns.guess import LENGTHS, PULLS, Guess, use_monitor
from dearig.recording.importers.quantities.labels import (
    DIMENSIONS,
    Label,
    Target,
    suggestion,
    target_name,
    target_of,
)
from dearig.recording.importers.quantities.units import UNITS, UnitScale
from dearig.recording.importers.source import Source, listing, no_such_column, part_of

__all__ = ["choose"]

#: Tables of a file in which columns are looked for; measurements have fewer specimens.
TABLES_TRIED = 64
_SCALE = re.compile(
    r"(?P<column>.+?)\s*(?:(?P<sign>[*/])\s*(?P<factor>[+-]?[\d.]+(?:[eE][+-]?\d+)?))?"
    r"\s*(?P<plus>[+-]\s*[\d.]+(?:[eE][+-]?\d+)?)?"
)


@dataclass(frozen=True)
class _Wanted:
    """What is asked for: columns by target, scales of a rig file; see ``choose``."""

    mapping: Mapping[str, str]
    raw: Mapping[str, UnitScale]
    timed: bool
    guess: bool
    apart: Collection[str] = ()


def choose(
    source: Source,
    mapping: Mapping[str, str],
    raw: Mapping[str, UnitScale],
    *,
    timed: bool,
    table: str | None = None,
    guess: bool = True,
    apart: Collection[str] = (),
) -> Chosen:
    """Return the columns of ``source`` that a recording needs.

    ``mapping`` has the column, with its scale if need be, by the name of the target; ``raw`` the
    scales of the rig file from volts at the card, by quantity, empty without one. A time column is
    not looked for if ``timed``. Only the columns of ``table`` are used if it is given. Of several
    tables, the only one with all the needed columns is used. Without ``guess``, only the columns in
    ``mapping`` are chosen; those ``apart`` are never guessed. Raises ``InputError`` for a wrong
    ``mapping`` or ``table``.
    """
    wanted = _Wanted(mapping, raw, timed, guess, apart)
    tables: Mapping[str, Sequence[str]] = getattr(source, "tables", {})
    if table is not None:
        if table not in tables:
            raise InputError(
                f"{source.path}: there is no table {table!r}; there are: {listing(list(tables))}"
                f"{suggestion([table], tables)}"
            )
        chosen = _choose(part_of(source, tables[table]), wanted)
        chosen.table = table
        return chosen
    if not guess:
        return _choose(source, wanted)
    whole = _whole(source, wanted)
    if isinstance(whole, Chosen) and _suffices(whole, timed):
        return whole
    parts: dict[str, Chosen] = {}
    for name in list(tables)[:TABLES_TRIED]:
        try:
            one = _choose(part_of(source, tables[name]), wanted)
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
        found.table_choices = tuple(parts)
        found.unsure.append(
            Note(
                f"there are several tables, of which one must be chosen: {listing([*parts])}",
                option="table",
            )
        )
    elif len(tables) > 1:
        found.notes.append(f"of {len(tables)} tables, {name!r} was taken")
    return found


def _whole(source: Source, wanted: _Wanted) -> Chosen | InputError:
    """Return the choice among all columns, or why there is none."""
    try:
        return _choose(source, wanted)
    except InputError as error:
        return error


def _choose(source: Source, wanted: _Wanted) -> Chosen:
    chosen = Chosen(source)
    labels = {name: label_in(source, name) for name in source.names}
    for name, text in wanted.mapping.items():
        pick = _asked(source, labels, wanted.raw, target_of(name), text)
        before = chosen.picked.get(pick.target.quantity)
        if before is not None:
            raise InputError(
                f"{pick.target.quantity} is given twice, as {before.target.name} and as {name}"
            )
        chosen.picked[pick.target.quantity] = pick
        chosen.notes += _overruled(pick, labels[pick.column])
    if not wanted.guess:
        use_monitor(chosen)
        return chosen
    asked = set(chosen.picked)
    free = {name: label for name, label in labels.items() if name not in wanted.apart}
    Guess(chosen, free, wanted.raw, wanted.timed).fill()
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
    film = there.keys() & set(LENGTHS) and there.keys() & set(PULLS)
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
    source: Source,
    labels: Mapping[str, Label],
    raw: Mapping[str, UnitScale],
    target: Target,
    text: str,
) -> Pick:
    """Return the pick of ``text`` for ``target``. Raises ``InputError`` if it cannot be."""
    column, own = _column(source, text)
    source.check(column)
    if target.raw and target.quantity not in raw:
        raise InputError(
            f"{target.name} takes volts at the card: give their scaling with a rig file, or as "
            f"{target_name(target.quantity, LIKELY[DIMENSIONS[target.quantity]])}={column}*FACTOR",
            option="rig_file",
        )
    scale = raw[target.quantity] if target.raw else target.scale
    if own is not None:
        return Pick(target, column, _both(own, scale), _behind(own))
    label = labels[column]
    if scaled := getattr(source, "scales", {}).get(column):
        raise InputError(
            f"{source.path}: next to {column!r} stands {scaled}, and it is not known whether its "
            f"values contain it: give its scale, such as "
            f"{shlex.quote(f'{target.name}={column}*2')}, or *1"
        )
    if label.unknown:
        raise InputError(
            f"{source.path}: {column!r} is in {label.unknown!r} by its name, which is not a unit "
            f"that is known here, and {target.name} asks for {target.unit}; give its scale, such "
            f"as {shlex.quote(f'{target.name}={column}*4')}, or *1 if it is in {target.unit}"
        )
    if not label.unit or label.conflict == target.unit:
        return Pick(target, column, scale)
    wanted = "voltage" if target.raw else DIMENSIONS[target.quantity]
    if wanted not in label.dimensions:
        raise InputError(
            f"{source.path}: {column!r} is in {label.unit} by its name, and {target.name} asks for "
            f"{target.unit}; if it is the output of an instrument, give its scale, such as "
            f"{shlex.quote(f'{target.name}={column}*4')}, or a rig file",
            option="rig_file",
        )
    if label.unit != target.unit:
        right = target.name if target.raw else target_name(target.quantity, label.unit)
        raise InputError(
            f"{source.path}: {column!r} is in {label.unit} by its name, and {target.name} asks for "
            f"{target.unit}; give {shlex.quote(f'{right}={column}')}, or a scale if its name is "
            f"wrong, such as {shlex.quote(f'{target.name}={column}*1')}"
        )
    return Pick(target, column, scale)


def _behind(scale: UnitScale) -> str:
    """Return ``scale`` as it stands behind a column in a command line."""
    factor = f"/{scale.over:g}" if scale.over != 1.0 else f"*{scale.times:g}"
    return factor + (f"{scale.plus:+g}" if scale.plus else "")


def _overruled(pick: Pick, label: Label) -> list[str]:
    """Return a sentence if a scale gives ``pick`` another unit than its name says."""
    units = UNITS[DIMENSIONS[pick.target.quantity]]
    if not pick.behind or label.unit not in units:
        return []
    named, taken = units[label.unit], pick.scale
    if math.isclose(named.times / named.over, taken.times / taken.over, rel_tol=1e-9):
        return []
    return [
        f"{pick.column!r} is taken as {pick.target.name} with the scale {pick.behind}, although "
        f"its name says {label.unit}"
    ]


def _column(source: Source, text: str) -> tuple[str, UnitScale | None]:
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
            return column, UnitScale(1.0 if divides else factor, factor if divides else 1.0, plus)
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


def _both(first: UnitScale, then: UnitScale) -> UnitScale:
    """Return the scale that applies ``first`` and ``then``."""
    return UnitScale(
        first.times * then.times,
        first.over * then.over,
        first.plus * then.times / then.over + then.plus,
    )
