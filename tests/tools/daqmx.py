"""The simulated card behind its server, and an unmodified client, as tests use them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import nidaqmx
import numpy as np
from nidaqmx import GrpcSessionOptions
from nidaqmx.stream_readers import AnalogUnscaledReader

from dearig.config.rigfile import RigFile
from dearig.drivers.daqmx.certificates import Certificates
from dearig.drivers.gate import GatedWaveform
from dearig.sim_backend.clock import Clock, ManualClock
from dearig.sim_backend.daqmx.opening import open_device
from dearig.sim_backend.daqmx.protocol.server import DaqmxServer
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard
from dearig.sim_backend.factory import open_simulated_rig
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.rig import SimulatedRig
from tests.tools.daqmx_client import (
    AO_CLOCK,
    INTERVAL,
    SKEW,
    add_inputs,
    add_output,
    as_the_rig_file_says,
    clock_inputs,
    clock_output,
    open_channel,
    read,
    write,
)

__all__ = [
    "AO_CLOCK",
    "ENABLE",
    "INTERVAL",
    "SKEW",
    "HandClock",
    "Served",
    "add_inputs",
    "add_output",
    "as_the_rig_file_says",
    "clock_inputs",
    "clock_output",
    "connected",
    "enabled_rig",
    "in_thread",
    "open_channel",
    "play_finite",
    "read",
    "served",
    "task",
    "the_rig",
    "volts",
    "write",
]

ENABLE = "port0/line0"


class HandClock:
    """A clock that only a test moves; whoever waits on it waits until it has been moved."""

    def __init__(self) -> None:
        self._now = 0.0
        self._moved = threading.Condition()
        self.waiters = 0

    def now(self) -> float:
        return self._now

    def wait(self, until: float, wake: threading.Event) -> None:
        with self._moved:
            self.waiters += 1
            self._moved.notify_all()
            # what is woken by the event and not by the clock is asked for now and then
            while self._now < until and not wake.is_set():
                self._moved.wait(0.01)
            self.waiters -= 1

    def advance(self, seconds: float) -> None:
        with self._moved:
            self._now += seconds
            self._moved.notify_all()

    def until_somebody_waits(self) -> None:
        with self._moved:
            assert self._moved.wait_for(lambda: self.waiters > 0, timeout=30.0)


@dataclass
class Served:
    """A server with the card behind it, and the session of one client."""

    server: DaqmxServer
    device: SimulatedCard
    session: GrpcSessionOptions


def enabled_rig(**card) -> RigFile:
    """A rig whose high voltage is enabled by a digital line."""
    return RigFile.model_validate({"card": {"do_hv_enable": ENABLE, **card}})


@contextmanager
def connected(port: int) -> Iterator[GrpcSessionOptions]:
    """The session of one more client."""
    channel = open_channel(port)
    try:
        yield GrpcSessionOptions(channel, "")
    finally:
        channel.close()


@contextmanager
def served(
    settings: RigFile | None = None,
    *,
    address: str = "sim",
    clock: Clock | None = None,
    seed: int = 0,
    faults: tuple[str, ...] = (),
    client_timeout: float | None = 1.0,
    link_timeout: float = 20.0,
    link: Clock | None = None,
    certificates: Certificates | None = None,
    sine: bool = False,
    signals: dict[str, str] | None = None,
) -> Iterator[Served]:
    """A server in this process, as fast as it can be, and a client of it without TLS.

    Time on the ``link`` stands still unless the caller moves it: a machine that stalls in the
    middle of a test is not a silent client.
    """
    settings = settings or RigFile()
    device = open_device(
        address,
        settings,
        settings.as_film(),
        settings.as_load(),
        seed=seed,
        clock=clock or ManualClock(),
        faults=FaultPlan.parse(faults),
        sine=sine,
        signals=signals,
    )
    with (
        DaqmxServer(
            device,
            client_timeout=client_timeout,
            link_timeout=link_timeout,
            link=link or ManualClock(),
            certificates=certificates,
        ) as server,
        connected(server.port) as session,
    ):
        yield Served(server, device, session)


@contextmanager
def task(session: GrpcSessionOptions) -> Iterator[nidaqmx.Task]:
    """A task that is cleared at the end, unless the test has done so."""
    made = nidaqmx.Task(grpc_options=session)
    try:
        yield made
    finally:
        if made._handle is not None:
            made.close()


def the_rig(address: str = "sim", seed: int = 0) -> SimulatedRig:
    """The same rig in this process, without a server."""
    settings = RigFile()
    return open_simulated_rig(address, settings, settings.as_film(), settings.as_load(), seed=seed)


def volts(waveform: GatedWaveform) -> np.ndarray:
    """V at the output that make ``waveform`` at the film, with a gain of 1000."""
    return waveform.window() / 1000.0


def play_finite(
    session: GrpcSessionOptions, waveform: GatedWaveform, kind: type = AnalogUnscaledReader
) -> np.ndarray:
    """Counts (inputs, samples) of one finite run as the rig file wires it."""
    with task(session) as ao, task(session) as ai:
        add_output(ao)
        add_inputs(ai)
        clock_output(ao, waveform.rate, waveform.samples)
        clock_inputs(ai, waveform.rate, waveform.samples)
        ao.write(volts(waveform))
        ai.start()
        ao.start()
        counts = read(ai, waveform.samples)
        ao.wait_until_done(0.0)
        ai.wait_until_done(0.0)
    return counts


def in_thread(call: Callable[[], object]) -> Callable[[], object]:
    """Begin ``call`` in another thread; what is given back waits for its result."""
    results: list[object] = []

    def run() -> None:
        try:
            results.append(call())
        except Exception as error:  # noqa: BLE001  (it is raised where it is waited for)
            results.append(error)

    thread = threading.Thread(target=run)
    thread.start()

    def wait() -> object:
        thread.join(30.0)
        assert results, "it has not come to an end"
        if isinstance(results[0], Exception):
            raise results[0]
        return results[0]

    return wait
