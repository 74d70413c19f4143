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

    model: str = Field(default="NI PCIe-6361", description="type of the card")
    device: str = Field(default="Dev1", min_length=1, description="name of the card in NI MAX")
    sample_rate_Hz: float = Field(
        default=1000.0, ge=1.0, le=1e6, description="sample rate of the output and the inputs"
    )
    bits: Literal[16] = Field(
        default=16, description="resolution of all converters; only 16 is supported"
    )
    ao_command: AnalogOutput = Field(
        default="ao0", description="terminal of the output to the amplifier"
    )
    ao_range_V: float = Field(
        default=10.0,
        ge=1.0,
        le=10.0,
        description="range of the output to the amplifier, plus and minus",
    )
    ai_voltage_monitor: AnalogInput = Field(
        default="ai0", description="terminal of the voltage monitor's input"
    )
    ai_current_monitor: AnalogInput = Field(
        default="ai1", description="terminal of the current monitor's input"
    )
    ai_displacement: AnalogInput = Field(
        default="ai2", description="terminal of the laser controller's input"
    )
    ai_temperature: AnalogInput = Field(
        default="ai3", description="terminal of the thermometer's input, if there is one"
    )
    range_voltage_monitor_V: InputRange = Field(
        default=10.0, description="range of the voltage monitor's input, plus and minus"
    )
    range_current_monitor_V: InputRange = Field(
        default=10.0, description="range of the current monitor's input, plus and minus"
    )
    range_displacement_V: InputRange = Field(
        default=10.0, description="range of the laser controller's input, plus and minus"
    )
    range_temperature_V: InputRange = Field(
        default=10.0, description="range of the thermometer's input, plus and minus"
    )
    terminals_voltage_monitor: Wiring = Field(
        default="DIFF",
        description="wiring of the voltage monitor's input: differential, referenced or "
        "non-referenced single-ended",
    )
    terminals_current_monitor: Wiring = Field(
        default="DIFF", description="wiring of the current monitor's input"
    )
    terminals_displacement: Wiring = Field(
        default="DIFF", description="wiring of the laser controller's input"
    )
    terminals_temperature: Wiring = Field(
        default="DIFF", description="wiring of the thermometer's input"
    )
    do_hv_enable: DigitalLine | None = Field(
        default=None,
        examples=["port0/line0"],
        description="digital line that enables the amplifier's high voltage; if left out, it "
        "is not wired",
    )
    hv_enable_watchdog_s: float = Field(
        default=0.0,
        ge=0.0,
        le=60.0,
        description="time of silence of the program after which the card's own watchdog takes "
        "do_hv_enable low; 0 means no watchdog",
    )
    first_convert_us: float = Field(
        default=50.0,
        ge=0.0,
        le=1e5,
        description="time from the tick to the first conversion, in which the amplifier follows",
    )
    convert_interval_us: float = Field(
        default=10.0,
        ge=0.5,
        le=1e5,
        description="time from the conversion of one input to that of the next",
    )
    ai_buffer_samples: int = Field(
        default=100_000,
        ge=1000,
        le=100_000_000,
        description="least size of the input buffer in samples per channel, for a late reader; a "
        "card keeps four times interlocks.late_s",
    )
    ao_fifo_samples: int = Field(
        default=8191, ge=1, le=100_000_000, description="size of the card's output FIFO in samples"
    )
    ao_buffer_s: float = Field(
        default=4.0,
        ge=0.5,
        le=60.0,
        description="length of the output buffer; a longer waveform is streamed, written ahead by "
        "this time",
    )
    ao_rate_max_kHz: float = Field(
        default=2860.0, gt=0.0, le=1e5, description="fastest update rate of one output"
    )
    ai_rate_max_kHz: float = Field(
        default=1000.0, gt=0.0, le=1e5, description="fastest conversion rate over several inputs"
    )
    timebase_MHz: float = Field(
        default=100.0,
        gt=0.0,
        le=1000.0,
        description="frequency of the card's clock, which is divided down to the sample rate",
    )
    calibration_ppm: float = Field(
        default=300.0,
        ge=0.0,
        le=1000.0,
        description="simulated rig only: spread of the inputs' calibration, as a part of the range",
    )
