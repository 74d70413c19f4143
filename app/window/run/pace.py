"""Time of a run that is on the screen: it flows, although samples come in blocks."""

from __future__ import annotations

import math

__all__ = ["ShownTime"]

#: Blocks by which the screen may be late before it jumps: a run that is faster than real time, or
#: a window that was busy.
_LATE = 2.0


class ShownTime:
    """The time up to which a run is shown, at the speed of a clock and one block behind the run.

    So each frame of the screen shows something new: with blocks of 0.1 s there would be ten of them
    a second otherwise.
    """

    def __init__(self) -> None:
        self._end = self._block = 0.0  # of the newest sample, and from the block before it, s
        self._shown = 0.0
        self._at = math.nan  # clock at the last call, s

    def shown(self, end: float, now: float) -> float:
        """Return the s of the run to show, where its newest sample is at ``end``.

        ``now`` is a clock in s.
        """
        if end < self._end:  # another run
            self._end = self._block = self._shown = 0.0
        if end > self._end:
            self._block, self._end = end - self._end, end
        if not math.isnan(self._at):
            self._shown += max(0.0, now - self._at)
        self._at = now
        if self._shown < end - _LATE * self._block:
            self._shown = end - self._block
        self._shown = min(self._shown, end)
        return self._shown
