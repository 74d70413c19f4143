"""NI's gRPC device protocol, translated to calls of the simulated card without further rules."""

# ruff: noqa: N802, ARG002  (names, arguments and messages are the protocol's)

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from typing import Any, NoReturn

import grpc
import numpy as np
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx._stubs import nidaqmx_pb2_grpc as pb_grpc
from session_pb2 import Session

from dearig.drivers.channels import COUNT_MAX, COUNT_MIN
from dearig.sim_backend.daqmx.card.errors import ERROR_TEXT, Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.properties import attributes
from dearig.sim_backend.daqmx.properties.attributes import Asked
from dearig.sim_backend.daqmx.properties.kinds import name_of
from dearig.sim_backend.daqmx.protocol.calls import BY_CHANNEL, is_finite, laid_out, number, status
from dearig.sim_backend.daqmx.protocol.counter_calls import CounterCalls
from dearig.sim_backend.daqmx.protocol.digital_calls import DigitalCalls
from dearig.sim_backend.daqmx.protocol.event_calls import EventCalls
from dearig.sim_backend.daqmx.protocol.scale_calls import ScaleCalls
from dearig.sim_backend.daqmx.protocol.sensor_calls import SensorCalls
from dearig.sim_backend.daqmx.protocol.system_calls import SystemCalls
from dearig.sim_backend.daqmx.protocol.trigger_calls import TriggerCalls
from dearig.sim_backend.daqmx.protocol.waveform_calls import WaveformCalls
from dearig.sim_backend.daqmx.running.reading import Reading

__all__ = ["Servicer", "refuse"]

log = logging.getLogger(__name__)

_ACTIVE_EDGE = 0x1301  # SAMP_CLK_ACTIVE_EDGE


def refuse(context: grpc.ServicerContext, error: DaqmxError) -> NoReturn:
    """End a call with ``error``, as NI's server does."""
    trailing = [("ni-error", str(error.code))]
    if error.read is not None:
        trailing.append(("ni-samps-per-chan-read", str(error.read)))
    if error.written is not None:
        trailing.append(("ni-samps-per-chan-written", str(error.written)))
    context.set_trailing_metadata(tuple(trailing))
    # the text goes into a header, which holds 8 KiB
    context.abort(grpc.StatusCode.UNKNOWN, str(error)[:ERROR_TEXT])
    raise error  # not reached: abort raises


class Servicer(
    SensorCalls,
    SystemCalls,
    WaveformCalls,
    DigitalCalls,
    CounterCalls,
    TriggerCalls,
    ScaleCalls,
    EventCalls,
):
    """Service of the calls; the caller handles ``DaqmxError`` and ``NotImplementedError``.

    All other calls are answered with UNIMPLEMENTED, and one line in the log.
    """

    # tasks

    def CreateTask(self, request: Any, context: grpc.ServicerContext) -> Any:
        behaviour = request.initialization_behavior
        if behaviour == 2:  # attach to an existing one
            self._device.task(request.session_name)
        task, new = self._device.create(request.session_name, context.peer(), attach=behaviour != 1)
        return pb.CreateTaskResponse(task=Session(name=task.name), new_session_initialized=new)

    def ClearTask(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.clear(self._task(request))
        return pb.ClearTaskResponse()

    def StartTask(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.states.start(self._task(request))
        return pb.StartTaskResponse()

    def StopTask(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.states.stop(self._task(request))
        return pb.StopTaskResponse()

    def TaskControl(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.states.control(self._task(request), request.action_raw or request.action)
        return pb.TaskControlResponse()

    def IsTaskDone(self, request: Any, context: grpc.ServicerContext) -> Any:
        return pb.IsTaskDoneResponse(is_task_done=self._device.states.is_done(self._task(request)))

    def WaitUntilTaskDone(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.states.wait_done(self._task(request), request.time_to_wait)
        return pb.WaitUntilTaskDoneResponse()

    def GetNthTaskChannel(self, request: Any, context: grpc.ServicerContext) -> Any:
        names = self._task(request).channel_names
        if not 1 <= request.index <= len(names):
            raise DaqmxError(Code.INVALID_VALUE, f"Index: {request.index}")
        return pb.GetNthTaskChannelResponse(buffer=names[request.index - 1])

    # channels and timing

    def CreateAIVoltageChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.channels.add_inputs(
            self._task(request),
            request.physical_channel,
            request.name_to_assign_to_channel,
            request.terminal_config_raw or request.terminal_config,
            (request.min_val, request.max_val),
            self._scale(request),
        )
        return pb.CreateAIVoltageChanResponse()

    def CreateAOVoltageChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.channels.add_outputs(
            self._task(request),
            request.physical_channel,
            request.name_to_assign_to_channel,
            (request.min_val, request.max_val),
            self._scale(request),
        )
        return pb.CreateAOVoltageChanResponse()

    def CfgSampClkTiming(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        self._device.timing.set_clock(
            task, request.rate, request.source, is_finite(request), request.samps_per_chan
        )
        edge = number(request, "active_edge")
        attributes.set_("Timing", _ACTIVE_EDGE, Asked(self._device, task), edge)
        return pb.CfgSampClkTimingResponse()

    def CfgDigEdgeStartTrig(self, request: Any, context: grpc.ServicerContext) -> Any:
        edge = request.trigger_edge_raw or request.trigger_edge
        self._device.triggering.set_start(self._task(request), request.trigger_source, edge)
        return pb.CfgDigEdgeStartTrigResponse()

    def DisableStartTrig(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.triggering.set_start(self._task(request), "")
        return pb.DisableStartTrigResponse()

    # reading

    def ReadAnalogF64(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        reading = self._read(task, request, request.array_size_in_samps)
        values = self._device.inputs.scaled(task, reading.values)
        return pb.ReadAnalogF64Response(
            status=status(reading.complete),
            read_array=laid_out(values, request),
            samps_per_chan_read=values.shape[1],
        )

    def ReadAnalogScalarF64(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        reading = self._device.inputs.read(task, 1, request.timeout)
        if not reading.complete:
            raise DaqmxError(Code.SAMPLES_NOT_YET_AVAILABLE, read=0)
        return pb.ReadAnalogScalarF64Response(
            value=float(self._device.inputs.scaled(task, reading.values)[0, 0])
        )

    def ReadBinaryI16(self, request: Any, context: grpc.ServicerContext) -> Any:
        reading = self._read(self._task(request), request, request.array_size_in_samps)
        return pb.ReadBinaryI16Response(
            status=status(reading.complete),
            read_array=laid_out(reading.values, request),
            samps_per_chan_read=reading.values.shape[1],
        )

    def ReadRaw(self, request: Any, context: grpc.ServicerContext) -> Any:
        room = request.array_size_in_bytes // 2
        reading = self._read(self._task(request), request, room)
        # the card delivers scan after scan
        scans = np.ascontiguousarray(reading.values.T).tobytes()
        return pb.ReadRawResponse(
            status=status(reading.complete),
            read_array=scans.ljust(request.array_size_in_bytes, b"\0"),
            samps_read=reading.values.shape[1],
            num_bytes_per_samp=2,
        )

    # writing

    def WriteAnalogF64(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        volts = self._to_write(task, request, np.float64)
        return pb.WriteAnalogF64Response(
            samps_per_chan_written=self._write(
                task, self._device.outputs.to_counts(task, volts), request
            )
        )

    def WriteAnalogScalarF64(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        self._outputs(task)
        if len(task.outputs) != 1:
            raise DaqmxError(Code.INVALID_VALUE, "A single value is for a single channel.")
        self._write(
            task, self._device.outputs.to_counts(task, np.array([[request.value]])), request
        )
        return pb.WriteAnalogScalarF64Response()

    def WriteBinaryI16(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        values = self._to_write(task, request, np.int64)
        if values.size and not COUNT_MIN <= values.min() <= values.max() <= COUNT_MAX:
            raise DaqmxError(Code.INVALID_SAMPLE, written=0)
        return pb.WriteBinaryI16Response(
            samps_per_chan_written=self._write(task, values.astype(np.int16), request)
        )

    def WriteRaw(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        self._outputs(task)
        whole = len(request.write_array) // 2 * 2
        scans = np.frombuffer(request.write_array[:whole], dtype=np.int16)
        rows = len(task.outputs)
        if scans.size < request.num_samps * rows:
            raise DaqmxError(Code.WRITE_BUFFER_TOO_SMALL, written=0)
        counts = scans[: request.num_samps * rows].reshape(-1, rows).T
        return pb.WriteRawResponse(samps_per_chan_written=self._write(task, counts, request))

    # shared by the calls

    def _asked(self, request: Any) -> Asked:
        """Return the target of a property's request."""
        fields = request.DESCRIPTOR.fields_by_name
        task = self._task(request) if "task" in fields else None
        if "device_name" in fields:
            self._device.check_device(request.device_name)
        channel = ""
        for field in ("channel", "physical_channel", "lines", "scale_name"):
            if field in fields:
                channel = getattr(request, field)
        return Asked(self._device, task, channel)

    def _read(self, task: Task, request: Any, room: int) -> Reading:
        samples, most = request.num_samps_per_chan, room // max(1, len(task.inputs))
        if samples > most:
            raise DaqmxError(Code.READ_BUFFER_TOO_SMALL, f"Task Name: {task.name}", read=0)
        return self._device.inputs.read(task, samples, request.timeout, most)

    def _outputs(self, task: Task) -> None:
        if task.kind is not Kind.AO:
            raise DaqmxError(Code.NOT_AN_OUTPUT, f"Task Name: {task.name}", written=0)

    def _to_write(self, task: Task, request: Any, kind: type) -> np.ndarray:
        """Return the array (channels, n) of a request."""
        self._outputs(task)
        rows, samples = len(task.outputs), request.num_samps_per_chan
        values: np.ndarray = np.fromiter(request.write_array, kind, len(request.write_array))
        if values.size < rows * samples:
            raise DaqmxError(Code.WRITE_BUFFER_TOO_SMALL, f"Task Name: {task.name}", written=0)
        values = values[: rows * samples]
        layout = request.data_layout_raw or request.data_layout
        return values.reshape(rows, -1) if layout == BY_CHANNEL else values.reshape(-1, rows).T

    def _write(self, task: Task, counts: np.ndarray, request: Any) -> int:
        return self._device.outputs.write(task, counts, request.auto_start, request.timeout)


def _attribute_call(name: str, response: Any) -> Callable[[Servicer, Any, Any], Any] | None:
    """Return the method for the call ``name``, such as ``GetTimingAttributeDouble``, or None."""
    found = re.match(r"(Get|Set|Reset)([A-Za-z]+?)Attribute", name)
    if not found or found[2] not in attributes.TABLES:
        return None
    verb, group = found[1], found[2]
    raw = "value_raw" in response.DESCRIPTOR.fields_by_name

    def answer(self: Servicer, request: Any, context: grpc.ServicerContext) -> Any:  # noqa: ARG001
        asked = self._asked(request)
        number = request.attribute_raw or request.attribute
        if "device_names" in request.DESCRIPTOR.fields_by_name:
            attributes.check_device_context(number, asked)
        if verb == "Reset":
            attributes.reset(group, number, asked)
            return response()
        if verb == "Set":
            fields = request.DESCRIPTOR.fields_by_name
            value = request.value
            if "value_raw" in fields and request.WhichOneof("value_enum") == "value_raw":
                value = request.value_raw
            attributes.set_(group, number, asked, value)
            return response()
        value = attributes.get(group, number, asked)
        try:
            return response(**{"value_raw" if raw else "value": value})
        except (TypeError, ValueError) as error:  # beyond the type of the reply
            raise DaqmxError(
                Code.INVALID_VALUE, f"Property: {name_of(group, number)}; Value: {value}"
            ) from error

    return answer


def _add_attribute_calls() -> None:
    """Add the calls for properties by type, of which the service has a hundred."""
    for method in pb.DESCRIPTOR.services_by_name["NiDAQmx"].methods:
        answer = _attribute_call(method.name, getattr(pb, method.output_type.name))
        if answer is not None:
            setattr(Servicer, method.name, answer)


def _unimplemented(name: str) -> Callable[[Servicer, Any, Any], Any]:
    """Return the method for the call ``name``, which the card does not simulate."""

    def answer(self: Servicer, request: Any, context: grpc.ServicerContext) -> Any:  # noqa: ARG001
        log.warning("%s is not simulated; the client is told so", name)
        raise NotImplementedError(f"{name} is not simulated")

    return answer


def _add_unimplemented_calls() -> None:
    """Add every other call; the base class would write a traceback for each."""
    for method in pb.DESCRIPTOR.services_by_name["NiDAQmx"].methods:
        if getattr(Servicer, method.name) is getattr(pb_grpc.NiDAQmxServicer, method.name):
            setattr(Servicer, method.name, _unimplemented(method.name))


_add_attribute_calls()
_add_unimplemented_calls()
