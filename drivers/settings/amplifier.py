"""Settings of the high-voltage amplifier."""

from __future__ import annotations

from pydantic import Field

from dearig.drivers.settings.section import Section

__all__ = ["AmplifierSettings"]


class AmplifierSettings(Section):
    """The high-voltage amplifier between the card's output and the electrodes."""

    driver: str = Field(
        default="trek",
        min_length=1,
        description="name of the driver that inspects the amplifier; dearig doctor lists them",
    )
    model: str = Field(
        default="TREK 10/40A-HS", description="type of the amplifier, as on its front panel"
    )
    serial: str = Field(default="", description="serial number, kept with every recording")
    gain_V_per_V: float = Field(
        default=1000.0,
        ge=1.0,
        le=1e5,
        description="gain: volts at the film per volt at the amplifier's input",
    )
    gain_V_per_V_uncertainty: float = Field(
        default=0.0,
        ge=0.0,
        le=1e5,
        description="standard uncertainty of gain_V_per_V; 0 if not known",
    )
    offset_V: float = Field(
        default=0.0,
        ge=-100.0,
        le=100.0,
        description="measured output of the amplifier at 0 V input; commands are corrected for it",
    )
    range_kV: float = Field(
        default=10.0, gt=0.0, le=100.0, description="output range of the amplifier, plus and minus"
    )
    current_limit_mA: float = Field(
        default=40.0, gt=0.0, le=1000.0, description="output current limit of the amplifier"
    )
    monitor_V_per_kV: float = Field(
        default=1.0,
        gt=0.0,
        le=100.0,
        description="scaling of the voltage monitor: volts per kilovolt at the film",
    )
    monitor_V_per_kV_uncertainty: float = Field(
        default=0.0,
        ge=0.0,
        le=100.0,
        description="standard uncertainty of monitor_V_per_kV; 0 if not known",
    )
    current_monitor_V_per_mA: float = Field(
        default=0.25,
        gt=0.0,
        le=100.0,
        description="scaling of the current monitor: volts per milliampere",
    )
    current_monitor_V_per_mA_uncertainty: float = Field(
        default=0.0,
        ge=0.0,
        le=100.0,
        description="standard uncertainty of current_monitor_V_per_mA; 0 if not known",
    )
    slew_V_per_us: float = Field(
        default=900.0, gt=0.0, le=1e5, description="slew rate of the amplifier without load"
    )
    bandwidth_kHz: float = Field(
        default=25.0,
        ge=0.1,
        le=1e4,
        description="small-signal bandwidth of the amplifier (-3 dB), modelled as first order",
    )
    current_monitor_bandwidth_kHz: float = Field(
        default=20.0,
        ge=0.1,
        le=1e4,
        description="bandwidth of the current monitor (-3 dB), modelled as first order; amplifiers "
        "have some kHz to 20 kHz",
    )
    cable_pF: float = Field(
        default=0.0,
        ge=0.0,
        le=1e6,
        description="simulated rig only: capacitance of the cable to the film, whose charging the "
        "current monitor shows too",
    )
    monitor_noise_mV: float = Field(
        default=1.0, ge=0.0, le=100.0, description="simulated rig only: RMS noise of either monitor"
    )
