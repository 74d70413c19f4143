"""Time stamps that do not go forward evenly: midnight, summer time, too coarse a clock."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dearig.recording.content.timestamps import not_forward
from dearig.recording.importers.source import LOST_MAX, NeedsOptionError, skip_or_refuse

__all__ = ["check_forward", "forward_rows", "jumps", "one_clock"]

#: s: a day, the least fall of a time of day that is the next day, the step of summer time.
_DAY, _NEXT_DAY, _SUMMER = 86_400.0, 43_200.0, 3600.0
#: Usual steps from which a step is a jump, and jumps that are named at most: more are the pauses
#: of a logger that writes when something happens.
_JUMP, _JUMPS_MAX = 100.0, 3
#: Durations of a recording before its first row from which its times count from that row.
_LONG_BEFORE = 100.0
#: Steps from which the usual one is found, at most, and steps that are looked at in one go.
_SOME = 2**17


def one_clock(
    time: np.ndarray, place: Callable[[int], str]
) -> tuple[np.ndarray, list[str], list[str]]:
    """Return the times (n,) of a clock in s as one that goes forward, notes, and warnings.

    ``place`` says where a row is in the file. A time of day that falls by more than half a day is
    of the next day. A clock that falls by an hour was set back at the end of summer time.
    """
    notes: list[str] = []
    warnings: list[str] = []
    steps = np.diff(time)
    forward = steps[steps > 0.0]
    if not forward.size or not np.isfinite(steps).all():
        return time, notes, warnings
    usual = float(np.median(forward))
    added = np.zeros(time.size)
    for at in np.flatnonzero(steps < 0.0).tolist():
        if -_DAY <= steps[at] < -_NEXT_DAY:
            added[at + 1 :] += _DAY
            notes.append(f"after {place(at)} the time of day begins again: the next day")
        elif abs(steps[at] + _SUMMER - usual) <= max(usual, 1.0):
            added[at + 1 :] += _SUMMER
            warnings.append(
                f"the time goes back by {-steps[at]:g} s after {place(at)}: did summer time end? "
                f"An hour was added to what follows"
            )
    return (time + added if notes or added.any() else time), notes, warnings


def jumps(time: np.ndarray, place: Callable[[int], str]) -> list[str]:
    """Return a sentence for each jump of times (n,) in s that go forward, if there are few.

    A clock may have been set forward, or a second run appended. ``place`` says where a row is in
    the file.
    """
    some = np.arange(0, time.size - 1, max(time.size // _SOME, 1))
    usual = float(np.median(time[some + 1] - time[some])) if some.size else 0.0
    if not 0.0 < usual < _SUMMER / 2.0:
        return []
    found: list[int] = []
    for first in range(0, time.size, _SOME):
        steps = np.diff(time[first : first + _SOME + 1])
        found += (first + np.flatnonzero(steps >= _JUMP * usual)).tolist()
        if len(found) > _JUMPS_MAX:
            return []
    return [
        f"the time jumps by {step:.7g} s after {place(at)}, and goes on in steps of {usual:.5g} s: "
        + (
            "did summer time begin?"
            if abs(step - _SUMMER - usual) <= 0.5 * usual
            else "was the clock set, or another run appended?"
        )
        for at, step in ((at, float(time[at + 1] - time[at])) for at in found)
    ]


def forward_rows(time: np.ndarray) -> np.ndarray:
    """Return rows (n,) bool of ``time`` between which it goes forward; NaN is left out.

    A time that is too late makes all rows after it go back. So the rows are counted from the start
    and from the end, and the count that leaves out fewer rows is used.
    """
    there: np.ndarray = np.isfinite(time)
    first, last = there.copy(), there.copy()
    latest = np.maximum.accumulate(np.where(there, time, -np.inf))
    first[1:] &= time[1:] > latest[:-1]
    coming: np.ndarray = np.minimum.accumulate(np.where(there, time, np.inf)[::-1])[::-1]
    last[:-1] &= time[:-1] < coming[1:]
    return last if int(last.sum()) > int(first.sum()) else first


def check_forward(time: np.ndarray, column: str, place: Callable[[int], str], path: object) -> None:
    """Raise ``InputError`` unless ``time`` (n,) increases; with an option if one is right."""
    if (back := not_forward(time)) is None:
        return
    at, how = back
    first, behind = _counted_from(time)
    # the digits behind those are of the rounding of the difference
    one, other = (round(float(t - first), 6) if behind else t for t in time[at - 1 : at + 1])
    said = f"{path}, {place(at)}, column {column!r}: time {how}, from {one:.9g} to {other:.9g}"
    said += behind
    if (shared := _shared(time)) is not None:
        rows, rate = shared
        raise NeedsOptionError(
            f"{said}: {rows:.3g} rows share each time stamp, so its clock is coarser than the "
            f"rows, or its digits are rounded; the rows are even, and a rate gives them their "
            f"time",
            answers={"rate_Hz": rate},
        )
    lost = time.size - int(forward_rows(time).sum())
    more = "; a rate replaces the time of evenly spaced samples"
    raise skip_or_refuse(said, lost, time.size, more, option=["rate_Hz"])


def _counted_from(time: np.ndarray) -> tuple[float, str]:
    """Return what times (n,) are shown from, and the words for it: 0, or the first row.

    Of seconds since 1904 or 1970 the digits that differ would not be seen.
    """
    forward = (steps := np.diff(time))[steps > 0.0]
    whole = float(np.median(forward)) * time.size if forward.size else 0.0
    first = float(time[0])
    return (first, " since the first row") if abs(first) > _LONG_BEFORE * whole > 0.0 else (0.0, "")


def _shared(time: np.ndarray) -> tuple[float, str] | None:
    """Return how many rows share a stamp and the rate of even rows in Hz; None if they are not."""
    steps = np.diff(time)
    first = np.flatnonzero(steps > 0.0) + 1  # rows that begin a stamp
    if (steps < 0.0).any() or first.size < 2 or first.size > (1.0 - LOST_MAX) * time.size:
        return None
    stamp = float(np.median(np.diff(time[first])))
    # a stamp begins within one row, so its first rows tell the period best
    rows = first - float(first.mean())
    period = float(rows @ time[first]) / float(rows @ rows)
    apart = time - period * np.arange(time.size)
    if float(apart.max() - apart.min()) > stamp + 2.0 * period:
        return None
    # where in a row a stamp begins has a standard deviation of the row over sqrt(12)
    tolerance = 2.0 / math.sqrt(12.0 * float(rows @ rows))
    return time.size / (first.size + 1), f"{1.0 / _roundest(period, tolerance):.9g}"


def _roundest(period: float, tolerance: float) -> float:
    """Return the period of few digits, or of a rate of few, within a part of ``period``."""
    for digits in range(1, 9):
        for found in (float(f"{period:.{digits}g}"), 1.0 / float(f"{1.0 / period:.{digits}g}")):
            if abs(found / period - 1.0) <= min(tolerance, 0.01):
                return found
    return period
