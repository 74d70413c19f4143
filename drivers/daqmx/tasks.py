"""The card's tasks of one run; this module alone creates, owns and clears them.

Inputs are converted on the ticks of the output's sample clock, because two clocks would drift
apart. The inputs are therefore started first and wait. They pause whenever the output does, and as
many samples are acquired as are output.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from dearig.drivers.channels import Channel
from dearig.drivers.command import Command
from dearig.drivers.daqmx.explain import TIMEOUT, instrument_errors
from dearig.drivers.daqmx.link import Link
from dearig.drivers.daqmx.outputs import clear
from dearig.drivers.errors import RigError
from dearig.drivers.settings import CardSettings, RigSettings

if TYPE_CHECKING:
    import nidaqmx
    from nidaqmx.system import WatchdogTask

__all__ = [
    "Card",
    "ClockedTasks",
    "actual_channels",
    "add_inputs",
    "identify_card",
    "read_counts",
    "time_conversions",
]

_READER_BUFFER = 4.0  # times the reader's delay that ends a run
_PIECE = 1 << 20  # samples in one request: a server bounds its size
_ODD_BUFFER = 4095  # samples; an output buffer of exactly this size misbehaved on a 6361


@dataclass(frozen=True)
class Card:
    """Properties that a card reports.

    ``channels`` are in the order of blocks, with the card's own scaling and actual timing.
    """

    model: str
    serial: str
    simulated: bool
    channels: tuple[Channel, ...]


def identify_card(link: Link, device: str, settings: RigSettings) -> Card:
    """Query the card without output. Raises ``RigError`` where it does not fit the settings."""
    with instrument_errors(device, link.server, answered=link.answered):
        from nidaqmx.system import Device

        card = Device(device, grpc_options=link.session)
        model, serial = card.product_type, f"{card.serial_num:X}"
        simulated = card.is_simulated
    tasks = ClockedTasks(link, device, settings)
    try:
        return Card(model, serial, simulated, tasks.channels())
    finally:
        tasks.close()


def add_inputs(task: nidaqmx.Task, device: str, settings: RigSettings) -> None:
    """Add the rig's inputs to ``task``, in the order of a block's rows."""
    from nidaqmx.constants import TerminalConfiguration

    terminals, ranges, wiring = settings.terminals(), settings.ranges(), settings.wiring()
    for name in settings.channel_names[1:]:
        task.ai_channels.add_ai_voltage_chan(
            f"{device}/{terminals[name]}",
            name_to_assign_to_channel=name,
            terminal_config=TerminalConfiguration[wiring[name]],
            min_val=-ranges[name],
            max_val=ranges[name],
        )


def time_conversions(task: nidaqmx.Task, card: CardSettings) -> None:
    """Let the inputs of ``task`` be converted one after another as ``card`` says."""
    from nidaqmx.constants import DigitalWidthUnits

    task.timing.ai_conv_rate = 1e6 / card.convert_interval_us
    task.timing.delay_from_samp_clk_delay_units = DigitalWidthUnits.SECONDS
    task.timing.delay_from_samp_clk_delay = card.first_convert_us * 1e-6


def actual_channels(task: nidaqmx.Task, settings: RigSettings) -> tuple[Channel, ...]:
    """Return the rig's channels with the scaling and the skew of the reserved inputs ``task``."""
    coefficients = {
        channel.name: tuple(channel.ai_dev_scaling_coeff) for channel in task.ai_channels
    }
    first = task.timing.delay_from_samp_clk_delay
    interval = 1.0 / task.timing.ai_conv_rate
    # the card corrects its output itself, so the nominal scaling holds
    coefficients["voltage_command"] = (0.0, settings.card.ao_range_V / 32768.0)
    inputs = len(settings.channel_names) - 1
    return settings.channels(coefficients, [first + i * interval for i in range(inputs)])


def read_counts(task: nidaqmx.Task, inputs: int, samples: int, wait: float) -> np.ndarray:
    """Return counts (inputs, n) int16 of the next ``samples``, or fewer after ``wait`` s."""
    import nidaqmx.errors
    from nidaqmx.stream_readers import AnalogUnscaledReader

    counts = np.empty((inputs, samples), dtype=np.int16)
    reader = AnalogUnscaledReader(task.in_stream)
    reader.verify_array_shape = False  # the shape is right, and the check costs a call
    try:
        read = reader.read_int16(counts, samples, wait)
    except nidaqmx.errors.DaqReadError as error:
        if error.error_code != TIMEOUT:
            raise
        read = error.samps_per_chan_read
    if read == samples:
        return counts
    # rows follow each other without gaps, at the length that was read
    return counts.reshape(-1)[: inputs * read].reshape(inputs, read).copy()


class ClockedTasks:
    """Tasks for output, inputs, enable line and watchdog of the card ``device`` behind ``link``.

    Every method raises ``RigError`` where the card refuses.
    """

    def __init__(self, link: Link, device: str, settings: RigSettings) -> None:
        self._link = link
        self._device = device
        self._settings = settings
        self._ao: nidaqmx.Task | None = None
        self._ai: nidaqmx.Task | None = None
        self._enable: nidaqmx.Task | None = None
        self._watchdog: WatchdogTask | None = None
        self._command: Command | None = None
        self._rate = 0.0
        self._first = 0  # first sample of the present output task
        self._written = 0  # samples of the command written so far
        self._buffer = 0  # samples that the output buffer holds

    def channels(self) -> tuple[Channel, ...]:
        """Return the rig's channels with the card's own scaling and actual skew.

        It reserves the inputs and the output, which fails on a card in use.
        """
        from nidaqmx.constants import TaskMode

        settings = self._settings
        with self._errors():
            self._make_output()
            self._output().control(TaskMode.TASK_RESERVE)
            ai = self._make_inputs(settings.card.conversion_rate_Hz)
            ai.control(TaskMode.TASK_RESERVE)
            return actual_channels(ai, settings)

    def prepare(self, command: Command, rate: float) -> float:
        """Reserve the card for ``command`` at ``rate`` Hz; returns the actual rate."""
        self._command = command
        self._rate = rate
        with self._errors():
            ao = self._make_output()
            self._time_output()
            self._rate = ao.timing.samp_clk_rate
            self._make_inputs(self._rate)
        return self._rate

    def arm(self) -> None:
        """Let the inputs wait for the clock; set the enable line high, with its watchdog."""
        import nidaqmx
        from nidaqmx.system import WatchdogTask
        from nidaqmx.types import DOExpirationState

        card, session = self._settings.card, self._link.session
        with self._errors():
            self._inputs().start()
            if card.do_hv_enable is None:
                return
            line = f"{self._device}/{card.do_hv_enable}"
            if card.watchdog_s > 0.0:
                from nidaqmx.constants import Level

                self._watchdog = WatchdogTask(
                    self._device, timeout=card.watchdog_s, grpc_options=session
                )
                self._watchdog.cfg_watchdog_do_expir_states(
                    [DOExpirationState(physical_channel=line, expiration_state=Level.LOW)]
                )
                self._watchdog.start()
            self._enable = nidaqmx.Task(grpc_options=session)
            self._enable.do_channels.add_do_chan(line)
            self._enable.write(True, auto_start=True)

    def start(self) -> None:
        """Start the sample clock."""
        with self._errors():
            self._output().start()

    def read(self, samples: int, wait: float) -> np.ndarray:
        """Return counts (inputs, n) int16 of the next ``samples``, or fewer after ``wait`` s."""
        ai = self._inputs()
        with self._errors():
            if self._watchdog is not None:
                self._watchdog.reset_timer()
            return read_counts(ai, len(self._settings.channel_names) - 1, samples, wait)

    def waiting(self) -> int:
        """Return the samples of each input that were acquired and not read."""
        with self._errors():
            return int(self._inputs().in_stream.avail_samp_per_chan)

    def refill(self, delivered: int) -> None:
        """Write further samples where there is room; at least ``delivered`` have been output."""
        left = self._commanded().available - self._written
        if left <= 0:
            return
        room = self._buffer - (self._written - max(delivered, self._first))
        # wait for room for a large piece; what became available during play goes out now
        if room >= self._buffer // 4 or room >= left:
            self._write(room)

    def hold(self) -> int:
        """Stop the clock and hold the output; returns the number of samples output so far."""
        with self._errors():
            self._output().stop()
            return int(self._inputs().in_stream.total_samp_per_chan_acquired)

    def continue_from(self, played: int) -> None:
        """Continue with the command, which has changed, from sample ``played``.

        Rate and inputs stay the same.
        """
        self._first = self._written = played
        if played == self._commanded().samples:
            return
        with self._errors():
            self._time_output()
            self._output().start()

    def check_output(self) -> None:
        """Raise ``RigError`` where the output has failed, which the inputs do not show."""
        with self._errors():
            self._output().is_task_done()

    def release(self) -> None:
        """Clear output and inputs; the output keeps its last value. Raises as ``close``."""
        ao, ai = self._ao, self._ai
        self._ao = self._ai = None
        self._all([partial(clear, task) for task in (ao, ai) if task is not None])

    def disable(self) -> None:
        """Set the enable line low and end its watchdog. Raises as ``close``."""
        enable, watchdog = self._enable, self._watchdog
        self._enable = self._watchdog = None
        calls: list[Callable[[], object]] = []
        if enable is not None:
            calls.append(lambda: enable.write(False, auto_start=True))
        calls.extend(partial(clear, task) for task in (enable, watchdog) if task is not None)
        self._all(calls)

    def forget(self) -> None:
        """Clear every task, and leave output and enable line as they are. Raises as ``close``."""
        enable, watchdog = self._enable, self._watchdog
        self._enable = self._watchdog = None
        rest = [partial(clear, task) for task in (enable, watchdog) if task is not None]
        self._all([self.release, *rest])

    def close(self) -> None:
        """Clear every task.

        Each one is cleared even if another fails; raises ``RigError`` for the first failure.
        """
        self._all([self.release, self.disable])

    def _all(self, calls: list[Callable[[], object]]) -> None:
        failed: RigError | None = None
        for call in calls:
            try:
                with self._errors():
                    call()
            except RigError as error:
                failed = failed or error
        if failed is not None:
            raise failed

    def _make_output(self) -> nidaqmx.Task:
        import nidaqmx

        card = self._settings.card
        self._ao = ao = nidaqmx.Task(grpc_options=self._link.session)
        ao.ao_channels.add_ao_voltage_chan(
            f"{self._device}/{card.ao_command}", min_val=-card.ao_range_V, max_val=card.ao_range_V
        )
        return ao

    def _make_inputs(self, rate: float) -> nidaqmx.Task:
        import nidaqmx
        from nidaqmx.constants import AcquisitionType

        settings, card = self._settings, self._settings.card
        self._ai = ai = nidaqmx.Task(grpc_options=self._link.session)
        add_inputs(ai, self._device, settings)
        # large enough at any rate for the interlock to see a late reader before samples are lost
        buffer = max(
            card.ai_buffer_samples, round(_READER_BUFFER * settings.interlocks.late_s * rate)
        )
        ai.timing.cfg_samp_clk_timing(
            rate,
            source=f"/{self._device}/ao/SampleClock",
            sample_mode=AcquisitionType.CONTINUOUS,
            samps_per_chan=buffer,
        )
        ai.in_stream.input_buf_size = buffer
        time_conversions(ai, card)
        return ai

    def _time_output(self) -> None:
        """Set the output's clock and buffer for the rest of the command, and fill it."""
        from nidaqmx.constants import AcquisitionType, RegenerationMode, TaskMode

        ao = self._output()
        # a finite generation needs 2 samples: add one at 0 V, where the command ends
        left = max(2, self._commanded().samples - self._first)
        ao.timing.cfg_samp_clk_timing(
            self._rate, sample_mode=AcquisitionType.FINITE, samps_per_chan=left
        )
        streamed = round(self._settings.card.ao_buffer_s * self._rate)
        self._buffer = min(left, max(streamed, 2))
        if self._buffer == _ODD_BUFFER:
            self._buffer += 1
        ao.out_stream.output_buf_size = self._buffer
        ao.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION
        ao.control(TaskMode.TASK_RESERVE)
        self._written = self._first
        self._write(self._buffer)
        ao.control(TaskMode.TASK_COMMIT)

    def _write(self, room: int) -> None:
        """Write up to ``room`` samples of the command."""
        from nidaqmx.stream_writers import AnalogSingleChannelWriter

        command = self._commanded()
        counts = command.window(self._written, self._written + room)
        volts = counts * (self._settings.card.ao_range_V / 32768.0)
        self._written += volts.size
        if self._written == command.samples and command.samples - self._first == 1:
            volts = np.append(volts, volts[-1:])
        with self._errors():
            writer = AnalogSingleChannelWriter(self._output().out_stream, auto_start=False)
            writer.verify_array_shape = False
            timeout = self._settings.guardian.link_timeout_s / 2.0
            for start in range(0, volts.size, _PIECE):
                writer.write_many_sample(volts[start : start + _PIECE], timeout=timeout)

    def _commanded(self) -> Command:
        if self._command is None:
            raise RigError(f"card {self._device}: no waveform is loaded")
        return self._command

    def _output(self) -> nidaqmx.Task:
        if self._ao is None:
            raise RigError(f"card {self._device}: no waveform is loaded")
        return self._ao

    def _inputs(self) -> nidaqmx.Task:
        if self._ai is None:
            raise RigError(f"card {self._device}: no waveform is loaded")
        return self._ai

    def _errors(self) -> AbstractContextManager[None]:
        return instrument_errors(self._device, self._link.server, answered=self._link.answered)
