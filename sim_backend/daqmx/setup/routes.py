"""Signals within the card, those that tasks export, and routes between terminals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from dearig.sim_backend.daqmx.card.acquisition import SharedTicks
from dearig.sim_backend.daqmx.card.channels import PulseChannel
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.hardware import CLOCK_OF, PINS
from dearig.sim_backend.daqmx.card.signals import ClockSignal, Events, Series, Signal
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.card.terminals import Terminals
from dearig.sim_backend.daqmx.card.triggers import EdgeTicks

__all__ = ["Routes"]

#: Exported signals by DAQmx's number.
_SIGNALS = {
    12487: "SAMP_CLK",
    12491: "START_TRIG",
    12490: "REF_TRIG",
    12494: "CTR_OUT_EVENT",
    12486: "20_MHZ_TIMEBASE",
    12536: "10_MHZ_REF_CLK",
}
#: Delay in s of clocks and triggers inside the card. Without it a start would come at the time up
#: to which the tasks that wait for it have looked already.
_INSIDE_S = 2e-9
_TIMEBASES = {"20_MHZ_TIMEBASE": "20mhztimebase", "10_MHZ_REF_CLK": "10mhzrefclk"}
_START_OF = {kind: name.replace("sampleclock", "starttrigger") for kind, name in CLOCK_OF.items()}


class Routes:
    """Routes between ``terminals``, to which it gives the clocks and triggers of the tasks."""

    def __init__(self, state: CardState, terminals: Terminals) -> None:
        self._state = state
        self._terminals = terminals
        inside: dict[str, Signal] = {
            "ai/referencetrigger": Events(self._reference_times),
            **{CLOCK_OF[kind]: self._clock_of(kind) for kind in CLOCK_OF},
            **{_START_OF[kind]: Events(self._starts_of(kind)) for kind in _START_OF},
        }
        for name, signal in inside.items():
            terminals.provide(name, signal)

    # signals within the card

    def starts(self, kind: Kind) -> Sequence[float]:
        """Return when the running task of ``kind`` has started, in s; none before that."""
        task = self._state.running(kind)
        if task is None:
            return ()
        if task.generation is not None:
            return (task.generation.start + _INSIDE_S,)
        start = None if task.sample_times is None else task.sample_times.start
        return () if start is None else (start + _INSIDE_S,)

    def _starts_of(self, kind: Kind) -> Callable[[], Sequence[float]]:
        return lambda: self.starts(kind)

    def _clock_of(self, kind: Kind) -> Signal:
        return ClockSignal(lambda: self._clock_series(kind))

    def _clock_series(self, kind: Kind) -> Series | None:
        task = self._state.running(kind)
        if task is None:
            return None
        if task.generation is not None:
            generation = task.generation
            total = generation.total if generation.ended is None else generation.ended
            return Series(generation.start + _INSIDE_S, np.zeros(1), 1.0 / generation.rate, total)
        ticks = task.sample_times
        if isinstance(ticks, EdgeTicks | SharedTicks) or ticks is None or ticks.start is None:
            return None
        return Series(ticks.start + _INSIDE_S, np.zeros(1), 1.0 / ticks.rate, task.wanted)

    def _reference_times(self) -> Sequence[float]:
        task = self._state.running(Kind.AI)
        at = None if task is None or task.reference is None else task.reference.at
        return () if at is None else (at,)

    # routes

    def connect(self, source: str, destination: str) -> None:
        """Put the signal of ``source`` out at the terminal ``destination``."""
        with self._state.present():
            self._terminals.connect(source, destination)
            self._state.notify()

    def disconnect(self, destination: str) -> None:
        """Put nothing out at ``destination`` any more."""
        with self._state.present():
            self._terminals.disconnect(destination)
            self._state.notify()

    # exported signals

    def export(self, task: Task, signal: int, destinations: str) -> None:
        """Put a signal of ``task``, by DAQmx's number, out at the terminals ``destinations``."""
        name = _SIGNALS.get(signal)
        if name is None or (_exported(task, name) is None and task.kind is not Kind.EMPTY):
            raise DaqmxError(Code.SIGNAL_NOT_EXPORTED, f"Signal: {signal}; Task Name: {task.name}")
        with self._state.lock:
            task.exports[name] = destinations

    def check(self, task: Task) -> None:
        """Refuse exports of ``task`` to terminals that the card has not."""
        for terminal in task.exports.values():
            if terminal and self._terminals.pin(terminal) not in PINS:
                raise DaqmxError(
                    Code.INVALID_ROUTE_DESTINATION,
                    f"Destination Terminal: {terminal}; Task Name: {task.name}",
                )

    def put_out(self, task: Task) -> None:
        """Put the exported signals and the pulses of ``task`` out at their terminals."""
        for name, destinations in task.exports.items():
            source = _exported(task, name)
            for destination in destinations.split(","):
                if destination.strip() and source is not None:
                    self._terminals.connect(source, destination)
        for channel in task.counters:
            if isinstance(channel, PulseChannel):
                self._terminals.connect(f"{channel.terminal}internaloutput", channel.output)


def _exported(task: Task, name: str) -> str | None:
    """Return the terminal within the card that has a signal of ``task``; None: it has none."""
    if name == "CTR_OUT_EVENT" and task.counters:
        return f"{task.counters[0].terminal}internaloutput"
    if name == "REF_TRIG" and task.kind is Kind.AI:
        return "ai/referencetrigger"
    if name == "SAMP_CLK":
        return CLOCK_OF.get(task.kind)
    if name == "START_TRIG":
        return _START_OF.get(task.kind)
    return _TIMEBASES.get(name)
