"""Multifunction card: 16-bit converters with calibration, timebase and a finite buffer."""

from __future__ import annotations

import numpy as np

from dearig.drivers.channels import COUNT_MAX, Channel, Scaling
from dearig.drivers.errors import RigError
from dearig.drivers.settings import RigSettings
from dearig.sim_backend.streams import Streams

__all__ = ["INPUT_OVERWRITTEN", "Converters"]

INPUT_OVERWRITTEN = -200279  #: DAQmx: samples were overwritten before they were read
_READER_BUFFER = 4.0  # times the reader's delay that ends a run, as a real card's tasks hold
RATE_TOO_HIGH = -200077  #: DAQmx: a requested value is not supported


class Converters:
    """Card of a rig with ``settings``; its calibration is drawn once from ``streams``."""

    def __init__(self, settings: RigSettings, streams: Streams) -> None:
        self._settings = settings
        generator = streams.of_instrument("card")
        spread = settings.card.calibration_ppm * 1e-6
        coefficients: dict[str, tuple[float, ...]] = {}
        for name, limit in settings.ranges().items():
            step = limit / (COUNT_MAX + 1)
            if name == "voltage_command":
                # the card corrects its output itself, so the nominal scaling holds
                coefficients[name] = (0.0, step)
                continue
            # calibration polynomial of an input: an offset, a gain, a small curvature
            offset, gain, square, cube = generator.uniform(-spread, spread, 4)
            coefficients[name] = (
                offset * limit,
                step * (1.0 + gain),
                0.1 * square * step / COUNT_MAX,
                0.1 * cube * step / COUNT_MAX**2,
            )
        self._channels = {c.name: c for c in settings.channels(coefficients)}
        # in volts: the other instruments scale them to physical quantities
        self._converters = {n: Scaling(c, 1.0) for n, c in coefficients.items()}

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Return the channels in the order of a block's rows."""
        return tuple(self._channels.values())

    def actual_rate(self, rate: float) -> float:
        """Return the rate in Hz nearest to ``rate`` that a division of the timebase gives.

        Raises ``RigError`` where the card cannot run at ``rate`` or scan its inputs within it.
        """
        card = self._settings.card
        inputs = len(self._channels) - 1
        fastest = 1e3 * min(card.ao_rate_max_kHz, card.ai_rate_max_kHz / inputs)
        if not 0.0 < rate <= fastest:
            averaged = ""
            if card.average > 1:
                averaged = f", card.sample_rate_Hz times card.average = {card.average},"
            raise RigError(
                f"card {card.device}: a sample rate of {rate:g} Hz{averaged} on {inputs} inputs is "
                f"not possible; choose up to {fastest:g} Hz",
                RATE_TOO_HIGH,
            )
        scan = self._settings.skew(inputs - 1) * 1e6 + card.convert_interval_us
        if scan * rate > 1e6 * (1.0 + 1e-9):
            raise RigError(
                f"card {card.device}: scanning {inputs} inputs takes {scan:g} us, a sample at "
                f"{rate:g} Hz {1e6 / rate:g} us; lower the rate, card.first_convert_us or "
                f"card.convert_interval_us",
                RATE_TOO_HIGH,
            )
        timebase = card.timebase_MHz * 1e6
        return timebase / max(1, round(timebase / rate))

    def put_out(self, counts: np.ndarray) -> np.ndarray:
        """Return the volts (N,) at the output terminal for ``counts``."""
        return self._converters["voltage_command"].physical(counts)

    def convert(self, channel: str, volts: np.ndarray) -> np.ndarray:
        """Return counts (N,) int16 for ``volts`` (N,) at the input of ``channel``, saturated."""
        return self._converters[channel].counts(volts)

    def check_buffer(self, waiting: int, rate: float) -> None:
        """Raise ``RigError`` where more samples are unread than the input buffer holds."""
        settings = self._settings
        late = round(_READER_BUFFER * settings.interlocks.late_s * rate)
        size = max(settings.card.ai_buffer_samples, late)
        if waiting > size:
            raise RigError(
                f"card {self._settings.card.device}: {waiting} samples waited for their reader and "
                f"the buffer holds {size}: the oldest were overwritten; read more often or enlarge "
                f"card.ai_buffer_samples",
                INPUT_OVERWRITTEN,
            )
