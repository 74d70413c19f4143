"""Connection to the DAQmx driver: the library in this computer, or a server with a deadline."""

from __future__ import annotations

import functools
import ipaddress
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from dearig.drivers.daqmx.certificates import read_certificates
from dearig.drivers.errors import LinkRefused, RigError
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.settings import CardSettings, RigSettings

if TYPE_CHECKING:
    import grpc
    from nidaqmx import GrpcSessionOptions

__all__ = ["Link", "is_loopback"]

# s; after a time-out further calls fail sooner, so that many calls do not take many time-outs
_LOST_TIMEOUT = 0.2
# nidaqmx asks for the three parts of the driver's version for each task; they do not change
_VERSION = "/GetSystemInfoAttributeUInt32"


def is_loopback(host: str) -> bool:
    """Return True if ``host`` is this computer's loopback; no name is looked up."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


class Link:
    """A connection to the DAQmx driver behind ``server``, or in this computer when that is None.

    ``settings`` give the server's time for an answer, without which a call to a frozen server
    would never end, and the TLS certificates. Only the ``server`` is contacted: proxies of the
    environment are ignored. Raises ``LinkRefused`` for another computer's server without TLS that
    the rig file does not allow, or for certificates that cannot be read; ``RigError`` where
    nidaqmx is not installed.
    """

    def __init__(self, server: str | None, settings: RigSettings) -> None:
        self.server = server
        #: True once the server has answered a call.
        self.answered = False
        self._channel: grpc.Channel | None = None
        if server is not None:
            _check_security(server, settings.card)
        self.security = None if server is None else _security(server, settings.card)
        try:
            import nidaqmx  # noqa: F401
        except ImportError as error:
            raise RigError(
                f'the Python package nidaqmx is not installed ({error}): pip install "dearig[rig]"'
            ) from error
        if server is not None:
            self._channel = _channel_with_deadline(
                server, settings.guardian.link_timeout_s, settings.card, self._note_answer
            )

    def _note_answer(self) -> None:
        self.answered = True

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


def _check_security(server: str, card: CardSettings) -> None:
    """Raise ``LinkRefused`` for another computer's server without TLS, unless it is allowed."""
    host = server.rpartition(":")[0]
    if not (is_loopback(host) or card.tls_ca or card.server_without_tls):
        raise LinkRefused(
            f"server {server} is on another computer and no TLS is set: write tls_ca, and tls_cert "
            f"and tls_key if it asks for them, in [card] of the rig file; or server_without_tls = "
            f"true if everybody on the network may drive the card"
        )


def _security(server: str, card: CardSettings) -> Finding:
    """Return the finding on the connection's encryption and authentication."""
    name, item = f"server {server}", "connection"
    if card.tls_ca:
        own = "this computer shows its certificate" if card.tls_cert else "without a client's one"
        return Finding(name, item, f"TLS, the server's certificate is verified, {own}")
    if is_loopback(server.rpartition(":")[0]):
        return Finding(name, item, "on this computer, without TLS")
    return Finding(
        name, item, "without TLS, as card.server_without_tls allows: everybody on the network "
        "between can read and drive the card", verdict="warning",
        advice="set up TLS at the server and write tls_ca, tls_cert and tls_key",
    )  # fmt: skip


class _Details(NamedTuple):
    method: str
    timeout: float
    metadata: Any
    credentials: Any


def _channel_with_deadline(
    server: str, timeout: float, card: CardSettings, on_answer: Callable[[], None]
) -> grpc.Channel:
    import grpc

    lost_codes = (grpc.StatusCode.DEADLINE_EXCEEDED, grpc.StatusCode.UNAVAILABLE)

    class Details(_Details, grpc.ClientCallDetails):
        pass

    class Deadline(grpc.UnaryUnaryClientInterceptor):
        lost = False

        def __init__(self) -> None:
            self._versions: dict[bytes, Any] = {}

        def intercept_unary_unary(self, call: Any, details: Any, request: Any) -> Any:
            asked = request.SerializeToString() if details.method.endswith(_VERSION) else b""
            if asked in self._versions:
                return self._versions[asked]
            within = min(timeout, _LOST_TIMEOUT) if self.lost else timeout
            answer = call(
                Details(details.method, within, details.metadata, details.credentials), request
            )
            self.lost = answer.code() in lost_codes
            if answer.code() is grpc.StatusCode.OK:
                on_answer()
                if asked:
                    self._versions[asked] = answer
            return answer

    unlimited = -1
    options = (
        ("grpc.max_receive_message_length", unlimited),
        ("grpc.max_send_message_length", unlimited),
        # a proxy from the environment must not be used between a rig and its card
        ("grpc.enable_http_proxy", 0),
        # only the address of the host is looked up, not its service configuration
        ("grpc.service_config_disable_resolution", 1),
    )
    # the scheme is given, so that no part of the host is read as another one
    target = f"dns:///{server}"
    if card.tls_ca:
        channel = grpc.secure_channel(target, _credentials(card), options=options)
    else:
        channel = grpc.insecure_channel(target, options=options)
    intercepted = grpc.intercept_channel(channel, Deadline())
    # nidaqmx asks for all of its 448 calls again for each task, which takes most of a task's time
    intercepted.unary_unary = functools.cache(intercepted.unary_unary)
    return intercepted


def _credentials(card: CardSettings) -> grpc.ChannelCredentials:
    """Return the credentials of ``card``'s certificates."""
    import grpc

    found = read_certificates(
        card.tls_ca, card.tls_cert, card.tls_key, ("card.tls_ca", "card.tls_cert", "card.tls_key")
    )
    return grpc.ssl_channel_credentials(found.ca, found.key, found.cert)
