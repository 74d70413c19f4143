"""Reading, setting and resetting of DAQmx's properties by group and number."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.properties.card import (
    CALIBRATION,
    DEVICE,
    PHYSICAL_CHANNEL,
    SERIAL,
    SYSTEM,
)
from dearig.sim_backend.daqmx.properties.channel import CHANNEL, kinds_of
from dearig.sim_backend.daqmx.properties.counter import COUNTER_CHANNEL
from dearig.sim_backend.daqmx.properties.kinds import Asked, Property, name_of
from dearig.sim_backend.daqmx.properties.scale import SAVED_SCALE, SCALE
from dearig.sim_backend.daqmx.properties.task import BUFFER, READ, TASK, WATCHDOG, WRITE
from dearig.sim_backend.daqmx.properties.timing import EXPORTED, TIMING, TRIGGER, WITH_DEVICE
from dearig.sim_backend.daqmx.properties.trigger import MORE_TRIGGERS

__all__ = ["SERIAL", "TABLES", "Asked", "check_device_context", "get", "reset", "set_"]

#: Properties by the group's name in the protocol, and by name.
TABLES: Mapping[str, Mapping[str, Property]] = {
    "Buffer": BUFFER,
    "CalInfo": CALIBRATION,
    "Chan": {**CHANNEL, **COUNTER_CHANNEL},
    "Device": DEVICE,
    "ExportedSignal": EXPORTED,
    "PersistedScale": SAVED_SCALE,
    "PhysicalChan": PHYSICAL_CHANNEL,
    "Read": READ,
    "Scale": SCALE,
    "SystemInfo": SYSTEM,
    "Task": TASK,
    "Timing": TIMING,
    "Trig": {**TRIGGER, **MORE_TRIGGERS},
    "Watchdog": WATCHDOG,
    "Write": WRITE,
}
_OF_A_TASK = ("Buffer", "Chan", "ExportedSignal", "Read", "Timing", "Trig", "Write")


def get(group: str, number: int, asked: Asked) -> Any:
    """Return the value of a property."""
    return _entry(group, number, asked).get(asked)


def set_(group: str, number: int, asked: Asked, value: Any) -> None:
    """Set a property, on every addressed channel."""
    entry = _entry(group, number, asked)
    if entry.set is None:
        raise DaqmxError(Code.PROPERTY_CANNOT_BE_SET, _words(group, number, asked))
    if group in _OF_A_TASK and asked.own.running and not entry.running:
        raise DaqmxError(Code.PROPERTY_WHILE_RUNNING, _words(group, number, asked))
    for one in asked.each() if group == "Chan" else (asked,):
        entry.set(one, value)


def reset(group: str, number: int, asked: Asked) -> None:
    """Set a property back to its default."""
    entry = _entry(group, number, asked)
    if entry.default is None:
        raise DaqmxError(Code.PROPERTY_CANNOT_BE_RESET, _words(group, number, asked))
    for one in asked.each() if group == "Chan" else (asked,):
        set_(group, number, one, entry.default(one))


def check_device_context(number: int, asked: Asked) -> None:
    """Refuse a property of the timing that is of the whole task, if it is asked of one device."""
    name = name_of("Timing", number)
    if name not in WITH_DEVICE:
        raise DaqmxError(Code.NO_DEVICE_CONTEXT, _words("Timing", number, asked))


def _entry(group: str, number: int, asked: Asked) -> Property:
    """Return the property; refuses those that the task's kind or the card does not have."""
    name = name_of(group, number)
    if group == "Chan":
        kinds = kinds_of(name)
        if kinds and asked.own.kind not in kinds and asked.selected():
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, _words(group, number, asked))
    entry = TABLES.get(group, {}).get(name)
    if entry is None:
        raise DaqmxError(
            Code.NOT_SUPPORTED_IN_TASK if group in _OF_A_TASK else Code.PROPERTY_NOT_SUPPORTED,
            f"{_words(group, number, asked)}; the simulated card does not have it.",
        )
    return entry


def _words(group: str, number: int, asked: Asked) -> str:
    return "; ".join(p for p in (f"Property: {name_of(group, number)}", asked.where) if p)
