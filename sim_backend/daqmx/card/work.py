"""What a task does while it runs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError

if TYPE_CHECKING:
    from dearig.sim_backend.daqmx.card.acquisition import Ticks
    from dearig.sim_backend.daqmx.card.tasks import Task

__all__ = ["CardSamples", "CardWork", "Input", "SampledInput"]


class CardWork(ABC):
    """Work of ``task``; every time is in s on the card's clock."""

    ticks: Ticks | None = None  # times of the samples of an input
    may_be_implicit = False  # True where each edge, or each pulse, may be a sample

    def __init__(self, task: Task) -> None:
        self.task = task

    def check_start(self) -> None:  # noqa: B027
        """Refuse a start that cannot be, beyond what the settings of the task say."""

    @abstractmethod
    def resources(self) -> list[str]:
        """Return what no other task may use at the same time."""

    @abstractmethod
    def start(self, now: float) -> None:
        """Begin: at once, or with the trigger."""

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
    def due(self, samples: int | None, now: float) -> float | None:
        """Return when there are ``samples`` (None: without end), or None where it is unknown."""


class Input(CardWork):
    """Work of a task that is read; its samples are numbered from 0 at the start."""

    @abstractmethod
    def watch(self, now: float) -> None:
        """Take what is due up to ``now``; more unread samples than the buffer holds is a failure.

        A task that lets unread samples be overwritten does not fail.
        """

    @abstractmethod
    def between(self, first: int, last: int) -> np.ndarray:
        """Return the samples (rows, n) from ``first`` to before ``last``, which the buffer has."""

    @abstractmethod
    def room(self) -> int:
        """Return the samples per channel that the buffer holds."""

    def at_most(self, samples: int) -> int:
        """Return how many of ``samples`` a read delivers, for a fault of the driver."""
        return samples

    @abstractmethod
    def still(self, samples: int, now: float) -> np.ndarray | None:
        """Return up to ``samples`` (rows, n) of a task without timing; None: there is none yet."""

    @abstractmethod
    def still_due(self, now: float) -> float | None:
        """Return when there will be one, or None where it is unknown."""


class CardSamples:
    """The newest samples (rows, n) of a task: the last ``room``, and those of the same block."""

    def __init__(self, rows: int, room: int, kind: type) -> None:
        self._blocks: deque[np.ndarray] = deque()
        self._none: np.ndarray = np.empty((rows, 0), dtype=kind)
        self._first = 0  # number of the first sample that is kept
        self.room = room
        self.total = 0  # samples since the start

    def append(self, values: np.ndarray) -> None:
        """Append ``values`` (rows, n)."""
        if not values.shape[1]:
            return
        self._blocks.append(values)
        self.total += int(values.shape[1])
        while self.total - self._first - self._blocks[0].shape[1] >= max(1, self.room):
            self._first += int(self._blocks.popleft().shape[1])

    def between(self, first: int, last: int) -> np.ndarray:
        """Return the samples from ``first`` to before ``last``, which are kept."""
        parts, start = [], self._first
        for block in self._blocks:
            end = start + block.shape[1]
            if start < last and end > first:
                parts.append(block[:, max(0, first - start) : last - start])
            start = end
        if len(parts) == 1:
            return parts[0]
        return np.concatenate(parts, axis=1) if parts else self._none


class SampledInput(Input):
    """Input whose samples are taken as time passes, because a signal's past is not kept."""

    samples: CardSamples | None = None

    def watch(self, now: float) -> None:
        if self.samples is None or self.task.failed is not None:
            return
        task, samples = self.task, self.samples
        new = self._new(now) - samples.total
        if task.wanted is not None:
            new = min(new, task.wanted - samples.total)
        waiting = samples.total - task.delivered
        if waiting + new > samples.room and not task.overwrites:
            task.failed = Code.SAMPLES_OVERWRITTEN
        elif new > 0:
            samples.append(self._take(samples.total, samples.total + new))

    @abstractmethod
    def _new(self, now: float) -> int:
        """Return the samples since the start."""

    @abstractmethod
    def _take(self, first: int, last: int) -> np.ndarray:
        """Return the samples (rows, n) from ``first`` to before ``last``, which have passed."""

    def between(self, first: int, last: int) -> np.ndarray:
        if self.samples is None:
            raise DaqmxError(Code.RUNTIME_ABORTED, f"Task Name: {self.task.name}", read=0)
        return self.samples.between(first, last)

    def room(self) -> int:
        return 0 if self.samples is None else self.samples.room

    def end(self, now: float) -> None:  # noqa: ARG002
        self.samples, self.ticks = None, None

    def done(self, now: float) -> bool:
        wanted = self.task.wanted
        return wanted is not None and self.passed(now) >= wanted

    def passed(self, now: float) -> int:
        self.watch(now)
        return 0 if self.samples is None else self.samples.total

    def due(self, samples: int | None, now: float) -> float | None:
        return None if self.ticks is None else self.ticks.due(samples or 1, now)
