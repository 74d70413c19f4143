"""Columns of a file that are called by their paths: the source of most binary formats."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import MappingProxyType

import numpy as np

from dearig.errors import InputError
from dearig.recording.files import one_line
from dearig.recording.importers.formats.columns import NamedColumns
from dearig.recording.importers.source import (
    PARSER_FAILURES,
    NeedsOptionError,
    listing,
    no_such_column,
)

__all__ = [
    "StoredColumn",
    "StoredColumns",
    "as_numbers",
    "is_thinned",
    "rate_step",
    "scale_of",
    "stated_scale",
]


@dataclass(frozen=True)
class StoredColumn:
    """A column (n,) of a file.

    Attributes
    ----------
    load : callable
        Returns its values: numbers, or dates and times of day.
    size : int, optional
        Number of values, where it is known before they are read.
    own : str
        Its name without its path; of a column of a matrix, with its number: ``x[2]``.
    unit, label : str
        What the file says of it next to its name.
    table : str
        The group, sheet or struct that it belongs to; columns of "" belong to all.
    step_s, start_s : float, optional
        Time from row to row, and of the first row.
    cell : callable, optional
        Returns what is wrong with the value at an index that is not a number, in words.
    row : callable, optional
        Returns the place in the file of the value at an index, in words.
    began : datetime, optional
        Date and time from which its values count.
    is_utc : bool
        True for dates that are of UTC, False for those of a clock on the wall.
    scaled : str
        A scale that the file states next to the values, and of which no convention says whether
        they contain it, such as ``gain = 2``.
    """

    load: Callable[[], np.ndarray]
    size: int | None
    own: str
    unit: str = ""
    label: str = ""
    table: str = ""
    step_s: float | None = None
    start_s: float = 0.0
    cell: Callable[[int], str] | None = None
    row: Callable[[int], str] | None = None
    began: datetime | None = None
    is_utc: bool = False
    scaled: str = ""


class StoredColumns(NamedColumns[StoredColumn]):
    """The ``columns`` of the file at ``path``, by their paths; see ``Source``.

    ``what`` the file should be ("an HDF5 file") is for messages. ``separator`` stands between the
    parts of a path. Columns of one value next to longer ones are settings of the measurement: the
    one that is called ``fs`` or ``dt`` gives the time from row to row. Raises ``InputError`` if
    there are no columns.
    """

    def __init__(
        self,
        path: Path,
        what: str,
        columns: Mapping[str, StoredColumn],
        *,
        separator: str = "/",
        about: Mapping[str, str] = MappingProxyType({}),
        notes: Sequence[str] = (),
        cut_short: bool = False,
        default_table: str | None = None,
    ) -> None:
        self.path, self.about, self.notes = path, about, notes
        self.cut_short, self.default_table = cut_short, default_table
        self._what, self._separator = what, separator
        single = {name for name, column in columns.items() if column.size == 1}
        if len(single) == len(columns):
            single = set()
        super().__init__({n: c for n, c in columns.items() if n not in single})
        self._settings = {n: columns[n] for n in single}
        self.step_from = ""
        self._began: dict[str, datetime] = {}  # of columns of dates that were read
        self._row: Callable[[int], str] | None = None
        if not self._columns:
            raise InputError(f"{path} holds no columns of numbers")

    @property
    def labels(self) -> dict[str, str]:
        """Longer names by column, where the file gives them."""
        return {name: column.label for name, column in self._columns.items() if column.label}

    @property
    def scales(self) -> dict[str, str]:
        """Scales that the file states next to the values, by column: with them, or as a setting."""
        found = {name: column.scaled for name, column in self._columns.items() if column.scaled}
        for setting, one in self._settings.items():
            value = self.read_setting(setting)
            for name, column in self._columns.items() if value not in (None, 1.0) else ():
                if scale_of(one.own, column.own):
                    found.setdefault(name, f"{setting} = {value:g}")
        return found

    @property
    def tables(self) -> dict[str, list[str]]:
        """Columns by their tables; each has those of no table too."""
        found: dict[str, list[str]] = {}
        for name, column in self._columns.items():
            if column.table:
                found.setdefault(column.table, []).append(name)
        shared = [name for name, column in self._columns.items() if not column.table]
        return {table: [*shared, *names] for table, names in found.items()}

    def own_name(self, name: str) -> str:
        """Return ``name`` without its path, and without its number in a matrix."""
        return re.sub(r"\[\d+\]$", "", self._columns[name].own)

    def named(self, name: str) -> list[str]:
        """Return the columns whose path is ``name`` or ends with it."""
        end = self._separator + name
        return [
            n for n, column in self._columns.items() if name in (n, column.own) or n.endswith(end)
        ]

    def size(self, name: str) -> int | None:
        """Return the number of values of a column; None if it is not known yet."""
        return self._columns[name].size

    def step_s(self, names: Sequence[str]) -> float | None:
        """Return the time from row to row of the columns ``names``; None if nothing gives it.

        Raises ``InputError`` for columns of several rates or starts.
        """
        timed = {n: c for n in names if (c := self._columns[n]).step_s is not None}
        for column in timed.values():
            first = next(iter(timed.values()))
            if not _same_timing(first, column):
                different = ", ".join(
                    f"{n} every {c.step_s:.6g} s from {c.start_s:.6g} s" for n, c in timed.items()
                )
                raise InputError(
                    f"{self.path}: the columns have different times: {different}; they are not "
                    f"resampled here: give columns of one rate",
                    option="column",
                )
        if timed:
            return next(iter(timed.values())).step_s
        steps: dict[str, float] = {}
        thinned: list[str] = []
        for name, one in self._settings.items():
            if (value := self.read_setting(name)) is None:
                continue
            if (step := rate_step(one.own, value)) is not None:
                steps[name] = step
            elif is_thinned(one.own, value):
                thinned.append(f"{name!r} is {value:g}")
        if not steps:
            return None
        step = next(iter(steps.values()))
        self.step_from = repr(next(iter(steps)))
        if thinned or not np.allclose([*steps.values()], step, rtol=1e-6, atol=0.0):
            said = [f"{name!r} gives {one:.6g} s from row to row" for name, one in steps.items()]
            raise NeedsOptionError(
                f"{self.path}: {listing([*said, *thinned])}: give the rate of the rows",
                answers={"rate_Hz": "RATE"},
            )
        return step

    def read_setting(self, name: str) -> float | None:
        """Return the number of the column of one value ``name``; None if it cannot be read."""
        try:
            return float(as_numbers(self._settings[name].load())[0])
        except (*PARSER_FAILURES, InputError):
            return None

    def row(self, index: int) -> str:
        """Return the row of sample ``index``, counted from 1."""
        return f"row {index + 1}" if self._row is None else self._row(index)

    def cell(self, index: int, name: str) -> str:
        """Return what is wrong with a value, in words; empty if only its value is known."""
        cell = self._columns[name].cell if name in self._columns else None
        return "" if cell is None else cell(index)

    def began(self, name: str) -> datetime | None:
        """Return the date and time from which the column ``name`` counts, once it is read."""
        return self._began.get(name, self._columns[name].began)

    def check(self, name: str) -> None:
        """See ``Source``."""
        if name in self._columns:
            return
        inside = [n for n in self._columns if re.match(re.escape(name) + r"[./\[({]", n)]
        if inside:
            raise InputError(
                f"{self.path}: {name!r} holds several columns; give one of them: {listing(inside)}"
            )
        raise no_such_column(self, name)

    def read(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return columns by name; see ``Source``."""
        found = {}
        for number, name in enumerate(names, 1):
            column = self._columns[name]
            try:
                values = column.load()
                found[name] = as_numbers(values)
                if values.dtype.kind == "M" and (first := values[~np.isnat(values)]).size:
                    self._began[name] = _moment(first[0], column.is_utc)
            except PARSER_FAILURES as error:
                raise InputError(
                    f"{self.path} cannot be read as {self._what}: {name}: {one_line(error)}"
                ) from error
            self._row = column.row
            self.progress(number / len(names))
        return found


#: Part of a step by which the starts of columns that were sampled together may differ.
START_APART = 0.01


def _same_timing(one: StoredColumn, other: StoredColumn) -> bool:
    step, second = one.step_s or 0.0, other.step_s or 0.0
    return bool(
        np.isclose(step, second, rtol=1e-9, atol=0.0)
        and abs(one.start_s - other.start_s) <= START_APART * step
    )


def _moment(value: np.datetime64, is_utc: bool) -> datetime:
    seconds = (value - np.datetime64(0, "s")) / np.timedelta64(1, "s")
    return datetime(1970, 1, 1, tzinfo=UTC if is_utc else None) + timedelta(seconds=seconds)


def as_numbers(values: np.ndarray) -> np.ndarray:
    """Return ``values`` (n,) as float64; of dates and durations, in s, dates from the first.

    What is not a time becomes not a number.
    """
    if values.dtype.kind == "M":
        there = values[~np.isnat(values)]
        values = values - there[0] if there.size else values - values
    if values.dtype.kind == "m":
        seconds = values / np.timedelta64(1, "s")
        return np.asarray(seconds, dtype=np.float64)
    return np.asarray(values, dtype=np.float64)


#: Names of one number that is a sample rate, and of one that is the time from row to row. A mere
#: "frequency" or "rate" may be that of the excitation or of the strain.
_RATES = re.compile(
    r"(f_?s|f_?sample|(sample|sampling|samp|acquisition|scan|daq)_?(rate|frequency|freq)"
    r"|abtastrate|abtastfrequenz)(_?(?P<unit>hz|khz|sps))?|rate_hz"
)
_STEPS = re.compile(
    r"(dt|ts|d_t|delta_?(t|x|time)|x?_?increment|wf_increment|time_?step"
    r"|(sample|sampling)_?(time|interval|period)|abtastzeit)(_?(?P<unit>s|ms|us))?"
)
#: Shortest and longest time in s from row to row that a setting may give.
STEP_MIN, STEP_MAX = 1e-12, 1e6
_PER_UNIT = MappingProxyType({"khz": 1e3, "ms": 1e-3, "us": 1e-6})


#: Settings by which fewer rows are stored than were sampled.
_THINNED = re.compile(r"(decimat|down_?sampl|subsampl|thin|stride|reduction)", re.I)
#: Names of what values are multiplied by, and of what is added to them; the first of whole numbers
#: only, since it may be said of other values too.
_OF_INTEGERS = frozenset({"calibration", "lsb", "resolution"})
_GAINS = frozenset(
    {"gain", "scale", "scaling", "slope", "factor", "multiplier", "conversion"}
    | {"scale_factor", "scaling_factor", "conversion_factor"}
)
_OFFSETS = frozenset({"offset", "intercept", "add_offset", "y_intercept"})
#: A setting that is the scale of the column whose name begins as it does: ``voltage_scale``.
_GAIN_OF = re.compile(rf"(?P<of>[^\W_]\w*?)_?(?:{'|'.join(sorted(_GAINS, reverse=True))})")


def is_thinned(name: str, value: float) -> bool:
    """Return True if the setting ``name`` says that fewer rows are stored than were sampled."""
    return _THINNED.match(name) is not None and value not in (0.0, 1.0)


def scale_of(setting: str, column: str) -> bool:
    """Return True if ``setting`` is called as the scale of ``column``, such as voltage_scale."""
    match = _GAIN_OF.fullmatch(setting.lower())
    return match is not None and column.lower().startswith(match["of"])


def stated_scale(stated: Mapping[str, object], integers: bool = False) -> str:
    """Return the first scale or offset that stands next to a column, such as "gain = 2", or "".

    ``stated`` is what the file says of the column by name; the column has ``integers`` or others.
    """
    for name, value in stated.items():
        plain = re.sub(r"[\s-]+", "_", name.strip().lower())
        plain = plain if plain in _GAINS | _OFFSETS else plain.removesuffix("s")
        neutral = 0.0 if plain in _OFFSETS else 1.0
        if plain not in _GAINS | _OFFSETS and not (integers and plain in _OF_INTEGERS):
            continue
        try:
            numbers = np.ravel(np.asarray(value)).astype(np.float64)
        except (TypeError, ValueError):  # a text, such as a date
            continue
        if numbers.size and not (numbers == neutral).all():
            return f"{name} = {', '.join(f'{number:g}' for number in numbers[:4])}"
    return ""


def rate_step(name: str, value: float) -> float | None:
    """Return the time in s from row to row that a setting called ``name`` gives, or None."""
    plain = re.sub(r"[\s\-.()\[\]]+", "_", name.strip().lower()).strip("_")
    if not 0.0 < value < float("inf"):
        return None
    if match := _RATES.fullmatch(plain):
        step = 1.0 / (value * _PER_UNIT.get(match["unit"] or "", 1.0))
    elif match := _STEPS.fullmatch(plain):
        step = value * _PER_UNIT.get(match["unit"] or "", 1.0)
    else:
        return None
    return step if STEP_MIN <= step <= STEP_MAX else None
