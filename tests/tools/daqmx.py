"""The simulated card and an unmodified client, as tests use them; run, it is such a client."""

from __future__ import annotations

import functools
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import grpc
import nidaqmx
import numpy as np
from nidaqmx import GrpcSessionOptions
from nidaqmx.constants import (
    AcquisitionType,
    DigitalWidthUnits,
    RegenerationMode,
    TerminalConfiguration,
)
from nidaqmx.stream_readers import AnalogUnscaledReader
from nidaqmx.stream_writers import AnalogSingleChannelWriter

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

ENABLE = "port0/line0"
SKEW, INTERVAL = 50e-6, 10e-6  # s, the rig file's defaults
AO_CLOCK = "/Dev1/ao/SampleClock"


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


def open_channel(port: int) -> grpc.Channel:
    options = [
        ("grpc.max_receive_message_length", -1),
        ("grpc.max_send_message_length", -1),
        ("grpc.enable_http_proxy", 0),
        # connections of their own, as of programs of their own
        ("grpc.use_local_subchannel_pool", 1),
    ]
    channel = grpc.insecure_channel(f"127.0.0.1:{port}", options)
    # nidaqmx asks for all of its 448 calls again for each task
    channel.unary_unary = functools.cache(channel.unary_unary)
    return channel


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


def add_output(made: nidaqmx.Task, terminal: str = "ao0") -> None:
    made.ao_channels.add_ao_voltage_chan(f"Dev1/{terminal}", min_val=-10.0, max_val=10.0)


def add_inputs(made: nidaqmx.Task, *terminals: str) -> None:
    for terminal in terminals or ("ai0", "ai1", "ai2"):
        made.ai_channels.add_ai_voltage_chan(
            f"Dev1/{terminal}",
            terminal_config=TerminalConfiguration.DIFF,
            min_val=-10.0,
            max_val=10.0,
        )


def as_the_rig_file_says(made: nidaqmx.Task) -> None:
    """Conversions at the times that the rig file gives by default."""
    made.timing.ai_conv_rate = 1.0 / INTERVAL
    made.timing.delay_from_samp_clk_delay_units = DigitalWidthUnits.SECONDS
    made.timing.delay_from_samp_clk_delay = SKEW


def clock_inputs(
    made: nidaqmx.Task,
    rate: float,
    samples: int | None = None,
    source: str = AO_CLOCK,
    buffer: int = 100_000,
) -> None:
    mode = AcquisitionType.CONTINUOUS if samples is None else AcquisitionType.FINITE
    made.timing.cfg_samp_clk_timing(
        rate, source=source, sample_mode=mode, samps_per_chan=samples or buffer
    )
    if samples is None:
        made.in_stream.input_buf_size = buffer
    as_the_rig_file_says(made)


def clock_output(
    made: nidaqmx.Task, rate: float, samples: int | None = None, buffer: int | None = None
) -> None:
    """Without regeneration where there is a ``buffer``."""
    mode = AcquisitionType.CONTINUOUS if samples is None else AcquisitionType.FINITE
    made.timing.cfg_samp_clk_timing(rate, sample_mode=mode, samps_per_chan=samples or 1000)
    if buffer is not None:
        made.out_stream.output_buf_size = buffer
        made.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION


def write(made: nidaqmx.Task, volts: np.ndarray, timeout: float = 10.0) -> int:
    writer = AnalogSingleChannelWriter(made.out_stream, auto_start=False)
    return writer.write_many_sample(np.ascontiguousarray(volts), timeout)


def read(made: nidaqmx.Task, samples: int, timeout: float = 10.0) -> np.ndarray:
    """Counts (channels, samples)."""
    counts = np.empty((len(made.channel_names), samples), dtype=np.int16)
    got = AnalogUnscaledReader(made.in_stream).read_int16(counts, samples, timeout)
    return counts.reshape(-1)[: counts.shape[0] * got].reshape(counts.shape[0], got)


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


def main() -> None:
    """Put 5 V on the output of the server at the port given, say so, and hang there.

    ``listening`` as second word also listens to an event of a task, ``reading`` hangs in a read.
    """
    port, how = int(sys.argv[1]), sys.argv[2]
    session = GrpcSessionOptions(open_channel(port), "")
    output, inputs = nidaqmx.Task(grpc_options=session), nidaqmx.Task(grpc_options=session)
    add_output(output)
    if how == "listening":
        output.register_done_event(lambda *_: 0)
    output.write(5.0)
    sys.stdout.write("5 V\n")
    sys.stdout.flush()
    if how == "reading":
        add_inputs(inputs)
        clock_inputs(inputs, 1000.0)
        read(inputs, 10, timeout=1e6)
    sys.stdin.read()


if __name__ == "__main__":
    main()
