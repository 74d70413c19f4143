"""Digital inputs, and digital outputs on a sample clock."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.output import Generation
from dearig.sim_backend.daqmx.card.tasks import Task
from dearig.sim_backend.daqmx.card.terminals import Terminals
from dearig.sim_backend.daqmx.card.triggers import AwaitedEdge, Edge, SampleTicks
from dearig.sim_backend.daqmx.card.work import CardSamples, CardWork, SampledInput
from dearig.sim_backend.daqmx.running.output_buffer import may_generate

__all__ = ["DigitalInput", "DigitalOutput"]


class DigitalInput(SampledInput):
    """Lines of ``task`` as they are at ``terminals``; ``timing(now)`` makes the clock.

    With ``counts`` a line for which it is True reads one bit of the number of the sample, as
    those of NI's simulated devices do: bit n for line n of a group of eight.
    """

    def __init__(
        self,
        task: Task,
        terminals: Terminals,
        timing: Callable[[Task, float], SampleTicks],
        buffer_size: Callable[[Task], int],
        counts: Callable[[str], bool] | None = None,
    ) -> None:
        super().__init__(task)
        self._terminals = terminals
        self._timing = timing
        self._counts = counts
        self._reads = 0  # samples that were read without a clock
        self._buffer_size = buffer_size

    def resources(self) -> list[str]:
        return ["digital input timing"] if self.task.clock is not None else []

    def start(self, now: float) -> None:
        if self.task.clock is not None:
            self.ticks = self._timing(self.task, now)
            room = self._buffer_size(self.task)
            self.samples = CardSamples(len(self.task.line_names), room, np.uint8)

    def _new(self, now: float) -> int:
        return 0 if self.ticks is None else self.ticks.passed(now)

    def _take(self, first: int, last: int) -> np.ndarray:
        if self.ticks is None:
            return self._levels(np.empty(0), 0)
        return self._levels(self.ticks.times(first, last), first)

    def _levels(self, times: np.ndarray, first: int) -> np.ndarray:
        """Return the levels (lines, n) at ``times`` (n,); ``first`` is the first one's number."""
        numbers = first + np.arange(times.size)
        levels = [
            (numbers >> int(line.rpartition("line")[2]) % 8) & 1
            if self._counts is not None and self._counts(line)
            else self._terminals.signal(line).level(times)
            for line in self.task.line_names
        ]
        return np.array(levels, dtype=np.uint8)

    def still(self, samples: int, now: float) -> np.ndarray:  # noqa: ARG002
        self._reads += 1
        return self._levels(np.array([now]), self._reads - 1)

    def still_due(self, now: float) -> float:
        return now

    def done(self, now: float) -> bool:
        return True if self.task.clock is None else super().done(now)


class DigitalOutput(CardWork):
    """Lines of ``task`` on a sample clock. ``set_line(line, level, time)`` tells the wire.

    The lines go through the written samples as the outputs do, with their buffer and
    regeneration. ``trigger(task)`` is the edge that starts it, or None. ``check_watchdog(task)``
    refuses a start while a watchdog holds the lines.
    """

    def __init__(
        self,
        task: Task,
        terminals: Terminals,
        set_line: Callable[[str, bool, float], None],
        trigger: Callable[[Task], Edge | None],
        check_watchdog: Callable[[Task], None],
    ) -> None:
        super().__init__(task)
        self._check_watchdog = check_watchdog
        self._terminals = terminals
        self._set_line = set_line
        self._trigger = trigger
        self._waits = AwaitedEdge()
        self._known = 0  # ticks that the wire knows

    def check_start(self) -> None:
        if self.task.clock is not None:
            self._check_watchdog(self.task)
            may_generate(self.task)

    def resources(self) -> list[str]:
        timing = ["digital output timing"] if self.task.clock is not None else []
        return timing + self.task.line_names

    def start(self, now: float) -> None:
        if self.task.clock is None:
            return
        edge = self._trigger(self.task)
        self._waits.begin(edge, now)
        if edge is None:
            self._generate(now)

    def _generate(self, at: float) -> None:
        task = self.task
        if task.waveform is None or task.clock is None:
            raise DaqmxError(Code.OUTPUT_BUFFER_EMPTY, f"Task Name: {task.name}")
        total = task.clock.samples if task.clock.finite else None
        task.generation = Generation(task.waveform, task.clock.rate, at, total)
        self._known = 0
        for row, line in enumerate(task.line_names):
            self._terminals.drive(line).follow(task.generation, row)

    def settle(self, now: float) -> None:
        at = self._waits.passed(now)
        if at is not None:
            self._generate(at)
        generation = self.task.generation
        if generation is None:
            return
        if generation.settle(now) is not None:
            self.task.failed = Code.OUTPUT_STARVED
        self._tell(generation, now)

    def _tell(self, generation: Generation, now: float) -> None:
        """Let the wire know every change of a line up to ``now``."""
        # the present sample is on the lines too, unless the end has counted it
        end = generation.ticks(now) + (0 if generation.finished(now) else 1)
        if end <= self._known:
            return
        first = max(0, self._known - 1)
        levels = generation.at_ticks(np.arange(first, end)) != 0
        for row, line in zip(levels, self.task.line_names, strict=True):
            changed = np.flatnonzero(row[1:] != row[:-1]) + 1
            for place in [*([0] if self._known == 0 else []), *changed.tolist()]:
                self._set_line(line, bool(row[place]), generation.due(first + place))
        self._known = end
        generation.waveform.drop_before(max(0, end - 1))

    def end(self, now: float) -> None:
        self._waits.begin(None, now)
        if self.task.generation is not None:
            self.task.generation.stop(now)
            self._tell(self.task.generation, now)
            levels = self.task.generation.at_times(np.array([now]))[:, 0]
            for line, level in zip(self.task.line_names, levels, strict=True):
                self._terminals.drive(line).set(now, bool(level))
            self.task.generation = None

    def done(self, now: float) -> bool:
        if self.task.clock is None:
            return True
        return self.task.generation is not None and self.task.generation.finished(now)

    def passed(self, now: float) -> int:
        return 0 if self.task.generation is None else self.task.generation.ticks(now)

    def due(self, samples: int | None, now: float) -> float | None:  # noqa: ARG002
        if self.task.generation is not None:
            return self.task.generation.due(samples or 1)
        return self._waits.due()
