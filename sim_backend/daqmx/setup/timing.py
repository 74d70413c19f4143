"""Sample clocks and buffers of tasks."""

from __future__ import annotations

import math
import sys
from typing import Any

from dearig.sim_backend.daqmx.card.checks import (
    has_timing,
    not_running,
    not_set_while_running,
)
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.hardware import CLOCK_OF
from dearig.sim_backend.daqmx.card.numbers import LINES_RATE, TIMEBASE
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, SampleClock, Task
from dearig.sim_backend.daqmx.card.terminals import ON_BOARD, Terminals

__all__ = ["SLOWEST_TICKS", "Timing"]

SLOWEST_TICKS = 2**32  #: ticks of the timebase between two samples, at most

_MOST_SAMPLES = 2**32 - 1  # per channel, in a buffer
#: A rate that is a whole division may be too high by the rounding of two divisions in doubles.
_ROUNDED = 1.0 + 2.0 * sys.float_info.epsilon
#: Default input buffer of a continuous task: up to a rate in Hz, in samples.
_BUFFERS = ((100.0, 1000), (10e3, 10_000), (1e6, 100_000), (math.inf, 1_000_000))
#: The same where the rate is not known: DAQmx then takes the largest of its sizes below 1 MHz.
_UNKNOWN_RATE_BUFFER = 1_000_000


class Timing:
    """Sample clocks of tasks, from the card's timebase or a terminal, and the sizes of buffers."""

    def __init__(self, state: CardState, terminals: Terminals) -> None:
        self._state = state
        self._terminals = terminals
        self._card = state.settings.card

    # the sample clock

    def set_clock(self, task: Task, rate: float, source: str, finite: bool, samples: int) -> None:
        """Give ``task`` a sample clock of ``rate`` Hz from the terminal ``source``."""
        with self._state.lock:
            not_running(task)
            has_timing(task)
            if samples > _MOST_SAMPLES:
                raise DaqmxError(
                    Code.INVALID_VALUE,
                    f"Property: SAMP_QUANT_SAMP_PER_CHAN; Requested Value: {samples}; Maximum "
                    f"Value: {_MOST_SAMPLES}; Task Name: {task.name}",
                )
            coerced = self._coerced(task, rate, external=_is_external(source))
            task.timing = SampleClock(coerced, source, finite, samples)
            task.clocked = True

    def change_clock(self, task: Task, **changes: Any) -> None:
        """Set fields of the timing of ``task`` without a change between clock and on demand."""
        with self._state.lock:
            clocked = task.clocked
            fields = ("rate", "source", "finite", "samples")
            wanted = {name: getattr(task.timing, name) for name in fields} | changes
            edge, implicit = task.timing.edge, task.timing.implicit
            self.set_clock(task, **wanted)
            task.timing.edge, task.timing.implicit = edge, implicit
            task.clocked = clocked

    def set_clocked(self, task: Task, clocked: bool) -> None:
        """Give ``task`` its sample clock, or make it sample on demand."""
        with self._state.lock:
            not_running(task)
            has_timing(task)
            task.clocked = clocked

    def set_implicit(self, task: Task, finite: bool, samples: int) -> None:
        """Let each edge of the measured signal, or each pulse, be a sample of a counter task."""
        with self._state.lock:
            not_running(task)
            if task.work is None or not task.work.may_be_implicit:
                raise DaqmxError(
                    Code.NOT_WITHOUT_CHANNELS if task.kind is Kind.EMPTY else Code.INVALID_VALUE,
                    f"Property: SampTimingType; Requested Value: Implicit; Task Name: {task.name}",
                )
            if finite and samples < 1:
                raise DaqmxError(
                    Code.INVALID_VALUE, f"Property: SampQuant.SampPerChan; Value: {samples}"
                )
            task.timing = SampleClock(task.timing.rate, "", finite, samples, implicit=True)
            task.clocked = True

    @staticmethod
    def clock_of(task: Task) -> SampleClock:
        """Return the settings of the sample clock of ``task``; raises an error if it has none."""
        has_timing(task)
        return task.timing

    def samples(self, task: Task) -> int:
        """Return the samples per channel; refuses a number that a finite task cannot have."""
        timing = self.clock_of(task)
        # a single pulse, or the measurement of one, is a task
        least = 0 if timing.implicit or not timing.finite else 2
        if timing.samples < least:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: SAMP_QUANT_SAMP_PER_CHAN; Requested Value: {timing.samples}; Minimum "
                f"Value: 2; Task Name: {task.name}",
            )
        return timing.samples

    def source(self, task: Task) -> str:
        """Return the terminal that clocks ``task``; empty for its own clock."""
        source = task.timing.source
        if not source:
            return ""
        terminal = self._terminals.source(source)
        if terminal in (ON_BOARD, CLOCK_OF.get(task.kind)):
            return ""
        if task.kind in (Kind.AO, Kind.DO):
            raise DaqmxError(
                Code.ROUTE_NOT_SUPPORTED,
                f"Source Terminal: {source}; outputs on a clock from elsewhere are not simulated. "
                f"Task Name: {task.name}",
            )
        return terminal

    def check(self, task: Task) -> None:
        """Refuse a sample clock that ``task`` cannot have."""
        clock = task.clock
        if clock is None:
            return
        self.samples(task)
        source = self.source(task)
        if task.kind is Kind.AI:
            self._coerced(task, clock.rate, external=True)
        elif task.kind in (Kind.CI, Kind.CO) and not clock.implicit and not source:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: SAMP_CLK_SRC; Requested Value: {clock.source or 'OnboardClock'}; a "
                f"counter needs a clock from a terminal. Task Name: {task.name}",
            )
        elif task.kind in (Kind.DI, Kind.DO):
            for line in task.line_names:
                if not line.startswith("port0/"):
                    raise DaqmxError(
                        Code.INVALID_VALUE,
                        f"Property: SampTimingType; Requested Value: Sample Clock; a sample clock "
                        f"is for lines of port 0. Physical Channel: {line}",
                    )

    # rates

    def _coerced(self, task: Task, rate: float, *, external: bool) -> float:
        """Return the rate in Hz that the card runs at for ``rate``."""
        most, least = self.fastest(task), self.slowest
        if not least <= rate <= most * (1.0 + 1e-9):
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: SampClk.Rate; Requested Value: {rate:g}; Maximum Value: {most:g}; "
                f"Minimum Value: {least:.6g}; Task Name: {task.name}",
            )
        if external:
            return rate
        ticks = self.timebase / rate
        # NI's driver truncates the divisor of an analog input and rounds the others
        whole = math.floor(ticks * _ROUNDED) if task.kind is Kind.AI else round(ticks)
        return self.timebase / max(whole, math.ceil(self.timebase / most / _ROUNDED))

    @property
    def timebase(self) -> float:
        """Return the rate in Hz of the timebase of inputs and outputs."""
        return self._card.timebase_MHz * 1e6

    @property
    def fastest_input(self) -> float:
        """Return the highest rate in Hz of a single input, which is twice that of several."""
        return 2e3 * self._card.ai_rate_max_kHz

    @property
    def slowest(self) -> float:
        """Return the lowest rate in Hz that the timebase can be divided down to."""
        return self.timebase / SLOWEST_TICKS

    def fastest(self, task: Task) -> float:
        """Return the highest rate in Hz of the sample clock of ``task``."""
        if task.kind in (Kind.DI, Kind.DO):
            return LINES_RATE
        if task.kind in (Kind.CI, Kind.CO):
            return TIMEBASE
        if task.kind is not Kind.AI:
            return 1e3 * self._card.ao_rate_max_kHz
        several = len(task.inputs)
        return 1e3 * self._card.ai_rate_max_kHz / several if several > 1 else self.fastest_input

    # buffers

    def set_buffer(self, task: Task, samples: int | None) -> None:
        """Set the size of the task's buffer to ``samples`` per channel; None: the default."""
        with self._state.lock:
            not_set_while_running(task)
            task.buffer = samples

    def set_regeneration(self, task: Task, allowed: bool) -> None:
        """Set whether an output task repeats the written samples."""
        with self._state.lock:
            not_set_while_running(task)
            task.regenerates = allowed
            task.waveform = None

    @staticmethod
    def buffer_size(task: Task) -> int:
        """Return the size of the task's buffer in samples per channel; 0 without a buffer."""
        clock = task.clock
        if task.buffer is not None:
            return task.buffer
        if clock is None:
            return 0
        if task.kind in (Kind.AO, Kind.DO):
            return task.first_write if task.waveform is not None else 0
        if task.kind is Kind.CO:
            return len(task.pulses)
        if clock.finite:
            return clock.samples
        usual = next(size for rate, size in _BUFFERS if clock.rate <= rate)
        return max(_UNKNOWN_RATE_BUFFER if clock.implicit else usual, clock.samples)


def _is_external(source: str) -> bool:
    return source.strip().lower().rpartition("/")[2] not in ("", ON_BOARD)
