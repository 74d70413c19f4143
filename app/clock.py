"""Time of day that may be set while the program runs, against the time that has passed.

The computer's clock is set by people, by time servers, and after a suspension. Deadlines and rests
are measured by the time that has passed; a change of the clock is reported where times of day are
recorded.
"""

from __future__ import annotations

import time
from collections.abc import Callable

__all__ = ["TOLERANCE", "ClockWatch", "UnixTime"]

TOLERANCE = 1.0  #: s that the two may differ; time servers shift a clock gradually by less


class ClockWatch:
    """Notices that the computer's clock was set: ``now`` in s since 1970 against ``clock`` in s."""

    def __init__(
        self,
        now: Callable[[], float] = time.time,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._now, self._clock = now, clock
        self._ahead = now() - clock()

    def change(self) -> str:
        """Return how the clock was set since the last call, as a sentence; "" where it was not."""
        ahead = self._now() - self._clock()
        by = ahead - self._ahead
        if abs(by) <= TOLERANCE:
            return ""
        self._ahead = ahead
        moment = time.strftime("%H:%M:%S", time.localtime(self._now()))
        how = f"set back by {-by:.0f} s" if by < 0.0 else f"set forward by {by:.0f} s"
        asleep = "" if by < 0.0 else ", or the computer was suspended"
        return (
            f"the computer's clock was {how}{asleep}; it is {moment} now, and earlier times of day "
            f"are those of the clock before"
        )


class UnixTime:
    """Unix time in s that does not go back where the computer's clock is set back.

    ``not_before`` is a time that was noted earlier. Suspension of the computer counts.
    """

    def __init__(
        self,
        now: Callable[[], float] = time.time,
        clock: Callable[[], float] = time.monotonic,
        not_before: float = 0.0,
    ) -> None:
        self._now, self._clock = now, clock
        self._begin = max(now(), not_before), clock()

    def __call__(self) -> float:
        """Return the time now."""
        wall, passed = self._begin
        return max(self._now(), wall + self._clock() - passed)
