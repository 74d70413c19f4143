"""Serve the simulated card until ctrl-C."""

from __future__ import annotations

import ipaddress
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dearig.acquisition.interrupts import Interrupts
from dearig.config.rigfile import RigFile
from dearig.drivers.errors import AddressError
from dearig.errors import InputError, InstrumentFault
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.keyence import SimulatedController
from dearig.sim_backend.serial_port import serve_on_pty, serve_on_socket

if TYPE_CHECKING:
    from dearig.sim_backend.daqmx.device import Device

__all__ = ["Serving", "serve"]

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


def serve(
    address: str,
    rig_file: RigFile,
    *,
    told: Callable[[Serving], None],
    host: str = "127.0.0.1",
    port: int = 0,
    anywhere: bool = False,
    paced: bool = True,
    faults: Sequence[str] = (),
    client_timeout: float | None = 1.0,
    link_timeout: float = 1.0,
    seed: int = 0,
    laser: bool = False,
) -> None:
    """Serve the card of the simulated rig at ``address`` until ctrl-C.

    ``told`` is called with a ``Serving`` once it listens. ``anywhere`` allows a ``host`` that
    other computers can reach. A client may be silent with a voltage at the film for
    ``client_timeout`` s, without limit if None, and its link may be dead for ``link_timeout`` s.
    Raises ``InputError`` for an address, host or port that cannot be used, and ``InstrumentFault``
    where the libraries are missing.
    """
    if not (anywhere or _is_loopback(host)):
        raise InputError(
            f"--host {host} can be reached from other computers: every program that reaches the "
            f"port can drive the rig; if that is intended, add --anywhere"
        )
    try:
        from dearig.sim_backend.daqmx.opening import open_device
        from dearig.sim_backend.daqmx.server import DaqmxServer
    except ImportError as error:
        raise InstrumentFault(
            f"the simulated card is built on one version of nidaqmx, which is not installed "
            f'({error}): pip install "dearig[simulated-card]"'
        ) from error
    try:
        plan = FaultPlan.parse(faults)
        device = open_device(
            address, rig_file, rig_file.as_film(), rig_file.as_load(), seed=seed, paced=paced,
            faults=plan,
        )  # fmt: skip
    except AddressError as error:
        raise InputError(str(error)) from error
    except ValueError as error:  # an unknown fault, or a film without a rest state
        raise InputError(f"rig {address!r}: {error}") from error
    server = DaqmxServer(
        device, host=host, port=port, client_timeout=client_timeout, link_timeout=link_timeout
    )
    with Interrupts() as interrupts:
        try:
            try:
                found = server.start()
            except OSError as error:
                raise InputError(
                    f"port {port} on {host} cannot be listened on: another program may have it, or "
                    f"the host is not one of this computer's; --port 0 takes any that is free"
                ) from error
            rig = f"daqmx:{device.name}@{host}:{found}"
            with _controller(rig_file, device, plan) if laser else nullcontext("") as serial_port:
                told(Serving(host, found, rig, serial_port))
                waiting = threading.Event()
                while not interrupts.asked():
                    waiting.wait(_POLL_S)
            interrupts.close()
        finally:
            server.close()


def _controller(
    rig_file: RigFile, device: Device, faults: FaultPlan
) -> AbstractContextManager[str]:
    """Return a laser controller at a serial port, set as in the rig file, that reads the film."""
    controller = SimulatedController(rig_file.laser, lambda _: device.displacement(), faults=faults)
    if sys.platform == "win32":
        return serve_on_socket(controller)
    return serve_on_pty(controller, baud_rate=rig_file.laser.baud_rate)


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
