"""What an unmodified client of a card does, as tests use it; run, it is such a client.

It imports nothing of this program, so that a process of its own starts in a moment.
"""

from __future__ import annotations

import functools
import sys

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

SKEW, INTERVAL = 50e-6, 10e-6  # s, the rig file's defaults
AO_CLOCK = "/Dev1/ao/SampleClock"


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
