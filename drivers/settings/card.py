"""Settings of the multifunction card."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from dearig.drivers.settings.section import (
    AnalogInput,
    AnalogOutput,
    DigitalLine,
    InputRange,
    Section,
    Wiring,
)

__all__ = ["AVERAGE_MAX", "WATCHDOG_DEFAULT_S", "CardSettings"]

#: conversions of one row, at most: the sum of so many 16-bit counts fits in 32 bits
AVERAGE_MAX = 65536

#: s; a run resets the watchdog with every read, at most 0.25 s apart, so three late reads are
#: tolerated; with it any two faults end within 1.1 s
WATCHDOG_DEFAULT_S = 1.0
_WATCHDOG_MIN_S = 0.3  # s; a run that waits for samples resets it every 0.25 s
# s; the counter holds (2**32 - 1) periods of 8 ns, 34.3597 s (NI, X Series User Manual, chapter
# Digital I/O, section Watchdog Timer)
_WATCHDOG_MAX_S = 34.35


class CardSettings(Section):
    """The multifunction card; the output's sample clock also times the inputs."""

    model: str = Field(default="NI PCIe-6361", description="type of the card")
    device: str = Field(default="Dev1", min_length=1, description="name of the card in NI MAX")
    sample_rate_Hz: float = Field(
        default=1000.0,
        ge=1.0,
        le=1e6,
        description="rate of the recording's rows; without averaging also that of the converters",
    )
    average: int = Field(
        default=1,
        ge=1,
        le=AVERAGE_MAX,
        description="number of conversions whose mean is one row of the recording: output and "
        "inputs run at sample_rate_Hz times this number, and interlocks check every conversion",
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
    hv_enable_watchdog_s: float | None = Field(
        default=None,
        ge=0.0,
        le=_WATCHDOG_MAX_S,
        description="time of silence of the program after which the card's own watchdog takes "
        f"do_hv_enable low: {_WATCHDOG_MIN_S:g} s or more, or 0 for no watchdog; if left out, it "
        f"is {WATCHDOG_DEFAULT_S:g} s where do_hv_enable is wired",
    )
    i_have_no_watchdog: bool = Field(
        default=False,
        description="true declares that no hardware watchdog is wired: nothing takes the voltage "
        "down if run and guardian die together; without watchdog and declaration a run on a real "
        "card is refused",
    )
    tls_ca: str = Field(
        default="",
        description="file (PEM) of the certificate authority that signed the server's "
        "certificate, relative to the rig file; a card behind another computer's server needs it",
    )
    tls_cert: str = Field(
        default="",
        description="file (PEM) of this computer's certificate, relative to the rig file, for a "
        "server that asks its clients for one",
    )
    tls_key: str = Field(
        default="",
        description="file (PEM) of the private key of tls_cert, relative to the rig file",
    )
    server_without_tls: bool = Field(
        default=False,
        description="true allows a card behind another computer's server without TLS: everybody "
        "on the network between can read and drive the card",
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

    @property
    def conversion_rate_Hz(self) -> float:  # noqa: N802
        """Return the rate of the output and the inputs in Hz."""
        return self.sample_rate_Hz * self.average

    @property
    def watchdog_s(self) -> float:
        """Return the time of the hardware watchdog in s; 0 if there is none."""
        if self.do_hv_enable is None:
            return 0.0
        wanted = self.hv_enable_watchdog_s
        return WATCHDOG_DEFAULT_S if wanted is None else wanted

    @field_validator("tls_ca", "tls_cert", "tls_key")
    @classmethod
    def _from_the_rig_files_folder(cls, value: str, info: ValidationInfo) -> str:
        folder = (info.context or {}).get("folder")
        return str(Path(folder) / value) if value and folder is not None else value

    @model_validator(mode="after")
    def _watchdog_is_possible(self) -> CardSettings:
        wanted = self.hv_enable_watchdog_s
        if wanted and self.do_hv_enable is None:
            raise ValueError(
                "card.hv_enable_watchdog_s is set, but not card.do_hv_enable, the line that it "
                "takes low"
            )
        if wanted and wanted < _WATCHDOG_MIN_S:
            raise ValueError(
                f"card.hv_enable_watchdog_s = {wanted:g} is below {_WATCHDOG_MIN_S:g}: a run that "
                f"waits for samples would trip it; 0 means no watchdog"
            )
        if self.i_have_no_watchdog and self.watchdog_s:
            raise ValueError(
                f"card.i_have_no_watchdog = true, but card.do_hv_enable = {self.do_hv_enable} has "
                f"a watchdog of {self.watchdog_s:g} s: remove one of the two"
            )
        return self

    @model_validator(mode="after")
    def _tls_is_complete(self) -> CardSettings:
        if bool(self.tls_cert) != bool(self.tls_key):
            one, other = ("tls_cert", "tls_key") if self.tls_cert else ("tls_key", "tls_cert")
            raise ValueError(f"card.{one} is set, but not card.{other}: they belong together")
        if self.tls_cert and not self.tls_ca:
            raise ValueError(
                "card.tls_cert is set, but not card.tls_ca: the server must be verified too"
            )
        if self.server_without_tls and self.tls_ca:
            raise ValueError(
                "card.server_without_tls = true, but card.tls_ca is set: remove one of the two"
            )
        return self
