"""Conversions of a scan of analog inputs: their rate, and the delay of the first one."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dearig.sim_backend.daqmx.card.checks import not_running, of_kind
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.setup.timing import SLOWEST_TICKS, Timing

__all__ = ["Conversions"]

SECONDS, TICKS, PERIODS = 10364, 10304, 10286  #: DAQmx: units of the delay

_SETTLE_US = 10.0  # extra settling time that the driver gives an input where there is time
_FIRST_US = 0.25  # default delay from the sample clock to the first conversion


class Conversions:
    """Conversions of the inputs of a task, in ticks of the timebase of ``timing``."""

    def __init__(self, state: CardState, timing: Timing) -> None:
        self._state = state
        self._timing = timing
        self._card = state.settings.card

    def ticks(self, task: Task) -> int:
        """Return the ticks of the timebase between two conversions of an input task."""
        if task.convert_ticks is not None:
            return task.convert_ticks
        timebase = self._timing.timebase
        fastest = math.ceil(timebase / (1e3 * self._card.ai_rate_max_kHz))
        settled = fastest + round(_SETTLE_US * self._card.timebase_MHz)
        if task.clock is None:
            return settled
        room = timebase / task.clock.rate - self.delay_ticks(task)
        return max(fastest, min(settled, math.floor(room / max(1, len(task.inputs)))))

    def set_rate(self, task: Task, rate: float) -> None:
        """Set the rate in Hz of an input task's conversions."""
        with self._state.lock:
            not_running(task)
            of_kind(task, Kind.AI)
            fastest = 1e3 * self._card.ai_rate_max_kHz
            if not self._timing.slowest <= rate <= fastest * (1.0 + 1e-9):
                raise DaqmxError(
                    Code.INVALID_VALUE,
                    f"Property: AIConv.Rate; Requested Value: {rate:g}; Maximum Value: {fastest:g}",
                )
            task.convert_ticks = round(self._timing.timebase / rate)

    def delay_ticks(self, task: Task) -> int:
        """Return the ticks of the timebase from a sample clock's edge to the first conversion."""
        if task.delay_ticks is not None:
            return task.delay_ticks
        return round(_FIRST_US * self._card.timebase_MHz)

    def delay(self, task: Task) -> float:
        """Return the same delay in the unit that the program has chosen."""
        ticks = self.delay_ticks(task)
        if task.delay_units == TICKS:
            return float(ticks)
        seconds = ticks / self._timing.timebase
        return seconds if task.delay_units == SECONDS else seconds * task.timing.rate

    def set_delay(self, task: Task, value: float) -> None:
        """Set the delay, in the unit that the program has chosen."""
        with self._state.lock:
            not_running(task)
            of_kind(task, Kind.AI)
            ticks = value
            if task.delay_units == SECONDS:
                ticks = value * self._timing.timebase
            elif task.delay_units == PERIODS:
                ticks = value / task.timing.rate * self._timing.timebase
            if not 0.0 <= ticks < SLOWEST_TICKS:
                raise DaqmxError(
                    Code.INVALID_VALUE, f"Property: DelayFromSampClk.Delay; Value: {value:g}"
                )
            task.delay_ticks = round(ticks)

    @staticmethod
    def set_delay_units(task: Task, units: int) -> None:
        """Set the unit of the delay: ``SECONDS``, ``TICKS`` or ``PERIODS``."""
        if units not in (SECONDS, TICKS, PERIODS):
            raise DaqmxError(
                Code.INVALID_VALUE, f"Property: DelayFromSampClk.DelayUnits; Value: {units}"
            )
        task.delay_units = units

    def skews(self, task: Task) -> Sequence[float]:
        """Return the times in s from the sample clock to the conversion of each input."""
        us = self._card.timebase_MHz
        first, step = self.delay_ticks(task) / us, self.ticks(task) / us
        return [(first + place * step) * 1e-6 for place in range(len(task.inputs))]

    def check(self, task: Task) -> None:
        """Refuse conversions that do not fit between two samples."""
        if task.clock is None or task.kind is not Kind.AI:
            return
        # the last input's conversion must have begun before the next tick
        last = self.delay_ticks(task) + (len(task.inputs) - 1) * self.ticks(task)
        if last >= self._timing.timebase / task.clock.rate:
            raise DaqmxError(
                Code.CONVERT_PERIOD,
                f"Sample Rate: {task.clock.rate:g}; Number of Channels: {len(task.inputs)}; the "
                f"last conversion begins after {last / self._timing.timebase * 1e6:g} us. Task "
                f"Name: {task.name}",
            )
