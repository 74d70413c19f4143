"""Checks of time: stamps that do not increase, and steps of the computer's clock."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import numpy as np

__all__ = ["ClockComparison", "compare_clocks", "local_time", "not_forward"]

#: Difference in s of two clocks between two flushes above which one of them has stepped. The load
#: of the computer and a slow disk cause such a difference too, but not one that stays.
STEP = 0.1
#: Part of a run without steps that is needed to compare the rates of the clocks.
COMPARABLE = 0.5


def not_forward(time: np.ndarray) -> tuple[int, str] | None:
    """Return the first sample of ``time`` (N,) that does not increase, and how; else None.

    The second value is ``goes back`` or ``stands still``, for a sentence that begins with time.
    """
    back = np.flatnonzero(time[1:] <= time[:-1])
    if not back.size:
        return None
    at = int(back[0]) + 1
    return at, "stands still" if time[at] == time[at - 1] else "goes back"


@dataclass(frozen=True)
class ClockComparison:
    """Comparison of the computer's clock with the sample clock.

    Attributes
    ----------
    step : float
        Time in s by which the computer's clock was set forward (above 0) or back in all; 0.0 if
        that cannot be told from a wrong rate.
    step_sample : int
        Sample at the largest step.
    computer : float
        Time in s by the computer's clock, without the steps.
    counted : float
        Time in s by the sample clock, in the same flushes.
    """

    step: float
    step_sample: int
    computer: float
    counted: float


def compare_clocks(sample: np.ndarray, moments: np.ndarray, rate: float) -> ClockComparison:
    """Compare the computer's time ``moments`` (n,) in s at ``sample`` (n,) with ``rate`` in Hz.

    A clock that is set steps between two flushes and agrees before and after; a wrong rate differs
    everywhere. After a slow flush the clocks differ once, and by the opposite in the next flushes.
    """
    took, counted = np.diff(moments), np.diff(sample) / rate
    apart = took - counted
    steps = np.abs(apart) > np.maximum(STEP, 0.5 * counted)
    if counted[~steps].sum() < COMPARABLE * counted.sum():
        # the clocks differ everywhere
        steps[:] = False
    step = float(apart[steps].sum())
    if abs(step) <= STEP:
        # a pause of the program that was made up for
        steps[:] = False
        step = 0.0
    at = int(sample[int(np.argmax(np.where(steps, np.abs(apart), 0.0)))]) if steps.any() else 0
    return ClockComparison(step, at, float(took[~steps].sum()), float(counted[~steps].sum()))


def local_time(text: str) -> str:
    """Return the ISO time ``text`` in this computer's time zone, with its offset from UTC.

    Text that is not a time with a zone is returned as it is.
    """
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return text
    if moment.tzinfo is None:
        return text
    try:
        return moment.astimezone().isoformat(" ", timespec="seconds")
    except (OverflowError, ValueError, OSError):
        return text  # a year that this system cannot convert
