"""Check of time stamps: the first one that does not increase."""

from __future__ import annotations

import numpy as np

__all__ = ["not_forward"]


def not_forward(time: np.ndarray) -> tuple[int, str] | None:
    """Return the first sample of ``time`` (N,) that does not increase, and how; else None.

    The second value is ``goes back`` or ``stands still``, for a sentence that begins with time.
    """
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if not back.size:
        return None
    at = int(back[0]) + 1
    return at, "stands still" if time[at] == time[at - 1] else "goes back"
