"""Simulated DAQmx card in this process, for tests of programs that use nidaqmx."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dearig.acquisition.serve import needs_simulated_card
from dearig.config.rigfile import RigFile

if TYPE_CHECKING:
    from nidaqmx import GrpcSessionOptions

    from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

__all__ = ["ServedCard", "simulated_daqmx_card"]


@dataclass(frozen=True)
class ServedCard:
    """Simulated card behind a server on this computer.

    ``session`` is what nidaqmx takes as ``grpc_options``; ``port`` is for other processes.
    ``device`` knows the truth: levels of lines, voltages of outputs, signals at terminals.
    """

    session: GrpcSessionOptions
    port: int
    device: SimulatedCard


@contextmanager
def simulated_daqmx_card(
    *,
    name: str = "Dev1",
    signals: Mapping[str, str] | None = None,
    sine: bool = False,
    paced: bool = False,
    seed: int = 0,
) -> Iterator[ServedCard]:
    """Serve a simulated PCIe-6361 called ``name``, and close it at the end.

    Parameters
    ----------
    name : str
        Name of the device.
    signals : mapping, optional
        Signals at the digital terminals: ``{"PFI8": "1 kHz, 25 %", "PFI3": "PFI12"}``. Without it
        the card has those of ``dearig.sim_backend.daqmx.card.terminals.DEFAULT_SIGNALS``.
    sine : bool
        Let the analog inputs read a sine within their limits instead of a rig at rest.
    paced : bool
        Run in real time; otherwise a wait of the program takes no time.
    seed : int
        Seed of the noise.

    Raises
    ------
    InstrumentFault
        The libraries of the extra ``simulated-card`` are not installed.
    """
    with needs_simulated_card():
        import grpc
        from nidaqmx import GrpcSessionOptions

        from dearig.sim_backend.daqmx.opening import open_device
        from dearig.sim_backend.daqmx.protocol.server import DaqmxServer
    rig = RigFile.model_validate({"card": {"device": name}})
    device = open_device(
        "sim", rig, rig.as_film(), rig.as_load(),
        seed=seed, paced=paced, sine=sine, signals=signals,
    )  # fmt: skip
    options = [
        ("grpc.max_receive_message_length", -1),
        ("grpc.max_send_message_length", -1),
        ("grpc.enable_http_proxy", 0),
    ]
    # a program under test may wait for as long as it likes with a voltage at an output
    with DaqmxServer(device, client_timeout=None) as server:
        channel = grpc.insecure_channel(f"127.0.0.1:{server.port}", options)
        try:
            yield ServedCard(GrpcSessionOptions(channel, ""), server.port, device)
        finally:
            channel.close()
