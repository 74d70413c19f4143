"""Set-up of the card's channels and timing, with errors for what the card does not have."""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from dearig.drivers.settings import RigSettings
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.ranges import check_order, fitting_range, smallest_range
from dearig.sim_backend.daqmx.card.scales import Scale
from dearig.sim_backend.daqmx.card.sensors import Sensor
from dearig.sim_backend.daqmx.card.tasks import (
    DIGITAL_EDGE,
    FALLING,
    NO_TRIGGER,
    RISING,
    AnalogInput,
    AnalogOutput,
    Kind,
    Lines,
    SampleClock,
    Task,
    Watchdog,
    counted_on,
    expanded,
    physical_names,
)
from dearig.sim_backend.daqmx.card.terminals import LINES, Terminals
from dearig.sim_backend.daqmx.card.wiring import OUTPUT_MONITOR

__all__ = [
    "CLOCKED_KINDS",
    "CLOCK_OF",
    "INPUTS",
    "INPUT_RANGES",
    "LINES",
    "OUTPUTS",
    "PINS",
    "Setup",
]

INPUT_RANGES = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1)  #: V, plus and minus, as the PCIe-6361 has them
INPUTS = 16
OUTPUTS = ("ao0", "ao1")
#: Terminals on the connector and the bus, in lower case.
PINS = {f"pfi{i}": f"PFI{i}" for i in range(16)} | {f"rtsi{i}": f"RTSI{i}" for i in range(8)}
#: Terminal of the sample clock of each kind of task.
CLOCK_OF = {
    Kind.AI: "ai/sampleclock",
    Kind.AO: "ao/sampleclock",
    Kind.DI: "di/sampleclock",
    Kind.DO: "do/sampleclock",
}
CLOCKED_KINDS = (
    Kind.AI,
    Kind.AO,
    Kind.DI,
    Kind.DO,
    Kind.CI,
    Kind.CO,
)  #: kinds of tasks with a sample clock
DIFFERENTIAL, SINGLE, SINGLE_OWN_SENSE = 10106, 10083, 10078  #: DAQmx: DIFF, RSE, NRSE
SECONDS, TICKS, PERIODS = 10364, 10304, 10286  #: DAQmx: units of the delay

_ON_BOARD = "onboardclock"
_MOST_SAMPLES = 2**32 - 1  # per channel, in a buffer
_SLOWEST = 2**32  # ticks of the timebase between two samples
_SETTLE_US = 10.0  # extra settling time that the driver gives an input where there is time
#: A rate that is a whole division may be too high by the rounding of two divisions in doubles.
_ROUNDED = 1.0 + 2.0 * sys.float_info.epsilon
_FIRST_US = 0.25  # default delay from the sample clock to the first conversion
#: Default input buffer of a continuous task: up to a rate in Hz, in samples.
_BUFFERS = ((100.0, 1000), (10e3, 10_000), (1e6, 100_000), (math.inf, 1_000_000))


class Setup:
    """Set-up of the card of a rig with ``settings``, without any timing.

    All methods are thread-safe, and all may raise ``DaqmxError``.
    """

    def __init__(self, settings: RigSettings, signals: Mapping[str, str] | None = None) -> None:
        self.settings = settings
        self.name = settings.card.device
        self.terminals = Terminals(self.name, signals)
        self._card = settings.card
        self._lock = threading.RLock()
        self.scales: dict[str, Scale] = {}  # by name in lower case
        self.kept: dict[object, object] = {}  # properties of the device without effect

    def check_device(self, name: str) -> None:
        """Refuse a device that is not this one; a channel of it stands for it too."""
        if name.partition("/")[0].lower() != self.name.lower():
            raise DaqmxError(Code.UNKNOWN_DEVICE, f"Device Specified: {name}")

    def add_scale(self, scale: Scale) -> None:
        """Add ``scale``, or replace the one of the same name."""
        scale.check()
        with self._lock:
            self.scales[scale.name.lower()] = scale

    def remove_scale(self, name: str) -> None:
        """Forget the custom scale called ``name``."""
        with self._lock:
            del self.scales[self.scale(name).name.lower()]

    def scale(self, name: str) -> Scale:
        """Return the custom scale called ``name``."""
        with self._lock:
            if name.lower() not in self.scales:
                raise DaqmxError(Code.UNKNOWN_SCALE, f"Custom Scale Name: {name}")
            return self.scales[name.lower()]

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
        with self._lock:
            self._may_add(task, Kind.AI)
            taken = smallest_range(limits if scale is None else scale.limits(limits), INPUT_RANGES)
            made: list[AnalogInput] = []
            terminals = physical_names(physical, self.name)
            for terminal, called in self._named(task, terminals, name):
                how = self._wiring_of(terminal, wiring)
                own = (
                    replace(scale, values=dict(scale.values))
                    if isinstance(scale, Sensor)
                    else scale
                )
                made.append(AnalogInput(called, terminal, limits, taken, how, own))
            task.kind = Kind.AI
            task.inputs += made
            return made

    def _wiring_of(self, terminal: str, wiring: int) -> int:
        """Return the wiring of the input ``terminal`` for ``wiring`` (-1: the default)."""
        if terminal in [OUTPUT_MONITOR.format(ao) for ao in OUTPUTS]:
            return DIFFERENTIAL
        known = terminal.startswith("ai") and terminal[2:].isdigit()
        if not known or int(terminal[2:]) >= INPUTS:
            raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {self.name}/{terminal}")
        # an input and the eighth one after it make a pair
        pair = int(terminal[2:]) % 16 < 8
        how = (DIFFERENTIAL if pair else SINGLE) if wiring == -1 else wiring
        offered = (DIFFERENTIAL, SINGLE, SINGLE_OWN_SENSE)
        if how not in offered or (how == DIFFERENTIAL and not pair):
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: AI_TERM_CFG; Requested Value: {how}; Channel Name: "
                f"{self.name}/{terminal}",
            )
        return how

    def set_wiring(self, task: Task, channel: AnalogInput, wiring: int) -> None:
        """Set the wiring of an input (-1: the default)."""
        with self._lock:
            self._not_set_while_running(task)
            channel.wiring = self._wiring_of(channel.terminal, wiring)

    def set_limits(
        self,
        task: Task,
        channel: AnalogInput | AnalogOutput,
        low: float | None = None,
        high: float | None = None,
    ) -> None:
        """Set one of a channel's limits, or both; their order is checked with the task."""
        with self._lock:
            self._not_set_while_running(task)
            present = channel.limits
            limits = (present[0] if low is None else low, present[1] if high is None else high)
            volts = limits if channel.scale is None else channel.scale.limits(limits)
            channel.range = fitting_range(volts, self._offered(channel))
            channel.limits = limits

    def set_range(self, task: Task, channel: AnalogInput | AnalogOutput, limit: float) -> None:
        """Set the range of a channel to the smallest one that includes ``limit`` V."""
        with self._lock:
            self._not_set_while_running(task)
            channel.range = fitting_range((-limit, limit), self._offered(channel))

    def set_scale(self, task: Task, channel: AnalogInput | AnalogOutput, name: str) -> None:
        """Set the custom scale of a channel; an empty ``name`` removes it."""
        with self._lock:
            self._not_set_while_running(task)
            scale = self.scale(name) if name else None
            volts = channel.limits if scale is None else scale.limits(channel.limits)
            channel.range = fitting_range(volts, self._offered(channel))
            channel.scale = scale

    def _offered(self, channel: AnalogInput | AnalogOutput) -> Sequence[float]:
        return INPUT_RANGES if isinstance(channel, AnalogInput) else (self._card.ao_range_V,)

    def add_outputs(
        self,
        task: Task,
        physical: str,
        name: str,
        limits: tuple[float, float],
        scale: Scale | None = None,
    ) -> None:
        """Add the outputs ``physical`` within ``limits``, in V or in the unit of ``scale``."""
        with self._lock:
            self._may_add(task, Kind.AO)
            volts = limits if scale is None else scale.limits(limits)
            taken = smallest_range(volts, (self._card.ao_range_V,))
            made = []
            terminals = physical_names(physical, self.name)
            for terminal, called in self._named(task, terminals, name):
                if terminal not in OUTPUTS:
                    raise DaqmxError(
                        Code.UNKNOWN_CHANNEL, f"Physical Channel: {self.name}/{terminal}"
                    )
                made.append(AnalogOutput(called, terminal, limits, taken, scale))
            task.kind = Kind.AO
            task.outputs += made

    def add_lines(
        self, task: Task, physical: str, name: str, *, together: bool, kind: Kind = Kind.DO
    ) -> None:
        """Add digital lines, a channel each or all ``together`` in one; ``kind`` is DI or DO."""
        with self._lock:
            self._may_add(task, kind)
            lines = self.lines_of(physical)
            if together:
                # the driver's name for several lines is that of the first one and three dots
                whole = [p for p in physical_names(physical, self.name) if "/" not in p]
                more = "..." if len(lines) > 1 else ""
                given = name or f"{self.name}/{whole[0] if whole else lines[0] + more}"
                groups = [Lines(given, tuple(lines), tuple(self._columns(physical)))]
            else:
                groups = [
                    Lines(called, (line,), (line,))
                    for line, called in self._named(task, lines, name)
                ]
            if {group.name for group in groups} & set(task.channel_names):
                raise DaqmxError(Code.CHANNEL_ALREADY_IN_TASK, f"Channel Name: {groups[0].name}")
            task.kind = kind
            task.lines += groups

    def _columns(self, physical: str) -> list[str]:
        """Return the lines in ``physical``, those of a whole port from the highest down."""
        columns = []
        for name in physical_names(physical, self.name):
            lines = self.lines_of(f"{self.name}/{name}")
            columns += lines if "/" in name else lines[::-1]
        return columns

    def lines_of(self, physical: str) -> list[str]:
        """Return the digital lines in ``physical``: ``Dev1/port0/line0:3``, or a whole port."""
        lines = []
        for name in physical_names(physical, self.name):
            found = [line for line in LINES if line == name or line.startswith(f"{name}/")]
            if not found:
                raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {self.name}/{name}")
            lines += found
        return lines

    # timing

    def set_clock(self, task: Task, rate: float, source: str, finite: bool, samples: int) -> None:
        """Give ``task`` a sample clock of ``rate`` Hz from the terminal ``source``."""
        with self._lock:
            self._not_running(task)
            self._has_timing(task)
            if samples > _MOST_SAMPLES:
                raise DaqmxError(
                    Code.INVALID_VALUE,
                    f"Property: SAMP_QUANT_SAMP_PER_CHAN; Requested Value: {samples}; Maximum "
                    f"Value: {_MOST_SAMPLES}; Task Name: {task.name}",
                )
            coerced = self._coerced(task, rate, external=self._is_external(source))
            task.timing = SampleClock(coerced, source, finite, samples)
            task.clocked = True

    def change_clock(self, task: Task, **changes: Any) -> None:
        """Set fields of the timing of ``task`` without a change between clock and on demand."""
        with self._lock:
            clocked = task.clocked
            fields = ("rate", "source", "finite", "samples")
            wanted = {name: getattr(task.timing, name) for name in fields} | changes
            edge, implicit = task.timing.edge, task.timing.implicit
            self.set_clock(task, **wanted)
            task.timing.edge, task.timing.implicit = edge, implicit
            task.clocked = clocked

    def set_clocked(self, task: Task, clocked: bool) -> None:
        """Give ``task`` its sample clock, or make it sample on demand."""
        with self._lock:
            self._not_running(task)
            self._has_timing(task)
            task.clocked = clocked

    def timing_of(self, task: Task) -> SampleClock:
        """Return the settings of the sample clock of ``task``; raises an error if it has none."""
        self._has_timing(task)
        return task.timing

    def samples_of(self, task: Task) -> int:
        """Return the samples per channel; refuses a number that a finite task cannot have."""
        timing = self.timing_of(task)
        if timing.samples < (2 if timing.finite else 0):
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: SAMP_QUANT_SAMP_PER_CHAN; Requested Value: {timing.samples}; Minimum "
                f"Value: 2; Task Name: {task.name}",
            )
        return timing.samples

    def _has_timing(self, task: Task) -> None:
        if task.kind is Kind.EMPTY:
            raise DaqmxError(Code.NOT_WITHOUT_CHANNELS, f"Task Name: {task.name}")
        if task.kind not in CLOCKED_KINDS:
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, f"Task Name: {task.name}")

    def _is_external(self, source: str) -> bool:
        return source.strip().lower().rpartition("/")[2] not in ("", "onboardclock")

    def convert_ticks(self, task: Task) -> int:
        """Return the ticks of the timebase between two conversions of an input task."""
        if task.convert_ticks is not None:
            return task.convert_ticks
        fastest = math.ceil(self._timebase / (1e3 * self._card.ai_rate_max_kHz))
        settled = fastest + round(_SETTLE_US * self._card.timebase_MHz)
        if task.clock is None:
            return settled
        room = self._timebase / task.clock.rate - self.delay_ticks(task)
        return max(fastest, min(settled, math.floor(room / max(1, len(task.inputs)))))

    def set_convert_rate(self, task: Task, rate: float) -> None:
        """Set the rate in Hz of an input task's conversions."""
        with self._lock:
            self._not_running(task)
            self._of_kind(task, Kind.AI)
            fastest = 1e3 * self._card.ai_rate_max_kHz
            if not self._timebase / _SLOWEST <= rate <= fastest * (1.0 + 1e-9):
                raise DaqmxError(
                    Code.INVALID_VALUE,
                    f"Property: AIConv.Rate; Requested Value: {rate:g}; Maximum Value: {fastest:g}",
                )
            task.convert_ticks = round(self._timebase / rate)

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
        seconds = ticks / self._timebase
        return seconds if task.delay_units == SECONDS else seconds * task.timing.rate

    def set_delay(self, task: Task, value: float) -> None:
        """Set the delay, in the unit that the program has chosen."""
        with self._lock:
            self._not_running(task)
            self._of_kind(task, Kind.AI)
            ticks = value
            if task.delay_units == SECONDS:
                ticks = value * self._timebase
            elif task.delay_units == PERIODS:
                ticks = value / task.timing.rate * self._timebase
            if not 0.0 <= ticks < _SLOWEST:
                raise DaqmxError(
                    Code.INVALID_VALUE, f"Property: DelayFromSampClk.Delay; Value: {value:g}"
                )
            task.delay_ticks = round(ticks)

    def set_delay_units(self, task: Task, units: int) -> None:
        """Set the unit of the delay: ``SECONDS``, ``TICKS`` or ``PERIODS``."""
        if units not in (SECONDS, TICKS, PERIODS):
            raise DaqmxError(
                Code.INVALID_VALUE, f"Property: DelayFromSampClk.DelayUnits; Value: {units}"
            )
        task.delay_units = units

    def set_trigger(self, task: Task, source: str, edge: int = RISING) -> None:
        """Make ``task`` wait for a digital ``edge`` on ``source`` at its start; empty: no wait.

        The pulses within the card have no length here, so both of their edges are at one time.
        """
        with self._lock:
            self._not_running(task)
            if edge not in (RISING, FALLING):
                raise DaqmxError(
                    Code.INVALID_VALUE, f"Property: DigEdge.StartTrig.Edge; Value: {edge}"
                )
            task.trigger = self._terminal(source) if source else ""
            task.trigger_edge = edge
            task.trigger_type = DIGITAL_EDGE if source else NO_TRIGGER

    def set_trigger_edge(self, task: Task, edge: int) -> None:
        """Set the edge of the start trigger."""
        kind = task.trigger_type
        self.set_trigger(task, task.trigger, edge)
        task.trigger_type = kind

    def set_trigger_type(self, task: Task, kind: int) -> None:
        """Set the type of the start trigger; its source is checked with the task."""
        with self._lock:
            self._not_running(task)
            task.trigger_type = kind
            if kind == NO_TRIGGER:
                task.trigger = ""

    def set_buffer(self, task: Task, samples: int | None) -> None:
        """Set the size of the task's buffer to ``samples`` per channel; None: the default."""
        with self._lock:
            self._not_set_while_running(task)
            task.buffer = samples

    def set_regeneration(self, task: Task, allowed: bool) -> None:
        """Set whether an output task repeats the written samples."""
        with self._lock:
            self._not_set_while_running(task)
            task.regenerates = allowed
            task.waveform = None

    def buffer_size(self, task: Task) -> int:
        """Return the size of the task's buffer in samples per channel; 0 without a buffer."""
        if task.buffer is not None:
            return task.buffer
        if task.clock is None:
            return 0
        if task.kind is Kind.AO:
            return task.first_write if task.waveform is not None else 0
        if task.clock.finite:
            return task.clock.samples
        usual = next(size for rate, size in _BUFFERS if task.clock.rate <= rate)
        return max(usual, task.clock.samples)

    # checks

    def _verify(self, task: Task) -> None:
        if task.kind is Kind.EMPTY:
            raise DaqmxError(Code.NOT_WITHOUT_CHANNELS, f"Task Name: {task.name}")
        for terminal in task.exports.values():
            if terminal and self._pin(terminal) not in PINS:
                raise DaqmxError(
                    Code.INVALID_ROUTE_DESTINATION,
                    f"Destination Terminal: {terminal}; Task Name: {task.name}",
                )
        analog: list[AnalogInput | AnalogOutput] = [*task.inputs, *task.outputs]
        for channel in analog:
            check_order(channel.limits)
            if channel.scale is not None:
                channel.scale.check()
            if max(abs(v) for v in channel.volts) > channel.range * (1.0 + 1e-9):
                raise DaqmxError(
                    Code.INVALID_VALUE,
                    f"Requested Values: {channel.volts}; Range: +-{channel.range:g} V; Channel "
                    f"Name: {channel.name}; Task Name: {task.name}",
                )
        if task.clock is None:
            if task.trigger_type != NO_TRIGGER and task.kind is not Kind.CO:
                raise DaqmxError(Code.TRIGGER_ON_DEMAND, f"Task Name: {task.name}")
            return
        analog_start = task.reference is not None and task.reference.starts
        if task.trigger_type not in (NO_TRIGGER, DIGITAL_EDGE) and not analog_start:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: START_TRIG_TYPE; Requested Value: {task.trigger_type}; You Can Select: "
                f"{NO_TRIGGER}, {DIGITAL_EDGE}; Task Name: {task.name}",
            )
        if task.trigger_type == DIGITAL_EDGE and not task.trigger:
            raise DaqmxError(Code.INVALID_ROUTE_SOURCE, f"Source Terminal: ; Task: {task.name}")
        self.samples_of(task)
        self.clock_source(task)
        if task.kind is not Kind.AI:
            return
        self._coerced(task, task.clock.rate, external=True)
        # the last input's conversion must have begun before the next tick
        last = self.delay_ticks(task) + (len(task.inputs) - 1) * self.convert_ticks(task)
        if last >= self._timebase / task.clock.rate:
            raise DaqmxError(
                Code.CONVERT_PERIOD,
                f"Sample Rate: {task.clock.rate:g}; Number of Channels: {len(task.inputs)}; the "
                f"last conversion begins after {last / self._timebase * 1e6:g} us. Task Name: "
                f"{task.name}",
            )

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
        ticks = self._timebase / rate
        # NI's driver truncates the divisor of an analog input and rounds the others
        whole = math.floor(ticks * _ROUNDED) if task.kind is Kind.AI else round(ticks)
        return self._timebase / max(whole, math.ceil(self._timebase / most / _ROUNDED))

    @property
    def _timebase(self) -> float:
        return self._card.timebase_MHz * 1e6

    @property
    def fastest_input(self) -> float:
        """Return the highest rate in Hz of a single input, which is twice that of several."""
        return 2e3 * self._card.ai_rate_max_kHz

    @property
    def slowest(self) -> float:
        """Return the lowest rate in Hz that the timebase can be divided down to."""
        return self._timebase / _SLOWEST

    def fastest(self, task: Task) -> float:
        """Return the highest rate in Hz of the sample clock of ``task``."""
        if task.kind is not Kind.AI:
            return 1e3 * self._card.ao_rate_max_kHz
        several = len(task.inputs)
        return 1e3 * self._card.ai_rate_max_kHz / several if several > 1 else self.fastest_input

    def _pin(self, source: str) -> str:
        """Return a terminal such as ``/Dev1/PFI0`` without its device, in lower case."""
        text = source.strip().lower()
        if text.startswith("/"):
            owner, _, text = text[1:].partition("/")
            if owner != self.name.lower():
                raise DaqmxError(Code.INVALID_ROUTE_SOURCE, f"Source Terminal: {source}")
        return text

    def _terminal(self, source: str) -> str:
        """Return a terminal such as ``/Dev1/ao/SampleClock`` without its device, in lower case."""
        if self._pin(source) == _ON_BOARD:
            return _ON_BOARD
        return self.terminals.name(source)

    def full_terminal(self, source: str) -> str:
        """Return the full name of a source, such as ``/Dev1/PFI0`` for ``pfi0``."""
        short = self._terminal(source)
        return f"/{self.name}/OnboardClock" if short == _ON_BOARD else self.terminals.full(short)

    def clock_source(self, task: Task) -> str:
        """Return the terminal that clocks ``task``; empty for its own clock."""
        source = task.timing.source
        if not source or self._terminal(source) == _ON_BOARD:
            return ""
        terminal = self._terminal(source)
        if terminal == CLOCK_OF.get(task.kind):
            return ""
        if task.kind in (Kind.AO, Kind.DO):
            raise DaqmxError(
                Code.ROUTE_NOT_SUPPORTED,
                f"Source Terminal: {source}; outputs on a clock from elsewhere are not simulated. "
                f"Task Name: {task.name}",
            )
        return terminal

    def _may_add(self, task: Task, kind: Kind) -> None:
        self._not_running(task)
        if task.kind not in (Kind.EMPTY, kind):
            raise DaqmxError(Code.MIXED_CHANNELS, f"Task Name: {task.name}")

    def _named(self, task: Task, terminals: list[str], name: str) -> Iterable[tuple[str, str]]:
        """Yield each of ``terminals`` with the unique name of its channel."""
        names = [f"{self.name}/{terminal}" for terminal in terminals]
        given = [n for part in name.split(",") for n in expanded(part.strip())] if name else []
        if len(given) == 1 and len(terminals) > 1:
            names = counted_on(given[0], len(terminals))
        elif given:
            names = given + names[len(given) :]
        taken = {called.lower() for called in task.channel_names}
        for called in names:
            if called.lower() in taken or [n.lower() for n in names].count(called.lower()) > 1:
                raise DaqmxError(Code.CHANNEL_ALREADY_IN_TASK, f"Channel Name: {called}")
        return list(zip(terminals, names, strict=False))

    def _not_set_while_running(self, task: Task) -> None:
        if task.running:
            raise DaqmxError(Code.PROPERTY_WHILE_RUNNING, f"Task Name: {task.name}")

    def _not_running(self, task: Task) -> None:
        if task.running:
            raise DaqmxError(Code.NOT_WHILE_RUNNING, f"Task Name: {task.name}")

    def _of_kind(self, task: Task, kind: Kind, code: Code = Code.NOT_SUPPORTED_IN_TASK) -> None:
        if task.kind is Kind.EMPTY:
            code = Code.NOT_WITHOUT_CHANNELS
        if task.kind is not kind:
            raise DaqmxError(code, f"Task Name: {task.name}")

    def _watchdog(self, task: Task) -> Watchdog:
        if task.watchdog is None:
            raise DaqmxError(Code.WATCHDOG_ONLY, f"Task Name: {task.name}")
        return task.watchdog
