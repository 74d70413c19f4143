"""Calls of NI's gRPC device protocol for events; each occupies a thread while a client listens."""

# ruff: noqa: N802, ARG002  (names, arguments and messages are the protocol's)

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import grpc
from nidaqmx._stubs import nidaqmx_pb2 as pb

from dearig.sim_backend.daqmx.card.tasks import Listener, Task
from dearig.sim_backend.daqmx.protocol.calls import Calls
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

__all__ = ["EventCalls"]

_POLL_S = 0.02  # period at which an event's stream checks whether it is due


class EventCalls(Calls):
    """Calls for the events of tasks."""

    def __init__(self, device: SimulatedCard, closing: threading.Event) -> None:
        super().__init__(device, closing)
        self._streams: dict[str, Listener] = {}

    def RegisterDoneEvent(self, request: Any, context: grpc.ServicerContext) -> Iterator[Any]:
        for outcome in self._events("done", request, context, None):
            yield pb.RegisterDoneEventResponse(status=outcome)

    def UnregisterDoneEvent(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._close_stream("done", self._task(request))
        return pb.UnregisterDoneEventResponse()

    def RegisterEveryNSamplesEvent(
        self, request: Any, context: grpc.ServicerContext
    ) -> Iterator[Any]:
        direction = request.every_n_samples_event_type_raw or request.every_n_samples_event_type
        for _ in self._events("samples", request, context, request.n_samples, direction):
            yield pb.RegisterEveryNSamplesEventResponse(
                every_n_samples_event_type_raw=direction, n_samples=request.n_samples
            )

    def UnregisterEveryNSamplesEvent(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._close_stream("samples", self._task(request))
        return pb.UnregisterEveryNSamplesEventResponse()

    def RegisterSignalEvent(self, request: Any, context: grpc.ServicerContext) -> Iterator[Any]:
        signal = request.signal_id_raw or request.signal_id
        for _ in self._events("signal", request, context, 1, signal=signal):
            yield pb.RegisterSignalEventResponse(signal_id=signal)

    def UnregisterSignalEvent(self, request: Any, context: grpc.ServicerContext) -> Any:
        self._close_stream("signal", self._task(request))
        return pb.UnregisterSignalEventResponse()

    def _events(
        self,
        what: str,
        request: Any,
        context: grpc.ServicerContext,
        every: int | None,
        direction: int = 0,
        signal: int | None = None,
    ) -> Iterator[int]:
        """Yield the status of each event of a task until the client has heard enough."""
        task = self._task(request)
        listener = self._device.listen(task, every, context, direction, signal)
        key = f"{what} {task.name}"
        self._streams[key] = listener

        def forget() -> None:
            self._device.forget(task, listener)
            if self._streams.get(key) is listener:
                del self._streams[key]

        if not context.add_callback(forget):
            forget()
        # the client waits for this before it continues
        context.send_initial_metadata(())
        while self._streams.get(key) is listener and context.is_active():
            yield from self._device.due_events(task, listener)
            if self._closing.wait(_POLL_S):
                return

    def _close_stream(self, what: str, task: Task) -> None:
        listener = self._streams.pop(f"{what} {task.name}", None)
        if listener is not None:
            self._device.forget(task, listener)
