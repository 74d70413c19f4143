"""What the parts of the card share: its lock, its tasks and its clock."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

from dearig.drivers.settings import RigSettings
from dearig.sim_backend.clock import Clock
from dearig.sim_backend.daqmx.card.tasks import Kind, Task

__all__ = ["CardState"]

T = TypeVar("T")


class CardState:
    """State of the card of a rig with ``settings`` on ``clock``.

    Nothing ticks: ``present`` first does everything that happened since the previous call, which
    is the sequence ``steps`` of what the parts do up to a time in s.
    """

    def __init__(self, settings: RigSettings, clock: Clock) -> None:
        self.settings = settings
        self.name = settings.card.device
        self.lock = threading.RLock()
        self.tasks: dict[str, Task] = {}
        self.kept: dict[object, object] = {}  # properties of the device without effect
        self.steps: Sequence[Callable[[float], None]] = ()
        self.clock = clock
        self.born = clock.now()
        self.born_at = time.time()  # s since 1970, for the time stamps of waveforms
        self._waiting: set[threading.Event] = set()

    def now(self) -> float:
        """Return the present time in s."""
        # from the card's creation, so that a tick's time is exact enough in doubles for hours
        return self.clock.now() - self.born

    @contextmanager
    def present(self) -> Iterator[float]:
        """Hold the card at the present time, which is the value, with all that was due done."""
        with self.lock:
            yield self._settle()

    def _settle(self) -> float:
        now = self.now()
        for step in self.steps:
            step(now)
        return now

    def wait(
        self,
        timeout: float,
        attempt: Callable[[float, bool], tuple[T | None, float | None]],
    ) -> T:
        """Repeat ``attempt(now, last)`` until it has a result; it returns the time to try again.

        ``timeout`` is in s; a negative one is unlimited.
        """
        with self.lock:
            deadline = math.inf if timeout < 0.0 else self.now() + timeout
        while True:
            with self.present() as now:
                result, due = attempt(now, now >= deadline)
                if result is not None:
                    return result
                wake = threading.Event()
                self._waiting.add(wake)
            until = min(deadline, math.inf if due is None else due)
            if until < math.inf:
                self.clock.wait(self.born + until, wake)
            else:
                wake.wait()  # only another call can help
            with self.lock:
                self._waiting.discard(wake)

    def notify(self) -> None:
        """Let everyone who waits try again."""
        for wake in self._waiting:
            wake.set()

    def running(self, kind: Kind) -> Task | None:
        """Return the running task of ``kind`` on a clock, of which there is at most one."""
        return next(
            (t for t in self.tasks.values() if t.kind is kind and t.running and t.clock), None
        )
