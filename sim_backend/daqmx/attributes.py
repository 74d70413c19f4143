"""DAQmx's properties by group and number, with getter and, if settable, setter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from dearig.sim_backend.daqmx.device import Device, check_watchdog
from dearig.sim_backend.daqmx.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.setup import INPUT_RANGES, INPUTS, LINES, OUTPUTS
from dearig.sim_backend.daqmx.tasks import AnalogInput, AnalogOutput, Kind, Lines, Task, expanded

__all__ = ["SERIAL", "Asked", "get", "reset", "set_"]

SERIAL = 0x0D1E1EC7  #: serial number of the simulated card
DRIVER = (25, 0, 0)  #: driver version that the server reports

_REGENERATION, _NO_REGENERATION = 10097, 10158
_FINITE, _CONTINUOUS = 10178, 10123
_SAMPLE_CLOCK, _ON_DEMAND = 10388, 10390
_VOLTAGE_IN, _VOLTAGE_OUT, _VOLTS, _BITS = 10322, 10322, 10348, 10109
_X_SERIES = 15858
_RISING = 10280
_HIGH, _LOW = 10192, 10214
_DIGITAL_EDGE, _NO_TRIGGER = 10150, 10230
_DO_NOT_OVERWRITE = 10159


@dataclass(frozen=True)
class Asked:
    """Target of a property: the ``device``, and a ``task`` and ``channel`` if any.

    ``channel`` names channels in the task, channels of the device, or lines, by the group.
    """

    device: Device
    task: Task | None = None
    channel: str = ""

    @property
    def own(self) -> Task:
        """Return the task; raises an error without one."""
        if self.task is None:
            raise DaqmxError(Code.INVALID_TASK)
        return self.task

    def first(self) -> AnalogInput | AnalogOutput | Lines:
        """Return the first of the addressed channels of the task."""
        task = self.own
        if not task.channels:
            raise DaqmxError(Code.NOT_WITHOUT_CHANNELS, f"Task Name: {task.name}")
        # the first name of a list or range such as Dev1/ai0:2; names are not case-sensitive
        wanted = expanded(self.channel.split(",")[0].strip())[0].lower()
        for channel in task.channels:
            if not wanted or channel.name.lower() == wanted:
                return channel
        raise DaqmxError(
            Code.CHANNEL_NOT_IN_TASK, f"Channel Name: {self.channel}; Task Name: {task.name}"
        )

    def analog(self) -> AnalogInput | AnalogOutput:
        """Return the same channel; raises an error unless it is analog."""
        channel = self.first()
        if isinstance(channel, Lines):
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, f"Task Name: {self.own.name}")
        return channel

    def input(self) -> AnalogInput:
        """Return the same channel; raises an error unless it is an analog input."""
        channel = self.first()
        if not isinstance(channel, AnalogInput):
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, f"Task Name: {self.own.name}")
        return channel


Getter = Callable[[Asked], Any]
Setter = Callable[[Asked, Any], None]


def _always(value: object) -> Getter:
    return lambda _: value


def _names(asked: Asked, parts: Sequence[str]) -> str:
    return ", ".join(f"{asked.device.name}/{part}" for part in parts)


def _physical(asked: Asked) -> str:
    channel = asked.first()
    terminals = channel.lines if isinstance(channel, Lines) else (channel.terminal,)
    return _names(asked, terminals)


def _ranges(limits: Sequence[float]) -> list[float]:
    return [side * limit for limit in sorted(limits) for side in (-1.0, 1.0)]


def _set_regeneration(asked: Asked, value: int) -> None:
    if value not in (_REGENERATION, _NO_REGENERATION):
        raise DaqmxError(Code.INVALID_VALUE, f"Property: Write.RegenMode; Value: {value}")
    asked.device.set_regeneration(asked.own, value == _REGENERATION)


def _set_quantity(asked: Asked, *, finite: bool | None = None, samples: int | None = None) -> None:
    clock = asked.device.clock_of(asked.own)
    asked.device.set_clock(
        asked.own,
        clock.rate,
        clock.source,
        clock.finite if finite is None else finite,
        clock.samples if samples is None else samples,
    )


def _only(*values: Any) -> Setter:
    """Return a setter that accepts only the values that the card has anyway."""

    def check(_: Asked, value: Any) -> None:
        if value not in values:
            raise DaqmxError(Code.INVALID_VALUE, f"Requested Value: {value}")

    return check


def _set_timeout(asked: Asked, value: float) -> None:
    watchdog = asked.own.watchdog
    if watchdog is not None:
        check_watchdog(value)
        watchdog.timeout = value


def _watchdog_timeout(asked: Asked) -> float:
    watchdog = asked.own.watchdog
    return -1.0 if watchdog is None else watchdog.timeout


def _clock_source(asked: Asked) -> str:
    source = asked.device.clock_of(asked.own).source
    return f"/{asked.device.name}/{source or 'OnboardClock'}"


def _trigger_terminal(asked: Asked) -> str:
    side = "ai" if asked.own.kind is Kind.AI else "ao"
    return f"/{asked.device.name}/{side}/StartTrigger"


def _set_read_available(asked: Asked, value: bool) -> None:
    asked.own.read_available = value


def _acquired(asked: Asked) -> int:
    return asked.device.acquired(asked.own)


#: group, number -> getter, setter
TABLE: dict[tuple[str, int], tuple[Getter | None, Setter | None]] = {
    # the system and the device
    ("SystemInfo", 0x1272): (_always(DRIVER[0]), None),
    ("SystemInfo", 0x1923): (_always(DRIVER[1]), None),
    ("SystemInfo", 0x2F22): (_always(DRIVER[2]), None),
    ("SystemInfo", 0x193B): (lambda a: a.device.name, None),
    ("SystemInfo", 0x1267): (_always(""), None),  # saved tasks
    ("SystemInfo", 0x1265): (_always(""), None),  # saved channels
    ("SystemInfo", 0x1266): (_always(""), None),  # saved scales
    ("Device", 0x0631): (_always("PCIe-6361"), None),
    ("Device", 0x0632): (_always(SERIAL), None),
    ("Device", 0x231D): (_always(0x7434), None),  # product number
    ("Device", 0x29A9): (_always(_X_SERIES), None),
    ("Device", 0x22CA): (_always(True), None),
    ("Device", 0x231E): (lambda a: _names(a, [f"ai{i}" for i in range(INPUTS)]), None),
    ("Device", 0x231F): (lambda a: _names(a, OUTPUTS), None),
    ("Device", 0x2320): (lambda a: _names(a, LINES), None),
    ("Device", 0x2322): (lambda a: _names(a, LINES), None),
    ("Device", 0x2321): (lambda a: _names(a, [f"port{i}" for i in range(3)]), None),
    ("Device", 0x2323): (lambda a: _names(a, [f"port{i}" for i in range(3)]), None),
    ("Device", 0x2324): (_always(""), None),  # counters in
    ("Device", 0x2325): (_always(""), None),  # counters out
    ("Device", 0x2990): (lambda _: _ranges(INPUT_RANGES), None),
    ("Device", 0x299B): (lambda a: _ranges([a.device.settings.card.ao_range_V]), None),
    ("Device", 0x298C): (lambda a: a.device.fastest_input, None),
    ("Device", 0x298D): (lambda a: 1e3 * a.device.settings.card.ai_rate_max_kHz, None),
    ("Device", 0x298E): (lambda a: a.device.slowest, None),
    ("Device", 0x298F): (_always(False), None),
    ("Device", 0x2997): (lambda a: 1e3 * a.device.settings.card.ao_rate_max_kHz, None),
    ("Device", 0x2998): (lambda a: a.device.slowest, None),
    ("Device", 0x2996): (_always(True), None),
    ("Device", 0x2985): (_always(True), None),
    # a task and its channels
    ("Task", 0x1276): (lambda a: a.own.name, None),
    ("Task", 0x1273): (lambda a: ", ".join(a.own.channel_names), None),
    ("Task", 0x2181): (lambda a: len(a.own.channel_names), None),
    ("Task", 0x230E): (lambda a: a.device.name if a.own.kind is not Kind.EMPTY else "", None),
    ("Task", 0x29BA): (lambda a: int(a.own.kind is not Kind.EMPTY), None),
    ("Task", 0x1274): (lambda a: a.device.is_done(a.own), None),
    ("Chan", 0x187F): (lambda a: a.first() and a.own.kind.value, None),
    ("Chan", 0x18F5): (_physical, None),
    ("Chan", 0x1926): (_always(""), None),
    ("Chan", 0x2304): (_always(False), None),
    ("Chan", 0x0695): (lambda a: a.input() and _VOLTAGE_IN, None),
    ("Chan", 0x1094): (lambda a: a.input() and _VOLTS, None),
    ("Chan", 0x1097): (lambda a: a.input().wiring, None),
    ("Chan", 0x17DD): (lambda a: a.input().limits[1], None),
    ("Chan", 0x17DE): (lambda a: a.input().limits[0], None),
    ("Chan", 0x1815): (lambda a: a.input().range, None),
    ("Chan", 0x1816): (lambda a: -a.input().range, None),
    ("Chan", 0x1930): (lambda a: a.device.scaling(a.own, a.input().name), None),
    ("Chan", 0x1765): (_always(16.0), None),
    ("Chan", 0x1764): (_always(_BITS), _only(_BITS)),
    ("Chan", 0x22DA): (lambda a: a.input() and 16, None),
    ("Chan", 0x1108): (_always(_VOLTAGE_OUT), None),
    ("Chan", 0x1184): (_always(_VOLTS), None),
    ("Chan", 0x1186): (lambda a: a.analog().limits[1], None),
    ("Chan", 0x1187): (lambda a: a.analog().limits[0], None),
    ("Chan", 0x182E): (lambda a: a.analog().range, None),
    ("Chan", 0x182D): (lambda a: -a.analog().range, None),
    ("Chan", 0x1931): (lambda a: a.device.scaling(a.own, a.analog().name), None),
    ("Chan", 0x182C): (_always(16.0), None),
    ("Chan", 0x182B): (_always(_BITS), _only(_BITS)),
    ("Chan", 0x2179): (lambda a: len(a.own.line_names), None),
    ("PhysicalChan", 0x2342): (lambda a: _wirings(a), None),
    # timing
    ("Timing", 0x1347): (lambda a: _ON_DEMAND if a.own.clock is None else _SAMPLE_CLOCK, None),
    ("Timing", 0x1344): (
        lambda a: a.device.clock_of(a.own).rate,
        lambda a, v: a.device.set_rate(a.own, v),
    ),
    ("Timing", 0x22C8): (lambda a: a.device.fastest(a.own), None),
    ("Timing", 0x1852): (_clock_source, None),
    ("Timing", 0x2F1B): (_clock_source, None),
    ("Timing", 0x1301): (_always(_RISING), _only(_RISING)),
    ("Timing", 0x1303): (lambda a: a.device.settings.card.timebase_MHz * 1e6, None),
    ("Timing", 0x1300): (
        lambda a: _FINITE if a.device.clock_of(a.own).finite else _CONTINUOUS,
        lambda a, v: _set_quantity(a, finite=v == _FINITE),
    ),
    ("Timing", 0x1310): (
        lambda a: a.device.clock_of(a.own).samples,
        lambda a, v: _set_quantity(a, samples=v),
    ),
    ("Timing", 0x1848): (
        lambda a: a.device.settings.card.timebase_MHz * 1e6 / a.device.convert_ticks(a.own),
        lambda a, v: a.device.set_convert_rate(a.own, v),
    ),
    ("Timing", 0x22C9): (lambda a: 1e3 * a.device.settings.card.ai_rate_max_kHz, None),
    ("Timing", 0x1317): (
        lambda a: a.device.delay(a.own),
        lambda a, v: a.device.set_delay(a.own, v),
    ),
    ("Timing", 0x1304): (
        lambda a: a.own.delay_units,
        lambda a, v: a.device.set_delay_units(a.own, v),
    ),
    # triggers
    ("Trig", 0x1393): (lambda a: _DIGITAL_EDGE if a.own.trigger else _NO_TRIGGER, None),
    ("Trig", 0x1407): (
        lambda a: f"/{a.device.name}/{a.own.trigger}" if a.own.trigger else "",
        lambda a, v: a.device.set_trigger(a.own, v, a.own.trigger_edge),
    ),
    ("Trig", 0x1404): (
        lambda a: a.own.trigger_edge,
        lambda a, v: a.device.set_trigger(a.own, a.own.trigger, v),
    ),
    ("Trig", 0x2F1E): (_trigger_terminal, None),
    # buffers, reading and writing
    ("Buffer", 0x186C): (
        lambda a: a.device.buffer_size(a.own),
        lambda a, v: a.device.set_buffer(a.own, v),
    ),
    ("Buffer", 0x186D): (
        lambda a: a.device.buffer_size(a.own),
        lambda a, v: a.device.set_buffer(a.own, v),
    ),
    ("Buffer", 0x230A): (_always(4095), None),
    ("Buffer", 0x230B): (lambda a: a.device.settings.card.ao_fifo_samples, None),
    ("Read", 0x1823): (lambda a: ", ".join(a.own.channel_names), None),
    ("Read", 0x217B): (lambda a: len(a.own.inputs), None),
    ("Read", 0x217A): (lambda a: 2 * len(a.own.inputs), None),
    ("Read", 0x1223): (lambda a: a.device.available(a.own), None),
    ("Read", 0x1221): (lambda a: a.own.delivered, None),
    ("Read", 0x192A): (_acquired, None),
    ("Read", 0x1826): (_always(True), _only(True)),
    ("Read", 0x1215): (lambda a: a.own.read_available, _set_read_available),
    ("Read", 0x31E8): (lambda a: a.device.default_samples(a.own), None),
    ("Read", 0x1211): (_always(_DO_NOT_OVERWRITE), _only(_DO_NOT_OVERWRITE)),
    ("Read", 0x2174): (_always(False), None),
    ("Write", 0x217E): (lambda a: len(a.own.channel_names), None),
    ("Write", 0x217F): (lambda a: _booleans(a), None),
    ("Write", 0x217D): (lambda a: 2 * len(a.own.outputs), None),
    ("Write", 0x1453): (
        lambda a: _REGENERATION if a.own.regenerates else _NO_REGENERATION,
        _set_regeneration,
    ),
    ("Write", 0x1458): (lambda a: a.device.written(a.own), None),
    ("Write", 0x1460): (lambda a: a.device.space(a.own), None),
    ("Write", 0x192B): (lambda a: a.device.generated(a.own), None),
    # the watchdog
    ("Watchdog", 0x21A8): (lambda a: a.device.expired(a.own), None),
    ("Watchdog", 0x21A9): (_watchdog_timeout, _set_timeout),
    ("Watchdog", 0x21A7): (
        lambda a: _HIGH if a.device.expiration(a.own, a.channel) else _LOW,
        lambda a, v: a.device.set_expiration(a.own, a.channel, level(v)),
    ),
}

#: Value that a reset of a property sets, where a reset is allowed.
DEFAULTS: dict[tuple[str, int], Any] = {
    ("Write", 0x1453): _REGENERATION,
    ("Chan", 0x182B): _BITS,
    ("Chan", 0x1764): _BITS,
    ("Trig", 0x1407): "",
}


def level(value: int) -> bool:
    """Return True if DAQmx's ``value`` of a line is high; refuses states without support."""
    if value not in (_HIGH, _LOW):
        raise DaqmxError(Code.INVALID_VALUE, f"Property: Watchdog.DO.ExpirState; Value: {value}")
    return value == _HIGH


def get(group: str, number: int, asked: Asked) -> Any:
    """Return the value of a property."""
    getter, _ = _entry(group, number)
    if getter is None:
        raise DaqmxError(Code.PROPERTY_NOT_SUPPORTED, f"Property: {group} {number:#06x}")
    return getter(asked)


def set_(group: str, number: int, asked: Asked, value: Any) -> None:
    """Set a property."""
    _, setter = _entry(group, number)
    if setter is None:
        raise DaqmxError(Code.PROPERTY_NOT_SUPPORTED, f"Property: {group} {number:#06x}")
    setter(asked, value)


def reset(group: str, number: int, asked: Asked) -> None:
    """Set a property back to its default."""
    if (group, number) not in DEFAULTS:
        raise DaqmxError(Code.PROPERTY_NOT_SUPPORTED, f"Property: {group} {number:#06x}")
    set_(group, number, asked, DEFAULTS[group, number])


def _entry(group: str, number: int) -> tuple[Getter | None, Setter | None]:
    entry = TABLE.get((group, number))
    if entry is None:
        raise DaqmxError(
            Code.PROPERTY_NOT_SUPPORTED, f"Property: {group} {number:#06x} is not simulated"
        )
    return entry


def _booleans(asked: Asked) -> int:
    return max((len(channel.lines) for channel in asked.own.lines), default=0)


def _wirings(asked: Asked) -> int:
    """Return the bits of an input's wirings: RSE, NRSE, and DIFF for the first of a pair."""
    name = asked.channel.rpartition("/")[2]
    if not (name.startswith("ai") and name[2:].isdigit() and int(name[2:]) < INPUTS):
        raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {asked.channel}")
    return 0b111 if int(name[2:]) % 16 < 8 else 0b011
