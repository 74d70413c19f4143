"""Inputs of a DAQmx card at rest: one task of analog inputs, and none of outputs."""

from __future__ import annotations

from contextlib import AbstractContextManager, suppress
from typing import TYPE_CHECKING

import numpy as np

from dearig.drivers.channels import Channel
from dearig.drivers.daqmx.address import Address
from dearig.drivers.daqmx.explain import instrument_errors
from dearig.drivers.daqmx.link import Link
from dearig.drivers.daqmx.outputs import clear
from dearig.drivers.daqmx.tasks import actual_channels, add_inputs, read_counts, time_conversions
from dearig.drivers.errors import RigError
from dearig.drivers.inputs import BLOCK_S
from dearig.drivers.settings import RigSettings

if TYPE_CHECKING:
    import nidaqmx

__all__ = ["DaqmxInputs"]

_WAIT = 0.25  # s for them, after which a read returns, so that the reader can end


class DaqmxInputs:
    """Inputs of the card at ``address``; see ``dearig.drivers.inputs.Inputs``.

    They are converted at the sample rate of the rig file, on the inputs' own clock: that of a run
    is the output's. Raises as ``ReadsInputs.open_inputs``.
    """

    def __init__(self, address: Address, settings: RigSettings) -> None:
        self._address = address
        self._settings = settings
        self._task: nidaqmx.Task | None = None
        self._link = Link(address.server, settings)
        try:
            with self._errors():
                self._start()
        except RigError:
            self.close()
            raise

    def _start(self) -> None:
        import nidaqmx
        from nidaqmx.constants import AcquisitionType, TaskMode

        settings, card = self._settings, self._settings.card
        self._task = task = nidaqmx.Task(grpc_options=self._link.session)
        add_inputs(task, self._address.device, settings)
        task.timing.cfg_samp_clk_timing(
            card.sample_rate_Hz,
            sample_mode=AcquisitionType.CONTINUOUS,
            samps_per_chan=card.ai_buffer_samples,
        )
        task.in_stream.input_buf_size = card.ai_buffer_samples
        time_conversions(task, card)
        task.control(TaskMode.TASK_RESERVE)
        self._channels = actual_channels(task, settings)[1:]
        self._rate = float(task.timing.samp_clk_rate)
        task.start()

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Return the channels in the order of the rows, with the card's own scaling."""
        return self._channels

    @property
    def rate(self) -> float:
        """Return the actual sample rate in Hz."""
        return self._rate

    def read(self) -> np.ndarray:
        """Return counts (channels, n) int16 of a tenth of a second, or of what came in a wait."""
        if self._task is None:
            raise RigError(f"card {self._address.device}: its inputs are closed")
        with self._errors():
            samples = max(1, round(BLOCK_S * self._rate))
            return read_counts(self._task, len(self._channels), samples, _WAIT)

    def close(self) -> None:
        """Clear the task, and close the connection."""
        task, self._task = self._task, None
        if task is not None:
            with suppress(RigError), self._errors():
                clear(task)
        self._link.close()

    def _errors(self) -> AbstractContextManager[None]:
        return instrument_errors(
            self._address.device, self._link.server, answered=self._link.answered
        )
