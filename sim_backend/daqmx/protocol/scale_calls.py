"""Calls of NI's gRPC device protocol for custom scales."""

# ruff: noqa: N802, ARG002  (names, arguments and messages are the protocol's)

from __future__ import annotations

from dataclasses import replace
from typing import Any

import grpc
from nidaqmx._stubs import nidaqmx_pb2 as pb

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.scales import (
    LINEAR,
    MAP,
    POLYNOMIAL,
    TABLE,
    Scale,
    reverse_coefficients,
)
from dearig.sim_backend.daqmx.properties.channel import FROM_CUSTOM_SCALE, VOLTS
from dearig.sim_backend.daqmx.protocol.calls import Calls

__all__ = ["ScaleCalls"]


class ScaleCalls(Calls):
    """Calls for custom scales."""

    def CreateLinScale(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_scale(request, LINEAR, slope=request.slope, y_intercept=request.y_intercept)
        return pb.CreateLinScaleResponse()

    def CreateMapScale(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_scale(
            request,
            MAP,
            map_pre_scaled=(request.prescaled_min, request.prescaled_max),
            map_scaled=(request.scaled_min, request.scaled_max),
        )
        return pb.CreateMapScaleResponse()

    def CreatePolynomialScale(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_scale(
            request,
            POLYNOMIAL,
            forward=tuple(request.forward_coeffs),
            reverse=tuple(request.reverse_coeffs),
        )
        return pb.CreatePolynomialScaleResponse()

    def CreateTableScale(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_scale(
            request,
            TABLE,
            table_pre_scaled=tuple(request.prescaled_vals),
            table_scaled=tuple(request.scaled_vals),
        )
        return pb.CreateTableScaleResponse()

    def SaveScale(self, request: Any, context: grpc.ServicerContext) -> Any:
        """Keep a scale in the list of saved ones, until the server ends."""
        scale = self._device.scales.find(request.scale_name)
        self._device.scales.add(
            replace(scale, name=request.save_as or scale.name, saved=True, author=request.author)
        )
        return pb.SaveScaleResponse()

    def DeleteSavedScale(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.scales.remove(request.scale_name)
        return pb.DeleteSavedScaleResponse()

    def CalculateReversePolyCoeff(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.CalculateReversePolyCoeffResponse(
            reverse_coeffs=reverse_coefficients(
                list(request.forward_coeffs),
                request.min_val_x,
                request.max_val_x,
                request.num_points_to_compute,
                request.reverse_poly_order,
            )
        )

    def _add_scale(self, request: Any, kind: int, **fields: Any) -> None:
        units = request.pre_scaled_units_raw or request.pre_scaled_units
        self._device.scales.add(
            Scale(
                request.name,
                kind,
                pre_scaled_units=units,
                scaled_units=request.scaled_units,
                **fields,
            )
        )

    def _scale(self, request: Any) -> Scale | None:
        """Return the custom scale of a new channel; None for V."""
        units, name = request.units_raw or request.units, request.custom_scale_name
        if units == FROM_CUSTOM_SCALE:
            return self._device.scales.find(name)
        if units != VOLTS:
            raise DaqmxError(Code.INVALID_VALUE, f"Requested Value: {units}; units of a voltage")
        if name:
            raise DaqmxError(Code.UNITS_NOT_FROM_SCALE, f"Custom Scale Name: {name}")
        return None
