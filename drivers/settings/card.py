"""Settings of the multifunction card."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from dearig.drivers.settings.section import (
    AnalogInput,
    AnalogOutput,
    DigitalLine,
    InputRange,
    Section,
    Wiring,
)

__all__ = ["CardSettings"]


class CardSettings(Section):
    """The multifunction card; the output's sample clock also times the inputs."""

    model: str = Field(default="NI PCIe-6361", description="type of card")
    device: str = Field(default="Dev1", min_length=1, description="name in NI MAX")
    sample_rate_Hz: float = Field(
        default=1000.0, ge=1.0, le=1e6, description="rate of output and inputs"
    )
    bits: Literal[16] = Field(
        default=16, description="resolution of all converters; only 16 is supported"
    )
    ao_command: AnalogOutput = Field(default="ao0", description="output to the amplifier")
    ao_range_V: float = Field(
        default=10.0, ge=1.0, le=10.0, description="output range, plus and minus"
    )
    ai_voltage_monitor: AnalogInput = Field(default="ai0", description="from the voltage monitor")
    ai_current_monitor: AnalogInput = Field(default="ai1", description="from the current monitor")
    ai_displacement: AnalogInput = Field(default="ai2", description="from the laser controller")
    ai_temperature: AnalogInput = Field(
        default="ai3", description="from the thermometer, if there is one"
    )
    range_voltage_monitor_V: InputRange = Field(
        default=10.0, description="input range, plus and minus"
    )
    range_current_monitor_V: InputRange = Field(
        default=10.0, description="input range, plus and minus"
    )
    range_displacement_V: InputRange = Field(
        default=10.0, description="input range, plus and minus"
    )
    range_temperature_V: InputRange = Field(default=10.0, description="input range, plus and minus")
    terminals_voltage_monitor: Wiring = Field(
        default="DIFF", description="how the input is wired: differential, (non-)referenced single"
    )
    terminals_current_monitor: Wiring = Field(default="DIFF", description="as above")
    terminals_displacement: Wiring = Field(default="DIFF", description="as above")
    terminals_temperature: Wiring = Field(default="DIFF", description="as above")
    do_hv_enable: DigitalLine | None = Field(
        default=None,
        description="line that enables the amplifier's high voltage, such as port0/line0; if left "
        "out, it is not wired",
    )
    hv_enable_watchdog_s: float = Field(
        default=0.0,
        ge=0.0,
        le=60.0,
        description="the card's own watchdog sets do_hv_enable low when the program is silent for "
        "this time; 0 means none",
    )
    first_convert_us: float = Field(
        default=50.0,
        ge=0.0,
        le=1e5,
        description="from the tick to the first conversion, so that the amplifier follows first",
    )
    convert_interval_us: float = Field(
        default=10.0, ge=0.5, le=1e5, description="from one input's conversion to the next one's"
    )
    ai_buffer_samples: int = Field(
        default=100_000,
        ge=1000,
        le=100_000_000,
        description="samples a channel kept for a late reader, at least; a card keeps four times "
        "interlocks.late_s",
    )
    ao_fifo_samples: int = Field(
        default=8191, ge=1, le=100_000_000, description="output FIFO of the card"
    )
    ao_buffer_s: float = Field(
        default=4.0,
        ge=0.5,
        le=60.0,
        description="a waveform longer than this is streamed, and written so far ahead",
    )
    ao_rate_max_kHz: float = Field(
        default=2860.0, gt=0.0, le=1e5, description="fastest output, one channel"
    )
    ai_rate_max_kHz: float = Field(
        default=1000.0, gt=0.0, le=1e5, description="fastest conversion over several channels"
    )
    timebase_MHz: float = Field(
        default=100.0,
        gt=0.0,
        le=1000.0,
        description="clock that is divided down to the sample rate",
    )
    calibration_ppm: float = Field(
        default=300.0,
        ge=0.0,
        le=1000.0,
        description="simulated rig only: spread of the inputs' calibration, of the range",
    )
