"""Properties of a task's channels."""

from __future__ import annotations

from typing import Any

import numpy as np

from dearig.sim_backend.daqmx.card.channels import AnalogInput, Lines
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.scales import Scale
from dearig.sim_backend.daqmx.card.sensors import RTD_COEFFICIENTS, Sensor
from dearig.sim_backend.daqmx.card.tasks import Kind
from dearig.sim_backend.daqmx.properties.kinds import (
    Asked,
    Property,
    accepted,
    changed,
    fixed,
    given,
)

__all__ = ["CHANNEL", "FROM_CUSTOM_SCALE", "VOLTS", "kinds_of"]

VOLTS, FROM_CUSTOM_SCALE = 10348, 10065  #: DAQmx: units of a voltage
_VOLTAGE, _BITS, _NONE, _RIGHT = 10322, 10109, 10230, 10279
_DC, _RSE, _INTERNAL = 10050, 10083, 10200
_DMA, _INTERRUPT, _POLLED = 10054, 10204, 10264
_HALF_FULL, _NOT_EMPTY = 10237, 10241
_EMPTY, _HALF_FULL_OR_LESS, _LESS_THAN_FULL = 10235, 10239, 10242
_MAINTAIN, _ACTIVE_DRIVE, _THREE_POINT_THREE = 12528, 12573, 14621


def kinds_of(name: str) -> tuple[Kind, ...]:
    """Return the kinds of tasks that have a property such as ``AI_MAX``; none: every kind."""
    return tuple(kind for kind in Kind if name.startswith(f"{kind.name}_"))


def _physical(asked: Asked) -> str:
    channel = asked.first()
    terminals = channel.lines if isinstance(channel, Lines) else (channel.terminal,)
    return ", ".join(f"{asked.device.name}/{terminal}" for terminal in terminals)


def _units(asked: Asked) -> int:
    return FROM_CUSTOM_SCALE if isinstance(asked.analog().scale, Scale) else VOLTS


def _set_units(asked: Asked, value: int) -> None:
    channel = asked.analog()
    if value == VOLTS:
        asked.device.channels.set_scale(asked.own, channel, "")
    elif value != FROM_CUSTOM_SCALE or channel.scale is None:
        raise DaqmxError(
            Code.INVALID_VALUE if value != FROM_CUSTOM_SCALE else Code.UNKNOWN_SCALE,
            f"Requested Value: {value}; {asked.where}",
        )


def _scale_name(asked: Asked) -> str:
    scale = asked.analog().scale
    return "" if scale is None else scale.name


_SCALE = changed(_scale_name, lambda a, v: a.device.channels.set_scale(a.own, a.analog(), v), "")
_UNITS = changed(_units, _set_units, VOLTS)


def _span(asked: Asked) -> tuple[float, float]:
    """Return the limits of a channel; those of an input are what its range can measure."""
    channel = asked.analog()
    if not isinstance(channel, AnalogInput):
        return channel.limits
    if isinstance(channel.scale, Sensor) and not channel.scale.linear:
        return channel.limits
    ends = np.array([-channel.range, channel.range])
    if channel.scale is not None:
        ends = channel.scale.scaled(ends)
    return float(ends.min()), float(ends.max())


_LOW = changed(
    lambda a: _span(a)[0], lambda a, v: a.device.channels.set_limits(a.own, a.analog(), low=v)
)
_HIGH = changed(
    lambda a: _span(a)[1], lambda a, v: a.device.channels.set_limits(a.own, a.analog(), high=v)
)
_RANGE_LOW = changed(
    lambda a: -a.analog().range, lambda a, v: a.device.channels.set_range(a.own, a.analog(), -v)
)
_RANGE_HIGH = changed(
    lambda a: a.analog().range, lambda a, v: a.device.channels.set_range(a.own, a.analog(), v)
)


def _usage(asked: Asked) -> int:
    scale = asked.input().scale
    return scale.usage if isinstance(scale, Sensor) else _VOLTAGE


#: Properties of sensors, all of which take effect where the sensor has them.
_SENSOR_PROPERTIES = (
    "AI_BRIDGE_CFG",
    "AI_CURRENT_SHUNT_LOC",
    "AI_CURRENT_SHUNT_RESISTANCE",
    "AI_CURRENT_UNITS",
    "AI_EXCIT_SRC",
    "AI_EXCIT_USE_FOR_SCALING",
    "AI_EXCIT_VAL",
    "AI_RESISTANCE_CFG",
    "AI_RESISTANCE_UNITS",
    "AI_RTD_A",
    "AI_RTD_B",
    "AI_RTD_C",
    "AI_RTD_R0",
    "AI_RTD_TYPE",
    "AI_TEMP_UNITS",
    "AI_THRMSTR_A",
    "AI_THRMSTR_B",
    "AI_THRMSTR_C",
    "AI_THRMSTR_R1",
)
_SENSOR_DEFAULTS = {"AI_EXCIT_USE_FOR_SCALING": False, "AI_RTD_R0": 100.0}


def _of_a_sensor(name: str) -> Property:
    """Return the property ``name`` of a sensor; it is refused where the sensor has none."""

    def sensor(asked: Asked) -> Sensor:
        scale = asked.input().scale
        if not isinstance(scale, Sensor) or name not in scale.values:
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, f"Property: {name}; {asked.where}")
        return scale

    def set_(asked: Asked, value: Any) -> None:
        sensor(asked).values[name] = value
        if name == "AI_RTD_TYPE" and value in RTD_COEFFICIENTS:
            for letter, coefficient in zip("ABC", RTD_COEFFICIENTS[value], strict=True):
                sensor(asked).values[f"AI_RTD_{letter}"] = coefficient

    def default(asked: Asked) -> Any:
        values = sensor(asked).values
        if name in ("AI_RTD_A", "AI_RTD_B", "AI_RTD_C"):
            kind = RTD_COEFFICIENTS.get(values["AI_RTD_TYPE"], RTD_COEFFICIENTS[10071])
            return kind["ABC".index(name[-1])]
        return _SENSOR_DEFAULTS.get(name, values[name])

    return changed(lambda a: sensor(a).values[name], set_, default)


def _invert(_: Asked, value: Any) -> None:
    if value:
        raise DaqmxError(Code.INVALID_VALUE, "Inverted lines are not simulated.")


#: Properties of channels; those that are ``accepted`` have no effect in the simulation.
CHANNEL = {
    "CHAN_TYPE": given(lambda a: a.first() and a.own.kind.value),
    "PHYSICAL_CHAN_NAME": given(_physical),
    "CHAN_DESCR": accepted(""),
    "CHAN_IS_GLOBAL": given(False),
    # analog input
    "AI_MEAS_TYPE": given(_usage),
    **{name: _of_a_sensor(name) for name in _SENSOR_PROPERTIES},
    "AI_VOLTAGE_UNITS": _UNITS,
    "AI_CUSTOM_SCALE_NAME": _SCALE,
    "AI_TERM_CFG": changed(
        lambda a: a.input().wiring,
        lambda a, v: a.device.channels.set_wiring(a.own, a.input(), v),
        -1,
    ),
    "AI_MAX": _HIGH,
    "AI_MIN": _LOW,
    "AI_RNG_HIGH": _RANGE_HIGH,
    "AI_RNG_LOW": _RANGE_LOW,
    "AI_COUPLING": fixed(_DC),
    "AI_DEV_SCALING_COEFF": given(lambda a: a.device.channels.scaling(a.own, a.input().name)),
    "AI_RESOLUTION": given(16.0),
    "AI_RESOLUTION_UNITS": fixed(_BITS),
    "AI_RAW_SAMP_SIZE": given(16),
    "AI_RAW_SAMP_JUSTIFICATION": given(_RIGHT),
    "AI_RAW_DATA_COMPRESSION_TYPE": fixed(_NONE),
    "AI_LOSSY_LSB_REMOVAL_COMPRESSED_SAMP_SIZE": accepted(16),
    "AI_DATA_XFER_MECH": accepted(_DMA, _DMA, _INTERRUPT, _POLLED),
    "AI_DATA_XFER_REQ_COND": accepted(_NOT_EMPTY, _NOT_EMPTY, _HALF_FULL),
    "AI_MEM_MAP_ENABLE": accepted(False),
    "AI_CHAN_CAL_ENABLE_CAL": fixed(False),
    "AI_CHAN_CAL_HAS_VALID_CAL_INFO": given(False),
    "AI_IS_TEDS": given(False),
    # analog output
    "AO_OUTPUT_TYPE": given(_VOLTAGE),
    "AO_VOLTAGE_UNITS": _UNITS,
    "AO_CUSTOM_SCALE_NAME": _SCALE,
    "AO_TERM_CFG": fixed(_RSE, -1),
    "AO_MAX": _HIGH,
    "AO_MIN": _LOW,
    "AO_DAC_RNG_HIGH": _RANGE_HIGH,
    "AO_DAC_RNG_LOW": _RANGE_LOW,
    "AO_DAC_REF_SRC": fixed(_INTERNAL),
    "AO_DAC_REF_VAL": fixed(lambda a: a.output().range),
    "AO_DAC_OFFSET_SRC": fixed(_INTERNAL),
    "AO_DAC_OFFSET_VAL": fixed(0.0),
    "AO_IDLE_OUTPUT_BEHAVIOR": fixed(_MAINTAIN),
    "AO_REGLITCH_ENABLE": accepted(True),
    "AO_USE_ONLY_ON_BRD_MEM": accepted(False),
    "AO_DATA_XFER_MECH": accepted(_DMA, _DMA, _INTERRUPT, _POLLED),
    "AO_DATA_XFER_REQ_COND": accepted(_LESS_THAN_FULL, _EMPTY, _HALF_FULL_OR_LESS, _LESS_THAN_FULL),
    "AO_MEM_MAP_ENABLE": accepted(False),
    "AO_DEV_SCALING_COEFF": given(lambda a: a.device.channels.scaling(a.own, a.output().name)),
    "AO_RESOLUTION": given(16.0),
    "AO_RESOLUTION_UNITS": fixed(_BITS),
    # digital input
    "DI_NUM_LINES": given(lambda a: len(a.digital().lines)),
    "DI_INVERT_LINES": changed(lambda _: False, _invert, False),
    # a line that a program drives is read back by an input too
    "DI_TRISTATE": accepted(True),
    "DI_DATA_XFER_MECH": accepted(_DMA, _DMA, _INTERRUPT, _POLLED),
    "DI_DATA_XFER_REQ_COND": accepted(_NOT_EMPTY, _NOT_EMPTY, _HALF_FULL),
    "DI_MEM_MAP_ENABLE": accepted(False),
    # digital output
    "DO_NUM_LINES": given(lambda a: len(a.digital().lines)),
    "DO_INVERT_LINES": changed(lambda _: False, _invert, False),
    "DO_TRISTATE": fixed(False),
    "DO_OUTPUT_DRIVE_TYPE": fixed(_ACTIVE_DRIVE),
    "DO_LOGIC_FAMILY": fixed(_THREE_POINT_THREE),
    "DO_USE_ONLY_ON_BRD_MEM": accepted(False),
    "DO_DATA_XFER_MECH": accepted(_DMA, _DMA, _INTERRUPT, _POLLED),
    "DO_DATA_XFER_REQ_COND": accepted(_LESS_THAN_FULL, _EMPTY, _HALF_FULL_OR_LESS, _LESS_THAN_FULL),
    "DO_MEM_MAP_ENABLE": accepted(False),
}
