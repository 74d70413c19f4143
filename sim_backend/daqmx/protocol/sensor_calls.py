"""Calls of NI's gRPC device protocol that make input channels with sensors."""

# ruff: noqa: N802, ARG002  (names, arguments and messages are the protocol's)

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import grpc
from nidaqmx._stubs import nidaqmx_pb2 as pb

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.sensors import CUSTOM_RTD, RTD_COEFFICIENTS, Sensor, Usage

if TYPE_CHECKING:
    from dearig.sim_backend.daqmx.card.tasks import Task
    from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

__all__ = ["SensorCalls"]

_DRIVER_CHOOSES, _EXTERNAL = -1, 10167
_AMPERES, _OHMS, _VOLTS = 10342, 10384, 10348
_TEMPERATURES = {10143: "Deg C", 10144: "Deg F", 10325: "Kelvins", 10145: "Deg R"}


def _number(request: Any, field: str) -> int:
    return int(getattr(request, f"{field}_raw") or getattr(request, field))


class SensorCalls:
    """Calls that add an input channel with a sensor."""

    _device: SimulatedCard

    if TYPE_CHECKING:

        def _task(self, request: Any) -> Task: ...

    def CreateAICurrentChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        place = _number(request, "shunt_resistor_loc")
        self._add_sensor(
            request,
            Usage.CURRENT,
            "Amps",
            AI_CURRENT_UNITS=_only(request, _AMPERES),
            AI_CURRENT_SHUNT_LOC=_EXTERNAL if place == _DRIVER_CHOOSES else place,
            AI_CURRENT_SHUNT_RESISTANCE=request.ext_shunt_resistor_val,
        )
        return pb.CreateAICurrentChanResponse()

    def CreateAIVoltageChanWithExcit(self, request: Any, context: grpc.ServicerContext) -> Any:
        _only(request, _VOLTS)
        self._add_sensor(
            request,
            Usage.WITH_EXCITATION,
            "Volts",
            AI_BRIDGE_CFG=_number(request, "bridge_config"),
            AI_EXCIT_SRC=_number(request, "voltage_excit_source"),
            AI_EXCIT_VAL=request.voltage_excit_val,
            AI_EXCIT_USE_FOR_SCALING=request.use_excit_for_scaling,
        )
        return pb.CreateAIVoltageChanWithExcitResponse()

    def CreateAIResistanceChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_sensor(
            request,
            Usage.RESISTANCE,
            "Ohms",
            AI_RESISTANCE_UNITS=_only(request, _OHMS),
            **_current_excitation(request),
        )
        return pb.CreateAIResistanceChanResponse()

    def CreateAIRTDChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        kind = _number(request, "rtd_type")
        # a program sets the coefficients of a thermometer of its own after it has made the channel
        a, b, c = RTD_COEFFICIENTS.get(kind, RTD_COEFFICIENTS[10071])
        if kind not in (*RTD_COEFFICIENTS, CUSTOM_RTD):
            raise DaqmxError(Code.INVALID_VALUE, f"Property: AI_RTD_TYPE; Requested Value: {kind}")
        self._add_sensor(
            request,
            Usage.RTD,
            _temperature(request),
            AI_TEMP_UNITS=_only(request, *_TEMPERATURES),
            AI_RTD_TYPE=kind,
            AI_RTD_R0=request.r0,
            AI_RTD_A=a,
            AI_RTD_B=b,
            AI_RTD_C=c,
            **_current_excitation(request),
        )
        return pb.CreateAIRTDChanResponse()

    def CreateAIThrmstrChanIex(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_thermistor(request, **_current_excitation(request))
        return pb.CreateAIThrmstrChanIexResponse()

    def CreateAIThrmstrChanVex(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_thermistor(
            request,
            AI_RESISTANCE_CFG=_number(request, "resistance_config"),
            AI_EXCIT_SRC=_number(request, "voltage_excit_source"),
            AI_EXCIT_VAL=request.voltage_excit_val,
            AI_THRMSTR_R1=request.r1,
        )
        return pb.CreateAIThrmstrChanVexResponse()

    def _add_thermistor(self, request: Any, **values: Any) -> None:
        self._add_sensor(
            request,
            Usage.THERMISTOR,
            _temperature(request),
            AI_TEMP_UNITS=_only(request, *_TEMPERATURES),
            AI_THRMSTR_A=request.a,
            AI_THRMSTR_B=request.b,
            AI_THRMSTR_C=request.c,
            **values,
        )

    def _add_sensor(self, request: Any, usage: int, units: str, **values: Any) -> None:
        """Add the channels of ``request``; their properties by name are ``values``."""
        if getattr(request, "custom_scale_name", ""):
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Custom Scale Name: {request.custom_scale_name}; a scale after a sensor is not "
                "simulated",
            )
        wiring = getattr(request, "terminal_config_raw", 0) or getattr(
            request, "terminal_config", _DRIVER_CHOOSES
        )
        sensor = Sensor(usage, values, units)
        self._device.channels.add_inputs(
            self._task(request),
            request.physical_channel,
            request.name_to_assign_to_channel,
            wiring,
            (request.min_val, request.max_val),
            sensor,
        )


def _temperature(request: Any) -> str:
    return _TEMPERATURES.get(_number(request, "units"), "")


def _only(request: Any, *offered: int) -> int:
    """Return the units of ``request``; refuses those that are not ``offered``."""
    units = _number(request, "units")
    if units not in offered:
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Requested Value: {units}; You Can Select: {', '.join(map(str, offered))}",
        )
    return units


def _current_excitation(request: Any) -> dict[str, Any]:
    return {
        "AI_RESISTANCE_CFG": _number(request, "resistance_config"),
        "AI_EXCIT_SRC": _number(request, "current_excit_source"),
        "AI_EXCIT_VAL": request.current_excit_val,
    }
