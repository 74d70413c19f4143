"""Dates and times of day as people write them, and the order of day and month in a column."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable
from datetime import date, datetime, timedelta

from dearig.errors import InputError
from dearig.recording.importers.quantities.text_numbers import is_number

__all__ = [
    "MIDNIGHT",
    "OpenDatesError",
    "day_first_of",
    "day_first_or_open",
    "first_moment",
    "is_date",
    "is_open_date",
    "moment_of",
]

#: A time of day, or a time since the start, which may have many hours or none.
_CLOCK = re.compile(r"(?:(\d{1,5}):)?([0-5]?\d):([0-5]\d(?:\.\d+)?)")
#: The same with thousandths behind a colon, which some loggers write.
_THOUSANDTHS = re.compile(r"(\d{1,5}:[0-5]?\d:[0-5]\d):(\d{3})")
#: A duration of ISO 8601, as pandas writes it into JSON.
_ISO_DURATION = re.compile(
    r"P(?P<days>\d{1,6})DT(?P<hour>\d{1,2})H(?P<minute>\d{1,2})M(?P<second>\d{1,2}(?:\.\d+)?)S"
)
_HALF_DAY = re.compile(r"(\d{1,2}):(\d{2}):(\d{2})(?:\.(\d+))? ?([AaPp])\.?[Mm]\.?")
#: Days and a time of day as pandas writes a duration; a negative one has negative days.
_DURATION = re.compile(
    r"(?P<days>-?\d{1,6}) days?,? [+]?(?P<hour>\d{1,2}):(?P<minute>\d{2}):"
    r"(?P<second>\d{2}(?:\.\d+)?)"
)
MIDNIGHT = datetime(1900, 1, 1)  # of times without a date, as strptime has it
#: Three parts of a date, then a time of day; the last part of the second may follow a colon.
_DATED = re.compile(
    r"(?P<a>\d{1,4}|[^\W\d_]{3,9})\.?(?P<sign>[/.\- ]) ?(?P<b>\d{1,2}|[^\W\d_]{3,9})\.?,?"
    r"(?P=sign) ?(?P<c>\d{4}|\d{1,2})[ T]+"
    r"(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2})(?:[.:](?P<part>\d{1,9}))?)?"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?"
)
#: Months by the first letters of their names in English, German and French.
_MONTHS = tuple(
    names.split()
    for names in (
        "jan", "feb fév fev", "mar mär mrz", "apr avr", "may mai", "jun juin", "jul juil",
        "aug aoû aou", "sep", "oct okt", "nov", "dec dez déc",
    )
)  # fmt: skip
_CENTURY = 2000  # of a year with two digits


class OpenDatesError(InputError):
    """Nothing says whether the dates of a column have the day or the month first."""


def moment_of(cell: str, day_first: bool | None = None) -> datetime | None:
    """Return the date and time of day in ``cell``; None if it is something else.

    ``day_first`` is the order in a date such as 03/04/2024. Without it the date is any that is
    possible, with the day first, but the month where the time has AM or PM.
    """
    if cell[:1] == "P" and (match := _ISO_DURATION.fullmatch(cell)):
        return _after(match)
    if ":" not in cell or not (cell[:1].isalnum() or cell[:1] == "-"):
        return None
    text = _THOUSANDTHS.sub(r"\1.\2", cell.replace(",", "."))
    if match := _CLOCK.fullmatch(text):
        hours, minutes, seconds = match.groups()
        if hours is None and "." not in seconds:
            return None  # it may be hours and minutes
        return MIDNIGHT + timedelta(
            hours=int(hours or 0), minutes=int(minutes), seconds=float(seconds)
        )
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        pass
    if match := _DURATION.fullmatch(text):
        return _after(match)
    if match := _HALF_DAY.fullmatch(text):
        hour, minute, second, part, half = match.groups()
        return _at(MIDNIGHT.date(), hour, minute, second, part, half)
    if (match := _DATED.fullmatch(cell) or _DATED.fullmatch(text)) is None:
        return None
    orders = (day_first,) if day_first is not None else (match["half"] is None, bool(match["half"]))
    for order in orders:
        day = _day(match["a"], match["sign"], match["b"], match["c"], order)
        if day is not None:
            return _at(day, *match.group("hour", "minute", "second", "part", "half"))
    return None


def _after(match: re.Match[str]) -> datetime:
    """Return the moment after midnight that the parts of a duration give."""
    return MIDNIGHT + timedelta(
        days=int(match["days"]), hours=int(match["hour"]), minutes=int(match["minute"]),
        seconds=float(match["second"]),
    )  # fmt: skip


def first_moment(since: datetime | None, is_open: bool) -> datetime | None:
    """Return ``since`` if it is a date and time of day that can be meant in one way only.

    ``is_open``: its form does not say whether day or month comes first.
    """
    if since is None or since.date() == MIDNIGHT.date():
        return None
    twofold = is_open and since.day <= 12 and since.day != since.month
    return None if twofold else since


def is_date(cell: str) -> bool:
    """Return True if ``cell`` is a date without a time of day."""
    if ":" in cell or is_number(cell) or not cell[:1].isalnum():
        return False
    return moment_of(f"{cell} {_NOON}") is not None


_NOON = "12:00:00"


def is_open_date(cell: str) -> bool:
    """Return True if the order of day and month in ``cell`` is not known from its form."""
    return _open_parts(cell) is not None


def day_first_of(cells: Iterable[str]) -> bool:
    """Return whether the dates in the ``cells`` of a column have the day first.

    The order is the one in which every date exists and time does not go back. Where both are
    possible, it is the one in which each date is the day after the one before; for a single date it
    does not matter, since time is counted from the first row. Raises ``OpenDatesError`` otherwise.
    """
    parts = (found for cell in cells if (found := _open_parts(cell)) is not None)
    dates = [one for one, _ in itertools.groupby(parts)]
    days = {order: [_day(a, "/", b, c, order) for a, b, c in dates] for order in (True, False)}
    possible = {
        order: [day.toordinal() for day in found if day is not None]
        for order, found in days.items()
        if None not in found
    }
    rising = {
        order: found
        for order, found in possible.items()
        if all(a < b for a, b in itertools.pairwise(found))
    }
    left = rising or possible or {True: []}
    if len(left) > 1 and len(dates) > 1:
        left = {
            order: found
            for order, found in left.items()
            if all(b - a == 1 for a, b in itertools.pairwise(found))
        } or left
    if len(left) > 1 and len(dates) > 1:
        shown = "/".join(dates[0])
        raise OpenDatesError(
            f"the dates, such as {shown}, may have the day or the month first, and time goes "
            f"forward either way; write them as {days[True][0]} or {days[False][0]}"
        )
    return next(iter(left))


def day_first_or_open(cells: Iterable[str]) -> bool:
    """Return what ``day_first_of`` does, or True where it does not know."""
    try:
        return day_first_of(cells)
    except OpenDatesError:
        return True


def _open_parts(cell: str) -> tuple[str, str, str] | None:
    """Return day and month in the order of ``cell``, and the year; None if the order is known."""
    match = _DATED.fullmatch(cell)
    if match is None or match["sign"] not in "/-":
        return None
    a, b, year = match.group("a", "b", "c")
    return (a, b, year) if len(a) < 3 and len(b) < 3 else None


def _day(a: str, sign: str, b: str, c: str, day_first: bool) -> date | None:
    """Return the day of three parts with ``sign`` between them; None if there is none."""
    if len(a) == 4 and a.isdigit():
        year, month, day = a, b, c
    elif a.isdigit() and (sign == "." or day_first or not b.isdigit()):
        day, month, year = a, b, c
    else:
        month, day, year = a, b, c
    number = int(month) if month.isdigit() else _month(month)
    if not day.isdigit() or len(year) == 3:
        return None
    try:
        return date(int(year) + (_CENTURY if len(year) < 3 else 0), number, int(day))
    except ValueError:
        return None


def _month(name: str) -> int:
    """Return the number of a month by its name; 0 for another word."""
    text = name.casefold()
    return next((n for n, starts in enumerate(_MONTHS, 1) if any(map(text.startswith, starts))), 0)


def _at(
    day: date, hour: str, minute: str, second: str | None, part: str | None, half: str | None
) -> datetime | None:
    """Return the moment on ``day``; ``half`` is the a or p of a clock of twelve hours."""
    hours = int(hour)
    if half is not None:
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + (12 if half in "pP" else 0)
    try:
        moment = datetime(day.year, day.month, day.day, hours, int(minute), int(second or 0))
    except ValueError:
        return None
    return moment + timedelta(seconds=float(f"0.{part or 0}"))
