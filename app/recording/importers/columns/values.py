"""Values of a recording from the columns that were chosen."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from dearig.errors import InputError, Note
from dearig.recording.importers.columns.chosen import Chosen, Pick, label_in
from dearig.recording.importers.columns.guess import LENGTHS, PULLS
from dearig.recording.importers.columns.missing import without_readings, without_rows
from dearig.recording.importers.columns.specimen import Specimen, specimen_from_header
from dearig.recording.importers.columns.start import MeasurementStart, start_of
from dearig.recording.importers.columns.time_faults import (
    check_forward,
    forward_rows,
    jumps,
    one_clock,
)
from dearig.recording.importers.quantities.clock_numbers import by_sixties, counts_days, epoch_unit
from dearig.recording.importers.quantities.labels import names_of, suggestion
from dearig.recording.importers.quantities.units import UNITS
from dearig.recording.importers.source import (
    GapError,
    NeedsOptionError,
    Source,
    listing,
    skip_or_refuse,
)
from dearig.units import counted

__all__ = ["Values", "values_of"]

#: Where the optional columns go, by quantity.
OPTIONAL = MappingProxyType(
    {
        "voltage_monitor": "voltage_monitor",
        "current": "current_monitor",
        "temperature": "temperature",
    }
)
#: Time in s above which a first time stamp counts from a fixed day, not from the start of a run.
LONG_AGO = 1e7


@dataclass
class Values:
    """Values (n,) of a recording of some ``kind``, by their names in it.

    ``left`` are the places of rows that were left out, by the sample before which they stood.
    ``warnings`` are what should be checked and ``notes`` what was done to the values. ``start`` is
    the start of the measurement, where the file tells it. ``channels`` has unit and label of
    declared channels. ``missing`` are the names of columns with readings that the file does not
    have, which are NaN.
    """

    kind: str
    columns: dict[str, np.ndarray]
    left: dict[int, list[str]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    start: MeasurementStart | None = None
    channels: dict[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def missing(self) -> tuple[str, ...]:
        return tuple(name for name, column in self.columns.items() if np.isnan(column).any())


def values_of(
    chosen: Chosen,
    specimen: Specimen,
    rate_Hz: float | None,
    skip_bad_rows: bool,
    gaps: Collection[str] = (),
) -> Values:
    """Return the values of the columns in ``chosen``, in the units of a recording.

    ``rate_Hz`` makes the time of a file that has none. With ``skip_bad_rows`` rows whose time or
    drive cannot be used are left out, and other readings that cannot are missing; they may be so
    in the columns ``gaps`` in any case. Raises ``InputError`` for what no recording can be.
    """
    take = _Take(rate_Hz, skip_bad_rows, frozenset(gaps))
    values = Values(_kind(chosen), {}, notes=list(chosen.notes))
    values.channels = {name: (unit, label) for name, unit, label in chosen.channels.values()}
    if values.kind == "actuator":
        if "force" in chosen.picked:
            values.warnings.append("the force was not used: actuator data have none")
        if specimen != Specimen():
            values.warnings.append("gauge length and area are for film data, and were not used")
        if "displacement" not in chosen.picked:
            raise _no_column(chosen, "displacement")
        measured = ["displacement", *OPTIONAL, *chosen.channels]
        found = _read(chosen, values, ["time", "voltage"], measured, take)
        values.columns = {
            "time": found["time"],
            "displacement": found["displacement"],
            "voltage_command": found["voltage"],
        }
        values.columns |= {OPTIONAL[q]: found[q] for q in OPTIONAL if q in found}
        values.columns |= {name: found[key] for key, (name, *_) in chosen.channels.items()}
        return values
    length, pull = _film_columns(chosen, specimen, values)
    measured = [pull, "temperature", *chosen.channels]
    found = _read(chosen, values, ["time", length], measured, take)
    channels = {name: found.pop(key) for key, (name, *_) in chosen.channels.items()}
    if "strain" in found:
        found["stretch"] = 1.0 + found.pop("strain")
    if specimen.gauge_length_mm is not None and "displacement" in found:
        found["stretch"] = 1.0 + found.pop("displacement") / (specimen.gauge_length_mm / 1e3)
    if specimen.area_mm2 is not None and "force" in found:
        found["nominal_stress"] = found.pop("force") / (specimen.area_mm2 / 1e6)
    _from_true(found, values)
    low = np.flatnonzero(found["stretch"] <= 0.0)
    if low.size:
        raise InputError(
            f"{chosen.source.path}, {chosen.source.row(int(low[0]))}: stretch is "
            f"{found['stretch'][low[0]]:.6g}; it is length over length at rest, and above 0"
        )
    values.columns = found | channels
    return values


def _from_true(found: dict[str, np.ndarray], values: Values) -> None:
    """Convert true strain and true stress. Changes ``found`` and the notes.

    True strain is the logarithm of the stretch. A film keeps its volume, so that its cross-section
    is that at rest over the stretch, however it is held.
    """
    if "true_strain" in found:
        found["stretch"] = np.exp(found.pop("true_strain"))
        values.notes.append("the stretch is computed from the true strain, its logarithm")
    if "true_stress" in found:
        found["nominal_stress"] = found.pop("true_stress") / found["stretch"]
        values.notes.append(
            "the nominal stress is the true stress over the stretch, of a film that keeps its "
            "volume"
        )


def _kind(chosen: Chosen) -> str:
    there = chosen.picked.keys()
    path = chosen.source.path
    film = [
        q for q in ("stretch", "strain", "true_strain", "nominal_stress", "true_stress")
        if q in there
    ]  # fmt: skip
    if "voltage" in there and film:
        raise InputError(
            f"{path} has both voltage and {' and '.join(film)}: actuator data are driven by "
            f"voltage, film data by stretch; import a file with the columns of one"
        )
    if "voltage" in there:
        if "displacement" not in there and _measures_force(chosen):
            raise InputError(
                f"{path} has voltage and force and no displacement: the force of a blocked film is "
                f"not modelled here; actuator data need the displacement"
            )
        return "actuator"
    if film or "force" in there:
        return "film"
    raise InputError(
        f"{path} has no column for voltage ({names_of('voltage')}), nor for film data "
        f"({names_of('stretch')}, {names_of('strain')}, {names_of('nominal_stress')}, "
        f"{names_of('force')}); there are: {listing(chosen.source.names)}"
        f"{suggestion(['voltage_kV', 'stretch'], chosen.source.names)}"
    )


def _measures_force(chosen: Chosen) -> bool:
    """Whether a column is a force by its name or its label, and none may be the displacement."""
    labels = [label_in(chosen.source, name) for name in chosen.source.names]
    named = {q for label in labels for q in (*label.quantities, *label.asked, label.raw)}
    return "force" in {*named, *chosen.picked} and "displacement" not in named


def _film_columns(chosen: Chosen, specimen: Specimen, values: Values) -> tuple[str, str]:
    """Return the quantities that stretch and stress come from.

    Raises ``NeedsOptionError`` for a size of the specimen that is missing, for both at once.
    """
    there, stated = chosen.picked, specimen_from_header(getattr(chosen.source, "block", ()))
    length = next((q for q in LENGTHS if q in there), None)
    pull = next((q for q in PULLS if q in there), None)
    if length is None:
        raise _no_column(
            chosen,
            "stretch",
            "strain, or displacement with a gauge length",
            option="gauge_length_mm",
        )
    if pull is None:
        raise _no_column(
            chosen, "nominal_stress", "or force_N with a cross-section", option="area_mm2"
        )
    missing, answers = [], {}
    if length == "displacement" and specimen.gauge_length_mm is None:
        missing.append(
            f"displacement and no stretch; give the specimen's length at rest"
            f"{_hint(chosen, 'length')}"
        )
        answers["gauge_length_mm"] = _typed(stated.gauge_length_mm, "LENGTH")
    if pull == "force" and specimen.area_mm2 is None:
        missing.append(
            f"force and no nominal stress; give the specimen's cross-section at rest"
            f"{_hint(chosen, 'width', 'thickness', 'section')}"
        )
        answers["area_mm2"] = _typed(stated.area_mm2, "AREA")
    if missing:
        raise NeedsOptionError(
            f"{chosen.source.path} has {'; and '.join(missing)}", answers=answers
        )
    if length != "displacement" and specimen.gauge_length_mm is not None:
        values.warnings.append(f"the gauge length was not used: there is a column of {length}")
    if pull != "force" and specimen.area_mm2 is not None:
        values.warnings.append("the area was not used: there is a column of nominal stress")
    return length, pull


def _typed(value: float | None, unknown: str) -> str:
    return unknown if value is None else f"{value:g}"


def _hint(chosen: Chosen, *words: str) -> str:
    """Return what the lines above the table say of the specimen, for a message."""
    block: Sequence[Sequence[str]] = getattr(chosen.source, "block", ())
    said = [" ".join(row) for row in block if row and any(word in row[0].lower() for word in words)]
    return f"; the file says: {listing(said)}" if said else ""


def _no_column(
    chosen: Chosen, quantity: str, otherwise: str = "", option: str | tuple[str, ...] = ()
) -> InputError:
    """Return the error for a quantity that no column has."""
    return InputError(
        f"{chosen.source.path} has no column for {quantity} "
        f"({names_of(quantity)}{', ' if otherwise else ''}{otherwise}); there are: "
        f"{listing(chosen.source.names)}"
        f"{suggestion([quantity], chosen.source.names)}",
        option=option,
    )


@dataclass(frozen=True)
class _Take:
    """How values are taken, as in ``values_of``."""

    rate_Hz: float | None
    skips: bool
    gaps: frozenset[str]

    def may_miss(self, quantity: str, column: str, chosen: Chosen) -> bool:
        """Return whether readings of ``quantity`` in ``column`` may be missing."""
        return column in self.gaps or (self.skips and quantity not in chosen.optional)


def _read(
    chosen: Chosen, values: Values, driving: list[str], measured: list[str], take: _Take
) -> dict[str, np.ndarray]:
    """Return the checked values of the quantities that exist, in the recording's units.

    Those ``driving`` are needed in every row, of those ``measured`` a reading may be missing.
    """
    source = chosen.source
    path = source.path
    picked = {q: chosen.picked[q] for q in (*driving, *measured) if q in chosen.picked}
    columns = [pick.column for pick in picked.values()]
    step = _step(chosen, columns, take.rate_Hz)
    free = {q for q in measured if q in picked and take.may_miss(q, picked[q].column, chosen)}
    raw = _read_columns(chosen, picked, free, values)
    values.notes += getattr(source, "notes", ())
    values.warnings += getattr(source, "warnings", ())
    columns = [pick.column for pick in picked.values()]
    sizes = {column: raw[column].size for column in columns}
    size = min(sizes.values())
    if getattr(source, "cut_short", False):
        values.warnings.append(
            f"the file ends early: it was not closed, or not copied as a whole; its columns have "
            f"{size} to {max(sizes.values())} values, and the first {size} of each are imported"
        )
    elif len(set(sizes.values())) > 1:
        different = ", ".join(f"{column} {n}" for column, n in sizes.items())
        raise InputError(f"{path}: the columns have different lengths: {different}")
    table = {q: raw[pick.column][:size] for q, pick in picked.items()}
    if step is not None:
        if not step * size < float("inf"):
            raise InputError(f"{path}: {step!r} s from row to row is too long")
        table["time"] = step * np.arange(size)
        said = getattr(source, "step_from", "") if take.rate_Hz is None else ""
        values.notes.append(
            f"time is counted from the first row, {step:.9g} s from row to row"
            f"{said and f', as {said} says'}"
        )
    _leave_gaps(chosen, picked, table, free, values)
    names = (
        {q: pick.column for q, pick in picked.items()}
        | {"time": "time"}
        | {q: pick.column for q, pick in picked.items() if q == "time"}
    )
    good, missing = without_rows(chosen, table, picked, measured, values.warnings)
    if "time" in picked and _is_clock(source, picked["time"].column):
        table["time"], notes, warnings = one_clock(table["time"], source.row)
        values.notes += notes
        values.warnings += warnings
    good = _good_rows(chosen, table, names, take.skips, good, missing, free)
    table = without_readings(chosen, table, picked, good, missing, free, values.warnings)
    if "time" in picked:
        _check_epoch(chosen, picked["time"], table["time"])
        table["time"] = _counted_by_sixties(chosen, picked["time"], table["time"], values)
    # a column at a time: what it was read from is given back
    del raw
    found = {}
    for q in list(table):
        column = table.pop(q)
        found[q] = picked[q].scale.apply(column) if q in picked else column
    del column
    if found["time"].size < 2:
        raise InputError(f"{path} has {found['time'].size} row of data; at least 2 are needed")
    if "time" in picked:
        values.warnings += jumps(found["time"], _place(source, good))
    first = float(found["time"][0])
    values.start = start_of(source, picked["time"].column if "time" in picked else None, first)
    if abs(first) > LONG_AGO:
        found["time"] = found["time"] - first
        values.notes.append(f"time is counted from the first time stamp, {first:.3f} s")
    _note_left_out(chosen, values, good)
    return found


def _is_clock(source: Source, column: str) -> bool:
    """Return True for a column of dates and times of day."""
    return getattr(source, "labels", {}).get(column) == "time"


def _check_epoch(chosen: Chosen, pick: Pick, time: np.ndarray) -> None:
    """Raise ``NeedsOptionError`` if ``time`` (n,) is not in the unit of its name by its size.

    It counts days from 1900, or the time since 1970 in a shorter unit. (A clock that has run for an
    hour counts as many microseconds as there are seconds since 1970.)
    """
    named = pick.target.unit
    unit = "d" if named == "s" and counts_days(time) else epoch_unit(time)
    if pick.behind or not unit or (unit != "d" and not _is_longer(named, unit)):
        return
    since = "1900, as spreadsheets do" if unit == "d" else "1970"
    raise NeedsOptionError(
        f"{chosen.source.path}: {pick.column!r} is in {named}, but its values, {time[0]:.9g} to "
        f"{time[-1]:.9g}, seem to count {'days' if unit == 'd' else unit} from {since}",
        answers={"column": f"time_{unit}={pick.column}*1"},
    )


def _is_longer(one: str, other: str) -> bool:
    """Return True if the unit ``one`` of a time is longer than the ``other``."""
    first, second = UNITS["time"][one], UNITS["time"][other]
    return first.times * second.over > second.times * first.over


def _counted_by_sixties(chosen: Chosen, pick: Pick, time: np.ndarray, values: Values) -> np.ndarray:
    """Return ``time`` (n,) in the unit of ``pick``; 40.59 min may be 40 min and 59 s.

    Changes the notes. Raises ``NeedsOptionError`` where the column's unit is none of which sixty
    make the next. A scale that the user gave says that the numbers are plain.
    """
    if pick.behind or (counted := by_sixties(time)) is None:
        return time
    unit, part = pick.target.unit, {"min": "seconds", "h": "minutes"}.get(pick.target.unit)
    carried = int(np.flatnonzero(np.diff(np.round(100.0 * time) % 100.0) < 0.0)[0])
    seen = f"{time[carried + 1]:.2f} follows {time[carried]:.2f}"
    plain = shlex.quote(f"{pick.target.name}={pick.column}*1")
    if part is not None:
        values.notes.append(
            Note(
                f"{pick.column!r} is read as {'minutes' if unit == 'min' else 'hours'} and {part}: "
                f"{seen}, and its steps are even only so; {plain} reads plain numbers",
                option="column",
            )
        )
        return counted / 60.0
    step = float(np.median(np.diff(counted)))
    raise NeedsOptionError(
        f"{chosen.source.path}: {pick.column!r} is in {unit}, but its values seem to be minutes "
        f"and seconds: {seen}, and its steps are even only so; give the rate, or {plain} if they "
        f"are plain numbers",
        answers={"rate_Hz": f"{1.0 / step:.9g}"},
        option=["column"],
    )


def _read_columns(
    chosen: Chosen, picked: dict[str, Pick], free: Collection[str], values: Values
) -> dict[str, np.ndarray]:
    """Return the columns ``picked``, without optional ones that have gaps and are not ``free``.

    Changes ``picked`` and the notes.
    """
    source = chosen.source
    if hasattr(source, "measured"):
        source.measured = frozenset(picked[q].column for q in free)
    while True:
        optional = {picked[q].column: q for q in chosen.optional - set(free) if q in picked}
        if hasattr(source, "optional"):
            source.optional = frozenset(optional)
        try:
            return source.read([pick.column for pick in picked.values()])
        except GapError as error:
            _leave_out(chosen, picked, optional[error.column], str(error), values)


def _leave_gaps(
    chosen: Chosen,
    picked: dict[str, Pick],
    table: dict[str, np.ndarray],
    free: Collection[str],
    values: Values,
) -> None:
    """Leave out optional columns that have no number where all others have one.

    Those that are ``free`` may have gaps. Changes ``picked``, ``table`` and the notes.
    """
    optional = [q for q in chosen.optional if q in table and q not in free]
    if not optional:
        return
    good = np.ones(table["time"].size, dtype=bool)
    for quantity in table.keys() - {*optional, *free}:
        good &= np.isfinite(table[quantity])
    for quantity in optional:
        gaps = good & ~np.isfinite(table[quantity])
        if gaps.any():
            at = int(np.argmax(gaps))
            where = f"{chosen.source.row(at)}: there is no value"
            _leave_out(chosen, picked, quantity, where, values)
            del table[quantity]


def _leave_out(
    chosen: Chosen, picked: dict[str, Pick], quantity: str, where: str, values: Values
) -> None:
    pick = picked.pop(quantity)
    chosen.picked.pop(quantity, None)
    wanted = shlex.quote(f"{pick.target.name}={pick.column}")
    values.notes.append(
        Note(
            f"the {quantity.replace('_', ' ')} was not imported: {pick.column!r} has gaps "
            f"({where}); it is if {wanted} is asked for and such rows are left out",
            option=("column", "skip_bad_rows"),
        )
    )


def _step(chosen: Chosen, columns: Sequence[str], rate_Hz: float | None) -> float | None:
    """Return the time from row to row where no column has the time. Raises ``InputError``."""
    if rate_Hz is not None:
        if not 0.0 < rate_Hz < float("inf"):
            raise InputError(f"the rate is {rate_Hz!r} Hz; it must be a finite number above 0")
        if "time" in chosen.picked:
            raise InputError("both a rate and a column for time are given; give one of them")
        return 1.0 / rate_Hz
    if "time" in chosen.picked:
        return None
    given = getattr(chosen.source, "step_s", None)
    step = given(columns) if given is not None else None
    if step is None:
        raise NeedsOptionError(
            f"{chosen.source.path} has no column for time ({names_of('time')}); there are: "
            f"{listing(chosen.source.names)}{suggestion(['time_s'], chosen.source.names)}; give "
            f"the rate if the samples are evenly spaced",
            answers={"rate_Hz": "RATE"},
        )
    return float(step)


def _place(source: Source, good: np.ndarray) -> Callable[[int], str]:
    """Return a function for the place in the file of one of the ``good`` rows."""
    return lambda at: source.row(int(np.flatnonzero(good)[at]))


def _good_rows(
    chosen: Chosen, table: dict[str, np.ndarray], names: dict[str, str], skip: bool,
    good: np.ndarray, missing: Mapping[str, np.ndarray], free: Collection[str],
) -> np.ndarray:  # fmt: skip
    """Return which of the ``good`` rows are finite and go forward in time, (n,) bool.

    Readings that are ``missing``, or ``free`` to be, count as there. Raises ``InputError`` for the
    first other row unless ``skip``.
    """
    source, marked = chosen.source, ~good
    good = good.copy()
    finite = {}
    if not getattr(source, "is_finite", False):
        finite = {
            q: np.isfinite(column) | marked | missing.get(q, np.False_)
            for q, column in table.items()
            if q not in free
        }
    for column in finite.values():
        good &= column
    bad = ~good & ~marked
    if not skip and bad.any():
        at = int(np.argmax(bad))
        quantity = next(q for q in finite if not finite[q][at])
        cell = getattr(source, "cell", None)
        wrong = "" if cell is None else cell(at, names[quantity])
        raise skip_or_refuse(
            f"{source.path}, {source.row(at)}, column {names[quantity]!r}: "
            f"{wrong or f'{table[quantity][at]} is not a finite number'}",
            int(bad.sum()),
            good.size,
        )
    seconds = table["time"]
    if not skip:
        kept = seconds if good.all() else seconds[good]
        check_forward(kept, names["time"], _place(source, good), source.path)
        return good
    forward: np.ndarray = good & forward_rows(np.where(good, seconds, np.nan))
    return forward


def _note_left_out(chosen: Chosen, values: Values, good: np.ndarray) -> None:
    """Note which rows were left out, at the sample before which they stood."""
    skipped: Sequence[tuple[int, str]] = getattr(chosen.source, "skipped", ())
    if not skipped and good.all():
        return
    kept = np.cumsum(good)
    places = [(int(kept[min(at, good.size) - 1]) if at else 0, where) for at, where in skipped]
    bad = np.flatnonzero(~good)[:_LISTED].tolist()
    rows = getattr(chosen.source, "rows", None)
    found = rows(bad) if rows is not None and bad else [chosen.source.row(at) for at in bad]
    places += [(int(kept[at]), where) for at, where in zip(bad, found, strict=True)]
    for sample, where in places:
        values.left.setdefault(sample, []).append(where)
    count = len(skipped) + int((~good).sum())
    if count:
        were = "was left out because it" if count == 1 else "were left out because they"
        values.warnings.append(f"{counted(count, 'row')} {were} could not be used")


_LISTED = 100  # rows whose places are looked up
