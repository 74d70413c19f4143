"""Properties of triggers other than a digital start trigger."""

from __future__ import annotations

import dataclasses
from typing import Any

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import (
    ANALOG_EDGE,
    DIGITAL_EDGE,
    FALLING,
    HIGH,
    LOW,
    NO_TRIGGER,
    RISING,
)
from dearig.sim_backend.daqmx.card.tasks import Kind
from dearig.sim_backend.daqmx.card.triggers import Reference
from dearig.sim_backend.daqmx.properties.kinds import Asked, Getter, Property, changed, fixed, given

__all__ = ["MORE_TRIGGERS"]

_DIGITAL_LEVEL = 10152
_SECONDS = 10364


# triggers


def _reference(asked: Asked, *, level: bool | None = None, starts: bool = False) -> Reference:
    """Return the task's trigger; with ``level`` an analog one, or a digital one."""
    found = asked.own.reference
    if (
        found is None
        or found.starts != starts
        or ((level is not None) and ((found.level is not None) != level))
    ):
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, asked.where)
    return found


def _reference_field(name: str, *, level: bool | None = None, starts: bool = False) -> Property:
    def set_(asked: Asked, value: Any) -> None:
        other = dataclasses.replace(_reference(asked, level=level, starts=starts), at=None)
        setattr(other, name, value == RISING if name == "rising" else value)
        asked.device.triggering.set_reference(asked.own, other)

    def get(asked: Asked) -> Any:
        value = getattr(_reference(asked, level=level, starts=starts), name)
        if name == "rising":
            return RISING if value else FALLING
        if name == "terminal":
            prefix = f"{asked.device.name}/{value}"
            return prefix if level else asked.device.terminals.full_source(value)
        return value

    return Property(get, set_)


def _reference_type(asked: Asked) -> int:
    found = asked.own.reference
    if found is None or found.starts:
        return NO_TRIGGER
    return DIGITAL_EDGE if found.level is None else ANALOG_EDGE


def _set_reference_type(asked: Asked, value: int) -> None:
    if value == NO_TRIGGER:
        asked.device.triggering.set_reference(asked.own, None)
    elif value != _reference_type(asked):
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Property: RefTrig.Type; Requested Value: {value}; configure the trigger with its "
            "source.",
        )


def _pause(asked: Asked) -> tuple[str, bool]:
    if asked.own.pause is None:
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, asked.where)
    return asked.own.pause


def _set_pause_type(asked: Asked, value: int) -> None:
    if value not in (NO_TRIGGER, _DIGITAL_LEVEL):
        raise DaqmxError(Code.INVALID_VALUE, f"Property: PauseTrig.Type; Requested Value: {value}")
    if value == NO_TRIGGER:
        asked.device.triggering.set_pause(asked.own, None)
    elif asked.own.pause is None:
        asked.device.triggering.set_pause(asked.own, ("", True))


def _arm(asked: Asked) -> tuple[str, bool]:
    if asked.own.arm is None:
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, asked.where)
    return asked.own.arm


def _set_arm_type(asked: Asked, value: int) -> None:
    if value not in (NO_TRIGGER, DIGITAL_EDGE):
        raise DaqmxError(
            Code.INVALID_VALUE, f"Property: ArmStartTrig.Type; Requested Value: {value}"
        )
    if value == NO_TRIGGER:
        asked.device.triggering.set_arm(asked.own, None)
    elif asked.own.arm is None:
        asked.device.triggering.set_arm(asked.own, ("", True))


def _level(value: int) -> bool:
    if value not in (HIGH, LOW):
        raise DaqmxError(Code.INVALID_VALUE, f"Property: DigLvl.When; Requested Value: {value}")
    return value == HIGH


def _trigger_terminal(what: str) -> Getter:
    def get(asked: Asked) -> str:
        side = {Kind.CI: "Ctr0", Kind.CO: "Ctr0"}.get(asked.own.kind, asked.own.kind.name.lower())
        return f"/{asked.device.name}/{side}/{what}"

    return get


MORE_TRIGGERS: dict[str, Property] = {
    "START_TRIG_RETRIGGERABLE": changed(
        lambda a: a.own.retriggers, lambda a, v: a.device.triggering.set_retriggers(a.own, v), False
    ),
    "START_TRIG_DELAY": fixed(0.0),
    "START_TRIG_DELAY_UNITS": fixed(10304, _SECONDS, 10286),
    "ANLG_EDGE_START_TRIG_SRC": _reference_field("terminal", level=True, starts=True),
    "ANLG_EDGE_START_TRIG_LVL": _reference_field("level", level=True, starts=True),
    "ANLG_EDGE_START_TRIG_SLOPE": _reference_field("rising", level=True, starts=True),
    "ANLG_EDGE_START_TRIG_HYST": _reference_field("hysteresis", level=True, starts=True),
    "START_TRIG_TERM": given(_trigger_terminal("StartTrigger")),
    "REF_TRIG_TYPE": changed(_reference_type, _set_reference_type, NO_TRIGGER),
    "REF_TRIG_PRETRIG_SAMPLES": _reference_field("before"),
    "DIG_EDGE_REF_TRIG_SRC": _reference_field("terminal", level=False),
    "DIG_EDGE_REF_TRIG_EDGE": _reference_field("rising", level=False),
    "ANLG_EDGE_REF_TRIG_SRC": _reference_field("terminal", level=True),
    "ANLG_EDGE_REF_TRIG_LVL": _reference_field("level", level=True),
    "ANLG_EDGE_REF_TRIG_SLOPE": _reference_field("rising", level=True),
    "ANLG_EDGE_REF_TRIG_HYST": _reference_field("hysteresis", level=True),
    "REF_TRIG_TERM": given(_trigger_terminal("ReferenceTrigger")),
    "PAUSE_TRIG_TYPE": changed(
        lambda a: NO_TRIGGER if a.own.pause is None else _DIGITAL_LEVEL,
        _set_pause_type,
        NO_TRIGGER,
    ),
    "DIG_LVL_PAUSE_TRIG_SRC": Property(
        lambda a: a.device.terminals.full_source(_pause(a)[0]),
        lambda a, v: a.device.triggering.set_pause(a.own, (v, _pause(a)[1])),
    ),
    "DIG_LVL_PAUSE_TRIG_WHEN": Property(
        lambda a: HIGH if _pause(a)[1] else LOW,
        lambda a, v: a.device.triggering.set_pause(a.own, (_pause(a)[0], _level(v))),
    ),
    "PAUSE_TRIG_TERM": given(_trigger_terminal("PauseTrigger")),
    "ARM_START_TRIG_TYPE": changed(
        lambda a: NO_TRIGGER if a.own.arm is None else DIGITAL_EDGE, _set_arm_type, NO_TRIGGER
    ),
    "DIG_EDGE_ARM_START_TRIG_SRC": Property(
        lambda a: a.device.terminals.full_source(_arm(a)[0]),
        lambda a, v: a.device.triggering.set_arm(a.own, (v, _arm(a)[1])),
    ),
    "DIG_EDGE_ARM_START_TRIG_EDGE": Property(
        lambda a: RISING if _arm(a)[1] else FALLING,
        lambda a, v: a.device.triggering.set_arm(a.own, (_arm(a)[0], v == RISING)),
    ),
    "TRIGGER_SYNC_TYPE": fixed(NO_TRIGGER),
}
