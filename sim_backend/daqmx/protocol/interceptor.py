"""Interceptor of every call: bounds on requests and threads, faults of the link, error replies."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any, NoReturn

import grpc
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import DecodeError

from dearig.sim_backend.clock import Clock
from dearig.sim_backend.daqmx.card.errors import ERROR_TEXT, Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import Kind
from dearig.sim_backend.daqmx.protocol.clients import Clients
from dearig.sim_backend.daqmx.protocol.servicer import refuse
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard
from dearig.sim_backend.faults import FaultKind

__all__ = ["THREADS", "Interceptor"]

log = logging.getLogger(__name__)

_ANSWERING = 32  # threads for calls that are answered at once; no call that waits takes them
_WAITING = 64  # calls that wait for samples or for the end of a task
_LISTENING = 64  # events that clients listen to; each takes a thread while it lasts
#: Threads of the server.
THREADS = _ANSWERING + _WAITING + _LISTENING

#: Samples in one reply, over all channels: 32 MiB as float64, computed in some 2 s.
_REPLY_SAMPLES = 2**22
_TEXT = 4096  # characters of a text in a request

_ROOMS = {"array_size_in_samps": 1, "array_size_in_bytes": 2, "array_size": 1}  # bytes a sample
_WAITS = ("Wait", "Read", "Write")
# on-demand tasks of these kinds do not wait
_IMMEDIATE = (Kind.EMPTY, Kind.AI, Kind.AO, Kind.DO)

Call = Callable[[Any, Any], Any]


class _Garbage:
    """Placeholder for a request that is not a protocol message."""


class _Places:
    """Places for calls that keep a thread; ``what`` they do, for the refusal of a further one."""

    def __init__(self, number: int, what: str) -> None:
        self._number, self._what = number, what
        self._free = threading.BoundedSemaphore(number)

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Take a place while the body runs. Raises ``DaqmxError`` where all are taken."""
        if not self._free.acquire(blocking=False):
            raise DaqmxError(
                Code.RESOURCE_NOT_AVAILABLE,
                f"The server serves at most {self._number} {self._what} at a time; end others "
                f"first, or clear the tasks that are no longer used.",
            )
        try:
            yield
        finally:
            self._free.release()


class Interceptor(grpc.ServerInterceptor):
    """Interceptor of the calls to ``device``; ``clients`` is None where no one tracks them.

    ``link`` is the clock of the faults of the link, ``closing`` is set when the server closes.
    """

    def __init__(
        self, device: SimulatedCard, clients: Clients | None, link: Clock, closing: threading.Event
    ) -> None:
        self._device = device
        self._clients = clients
        self._link = link
        self._closing = closing
        self._waiting = _Places(_WAITING, "calls that wait")
        self._listening = _Places(_LISTENING, "events that a client listens to")

    def intercept_service(
        self, continuation: Callable[[Any], Any], handler_call_details: Any
    ) -> Any:
        """See ``grpc.ServerInterceptor``."""
        handler = continuation(handler_call_details)
        if handler is None:
            return None
        name = handler_call_details.method.rpartition("/")[2]
        decode = _decoder(handler.request_deserializer)
        if handler.unary_unary is not None:
            return grpc.unary_unary_rpc_method_handler(
                self._answering(name, handler.unary_unary), decode, handler.response_serializer
            )
        return grpc.unary_stream_rpc_method_handler(
            self._streaming(name, handler.unary_stream), decode, handler.response_serializer
        )

    def _answering(self, name: str, call: Call) -> Call:
        def answer(request: Any, context: grpc.ServicerContext) -> Any:
            clients = self._clients
            watched = nullcontext() if clients is None else clients.call(context.peer(), context)
            # a call that is held does not arrive, so its client counts as silent
            self._freeze()
            with self._errors(name, context, frozen=True):
                _check(name, request)
                with self._place(name, request), watched:
                    response = call(request, context)
                    self._delay()  # a client that waits for a late reply is not silent
            self._freeze()
            return response

        return answer

    def _streaming(self, name: str, call: Call) -> Call:
        def answer(request: Any, context: grpc.ServicerContext) -> Iterator[Any]:
            with self._errors(name, context):
                _check(name, request)
                with self._listening.taken():
                    if self._clients is not None:
                        self._clients.listen(context.peer(), request.task.name, context)
                    yield from call(request, context)

        return answer

    @contextmanager
    def _errors(
        self, name: str, context: grpc.ServicerContext, *, frozen: bool = False
    ) -> Iterator[None]:
        """End the call ``name`` with an error that the body raises."""
        try:
            yield
        except DaqmxError as error:
            if frozen:
                self._freeze()
            refuse(context, error)
        except NotImplementedError as error:
            _abort(context, grpc.StatusCode.UNIMPLEMENTED, str(error))
        except Exception as error:
            # the protocol's own way to end a call with a status raises a bare exception
            if type(error) is Exception:
                raise
            # a fault of this program is one line at the terminal; the log file has the traceback
            words = f"{type(error).__name__}: {error}"[:ERROR_TEXT]
            log.warning("%s failed in the simulated card: %s", name, words)
            log.debug("%s failed", name, exc_info=True)
            _abort(context, grpc.StatusCode.INTERNAL, f"{name} failed in the simulated card")

    def _place(self, name: str, request: Any) -> AbstractContextManager[None]:
        return self._waiting.taken() if self._may_wait(name, request) else nullcontext()

    def _may_wait(self, name: str, request: Any) -> bool:
        """Return True if the call may keep its thread for longer than it computes."""
        if not name.startswith(_WAITS) or "task" not in request.DESCRIPTOR.fields_by_name:
            return False
        try:
            task = self._device.task(request.task.name)
        except DaqmxError:
            return False
        return task.clock is not None or task.kind not in _IMMEDIATE

    def _freeze(self) -> None:
        """Hold a call while the server is frozen."""
        fault = self._device.run.active(FaultKind.SERVER_FROZEN)
        if fault is None:
            return
        if fault.duration < math.inf:
            self._link.wait(self._link.now() + fault.duration, self._closing)
        else:
            self._closing.wait()

    def _delay(self) -> None:
        """Delay one reply."""
        fault = self._device.run.fires(FaultKind.LATE_REPLY)
        if fault is not None:
            self._link.wait(self._link.now() + fault.duration, self._closing)


def _decoder(decode: Callable[[bytes], Any]) -> Callable[[bytes], Any]:
    """Return ``decode`` without an exception, which gRPC would write to the terminal."""

    def decoded(data: bytes) -> Any:
        try:
            return decode(data)
        except DecodeError:
            return _Garbage()

    return decoded


def _abort(context: grpc.ServicerContext, code: grpc.StatusCode, words: str) -> NoReturn:
    context.abort(code, words)
    raise AssertionError("abort returns")


def _check(name: str, request: Any) -> None:
    """Refuse a request that is not a message, or whose reply or texts would be too large."""
    if isinstance(request, _Garbage):
        raise DaqmxError(Code.INVALID_VALUE, f"The request of {name} is not a message.")
    for field, value in request.ListFields():
        kind = field.cpp_type
        if field.name in _ROOMS:
            if value > _REPLY_SAMPLES * _ROOMS[field.name]:
                raise DaqmxError(
                    Code.MEMORY_FULL,
                    f"Samples Requested: {value // _ROOMS[field.name]}; a reply of this server "
                    f"holds {_REPLY_SAMPLES} over all channels: read them in several calls.",
                    read=0,
                )
        elif kind == FieldDescriptor.CPPTYPE_STRING:
            _check_text(name, field.name, value)
        elif kind == FieldDescriptor.CPPTYPE_MESSAGE and field.name == "task":
            _check_text(name, "task", value.name)
        elif isinstance(value, float) and math.isnan(value):
            raise DaqmxError(Code.INVALID_VALUE, f"Requested Value of {field.name}: nan")
        elif field.name.startswith("num_samps") and value < 0 and name.startswith("Write"):
            raise DaqmxError(Code.INVALID_VALUE, f"Number of Samples: {value}", written=0)


def _check_text(name: str, field: str, value: Any) -> None:
    """Refuse a text, or several, in the ``field`` of a call that is too long."""
    if field == "write_array":
        return  # samples, which the size of a request bounds
    texts = [value] if isinstance(value, (str, bytes)) else value
    length = max(len(texts), *(len(text) for text in texts))
    if length > _TEXT:
        raise DaqmxError(
            Code.INVALID_VALUE, f"{field} of {name} has a length of {length}; at most {_TEXT}."
        )
