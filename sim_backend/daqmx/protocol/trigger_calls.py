"""Calls of NI's gRPC device protocol for triggers, signals and routes, and those with a refusal."""

# ruff: noqa: N802, ARG002  (names, arguments and messages are the protocol's)

from __future__ import annotations

from typing import Any

import grpc
from nidaqmx._stubs import nidaqmx_pb2 as pb

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.names import physical_names
from dearig.sim_backend.daqmx.card.numbers import RISING
from dearig.sim_backend.daqmx.card.triggers import Reference
from dearig.sim_backend.daqmx.protocol.calls import Calls, number

__all__ = ["TriggerCalls"]


class TriggerCalls(Calls):
    """Calls for triggers, exported signals and routes."""

    def CfgDigEdgeRefTrig(self, request: Any, context: grpc.ServicerContext) -> Any:
        rising = number(request, "trigger_edge") == RISING
        self._device.triggering.set_reference(
            self._task(request),
            Reference(request.trigger_source, rising, request.pretrigger_samples),
        )
        return pb.CfgDigEdgeRefTrigResponse()

    def CfgAnlgEdgeRefTrig(self, request: Any, context: grpc.ServicerContext) -> Any:
        rising = number(request, "trigger_slope") == RISING
        self._device.triggering.set_reference(
            self._task(request),
            Reference(
                request.trigger_source, rising, request.pretrigger_samples, request.trigger_level
            ),
        )
        return pb.CfgAnlgEdgeRefTrigResponse()

    def CfgAnlgEdgeStartTrig(self, request: Any, context: grpc.ServicerContext) -> Any:
        rising = number(request, "trigger_slope") == RISING
        self._device.triggering.set_reference(
            self._task(request),
            Reference(request.trigger_source, rising, 0, request.trigger_level, starts=True),
        )
        return pb.CfgAnlgEdgeStartTrigResponse()

    def DisableRefTrig(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.triggering.set_reference(self._task(request), None)
        return pb.DisableRefTrigResponse()

    def ExportSignal(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.routes.export(
            self._task(request), number(request, "signal_id"), request.output_terminal
        )
        return pb.ExportSignalResponse()

    def ConnectTerms(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.routes.connect(request.source_terminal, request.destination_terminal)
        return pb.ConnectTermsResponse()

    def DisconnectTerms(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.routes.disconnect(request.destination_terminal)
        return pb.DisconnectTermsResponse()

    def TristateOutputTerm(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.routes.disconnect(request.output_terminal)
        return pb.TristateOutputTermResponse()

    def ConfigureLogging(self, request: Any, context: grpc.ServicerContext) -> Any:
        raise DaqmxError(
            Code.NOT_SUPPORTED_BY_DEVICE,
            f"TDMS logging is not simulated. Task Name: {request.task.name}",
        )


def _not_measured(name: str) -> Any:
    """Return the method for a kind of analog channel that the card does not have."""

    def answer(self: TriggerCalls, request: Any, _: grpc.ServicerContext) -> Any:
        fields = request.DESCRIPTOR.fields_by_name
        channel = next((getattr(request, f) for f in fields if "physical_channel" in f), "")
        code = (
            Code.NOT_PUT_OUT_BY_CHANNEL
            if name.startswith("CreateAO")
            else Code.NOT_MEASURED_BY_CHANNEL
        )
        physical_names(channel, self._device.name)
        raise DaqmxError(
            code, f"Physical Channel: {channel}; {name[6:]} is not simulated on this card."
        )

    return answer


def _add_refusals() -> None:
    """Add the calls that create other channels than the card has."""
    for method in pb.DESCRIPTOR.services_by_name["NiDAQmx"].methods:
        if method.name.startswith(("CreateAI", "CreateAO", "CreateTEDS")) and method.name not in (
            "CreateAIVoltageChan",
            "CreateAOVoltageChan",
        ):
            setattr(TriggerCalls, method.name, _not_measured(method.name))


_add_refusals()
