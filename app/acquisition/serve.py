"""Serve the simulated card until ctrl-C."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dearig.acquisition.interrupts import Interrupts
from dearig.config.rigfile import RigFile
from dearig.drivers.daqmx.certificates import Certificates, read_certificates
from dearig.drivers.daqmx.link import is_loopback
from dearig.drivers.errors import AddressError, LinkRefused
from dearig.errors import InputError, InstrumentFault
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.keyence import SimulatedController
from dearig.sim_backend.serial_port import serve_on_pty, serve_on_socket

if TYPE_CHECKING:
    from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

__all__ = ["Serving", "TlsFiles", "needs_simulated_card", "serve"]

_TLS = ("tls_cert", "tls_key", "tls_client_ca")  # names of the options
_POLL_S = 0.1  # s between two checks for ctrl-C


@dataclass(frozen=True)
class Serving:
    """Where the server listens, and the ``rig`` address that reaches it.

    ``laser`` is the serial port of the simulated laser controller, empty where none was asked for.
    """

    host: str
    port: int
    rig: str
    laser: str = ""
    security: str = ""


@dataclass(frozen=True)
class TlsFiles:
    """PEM files of TLS, None where there is none.

    ``cert`` and ``key`` are the server's; with ``client_ca`` every client must show a certificate
    that this authority signed (mutual TLS), as with NI's server.
    """

    cert: Path | None = None
    key: Path | None = None
    client_ca: Path | None = None


_NO_TLS = TlsFiles()


@contextmanager
def needs_simulated_card() -> Iterator[None]:
    """Raise ``InstrumentFault`` if the body imports a library that is not installed."""
    try:
        yield
    except ImportError as error:
        raise InstrumentFault(
            f"the simulated card is built on one version of nidaqmx, which is not installed "
            f'({error}): pip install "dearig[simulated-card]"'
        ) from error


def serve(
    address: str,
    rig_file: RigFile,
    *,
    announce: Callable[[Serving], None],
    host: str = "127.0.0.1",
    port: int = 0,
    anywhere: bool = False,
    tls: TlsFiles = _NO_TLS,
    paced: bool = True,
    faults: Sequence[str] = (),
    client_timeout: float | None = 1.0,
    link_timeout: float = 1.0,
    seed: int = 0,
    laser: bool = False,
    sine: bool = False,
    signals: Sequence[str] | None = None,
) -> None:
    """Serve the card of the simulated rig at ``address`` until ctrl-C.

    ``announce`` is called with a ``Serving`` once it listens. ``anywhere`` allows a ``host`` that
    other computers can reach; all files of ``tls`` must then be given. A client may be silent with
    a voltage at the film for ``client_timeout`` s, without limit if None, and its link may be dead
    for ``link_timeout`` s. With ``sine`` the card's inputs read a sine within their limits, as
    NI's own simulated devices give one, and not the rig. ``signals`` at its digital terminals are
    texts such as ``PFI8=1 kHz, 25 %``; None: the default ones.
    Raises ``InputError`` for an address, host or port that cannot be used, and ``InstrumentFault``
    where the libraries are missing.
    """
    certificates = _certificates(host, anywhere, tls)
    # the library's own lines about broken connections are no help at this terminal
    os.environ.setdefault("GRPC_VERBOSITY", "NONE")
    with needs_simulated_card():
        from dearig.sim_backend.daqmx.opening import open_device
        from dearig.sim_backend.daqmx.protocol.server import DaqmxServer
    try:
        plan = FaultPlan.parse(faults)
        device = open_device(
            address, rig_file, rig_file.as_film(), rig_file.as_load(), seed=seed, paced=paced,
            faults=plan, sine=sine, signals=_signals(signals),
        )  # fmt: skip
    except AddressError as error:
        raise InputError(str(error)) from error
    except ValueError as error:  # an unknown fault or signal, or a film without a rest state
        raise InputError(f"rig {address!r}: {error}") from error
    server = DaqmxServer(
        device, host=host, port=port, client_timeout=client_timeout, link_timeout=link_timeout,
        certificates=certificates,
    )  # fmt: skip
    with Interrupts() as interrupts:
        try:
            try:
                found = server.start()
            except OSError as error:
                raise InputError(
                    f"port {port} on {host} cannot be listened on: another program may have it, or "
                    f"the host is not one of this computer's; port 0 takes any that is free",
                    option="port",
                ) from error
            named = f"[{host}]" if ":" in host else host
            rig = f"daqmx:{device.name}@{named}:{found}"
            with _controller(rig_file, device, plan) if laser else nullcontext("") as serial_port:
                announce(Serving(host, found, rig, serial_port, _security(certificates)))
                waiting = threading.Event()
                while not interrupts.asked():
                    waiting.wait(_POLL_S)
            interrupts.close()
        finally:
            server.close()


def _signals(texts: Sequence[str] | None) -> dict[str, str] | None:
    """Return the signals by terminal; raises ``ValueError`` for a text without ``=``."""
    if texts is None:
        return None
    signals = {}
    for text in texts:
        terminal, equals, signal = text.partition("=")
        if not equals:
            raise ValueError(f"signal {text!r}: write it as PFI8='1 kHz, 25 %'")
        signals[terminal] = signal
    return signals


def _controller(
    rig_file: RigFile, device: SimulatedCard, faults: FaultPlan
) -> AbstractContextManager[str]:
    """Return a laser controller at a serial port, set as in the rig file, that reads the film."""
    controller = SimulatedController(rig_file.laser, lambda _: device.displacement(), faults=faults)
    if sys.platform == "win32":
        return serve_on_socket(controller)
    return serve_on_pty(controller, baud_rate=rig_file.laser.baud_rate)


def _certificates(host: str, anywhere: bool, tls: TlsFiles) -> Certificates | None:
    """Return the server's certificates, None for no TLS, if ``host`` may be listened on with them.

    Raises ``InputError`` where it may not.
    """
    if (tls.cert is None) != (tls.key is None):
        raise InputError(
            "a certificate and its key belong together; give both", option=("tls_cert", "tls_key")
        )
    if tls.client_ca is not None and tls.cert is None:
        raise InputError(
            "a CA of the clients needs the server's own certificate and key",
            option=("tls_cert", "tls_key"),
        )
    if not is_loopback(host):
        if not anywhere:
            raise InputError(
                f"host {host} can be reached from other computers: every program that reaches "
                f"the port can drive the rig; if that is intended, allow it, with certificates",
                option=("anywhere", *_TLS),
            )
        if tls.client_ca is None:
            raise InputError(
                f"host {host} can be reached from other computers, and needs a certificate, its "
                f"key and the CA of the clients: only clients with a certificate may drive the rig",
                option=_TLS,
            )
    if tls.cert is None:
        return None
    try:
        return read_certificates(
            tls.client_ca or "", tls.cert, tls.key or "",
            ("CA of the clients", "certificate", "key"),
        )  # fmt: skip
    except LinkRefused as error:
        raise InputError(str(error), option=_TLS) from error


def _security(certificates: Certificates | None) -> str:
    """Return the part of the announcement about TLS."""
    if certificates is None:
        return ""
    asks = "asks clients for a certificate; " if certificates.ca else ""
    return f"TLS, {asks}set card.tls_ca in the client's rig file; "
