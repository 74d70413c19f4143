"""Start of a measurement, where the file tells it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from dearig.recording.importers.source import Source

__all__ = ["MeasurementStart", "start_of"]

#: Epochs from which programs count seconds, and days (as spreadsheets do, on the wall's clock).
_UNIX = datetime(1970, 1, 1, tzinfo=UTC)
_LABVIEW = datetime(1904, 1, 1, tzinfo=UTC)
_SPREADSHEET = datetime(1899, 12, 30)
#: s: a count of the time since an epoch, not since the start of a run, is of this year or later.
_EARLIEST = datetime(2000, 1, 1, tzinfo=UTC).timestamp()
_DAY = 86_400.0  # s


@dataclass(frozen=True)
class MeasurementStart:
    """Start of a measurement in s since 1970, and what tells it, as "the column 'Date'"."""

    at: float
    stated_by: str


def start_of(source: Source, column: str | None, first: float) -> MeasurementStart | None:
    """Return the start of the measurement, or None where ``source`` does not tell it.

    ``column`` has the time, None where no column has it; ``first`` is its first value in s. A date
    and time of day without a zone is that of this computer's.
    """
    began = None
    if column is not None and hasattr(source, "began"):
        began = source.began(column)
    if column is not None and began is None:
        began, first = _epoch_of(first), (0.0 if _epoch_of(first) else first)
    if began is not None:
        return _start(began, first, f"the column {column!r}")
    stated = getattr(source, "started", None)
    return None if stated is None else _start(stated, 0.0, "the file's waveforms")


def _epoch_of(first: float) -> datetime | None:
    """Return the moment of a number of seconds since an epoch; None for another number."""
    now = time.time()
    for epoch in (_UNIX, _LABVIEW, _SPREADSHEET.astimezone()):
        if _EARLIEST <= epoch.timestamp() + first <= now:
            whole = _SPREADSHEET if epoch.date() == _SPREADSHEET.date() else epoch
            return whole + timedelta(seconds=first)
    return None


def _start(began: datetime, seconds: float, stated_by: str) -> MeasurementStart | None:
    try:
        return MeasurementStart((began + timedelta(seconds=seconds)).timestamp(), stated_by)
    except (OverflowError, OSError, ValueError):  # a year that this system cannot convert
        return None
