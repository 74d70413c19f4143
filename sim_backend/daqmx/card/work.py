"""What a task of digital lines or counters does while it runs; analog tasks are the engine's."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.triggers import SampleTicks

if TYPE_CHECKING:
    from dearig.sim_backend.daqmx.card.tasks import Task

__all__ = ["InputWork", "Samples", "Work"]

_DROP = 100_000  # samples that are discarded at a time


class Work(ABC):
    """Work of ``task``; every time is in s on the card's clock."""

    def __init__(self, task: Task) -> None:
        self.task = task

    @abstractmethod
    def resources(self) -> list[str]:
        """Return what no other task may use at the same time."""

    @abstractmethod
    def start(self, now: float) -> None:
        """Begin: at once, or with the trigger."""

    @abstractmethod
    def settle(self, now: float) -> None:
        """Do everything that is due up to ``now``."""

    @abstractmethod
    def end(self, now: float) -> None:
        """Stop."""

    @abstractmethod
    def done(self, now: float) -> bool:
        """Return True once a running task is complete."""

    @abstractmethod
    def passed(self, now: float) -> int:
        """Return the samples per channel that were acquired or generated."""

    @abstractmethod
    def due(self, samples: int, now: float) -> float | None:
        """Return when there are ``samples``, or None where it is unknown."""


class Samples:
    """Samples (rows, n) that wait to be read, at most ``room`` of them."""

    def __init__(self, rows: int, room: int, kind: type) -> None:
        self._values: np.ndarray = np.empty((rows, 0), dtype=kind)
        self._first = 0
        self.room = room
        self.taken = 0  # samples that were read

    @property
    def total(self) -> int:
        """Return the samples since the start."""
        return self._first + int(self._values.shape[1])

    @property
    def waiting(self) -> int:
        """Return the samples that were not read."""
        return self.total - self.taken

    def append(self, values: np.ndarray) -> None:
        """Append ``values`` (rows, n)."""
        if values.shape[1]:
            self._values = np.concatenate((self._values, values), axis=1)

    def take(self, samples: int) -> np.ndarray:
        """Return the next ``samples`` (rows, samples), which are there."""
        start = self.taken - self._first
        values = self._values[:, start : start + samples]
        self.taken += samples
        if self.taken - self._first > _DROP:
            self._values = self._values[:, self.taken - self._first :].copy()
            self._first = self.taken
        return values


class InputWork(Work):
    """Input task whose samples are kept until they are read."""

    samples: Samples | None = None
    ticks: SampleTicks | None = None

    def settle(self, now: float) -> None:
        """Take the samples up to ``now``; more than the buffer holds is the task's failure."""
        if self.samples is None or self.task.failed is not None:
            return
        new = self._new(now) - self.samples.total
        if self.task.wanted is not None:
            new = min(new, self.task.wanted - self.samples.total)
        if self.samples.waiting + new > self.samples.room:
            self.task.failed = Code.SAMPLES_OVERWRITTEN
        elif new > 0:
            self.samples.append(self._take(self.samples.total, self.samples.total + new))

    @abstractmethod
    def _new(self, now: float) -> int:
        """Return the samples since the start."""

    @abstractmethod
    def _take(self, first: int, last: int) -> np.ndarray:
        """Return the samples (rows, n) from ``first`` to before ``last``, which have passed."""

    @abstractmethod
    def still(self, now: float) -> np.ndarray | None:
        """Return one sample (rows, 1) of a task without timing; None: there is none yet."""

    @abstractmethod
    def still_due(self, now: float) -> float | None:
        """Return when there will be one, or None where it is unknown."""

    def end(self, now: float) -> None:  # noqa: ARG002
        self.samples, self.ticks = None, None

    def done(self, now: float) -> bool:
        wanted = self.task.wanted
        if wanted is None:
            return False
        return self.passed(now) >= wanted

    def passed(self, now: float) -> int:
        self.settle(now)
        return 0 if self.samples is None else self.samples.total

    def due(self, samples: int, now: float) -> float | None:
        return None if self.ticks is None else self.ticks.due(samples, now)

    def buffered(self) -> Samples:
        """Return the samples; raises an error for a task that was aborted."""
        if self.samples is None:
            raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {self.task.name}", read=0)
        return self.samples
