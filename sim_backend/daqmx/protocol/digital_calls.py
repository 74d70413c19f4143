"""Calls of NI's gRPC device protocol for digital lines and their watchdogs."""

# ruff: noqa: N802, ARG002  (names, arguments and messages are the protocol's)

from __future__ import annotations

import datetime
from collections.abc import Sequence
from typing import Any

import grpc
import numpy as np
from ni.protobuf.types.waveform_conversion import (
    digital_waveform_from_protobuf,
    digital_waveform_to_protobuf,
)
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nitypes.waveform import DigitalWaveform, Timing
from session_pb2 import Session

from dearig.sim_backend.daqmx.card.channels import Lines
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.protocol.calls import BY_CHANNEL, Calls, laid_out, number, status

__all__ = ["DigitalCalls"]


def _place(line: str) -> int:
    """Return the bit of a line in the word of its port."""
    return int(line.rpartition("line")[2])


def _words(task: Task, levels: np.ndarray) -> np.ndarray:
    """Return a word for each channel (channels, n) from ``levels`` (lines, n)."""
    words = np.zeros((len(task.lines), levels.shape[1]), dtype=np.uint32)
    row = 0
    for word, channel in zip(words, task.lines, strict=True):
        for line in channel.lines:
            word |= levels[row].astype(np.uint32) << np.uint32(_place(line))
            row += 1
    return words


def _levels(task: Task, words: np.ndarray) -> np.ndarray:
    """Return the levels (lines, n) of ``words`` (channels, n); other bits have no line."""
    rows = [
        (word >> np.uint32(_place(line))) & np.uint32(1)
        for word, channel in zip(words.astype(np.uint32), task.lines, strict=True)
        for line in channel.lines
    ]
    return np.array(rows, dtype=np.uint8)


class DigitalCalls(Calls):
    """Calls for digital lines."""

    # reading lines

    def CreateDIChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.lines.add(
            self._task(request),
            request.lines,
            request.name_to_assign_to_lines,
            together=number(request, "line_grouping") == 1,
            kind=Kind.DI,
        )
        return pb.CreateDIChanResponse()

    def CreateDOChan(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._device.lines.add(
            self._task(request),
            request.lines,
            request.name_to_assign_to_lines,
            together=number(request, "line_grouping") == 1,
        )
        return pb.CreateDOChanResponse()

    def ReadDigitalU32(self, request: Any, context: grpc.ServicerContext) -> Any:
        return self._read_words(request, pb.ReadDigitalU32Response, 32)

    def ReadDigitalU16(self, request: Any, context: grpc.ServicerContext) -> Any:
        return self._read_words(request, pb.ReadDigitalU16Response, 16)

    def ReadDigitalU8(self, request: Any, context: grpc.ServicerContext) -> Any:
        return self._read_words(request, pb.ReadDigitalU8Response, 8)

    def _read_words(self, request: Any, response: Any, bits: int) -> Any:
        task = self._of_lines(request)
        room = request.array_size_in_samps
        if bits == 8 and hasattr(request, "array_size_in_bytes"):
            room = request.array_size_in_bytes
        levels, complete = self._read_levels(task, request, room // max(1, len(task.lines)))
        words = laid_out(_words(task, levels), request)
        return response(
            status=status(complete),
            read_array=words.astype(np.uint8).tobytes() if bits == 8 else words,
            samps_per_chan_read=levels.shape[1],
        )

    def ReadDigitalScalarU32(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._of_lines(request)
        levels, complete = self._levels(task, 1, request.timeout)
        if not complete:
            raise DaqmxError(Code.SAMPLES_NOT_YET_AVAILABLE, read=0)
        return pb.ReadDigitalScalarU32Response(value=int(_words(task, levels)[0, 0]))

    def ReadDigitalLines(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._of_lines(request)
        widest = max(len(channel.lines) for channel in task.lines)
        room = request.array_size_in_bytes
        levels, complete = self._read_levels(task, request, room // (widest * len(task.lines)))
        samples = levels.shape[1]
        # (channels, samples, lines), the lines of a narrower channel padded with zeros
        by_channel = np.zeros((len(task.lines), samples, widest), dtype=np.uint8)
        row = 0
        for place, channel in enumerate(task.lines):
            lines = levels[row : row + len(channel.lines)]
            by_channel[place, :, : len(channel.lines)] = lines.T
            row += len(channel.lines)
        if number(request, "fill_mode") != BY_CHANNEL:
            by_channel = by_channel.transpose(1, 0, 2)
        return pb.ReadDigitalLinesResponse(
            status=status(complete),
            read_array=np.ascontiguousarray(by_channel).tobytes(),
            samps_per_chan_read=samples,
            num_bytes_per_samp=widest,
        )

    def _read_levels(self, task: Task, request: Any, most: int) -> tuple[np.ndarray, bool]:
        samples = request.num_samps_per_chan
        if samples > most:
            raise DaqmxError(Code.READ_BUFFER_TOO_SMALL, f"Task Name: {task.name}", read=0)
        return self._levels(task, samples, request.timeout, most)

    def _levels(
        self, task: Task, samples: int, timeout: float, most: int | None = None
    ) -> tuple[np.ndarray, bool]:
        """Return the next levels (lines, n) of a task; of one that puts them out, the present."""
        if task.kind is Kind.DO:
            held = [[self._device.line(line)] for line in task.line_names]
            return np.repeat(np.array(held, dtype=np.uint8), max(1, samples), axis=1), True
        reading = self._device.reader.read(task, samples, timeout, most)
        return reading.values, reading.complete

    def _of_lines(self, request: Any, kind: Kind = Kind.DI) -> Task:
        task = self._task(request)
        # lines that are put out on demand can be read back
        read_back = task.kind is Kind.DO and task.clock is None
        if task.kind is not kind and not (kind is Kind.DI and read_back):
            if kind is Kind.DO:
                raise DaqmxError(Code.NOT_AN_OUTPUT, f"Task Name: {task.name}", written=0)
            raise DaqmxError(Code.NOT_AN_INPUT, f"Task Name: {task.name}", read=0)
        return task

    # writing lines

    def WriteDigitalLines(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._of_lines(request, Kind.DO)
        values = np.frombuffer(request.write_array, dtype=np.uint8)
        samples, widest = request.num_samps_per_chan, max(len(c.lines) for c in task.lines)
        size = len(task.lines) * samples * widest
        if values.size < size:
            raise DaqmxError(Code.WRITE_BUFFER_TOO_SMALL, f"Task Name: {task.name}", written=0)
        shape = (len(task.lines), samples, widest)
        if number(request, "data_layout") == BY_CHANNEL:
            by_channel = values[:size].reshape(shape)
        else:
            by_channel = values[:size].reshape(samples, len(task.lines), widest).transpose(1, 0, 2)
        rows = [
            by_channel[place, :, bit] != 0
            for place, channel in enumerate(task.lines)
            for bit in range(len(channel.lines))
        ]
        return pb.WriteDigitalLinesResponse(
            samps_per_chan_written=self._write_levels(task, np.array(rows), request)
        )

    def WriteDigitalU32(self, request: Any, context: grpc.ServicerContext) -> Any:
        return self._write_words(request, request.write_array, pb.WriteDigitalU32Response)

    def WriteDigitalU16(self, request: Any, context: grpc.ServicerContext) -> Any:
        return self._write_words(request, request.write_array, pb.WriteDigitalU16Response)

    def WriteDigitalU8(self, request: Any, context: grpc.ServicerContext) -> Any:
        words = np.frombuffer(request.write_array, dtype=np.uint8)
        return self._write_words(request, words, pb.WriteDigitalU8Response)

    def WriteDigitalScalarU32(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._of_lines(request, Kind.DO)
        words = np.full((len(task.lines), 1), request.value, dtype=np.uint32)
        self._write_levels(task, _levels(task, words), request)
        return pb.WriteDigitalScalarU32Response()

    def _write_words(self, request: Any, values: Any, response: Any) -> Any:
        task = self._of_lines(request, Kind.DO)
        words = np.fromiter(values, np.uint32, len(values))
        channels = len(task.lines)
        samples = request.num_samps_per_chan
        if words.size < channels * samples:
            raise DaqmxError(Code.WRITE_BUFFER_TOO_SMALL, f"Task Name: {task.name}", written=0)
        words = words[: channels * samples]
        by_channel = number(request, "data_layout") == BY_CHANNEL
        words = words.reshape(channels, -1) if by_channel else words.reshape(-1, channels).T
        written = self._write_levels(task, _levels(task, words), request)
        return response(samps_per_chan_written=written)

    def _write_levels(self, task: Task, levels: np.ndarray, request: Any) -> int:
        return self._device.lines.write(task, levels, request.auto_start, request.timeout)

    # waveforms

    def ReadDigitalWaveforms(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._of_lines(request)
        levels, complete = self._levels(task, request.num_samps_per_chan, request.timeout)
        by_line = dict(zip(task.line_names, levels, strict=True))
        waveforms = [
            self._digital_waveform(task, c, np.array([by_line[line] for line in c.columns]))
            for c in task.lines
        ]
        return pb.ReadDigitalWaveformsResponse(
            status=status(complete), waveforms=waveforms, samps_per_chan_read=levels.shape[1]
        )

    def _digital_waveform(self, task: Task, channel: Lines, levels: np.ndarray) -> Any:
        waveform = DigitalWaveform.from_lines(np.ascontiguousarray(levels.T), dtype=np.uint8)
        waveform.channel_name = channel.name
        # a signal's number counts from the last column
        for signal, line in zip(waveform.signals, reversed(channel.columns), strict=True):
            signal.name = f"{self._device.name}/{line}"
        waveform.timing = self._timing(task, levels.shape[1])
        return digital_waveform_to_protobuf(waveform)

    def _timing(self, task: Task, samples: int) -> Any:
        """Return the times of the last ``samples`` of ``task`` on this computer's clock."""
        if task.clock is None:
            return Timing.create_with_no_interval(datetime.datetime.now(datetime.UTC))
        start, interval = self._device.lines.times_of_last(task, samples)
        return Timing.create_with_regular_interval(
            datetime.timedelta(seconds=interval),
            datetime.datetime.now(datetime.UTC) - datetime.timedelta(seconds=start),
        )

    def WriteDigitalWaveforms(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._of_lines(request, Kind.DO)
        rows: list[np.ndarray] = []
        for waveform, channel in zip(request.waveforms, task.lines, strict=False):
            data = digital_waveform_from_protobuf(waveform).data
            if data.shape[1] != len(channel.lines):
                raise DaqmxError(
                    Code.DIGITAL_LINES_MISMATCH,
                    f"Lines in the Data: {data.shape[1]}; Lines in the Channel: "
                    f"{len(channel.lines)}; Channel Name: {channel.name}",
                    written=0,
                )
            by_line = dict(zip(channel.columns, data.T != 0, strict=True))
            rows += [by_line[line] for line in channel.lines]
        levels = self._as_array(task, rows, len(task.line_names))
        written = self._write_levels(task, levels, request)
        return pb.WriteDigitalWaveformsResponse(samps_per_chan_written=written)

    @staticmethod
    def _as_array(task: Task, rows: Sequence[np.ndarray], channels: int) -> np.ndarray:
        if len(rows) != channels or not rows:
            raise DaqmxError(Code.WRITE_BUFFER_TOO_SMALL, f"Task Name: {task.name}", written=0)
        return np.array(rows)

    # the watchdog

    def CreateWatchdogTimerTaskEx(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._device.create_watchdog(
            request.session_name, context.peer(), request.device_name, request.timeout
        )
        return pb.CreateWatchdogTimerTaskExResponse(
            task=Session(name=task.name), new_session_initialized=True
        )

    def CfgWatchdogDOExpirStates(self, request: Any, context: grpc.ServicerContext) -> Any:
        task = self._task(request)
        names = [name.strip() for name in request.channel_names.split(",")]
        for name, value in zip(names, request.expir_state_array, strict=True):
            self._device.watchdogs.set_expiration(task, name, value)
        return pb.CfgWatchdogDOExpirStatesResponse()

    def ControlWatchdogTask(self, request: Any, context: grpc.ServicerContext) -> Any:
        action = request.action_raw or request.action
        self._device.watchdogs.control(self._task(request), clear=action == 1)
        return pb.ControlWatchdogTaskResponse()
