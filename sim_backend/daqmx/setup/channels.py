"""Analog channels of tasks: terminals, limits, ranges, wiring and scales."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from dearig.drivers.channels import COUNT_MAX
from dearig.sim_backend.daqmx.card.channels import AnalogInput, AnalogOutput
from dearig.sim_backend.daqmx.card.checks import may_add, not_set_while_running
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.hardware import (
    DIFFERENTIAL,
    INPUT_RANGES,
    INPUTS,
    OUTPUTS,
    SINGLE,
    SINGLE_OWN_SENSE,
)
from dearig.sim_backend.daqmx.card.names import named, physical_names
from dearig.sim_backend.daqmx.card.scales import Scale
from dearig.sim_backend.daqmx.card.sensors import Sensor
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.card.wiring import OUTPUT_MONITOR, Wiring
from dearig.sim_backend.daqmx.card.work import CardWork
from dearig.sim_backend.daqmx.setup.custom_scales import CustomScales

__all__ = ["AnalogChannels"]


class AnalogChannels:
    """Analog channels; ``work`` makes what the task of a kind does while it runs."""

    def __init__(
        self,
        state: CardState,
        scales: CustomScales,
        wiring: Wiring,
        work: Callable[[Task, Kind], CardWork],
    ) -> None:
        self._state = state
        self._scales = scales
        self._wiring = wiring
        self._work = work

    def add_inputs(
        self,
        task: Task,
        physical: str,
        name: str,
        wiring: int,
        limits: tuple[float, float],
        scale: Scale | Sensor | None = None,
    ) -> list[AnalogInput]:
        """Add the inputs ``physical`` with ``wiring`` (-1: the default) and ``limits``.

        The limits are in V, or in the unit of ``scale``. Returns the new channels.
        """
        with self._state.lock:
            may_add(task, Kind.AI)
            taken = _smallest_range(limits if scale is None else scale.limits(limits), INPUT_RANGES)
            made: list[AnalogInput] = []
            terminals = physical_names(physical, self._state.name)
            for terminal, called in named(task, self._state.name, terminals, name):
                how = self._wiring_of(terminal, wiring)
                own = (
                    replace(scale, values=dict(scale.values))
                    if isinstance(scale, Sensor)
                    else scale
                )
                made.append(AnalogInput(called, terminal, limits, taken, how, own))
            self._of(task, Kind.AI)
            task.inputs += made
            return made

    def add_outputs(
        self,
        task: Task,
        physical: str,
        name: str,
        limits: tuple[float, float],
        scale: Scale | None = None,
    ) -> None:
        """Add the outputs ``physical`` within ``limits``, in V or in the unit of ``scale``."""
        with self._state.lock:
            may_add(task, Kind.AO)
            volts = limits if scale is None else scale.limits(limits)
            taken = _smallest_range(volts, (self._state.settings.card.ao_range_V,))
            made = []
            terminals = physical_names(physical, self._state.name)
            for terminal, called in named(task, self._state.name, terminals, name):
                if terminal not in OUTPUTS:
                    raise self._unknown(terminal)
                made.append(AnalogOutput(called, terminal, limits, taken, scale))
            self._of(task, Kind.AO)
            task.outputs += made

    def _of(self, task: Task, kind: Kind) -> None:
        """Make ``task`` one of ``kind``, with its first channels."""
        if task.kind is Kind.EMPTY:
            task.kind, task.work = kind, self._work(task, kind)

    def _unknown(self, terminal: str) -> DaqmxError:
        return DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {self._state.name}/{terminal}")

    def _wiring_of(self, terminal: str, wiring: int) -> int:
        """Return the wiring of the input ``terminal`` for ``wiring`` (-1: the default)."""
        if terminal in [OUTPUT_MONITOR.format(ao) for ao in OUTPUTS]:
            return DIFFERENTIAL
        known = terminal.startswith("ai") and terminal[2:].isdigit()
        if not known or int(terminal[2:]) >= INPUTS:
            raise self._unknown(terminal)
        # an input and the eighth one after it make a pair
        pair = int(terminal[2:]) % 16 < 8
        how = (DIFFERENTIAL if pair else SINGLE) if wiring == -1 else wiring
        offered = (DIFFERENTIAL, SINGLE, SINGLE_OWN_SENSE)
        if how not in offered or (how == DIFFERENTIAL and not pair):
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: AI_TERM_CFG; Requested Value: {how}; Channel Name: "
                f"{self._state.name}/{terminal}",
            )
        return how

    def set_wiring(self, task: Task, channel: AnalogInput, wiring: int) -> None:
        """Set the wiring of an input (-1: the default)."""
        with self._state.lock:
            not_set_while_running(task)
            channel.wiring = self._wiring_of(channel.terminal, wiring)

    def set_limits(
        self,
        task: Task,
        channel: AnalogInput | AnalogOutput,
        low: float | None = None,
        high: float | None = None,
    ) -> None:
        """Set one of a channel's limits, or both; their order is checked with the task."""
        with self._state.lock:
            not_set_while_running(task)
            present = channel.limits
            limits = (present[0] if low is None else low, present[1] if high is None else high)
            volts = limits if channel.scale is None else channel.scale.limits(limits)
            channel.range = _fitting_range(volts, self._offered(channel))
            channel.limits = limits

    def set_range(self, task: Task, channel: AnalogInput | AnalogOutput, limit: float) -> None:
        """Set the range of a channel to the smallest one that includes ``limit`` V."""
        with self._state.lock:
            not_set_while_running(task)
            channel.range = _fitting_range((-limit, limit), self._offered(channel))

    def set_scale(self, task: Task, channel: AnalogInput | AnalogOutput, name: str) -> None:
        """Set the custom scale of a channel; an empty ``name`` removes it."""
        with self._state.lock:
            not_set_while_running(task)
            scale = self._scales.find(name) if name else None
            volts = channel.limits if scale is None else scale.limits(channel.limits)
            channel.range = _fitting_range(volts, self._offered(channel))
            channel.scale = scale

    def _offered(self, channel: AnalogInput | AnalogOutput) -> Sequence[float]:
        if isinstance(channel, AnalogInput):
            return INPUT_RANGES
        return (self._state.settings.card.ao_range_V,)

    def scaling(self, task: Task, name: str) -> tuple[float, ...]:
        """Return volts over counts of the input ``name``, or counts over volts of an output."""
        for channel in task.inputs:
            if channel.name == name:
                return self._wiring.coefficients(channel)
        for output in task.outputs:
            if output.name == name:
                return (0.0, (COUNT_MAX + 1) / output.range)
        raise DaqmxError(Code.CHANNEL_NOT_IN_TASK, f"Channel Name: {name}")

    @staticmethod
    def check(task: Task) -> None:
        """Refuse limits, scales and ranges of the channels of ``task`` that do not agree."""
        analog: list[AnalogInput | AnalogOutput] = [*task.inputs, *task.outputs]
        for channel in analog:
            _check_order(channel.limits)
            if channel.scale is not None:
                channel.scale.check()
            if max(abs(v) for v in channel.volts) > channel.range * (1.0 + 1e-9):
                raise DaqmxError(
                    Code.INVALID_VALUE,
                    f"Requested Values: {channel.volts}; Range: +-{channel.range:g} V; Channel "
                    f"Name: {channel.name}; Task Name: {task.name}",
                )


def _smallest_range(limits: tuple[float, float], offered: Sequence[float]) -> float:
    """Return the smallest of the ranges ``offered`` in V that includes ``limits``."""
    _check_order(limits)
    return _fitting_range(limits, offered)


def _check_order(limits: tuple[float, float]) -> None:
    """Refuse limits whose minimum is not below their maximum."""
    low, high = limits
    if not low < high:
        raise DaqmxError(
            Code.MIN_NOT_LESS_THAN_MAX, f"Minimum Value: {low:g}; Maximum Value: {high:g}"
        )


def _fitting_range(limits: tuple[float, float], offered: Sequence[float]) -> float:
    """Return the smallest of the ranges ``offered`` in V that includes both ``limits``."""
    low, high = limits
    fitting = [r for r in offered if max(abs(low), abs(high)) <= r * (1.0 + 1e-9)]
    if not fitting:
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Property: Max or Min; Requested Values: {low:g}, {high:g}; Largest Range: "
            f"+-{max(offered):g} V",
        )
    return min(fitting)
