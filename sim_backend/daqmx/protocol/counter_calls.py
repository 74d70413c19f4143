"""Calls of NI's gRPC device protocol for counters."""

# ruff: noqa: N802, ARG002  (names, arguments and messages are the protocol's)

from __future__ import annotations

import math
from typing import Any

import grpc
import numpy as np
from nidaqmx._stubs import nidaqmx_pb2 as pb

from dearig.sim_backend.daqmx.card.channels import Pulse
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import TIMEBASE
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.digital.measures import (
    DEGREES,
    INCHES,
    METRES,
    RADIANS,
    TICKS,
    Measure,
    default_terminal,
)
from dearig.sim_backend.daqmx.protocol.calls import Calls, is_finite, laid_out, number, status

__all__ = ["CounterCalls"]

_HIGH = 10192  # DAQmx: level
_PULSE_TIME, _PULSE_FREQUENCY, _PULSE_TICKS = 10269, 10119, 10268  # DAQmx: counter outputs


def _known(request: Any, field: str, *values: int) -> int:
    """Return an enumeration's number, which is one of ``values``."""
    value = number(request, field)
    if value not in values:
        raise DaqmxError(Code.INVALID_VALUE, f"Property: {field}; Requested Value: {value}")
    return value


class CounterCalls(Calls):
    """Calls for counter inputs and outputs."""

    # inputs

    def _add(self, request: Any, measure: Measure, parts: dict[str, str], **settings: Any) -> None:
        """Add a counter input; ``parts`` are the counter's pins that it uses, by role."""
        counter = request.counter.rpartition("/")[2].lower()
        if not counter.startswith("ctr") or not counter[3:].isdigit() or int(counter[3:]) > 3:
            raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {request.counter}")
        self._device.counters.add_input(
            self._task(request),
            request.counter,
            request.name_to_assign_to_channel,
            measure=int(measure),
            terminals={role: default_terminal(counter, part) for role, part in parts.items()},
            **settings,
        )

    def CreateCICountEdgesChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add(
            request,
            Measure.COUNT_EDGES,
            {"input": "source", "direction": "aux"},
            edge=number(request, "edge"),
            initial=float(request.initial_count),
            direction=_known(request, "count_direction", 10128, 10124, 10326),
        )
        return pb.CreateCICountEdgesChanResponse()

    def CreateCIFreqChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_interval(request, Measure.FREQUENCY, 10373, edge=number(request, "edge"))
        return pb.CreateCIFreqChanResponse()

    def CreateCIPeriodChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_interval(request, Measure.PERIOD, 10364, edge=number(request, "edge"))
        return pb.CreateCIPeriodChanResponse()

    def CreateCIPulseWidthChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        edge = number(request, "starting_edge")
        self._add_interval(request, Measure.PULSE_WIDTH, 10364, edge=edge)
        return pb.CreateCIPulseWidthChanResponse()

    def CreateCISemiPeriodChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_interval(request, Measure.SEMI_PERIOD, 10364)
        return pb.CreateCISemiPeriodChanResponse()

    def CreateCIPulseChanFreq(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_interval(request, Measure.PULSE_FREQUENCY, 10373)
        return pb.CreateCIPulseChanFreqResponse()

    def CreateCIPulseChanTime(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._add_interval(request, Measure.PULSE_TIME, 10364)
        return pb.CreateCIPulseChanTimeResponse()

    def CreateCIPulseChanTicks(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._check_limits(request)
        self._check_source(request)
        self._add(
            request,
            Measure.PULSE_TICKS,
            {"input": "gate"},
            limits=(request.min_val, request.max_val),
            units=TICKS,
        )
        return pb.CreateCIPulseChanTicksResponse()

    def _add_interval(self, request: Any, measure: Measure, unit: int, **settings: Any) -> None:
        self._check_limits(request)
        units = _known(request, "units", unit, TICKS)
        self._add(
            request,
            measure,
            {"input": "gate"},
            limits=(request.min_val, request.max_val),
            units=units,
            **settings,
        )

    @staticmethod
    def _check_limits(request: Any) -> None:
        low, high = request.min_val, request.max_val
        if not low < high:
            raise DaqmxError(
                Code.MIN_NOT_LESS_THAN_MAX, f"Minimum Value: {low:g}; Maximum Value: {high:g}"
            )

    @staticmethod
    def _check_source(request: Any) -> None:
        """Refuse a timebase from outside, whose ticks would have to be counted."""
        source = request.source_terminal.rpartition("/")[2].lower()
        if source not in ("", "onboardclock", "100mhztimebase"):
            raise DaqmxError(
                Code.ROUTE_NOT_SUPPORTED,
                f"Source Terminal: {request.source_terminal}; ticks are those of the 100 MHz "
                "timebase here",
            )

    def CreateCITwoEdgeSepChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._check_limits(request)
        self._add(
            request,
            Measure.TWO_EDGE_SEPARATION,
            {"input": "aux", "second": "gate"},
            limits=(request.min_val, request.max_val),
            units=_known(request, "units", 10364, TICKS),
            edge=number(request, "first_edge"),
            second_edge=number(request, "second_edge"),
        )
        return pb.CreateCITwoEdgeSepChanResponse()

    def CreateCIAngEncoderChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        units = _known(request, "units", DEGREES, RADIANS, TICKS)
        turn = {DEGREES: 360.0, RADIANS: 2.0 * math.pi, TICKS: 0.0}[units]
        if request.pulses_per_rev < 1:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: CI.AngEncoder.PulsesPerRev; Value: {request.pulses_per_rev}",
            )
        self._add_encoder(
            request,
            Measure.ANGLE,
            units,
            initial=request.initial_angle,
            distance=turn / request.pulses_per_rev,
            pulses=request.pulses_per_rev,
        )
        return pb.CreateCIAngEncoderChanResponse()

    def CreateCILinEncoderChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        units = _known(request, "units", METRES, INCHES, TICKS)
        self._add_encoder(
            request,
            Measure.LENGTH,
            units,
            initial=request.initial_pos,
            distance=request.dist_per_pulse,
        )
        return pb.CreateCILinEncoderChanResponse()

    def _add_encoder(self, request: Any, measure: Measure, units: int, **settings: Any) -> None:
        self._add(
            request,
            measure,
            {"a": "source", "b": "aux", "z": "gate"},
            units=units,
            decoding=_known(request, "decoding_type", 10090, 10091, 10092, 10313),
            index=request.zidx_enable,
            index_value=request.zidx_val,
            index_phase=number(request, "zidx_phase"),
            **settings,
        )

    # reading

    def ReadCounterF64(self, request: Any, context: grpc.ServicerContext) -> Any:
        return self._read_counter(request, pb.ReadCounterF64Response, np.float64)

    def ReadCounterF64Ex(self, request: Any, context: grpc.ServicerContext) -> Any:
        return self._read_counter(request, pb.ReadCounterF64ExResponse, np.float64)

    def ReadCounterU32(self, request: Any, context: grpc.ServicerContext) -> Any:
        return self._read_counter(request, pb.ReadCounterU32Response, np.uint32)

    def ReadCounterU32Ex(self, request: Any, context: grpc.ServicerContext) -> Any:
        return self._read_counter(request, pb.ReadCounterU32ExResponse, np.uint32)

    def _read_counter(self, request: Any, response: Any, kind: type) -> Any:
        room = request.array_size_in_samps
        values, complete = self._values(request, room)
        return response(
            status=status(complete),
            read_array=laid_out(values[:1].astype(kind), request),
            samps_per_chan_read=values.shape[1],
        )

    def ReadCounterScalarF64(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.ReadCounterScalarF64Response(value=float(self._one(request)[0]))

    def ReadCounterScalarU32(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.ReadCounterScalarU32Response(value=int(self._one(request)[0]))

    def ReadCtrFreq(self, request: Any, context: grpc.ServicerContext) -> Any:
        first, second, fields = self._read_pulses(request, np.float64)
        return pb.ReadCtrFreqResponse(
            read_array_frequency=first, read_array_duty_cycle=second, **fields
        )

    def ReadCtrTime(self, request: Any, context: grpc.ServicerContext) -> Any:
        first, second, fields = self._read_pulses(request, np.float64)
        return pb.ReadCtrTimeResponse(
            read_array_high_time=first, read_array_low_time=second, **fields
        )

    def ReadCtrTicks(self, request: Any, context: grpc.ServicerContext) -> Any:
        first, second, fields = self._read_pulses(request, np.uint32)
        return pb.ReadCtrTicksResponse(
            read_array_high_ticks=first, read_array_low_ticks=second, **fields
        )

    def ReadCtrFreqScalar(self, request: Any, context: grpc.ServicerContext) -> Any:
        frequency, duty = self._one(request)
        return pb.ReadCtrFreqScalarResponse(frequency=frequency, duty_cycle=duty)

    def ReadCtrTimeScalar(self, request: Any, context: grpc.ServicerContext) -> Any:
        high, low = self._one(request)
        return pb.ReadCtrTimeScalarResponse(high_time=high, low_time=low)

    def ReadCtrTicksScalar(self, request: Any, context: grpc.ServicerContext) -> Any:
        high, low = self._one(request)
        return pb.ReadCtrTicksScalarResponse(high_ticks=int(high), low_ticks=int(low))

    def _read_pulses(self, request: Any, kind: type) -> tuple[Any, Any, dict[str, Any]]:
        room = request.array_size_in_samps
        values, complete = self._values(request, room)
        rows: np.ndarray = values.astype(kind)
        fields = {"status": status(complete), "samps_per_chan_read": values.shape[1]}
        return rows[0], rows[1], fields

    def _values(self, request: Any, room: int) -> tuple[np.ndarray, bool]:
        task = self._input(request)
        samples = request.num_samps_per_chan
        if samples > room:
            raise DaqmxError(Code.READ_BUFFER_TOO_SMALL, f"Task Name: {task.name}", read=0)
        reading = self._device.reader.read(task, samples, request.timeout, room)
        return reading.values, reading.complete

    def _one(self, request: Any) -> np.ndarray:
        reading = self._device.reader.read(self._input(request), 1, request.timeout)
        if not reading.complete:
            raise DaqmxError(Code.SAMPLES_NOT_YET_AVAILABLE, read=0)
        return reading.values[:, 0]

    def _input(self, request: Any) -> Task:
        task = self._task(request)
        if task.kind is not Kind.CI:
            raise DaqmxError(Code.NOT_AN_INPUT, f"Task Name: {task.name}", read=0)
        return task

    # outputs

    def CreateCOPulseChanFreq(self, request: Any, context: grpc.ServicerContext) -> Any:
        _known(request, "units", 10373)
        pulse = Pulse.of_frequency(request.freq, request.duty_cycle)
        self._add_output(request, _PULSE_FREQUENCY, pulse, request.initial_delay)
        return pb.CreateCOPulseChanFreqResponse()

    def CreateCOPulseChanTime(self, request: Any, context: grpc.ServicerContext) -> Any:
        _known(request, "units", 10364)
        pulse = Pulse.of_times(request.high_time, request.low_time)
        self._add_output(request, _PULSE_TIME, pulse, request.initial_delay)
        return pb.CreateCOPulseChanTimeResponse()

    def CreateCOPulseChanTicks(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._check_source(request)
        pulse = Pulse.of_ticks(request.high_ticks, request.low_ticks)
        self._add_output(request, _PULSE_TICKS, pulse, request.initial_delay / TIMEBASE)
        return pb.CreateCOPulseChanTicksResponse()

    def _add_output(self, request: Any, kind: int, pulse: Pulse, delay: float) -> None:
        if not delay >= 0.0:
            raise DaqmxError(Code.INVALID_VALUE, f"Property: initial delay; Value: {delay:g}")
        self._device.counters.add_output(
            self._task(request),
            request.counter,
            request.name_to_assign_to_channel,
            kind,
            pulse,
            delay,
            number(request, "idle_state") == _HIGH,
        )

    def CfgImplicitTiming(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.timing.set_implicit(
            self._task(request), is_finite(request), request.samps_per_chan
        )
        return pb.CfgImplicitTimingResponse()

    # writing

    def WriteCtrFreq(self, request: Any, context: grpc.ServicerContext) -> Any:
        pulses = [
            Pulse.of_frequency(f, d)
            for f, d in zip(request.frequency, request.duty_cycle, strict=True)
        ]
        return pb.WriteCtrFreqResponse(
            num_samps_per_chan_written=self._write_pulses(request, pulses)
        )

    def WriteCtrTime(self, request: Any, context: grpc.ServicerContext) -> Any:
        pulses = [
            Pulse.of_times(h, low)
            for h, low in zip(request.high_time, request.low_time, strict=True)
        ]
        return pb.WriteCtrTimeResponse(
            num_samps_per_chan_written=self._write_pulses(request, pulses)
        )

    def WriteCtrTicks(self, request: Any, context: grpc.ServicerContext) -> Any:
        pulses = [
            Pulse.of_ticks(h, low)
            for h, low in zip(request.high_ticks, request.low_ticks, strict=True)
        ]
        return pb.WriteCtrTicksResponse(
            num_samps_per_chan_written=self._write_pulses(request, pulses)
        )

    def WriteCtrFreqScalar(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._write_one(request, Pulse.of_frequency(request.frequency, request.duty_cycle))
        return pb.WriteCtrFreqScalarResponse()

    def WriteCtrTimeScalar(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._write_one(request, Pulse.of_times(request.high_time, request.low_time))
        return pb.WriteCtrTimeScalarResponse()

    def WriteCtrTicksScalar(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._write_one(request, Pulse.of_ticks(request.high_ticks, request.low_ticks))
        return pb.WriteCtrTicksScalarResponse()

    def _write_pulses(self, request: Any, pulses: list[Pulse]) -> int:
        return self._device.counters.write(self._task(request), pulses, request.auto_start)

    def _write_one(self, request: Any, pulse: Pulse) -> None:
        self._device.counters.write(self._task(request), [pulse], request.auto_start)
