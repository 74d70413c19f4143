"""Server of the simulated card with NI's gRPC device protocol, for the unmodified client."""

from __future__ import annotations

import logging
import threading
from concurrent.futures import ThreadPoolExecutor

import grpc
from nidaqmx._stubs import nidaqmx_pb2_grpc as pb_grpc

from dearig.drivers.daqmx.certificates import Certificates
from dearig.sim_backend.clock import Clock, PacedClock
from dearig.sim_backend.daqmx.protocol.clients import Clients
from dearig.sim_backend.daqmx.protocol.interceptor import THREADS, Interceptor
from dearig.sim_backend.daqmx.protocol.servicer import Servicer
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard
from dearig.sim_backend.faults import FaultKind

__all__ = ["DaqmxServer"]

log = logging.getLogger(__name__)

_POLL_S = 0.05  # period of the search for silent clients
_REQUEST_MAX = 2**26  # bytes: 8 million samples in float64
_OPTIONS = (
    ("grpc.max_send_message_length", -1),
    ("grpc.max_receive_message_length", _REQUEST_MAX),
    # who connects and says nothing is dropped; a busy client needs milliseconds
    ("grpc.server_handshake_timeout_ms", 2000),
    # a process may have 1024 files on Linux by default
    ("grpc.max_allowed_incoming_connections", 256),
    ("grpc.max_concurrent_streams", 256),  # calls at a time on one connection
    ("grpc.so_reuseport", 0),  # a port in use is an error; it is not shared
    # a client may check the link at any rate
    ("grpc.http2.max_ping_strikes", 0),
    ("grpc.http2.min_recv_ping_interval_without_data_ms", 50),
)
_PING_S = 0.1  # period of the check that a client is alive


class DaqmxServer:
    """Server of ``device`` on ``host`` and ``port`` (0: any free one), local by default.

    With ``client_timeout`` in s the output is set to 0 V when a client dies or is silent while
    there is a voltage at the film. With None the server behaves as NI's: tasks and outputs stay
    as they are. ``link_timeout`` in s does the same for a client without a sign of life, whose
    link was cut or whose process was halted; too short a time mistakes a busy computer for that.
    ``link`` is the clock of the link; the card has its own. With ``certificates`` it speaks TLS,
    and clients must show a certificate of its ``ca`` if there is one.
    """

    def __init__(
        self,
        device: SimulatedCard,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        client_timeout: float | None = 1.0,
        link_timeout: float = 1.0,
        link: Clock | None = None,
        certificates: Certificates | None = None,
    ) -> None:
        self.device = device
        self._address = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        self._link = link or PacedClock()
        self._certificates = certificates
        self._closing = threading.Event()
        self.clients = (
            None if client_timeout is None else Clients(device, self._link, client_timeout)
        )
        self._pool = ThreadPoolExecutor(THREADS, thread_name_prefix="daqmx")
        self._server = grpc.server(
            self._pool,
            interceptors=(Interceptor(device, self.clients, self._link, self._closing),),
            options=_OPTIONS if client_timeout is None else _OPTIONS + _pings(link_timeout),
        )
        pb_grpc.add_NiDAQmxServicer_to_server(Servicer(device, self._closing), self._server)
        self._watch = threading.Thread(target=self._poll, name="daqmx clients", daemon=True)
        self.port = 0

    def start(self) -> int:
        """Listen; returns the port. Raises ``OSError`` where the address is not available."""
        try:
            self.port = self._listen()
        except RuntimeError as error:
            raise OSError(f"{self._address} cannot be listened on") from error
        if self.port == 0:
            raise OSError(f"{self._address} cannot be listened on")
        self._server.start()
        self._watch.start()
        return self.port

    def _listen(self) -> int:
        found = self._certificates
        if found is None:
            return int(self._server.add_insecure_port(self._address))
        credentials = grpc.ssl_server_credentials(
            [(found.key, found.cert)],
            root_certificates=found.ca,
            require_client_auth=found.ca is not None,
        )
        return int(self._server.add_secure_port(self._address, credentials))

    def close(self) -> None:
        """Take the output to 0 V and drop every connection."""
        self.device.make_safe()
        self._closing.set()
        self._server.stop(0).wait()
        if self._watch.is_alive():
            self._watch.join()
        self._pool.shutdown()

    def __enter__(self) -> DaqmxServer:
        """Itself, listening."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()

    def _poll(self) -> None:
        """Check for silent clients and for the planned end of the server, until it is closed."""
        while not self._closing.wait(_POLL_S):
            if self.clients is not None:
                self.clients.check()
            if self.device.run.fires(FaultKind.SERVER_GONE) is not None:
                log.warning("fault: the server is gone")
                self._server.stop(0)
                if self.clients is not None:
                    self.clients.all_gone()


def _pings(timeout: float) -> tuple[tuple[str, int], ...]:
    """Return the options that detect within ``timeout`` s a peer that does not answer."""
    answer = max(50, round((timeout - _PING_S) * 1e3))
    return (
        ("grpc.keepalive_time_ms", round(_PING_S * 1e3)),
        ("grpc.keepalive_timeout_ms", answer),
        ("grpc.http2.ping_timeout_ms", answer),  # this one takes effect, though not meant for this
        ("grpc.keepalive_permit_without_calls", 1),
        ("grpc.http2.max_pings_without_data", 0),
    )
