"""Calls of NI's gRPC device protocol that read and write waveforms and raw numbers."""

# ruff: noqa: N802, ARG002  (names, arguments and messages are the protocol's)

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import grpc
import numpy as np
from ni.protobuf.types.precision_timestamp_pb2 import PrecisionTimestamp
from ni.protobuf.types.waveform_pb2 import DoubleAnalogWaveform, WaveformAttributeValue
from nidaqmx._stubs import nidaqmx_pb2 as pb

from dearig.drivers.channels import COUNT_MAX, COUNT_MIN
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import Kind, Task

if TYPE_CHECKING:
    from dearig.sim_backend.daqmx.running.reading import Reading
    from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

__all__ = ["WaveformCalls", "check_channels"]

_TIMING, _PROPERTIES = 1, 2  # DAQmx: bits of the waveform's attribute mode
_TO_1904_S = 2_082_844_800  # from NI's epoch, 1904, to that of POSIX, 1970
_FRACTIONS = 2**64  # of a second in NI's time stamps


def _time_stamp(seconds: float) -> PrecisionTimestamp:
    """Return NI's time stamp for ``seconds`` since 1970."""
    whole = int(seconds // 1.0)
    part = min(int((seconds - whole) * _FRACTIONS), _FRACTIONS - 1)
    return PrecisionTimestamp(seconds=whole + _TO_1904_S, fractional_seconds=part)


class WaveformCalls:
    """Calls with waveforms, and with raw numbers other than int16."""

    _device: SimulatedCard

    if TYPE_CHECKING:

        def _task(self, request: Any) -> Task: ...

        def _read(self, task: Task, request: Any, room: int) -> Reading: ...

        def _to_write(self, task: Task, request: Any, kind: type) -> np.ndarray: ...

        def _write(self, task: Task, counts: np.ndarray, request: Any) -> int: ...

    # waveforms

    def ReadAnalogWaveforms(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        mode = request.waveform_attribute_mode_raw or request.waveform_attribute_mode
        reading = self._device.inputs.read(task, request.num_samps_per_chan, request.timeout)
        start = self._device.inputs.time_of(task, reading.first)
        waveforms = []
        for channel, values in zip(
            task.inputs, self._device.inputs.scaled(task, reading.values), strict=True
        ):
            waveform = DoubleAnalogWaveform(y_data=values)
            if mode & _TIMING:
                waveform.t0.CopyFrom(_time_stamp(start))
                waveform.dt = 0.0 if task.clock is None else 1.0 / task.clock.rate
            if mode & _PROPERTIES:
                unit = "Volts" if channel.scale is None else channel.scale.scaled_units
                for key, text in (("NI_ChannelName", channel.name), ("NI_UnitDescription", unit)):
                    waveform.attributes[key].CopyFrom(WaveformAttributeValue(string_value=text))
            waveforms.append(waveform)
        return pb.ReadAnalogWaveformsResponse(
            status=0 if reading.complete else int(Code.SAMPLES_NOT_YET_AVAILABLE),
            waveforms=waveforms,
            samps_per_chan_read=reading.values.shape[1],
        )

    def WriteAnalogWaveforms(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        if task.kind is not Kind.AO:
            raise DaqmxError(Code.NOT_AN_OUTPUT, f"Task Name: {task.name}", written=0)
        rows = [np.array(waveform.y_data) for waveform in request.waveforms]
        check_channels(task, len(rows), len(task.outputs))
        if len({row.size for row in rows}) > 1:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Waveforms of different numbers of samples. Task Name: {task.name}",
                written=0,
            )
        counts = self._device.outputs.to_counts(task, np.array(rows))
        return pb.WriteAnalogWaveformsResponse(
            samps_per_chan_written=self._write(task, counts, request)
        )

    # raw numbers

    def ReadBinaryU16(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.ReadBinaryU16Response(**self._raw(request, np.uint16))

    def ReadBinaryI32(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.ReadBinaryI32Response(**self._raw(request, np.int32))

    def ReadBinaryU32(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.ReadBinaryU32Response(**self._raw(request, np.uint32))

    def WriteBinaryU16(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.WriteBinaryU16Response(samps_per_chan_written=self._write_raw(request))

    def WriteBinaryI32(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.WriteBinaryI32Response(samps_per_chan_written=self._write_raw(request))

    def WriteBinaryU32(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.WriteBinaryU32Response(samps_per_chan_written=self._write_raw(request))

    def _raw(self, request: Any, kind: type) -> dict[str, Any]:
        """Return the fields of a reply with raw numbers; negative ones are those modulo 2^n."""
        room = request.array_size_in_samps
        reading = self._read(self._task(request), request, room)
        values: np.ndarray = reading.values.astype(kind)
        laid = np.zeros(max(room, values.size), dtype=kind)
        by_channel = (request.fill_mode_raw or request.fill_mode) == 0
        laid[: values.size] = values.ravel() if by_channel else values.T.ravel()
        return {
            "status": 0 if reading.complete else int(Code.SAMPLES_NOT_YET_AVAILABLE),
            "read_array": laid,
            "samps_per_chan_read": values.shape[1],
        }

    def _write_raw(self, request: Any) -> int:
        task = self._task(request)
        values = self._to_write(task, request, np.int64)
        # unsigned 16-bit numbers stand for the signed ones of the same bits
        unsigned = type(request).__name__ == "WriteBinaryU16Request"
        values = values.astype(np.uint16).astype(np.int16) if unsigned else values
        if values.size and not COUNT_MIN <= values.min() <= values.max() <= COUNT_MAX:
            raise DaqmxError(Code.INVALID_SAMPLE, f"Task Name: {task.name}", written=0)
        return self._write(task, values.astype(np.int16), request)


def check_channels(task: Task, given: int, wanted: int) -> None:
    """Refuse data of another number of channels than the task has."""
    if given != wanted:
        raise DaqmxError(
            Code.CHANNELS_DIFFER,
            f"Number of Channels in Task: {wanted}; Number of Channels in Data: {given}; "
            f"Task Name: {task.name}",
            written=0,
        )
