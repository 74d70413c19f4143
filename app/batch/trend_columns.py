"""Columns of a study's table by which its numbers may change, and which of them can be told apart.

The columns are temperature, humidity, cycles and days of the film, the settings of a campaign and
the rig. Cycles and days are counted for each film from its first run in the table.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np

from dearig.errors import InputError
from dearig.input_file import parse_json
from dearig.recording.content.fields import CONDITIONS

__all__ = [
    "FREEDOM_MIN",
    "Covariate",
    "Design",
    "columns_in",
    "days_of_films",
    "design_of",
    "films_in",
]

_CYCLES = "cycles"
_SECONDS_A_DAY = 86400.0
#: Degrees of freedom, at least: with one, an interval is 12.7 standard errors wide on either side,
#: and its own error is not bounded.
FREEDOM_MIN = 2
_RIGS_MAX = 8  # each is a row of every number in the table, which is to be read
#: Part of a column's variance that the columns before it explain, above which it is left out: its
#: interval would be ten times as wide as on its own.
_CONFOUNDED = 0.99
#: Correlation of two columns above which an experiment should separate them: there the interval of
#: each is 1/sqrt(1 - 0.8^2) = 1.7 times as wide as without the other one.
_ENTANGLED = 0.8

#: Units of the cycles before a run.
_CYCLE_UNITS = (1000, 100, 10, 1)
#: Units of the time since a film's first run: label, unit, and how many are a day.
_TIMES = (("days", "day", 1.0), ("hours", "h", 24.0), ("minutes", "min", 1440.0))


@dataclass(frozen=True)
class Covariate:
    """A column that may change the numbers: ``values`` (n,) of all rows, NaN where not known.

    Slopes are given per ``unit``. A range smaller than ``least_range`` counts as not varied.
    """

    label: str
    unit: str
    values: np.ndarray
    least_range: float = 0.0

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest value."""
        return float(np.nanmin(self.values)), float(np.nanmax(self.values))


@dataclass(frozen=True)
class Design:
    """Columns whose effects are estimated together, and sentences on those that are not.

    ``entangled`` are pairs of columns with their correlation, where it is large. ``missing`` and
    ``constant`` are labels of columns that are left out because too few runs have a value, and
    because all runs have the same value.
    """

    columns: tuple[Covariate, ...]
    left_out: tuple[str, ...]
    entangled: tuple[tuple[str, str, float], ...]
    missing: tuple[str, ...]
    constant: tuple[str, ...]


def films_in(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the name of the film of each row, "" where it has none."""
    return [str(row.get("film") or "") for row in rows]


def columns_in(
    rows: Sequence[Mapping[str, Any]], films: Sequence[str], against: Sequence[str] = ()
) -> list[Covariate]:
    """Return the columns of ``rows`` by which their numbers may change, in order of interest.

    ``against`` names columns of the table to use in place of all these. Raises ``InputError`` for
    one that is not there or has no numbers.
    """
    if against:
        return [_named(rows, name) for name in against]
    found = [
        Covariate(c.short or c.label, c.slope_unit or c.unit, _numbers(rows, name), c.tight)
        for name, c in CONDITIONS.items()
        if any(row.get(name) is not None for row in rows)
    ]
    days = days_of_films(rows, films)
    order = np.argsort(np.where(np.isfinite(days), days, np.inf), kind="stable")
    if any(row.get(_CYCLES) is not None for row in rows):
        found.append(_cycles_column(_cycles_before(rows, films, order)))
    if np.isfinite(days).any():
        found.append(_time_column(days))
    settings = [n for n in dict.fromkeys(n for row in rows for n in row) if n.startswith("set ")]
    for name in settings:
        found += _setting_columns(name.removeprefix("set "), [row.get(name) for row in rows])
    return found + _rigs(rows, films)


def _setting_columns(label: str, values: Sequence[Any]) -> list[Covariate]:
    """Return the columns of a setting: one, or one for each place of a list of numbers.

    The places are numbered from 0, as in a plan: ``segment.0.amplitudes_kV.0``.
    """
    each = [_listed(value) for value in values]
    places = max((len(value) for value in each), default=0)
    names = [label]
    if any(isinstance(_plain(value), list) for value in values):
        names = [f"{label}.{place}" for place in range(places)]
    columns = [
        np.array([value[place] if place < len(value) else math.nan for value in each])
        for place in range(places)
    ]
    return [
        Covariate(name, "", column)
        for name, column in zip(names, columns, strict=False)
        if np.isfinite(column).any()
    ]


def _plain(value: object) -> object:
    """Return a list that a table (CSV) holds as text; any other value as it is."""
    if isinstance(value, str) and value.startswith("["):
        try:
            return parse_json(value)
        except ValueError:
            return value
    return value


def _listed(value: object) -> list[float]:
    """Return the numbers in a setting, NaN for what is none."""
    plain = _plain(value)
    parts = plain if isinstance(plain, list | tuple) else [plain]
    return [
        float(v) if isinstance(v, int | float) and math.isfinite(v) else math.nan for v in parts
    ]


def _cycles_column(cycles: np.ndarray) -> Covariate:
    """Return the column of the cycles, in the largest unit that the runs span.

    A slope per 1000 cycles of runs within 40 would be an extrapolation far beyond them.
    """
    span = float(np.ptp(cycles))
    unit = next((u for u in _CYCLE_UNITS if span >= u), _CYCLE_UNITS[-1])
    name = f"{unit} cycles" if unit > 1 else "cycle"
    return Covariate("cycles", name, cycles / unit)


def _time_column(days: np.ndarray) -> Covariate:
    """Return the column of the time, in the largest unit that the runs span.

    A slope per day of runs within minutes would be an extrapolation far beyond them.
    """
    span = float(np.nanmax(days) - np.nanmin(days))
    unit = next((u for u in _TIMES if span * u[2] >= 1.0), _TIMES[-1])
    return Covariate(unit[0], unit[1], days * unit[2])


def _named(rows: Sequence[Mapping[str, Any]], name: str) -> Covariate:
    values = _numbers(rows, name)
    if not np.isfinite(values).any():
        known = sorted({n for row in rows for n in row})
        raise InputError(
            f"column {name!r} is not in the table, or has no numbers; its columns are "
            f"{', '.join(known[:40])}"
        )
    return Covariate(name, "", values)


def _numbers(rows: Sequence[Mapping[str, Any]], name: str) -> np.ndarray:
    """Return the numbers of a column (n,), NaN where there is none."""
    values = [row.get(name) for row in rows]
    return np.array(
        [float(v) if isinstance(v, int | float) and math.isfinite(v) else np.nan for v in values]
    )


def days_of_films(rows: Sequence[Mapping[str, Any]], films: Sequence[str]) -> np.ndarray:
    """Return the days (n,) of each run since the first run of its film."""
    starts = np.array([_seconds(row.get("started")) for row in rows])
    first: dict[str, float] = {}
    for film, start in zip(films, starts, strict=True):
        if math.isfinite(start):
            first[film] = min(start, first.get(film, start))
    since = np.array([first.get(film, np.nan) for film in films])
    return np.asarray((starts - since) / _SECONDS_A_DAY)


def _seconds(started: object) -> float:
    try:
        return datetime.fromisoformat(str(started)).timestamp()
    except (ValueError, OverflowError, OSError):
        return math.nan


def _cycles_before(
    rows: Sequence[Mapping[str, Any]], films: Sequence[str], order: np.ndarray
) -> np.ndarray:
    """Return the cycles (n,) that the film of each run had done before it, in this table."""
    own = np.nan_to_num(_numbers(rows, _CYCLES))
    before, count = np.zeros(len(rows)), dict.fromkeys(films, 0.0)
    for i in order:
        before[i] = count[films[i]]
        count[films[i]] += own[i]
    return before


def _rigs(rows: Sequence[Mapping[str, Any]], films: Sequence[str]) -> list[Covariate]:
    """Return a column of zeros and ones for each rig but the first.

    There are none where each film was on one rig, and the films are too few to tell them from rigs.
    """
    names = [str(row.get("rig") or "") for row in rows]
    rigs, each = sorted(set(names)), set(films)
    is_of_films = len(set(zip(films, names, strict=True))) == len(each)
    if not 1 < len(rigs) <= _RIGS_MAX or (is_of_films and len(each) - len(rigs) < FREEDOM_MIN):
        return []
    return [
        Covariate(
            f"rig {rig} in place of {rigs[0]}", "", np.array([n == rig for n in names], float)
        )
        for rig in rigs[1:]
    ]


def design_of(columns: Sequence[Covariate], used: np.ndarray) -> Design:
    """Return the columns that can be estimated together on the rows ``used`` (n,) bool.

    A column that is constant, or that follows from those before it, is left out.
    """
    kept: list[Covariate] = []
    left_out: list[str] = []
    missing: list[str] = []
    constant: list[str] = []
    basis = [np.ones(int(used.sum()))]
    for column in columns:
        values = column.values[used]
        if np.isfinite(values).sum() < 0.5 * values.size:
            missing.append(column.label)
            left_out.append(f"{column.label}: fewer than half of the runs have a value.")
            continue
        filled = np.where(np.isfinite(values), values, np.nanmean(values))
        spread = float(np.std(filled))
        if spread <= 1e-9 * max(float(np.max(np.abs(filled))), 1e-300):
            constant.append(column.label)
            left_out.append(f"{column.label}: the same in all runs, so that it shows no effect.")
            continue
        standard = (filled - filled.mean()) / spread
        matrix = np.column_stack(basis)
        solution, *_ = np.linalg.lstsq(matrix, standard, rcond=1e-9)
        explained = 1.0 - float(np.mean((standard - matrix @ solution) ** 2))
        if explained > _CONFOUNDED:
            others = [
                c.label
                for c, b in zip(kept, basis[1:], strict=True)
                if abs(float(np.mean(b * standard))) > _ENTANGLED
            ] or [c.label for c in kept]
            left_out.append(
                f"{column.label}: it follows from {' and '.join(others)}, so that their effects "
                f"cannot be distinguished."
            )
            continue
        kept.append(column)
        basis.append(standard)
    entangled = [
        (a.label, b.label, float(np.mean(x * y)))
        for i, (a, x) in enumerate(zip(kept, basis[1:], strict=True))
        for b, y in list(zip(kept, basis[1:], strict=True))[i + 1 :]
        if abs(float(np.mean(x * y))) > _ENTANGLED
    ]
    return Design(tuple(kept), tuple(left_out), tuple(entangled), tuple(missing), tuple(constant))
