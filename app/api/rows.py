"""Rows of results: found by position or name, shown as a table, taken by pandas."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar, overload

from dearig.analysis.outcomes import constraint_table
from dearig.api.display import table_html
from dearig.extras import import_extra
from dearig.report.text.numbers import NO_VALUE, interval_ends, quoted, significant
from dearig.report.text.tables import Row, Table
from dearig.units import SHOWN

if TYPE_CHECKING:
    from pandas import DataFrame

    from dearig.analysis.outcomes import Comparison
    from dearig.model.fitting import Estimate

__all__ = ["Parameter", "RecordingErrors", "Rows", "errors_of", "parameters_of"]


class _Named(Protocol):
    @property
    def name(self) -> str: ...


T = TypeVar("T", bound=_Named)


@dataclass(frozen=True)
class Parameter:
    """One parameter of a fitted model, in the SI ``unit``, with its 95 % interval.

    ``low95`` and ``high95`` are 0 or infinite where the data leave an end open. A parameter that is
    not ``determined`` could have other values with the same error. ``effect`` is the effect that it
    belongs to, "" for the springs. ``stated`` is what was stated of it before the fit (fixed, low,
    high, mean, sd) in the same unit, None where nothing was; both ends of a fixed one are its
    value.
    """

    name: str
    value: float
    unit: str
    low95: float
    high95: float
    determined: bool
    effect: str = ""
    stated: dict[str, float] | None = None


@dataclass(frozen=True)
class RecordingErrors:
    """Errors of a model on one recording: measured less model.

    ``role`` is train or validation. ``rms``, ``max`` and ``noise_floor`` (None if unknown) are in
    ``unit``, um or kPa; ``nrmse_pct`` is the RMS in per cent of the measured range.
    """

    name: str
    role: str
    rms: float
    max: float
    noise_floor: float | None
    unit: str
    nrmse_pct: float


class Rows(Sequence[T], Generic[T]):
    """Rows of a result: ``rows[0]``, ``rows["mu_0"]``, ``pandas.DataFrame(rows)``."""

    def __init__(self, rows: Iterable[T]) -> None:
        self._rows = tuple(rows)

    @overload
    def __getitem__(self, key: int | str) -> T: ...
    @overload
    def __getitem__(self, key: slice) -> Rows[T]: ...
    def __getitem__(self, key: int | str | slice) -> T | Rows[T]:
        """Return the row at an index or of a name, or several rows of a slice."""
        if isinstance(key, slice):
            return Rows(self._rows[key])
        if isinstance(key, int):
            return self._rows[key]
        found = next((row for row in self._rows if row.name == key), None)
        if found is None:
            raise KeyError(f"{key!r} is not one of {', '.join(row.name for row in self._rows)}")
        return found

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self._rows)

    def __iter__(self) -> Iterator[T]:
        """Iterate over the rows."""
        return iter(self._rows)

    def __repr__(self) -> str:
        """Return the rows, one a line."""
        return "\n".join(repr(row) for row in self._rows) or "no rows"

    def to_pandas(self) -> DataFrame:
        """Return the rows as a data frame.

        Returns
        -------
        pandas.DataFrame
            A row for each name, which is the index.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        lib = import_extra("pandas", "notebook", "to_pandas")
        frame: DataFrame = lib.DataFrame([vars(row) for row in self._rows])
        return frame.set_index("name") if self._rows else frame

    def _repr_html_(self) -> str:
        if not self._rows:
            return "<p>no rows</p>"
        names = [field.name for field in fields(self._rows[0])]  # type: ignore[arg-type]
        names = [n for n in names if any(getattr(row, n) not in ("", None) for row in self._rows)]
        head = tuple((name.replace("_", " "), "") for name in names)
        lines = tuple(Row(tuple(_shown(row, name) for name in names)) for row in self._rows)
        return table_html(Table("", head, lines))


def _shown(row: object, name: str) -> str:
    value = getattr(row, name)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(row, Parameter) and name in ("value", "low95", "high95"):
        low, high = interval_ends(row.low95, row.high95)
        ends = {"low95": low, "high95": high}
        return ends.get(name) or quoted(row.value, row.low95, row.high95)
    if isinstance(value, float):
        return significant(value, 4)
    return NO_VALUE if value is None else str(value)


def parameters_of(estimates: Sequence[Estimate], effect: str = "") -> list[Parameter]:
    """Return estimates as parameters.

    Parameters
    ----------
    estimates : sequence of Estimate
        Estimates of a fit, in SI units.
    effect : str
        Effect that they belong to; empty for the springs.

    Returns
    -------
    list of Parameter
        One parameter for each estimate.
    """
    return [
        Parameter(
            e.name,
            e.value,
            e.unit,
            e.low,
            e.high,
            bool(e.determined),
            effect,
            constraint_table(e.constraint),
        )
        for e in estimates
    ]


def errors_of(comparisons: Iterable[Comparison]) -> Rows[RecordingErrors]:
    """Return the errors of each comparison.

    Parameters
    ----------
    comparisons : iterable of Comparison
        Measurement and model of each recording.

    Returns
    -------
    Rows of RecordingErrors
        Errors in um for actuators and in kPa for films.
    """
    rows = []
    for c in comparisons:
        shown = SHOWN[c.kind]
        factor = shown.error_factor
        rows.append(
            RecordingErrors(
                c.name,
                c.role,
                c.errors.rms * factor,
                c.errors.max * factor,
                None if c.noise is None else c.noise * factor,
                shown.suffix,
                c.errors.nrmse_pct,
            )
        )
    return Rows(rows)
