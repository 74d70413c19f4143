"""Clocks of a simulated rig. No other module of the simulation reads the time or waits."""

from __future__ import annotations

import threading
import time
from typing import Protocol

__all__ = ["Clock", "ManualClock", "PacedClock"]


class Clock(Protocol):
    """Time in s from an arbitrary start."""

    def now(self) -> float:
        """Present time in s."""
        ...

    def wait(self, until: float, wake: threading.Event) -> None:
        """Return at time ``until``, or as soon as ``wake`` is set."""
        ...


class ManualClock:
    """A clock that stands still until a caller waits, and then jumps to that time.

    A rig on this clock runs as fast as it can. A test moves the clock with ``advance``.
    """

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Present time in s."""
        return self._now

    def advance(self, seconds: float) -> None:
        """Move the clock forward by ``seconds``."""
        if not seconds >= 0.0:
            raise ValueError(f"a clock moves forward by 0 s or more, not by {seconds!r} s")
        self._now += seconds

    def wait(self, until: float, wake: threading.Event) -> None:
        """Jump to ``until``, unless ``wake`` is set already."""
        if not wake.is_set():
            self._now = max(self._now, until)


class PacedClock:
    """Real time."""

    def now(self) -> float:
        """Present time in s."""
        return time.monotonic()

    def wait(self, until: float, wake: threading.Event) -> None:
        """Wait until ``until``, or until ``wake`` is set."""
        wake.wait(min(max(0.0, until - self.now()), threading.TIMEOUT_MAX))
