"""Connection to the DAQmx driver: the library in this computer, or a server with a deadline."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from dearig.drivers.errors import RigError

if TYPE_CHECKING:
    import grpc
    from nidaqmx import GrpcSessionOptions

__all__ = ["Link"]

# s; after a time-out further calls fail sooner, so that many calls do not take many time-outs
_LOST_TIMEOUT = 0.2


class Link:
    """A connection to the DAQmx driver behind ``server``, or in this computer when that is None.

    ``timeout`` in s limits the server's time for an answer; without it, a call to a frozen server
    would never end. Raises ``RigError`` where nidaqmx is not installed.
    """

    def __init__(self, server: str | None, timeout: float) -> None:
        self.server = server
        self._channel: grpc.Channel | None = None
        try:
            import nidaqmx  # noqa: F401
        except ImportError as error:
            raise RigError(
                f'the Python package nidaqmx is not installed ({error}): pip install "dearig[rig]"'
            ) from error
        if server is not None:
            self._channel = _channel_with_deadline(server, timeout)

    @property
    def session(self) -> GrpcSessionOptions | None:
        """Return the ``grpc_options`` for nidaqmx."""
        if self._channel is None:
            return None
        from nidaqmx import GrpcSessionOptions

        return GrpcSessionOptions(self._channel, "")

    def close(self) -> None:
        """Close the connection; tasks on the server remain there."""
        if self._channel is not None:
            self._channel.close()


class _Details(NamedTuple):
    method: str
    timeout: float
    metadata: Any
    credentials: Any


def _channel_with_deadline(server: str, timeout: float) -> grpc.Channel:
    import grpc

    lost_codes = (grpc.StatusCode.DEADLINE_EXCEEDED, grpc.StatusCode.UNAVAILABLE)

    class Details(_Details, grpc.ClientCallDetails):
        pass

    class Deadline(grpc.UnaryUnaryClientInterceptor):
        lost = False

        def intercept_unary_unary(self, call: Any, details: Any, request: Any) -> Any:
            within = min(timeout, _LOST_TIMEOUT) if self.lost else timeout
            answer = call(
                Details(details.method, within, details.metadata, details.credentials), request
            )
            self.lost = answer.code() in lost_codes
            return answer

    unlimited = -1
    channel = grpc.insecure_channel(
        server,
        options=(
            ("grpc.max_receive_message_length", unlimited),
            ("grpc.max_send_message_length", unlimited),
            # a proxy from the environment must not be used between a rig and its card
            ("grpc.enable_http_proxy", 0),
        ),
    )
    return grpc.intercept_channel(channel, Deadline())
