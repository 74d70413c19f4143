"""Single values without a clock: output to 0 V, enable line, reading of an input.

The run and its guardian both use this, each with its own connection.
"""

from __future__ import annotations

import numpy as np

from dearig.drivers.daqmx.explain import RESERVED, instrument_errors
from dearig.drivers.daqmx.link import Link
from dearig.drivers.errors import RigError
from dearig.drivers.settings import RigSettings

__all__ = ["Outputs"]

_MONITOR_READINGS = 20  # the amplifier's output falls in less than a millisecond


class Outputs:
    """Outputs of the card ``device`` behind ``link``, of a rig with ``settings``.

    Every method raises ``RigError`` where the card or its server fails.
    """

    def __init__(self, link: Link, device: str, settings: RigSettings) -> None:
        self._link = link
        self._device = device
        self._settings = settings

    def zero(self, *, force: bool = False) -> None:
        """Set 0 V at the output, and check it on the voltage monitor.

        With ``force``, a card that is in use is reset, which aborts every task and
        takes outputs and lines down in one step.
        """
        try:
            self._write_zero()
        except RigError as error:
            if not force or error.code != RESERVED:
                raise
            self.reset()
            self._write_zero()
        self.check_zero()

    def shut(self) -> None:
        """Set 0 V and the enable line low, also on a card in use; for the guardian."""
        try:
            self.zero(force=True)
        finally:
            try:
                self._disable()
            except RigError as error:
                if error.code != RESERVED:
                    raise
                self.reset()
                self._disable()

    def reset(self) -> None:
        """Abort every task of every program on the card; its outputs go to 0 V in one step."""
        with instrument_errors(self._device, self._link.server):
            from nidaqmx.system import Device

            Device(self._device, grpc_options=self._link.session).reset_device()

    def check_zero(self) -> None:
        """Raise ``RigError`` unless the voltage monitor reads 0 within the limits' tolerance."""
        tolerance = self._settings.limits.zero_tolerance_kV
        per_volt = 1.0 / self._settings.amplifier.monitor_V_per_kV
        reading = 0.0
        for _ in range(_MONITOR_READINGS):
            reading = self.read("voltage_monitor") * per_volt
            if abs(reading) <= tolerance:
                return
        raise RigError(
            f"the output was set to 0 V, but the voltage monitor still reads {reading:.3g} kV "
            f"({tolerance:g} kV is allowed): switch the amplifier's high voltage off by hand"
        )

    def read(self, channel: str) -> float:
        """Return the V at the input of ``channel`` now, the mean of ten readings."""
        settings = self._settings
        limit = settings.ranges()[channel]
        with instrument_errors(self._device, self._link.server):
            import nidaqmx
            from nidaqmx.constants import TerminalConfiguration

            with nidaqmx.Task(grpc_options=self._link.session) as task:
                task.ai_channels.add_ai_voltage_chan(
                    f"{self._device}/{settings.terminals()[channel]}",
                    terminal_config=TerminalConfiguration[settings.wiring()[channel]],
                    min_val=-limit,
                    max_val=limit,
                )
                return float(np.mean([task.read() for _ in range(10)]))

    def _disable(self) -> None:
        """Set the line that enables the amplifier's high voltage low, if it is wired."""
        line = self._settings.card.do_hv_enable
        if line is None:
            return
        with instrument_errors(self._device, self._link.server):
            import nidaqmx

            with nidaqmx.Task(grpc_options=self._link.session) as task:
                task.do_channels.add_do_chan(f"{self._device}/{line}")
                task.write(False, auto_start=True)

    def _write_zero(self) -> None:
        card, offset = self._settings.card, self._settings.amplifier.offset_V
        with instrument_errors(self._device, self._link.server):
            import nidaqmx

            with nidaqmx.Task(grpc_options=self._link.session) as task:
                task.ao_channels.add_ao_voltage_chan(
                    f"{self._device}/{card.ao_command}",
                    min_val=-card.ao_range_V,
                    max_val=card.ao_range_V,
                )
                # the command for 0 V at the film, which includes the amplifier's offset
                task.write(-offset / self._settings.amplifier.gain_V_per_V, auto_start=True)
