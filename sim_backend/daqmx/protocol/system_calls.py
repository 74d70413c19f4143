"""Calls of NI's gRPC device protocol about the card as a whole: tests, calibration, power-up."""

# ruff: noqa: N802, ARG002  (names, arguments and messages are the protocol's)

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import grpc
from nidaqmx._stubs import nidaqmx_pb2 as pb

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError, message_of
from dearig.sim_backend.daqmx.card.hardware import LINES
from dearig.sim_backend.daqmx.card.numbers import HIGH, LOW, TRISTATE

if TYPE_CHECKING:
    from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

__all__ = ["SystemCalls"]

#: The card is calibrated for ever; this is the date that it gives: year, month, day, hour, minute.
_CALIBRATED = {"year": 2020, "month": 1, "day": 1, "hour": 0, "minute": 0}


class SystemCalls:
    """Calls about the card, without a task."""

    _device: SimulatedCard

    def GetErrorString(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.GetErrorStringResponse(error_string=message_of(request.error_code))

    def ResetDevice(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.reset(request.device_name)
        return pb.ResetDeviceResponse()

    def SelfTestDevice(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.check_device(request.device_name)
        return pb.SelfTestDeviceResponse()

    # calibration: without an effect, as the simulated converters have no error to correct

    def DeviceSupportsCal(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.check_device(request.device_name)
        return pb.DeviceSupportsCalResponse(cal_supported=True)

    def SelfCal(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.check_device(request.device_name)
        return pb.SelfCalResponse()

    def RestoreLastExtCalConst(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.check_device(request.device_name)
        return pb.RestoreLastExtCalConstResponse()

    def GetSelfCalLastDateAndTime(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.check_device(request.device_name)
        return pb.GetSelfCalLastDateAndTimeResponse(**_CALIBRATED)

    def GetExtCalLastDateAndTime(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.check_device(request.device_name)
        return pb.GetExtCalLastDateAndTimeResponse(**_CALIBRATED)

    # power-up states: kept and given back; the simulated card is never switched on again

    def SetDigitalPowerUpStates(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.check_device(request.device_name)
        for one in request.power_up_states:
            state = one.state
            if state not in (HIGH, LOW, TRISTATE):
                raise DaqmxError(
                    Code.INVALID_VALUE, f"Power Up State: {state}; Channel: {one.channel_names}"
                )
            for line in self._device.levels.lines_of(one.channel_names):
                self._device.state.kept["power up", line] = state
        return pb.SetDigitalPowerUpStatesResponse()

    def GetDigitalPowerUpStates(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.check_device(request.device_name)
        named = [
            line for name in request.channel_name for line in self._device.levels.lines_of(name)
        ]
        kept, wanted = self._device.state.kept, named or list(LINES)
        return pb.GetDigitalPowerUpStatesResponse(
            power_up_states=[kept.get(("power up", line), TRISTATE) for line in wanted]
        )
