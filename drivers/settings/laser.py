"""Settings of the laser displacement sensor."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from dearig.drivers.settings.section import Section

__all__ = ["LaserSettings"]


class LaserSettings(Section):
    """The laser displacement sensor below the load, with its controller's analog output."""

    driver: str = Field(
        default="keyence",
        min_length=1,
        description="name of the driver that inspects the laser; dearig doctor lists them",
    )
    model: str = Field(
        default="Keyence LK-H152 / LK-G5000",
        description="types of the sensor head and the controller",
    )
    serial: str = Field(default="", description="serial number, kept with every recording")
    reference_distance_mm: float = Field(
        default=150.0, gt=0.0, le=5000.0, description="distance at which the analog output is 0 V"
    )
    range_mm: float = Field(
        default=40.0,
        gt=0.0,
        le=2000.0,
        description="measuring range, plus and minus, about the reference",
    )
    analog_range_V: float = Field(
        default=10.0, gt=0.0, le=10.0, description="range of the analog output, plus and minus"
    )
    mm_per_V: float = Field(
        default=4.0,
        gt=0.0,
        le=1000.0,
        description="scaling of the analog output, as set in the controller",
    )
    mm_per_V_uncertainty: float = Field(
        default=0.0,
        ge=0.0,
        le=1000.0,
        description="standard uncertainty of mm_per_V; 0 if not known",
    )
    direction: Literal[1, -1] = Field(
        default=1,
        description="sign of the analog output: 1 when it rises as the film gets longer, -1 when "
        "it falls",
    )
    sampling_us: float = Field(
        default=20.0, ge=2.55, le=1000.0, description="sampling period of the sensor"
    )
    averaging: int = Field(
        default=16,
        ge=1,
        le=262144,
        description="number of samples in the moving average; a power of 4 for the driver keyence",
    )
    port: str = Field(
        default="",
        description="serial port of the controller, such as COM3 or /dev/ttyUSB0; left empty, its "
        "settings are not compared with the ones here",
    )
    baud_rate: Literal[9600, 19200, 38400, 57600, 115200] = Field(
        default=115200, description="baud rate of the serial port"
    )
    output: Literal[1, 2] = Field(
        default=1, description="number of the controller's output (OUT), which selects the head"
    )
    resolution_um: float = Field(
        default=0.01, ge=0.0, le=100.0, description="simulated rig only: smallest step of a reading"
    )
    noise_um: float = Field(
        default=1.0,
        ge=0.0,
        le=1000.0,
        description="simulated rig only: RMS noise of a reading, with the averaging set here",
    )
    rest_position_mm: float = Field(
        default=6.4,
        ge=-2000.0,
        le=2000.0,
        description="simulated rig only: reading with the film at rest under its load",
    )
    clock_error_ppm: float = Field(
        default=20.0,
        ge=-1000.0,
        le=1000.0,
        description="simulated rig only: by how much its sampling clock is slower than the card's",
    )

    @field_validator("averaging")
    @classmethod
    def _power_of_four(cls, value: int, info: ValidationInfo) -> int:
        if info.data.get("driver") != "keyence":
            return value
        if value.bit_count() != 1 or value.bit_length() % 2 != 1:
            offered = ", ".join(str(4**i) for i in range(10))
            raise ValueError(f"the controller offers {offered}")
        return value

    @property
    def window(self) -> float:
        """Return the length of the moving average in s."""
        return self.averaging * self.sampling_us * 1e-6

    @property
    def delay(self) -> float:
        """Return the mean age of a reading in s.

        The average lags by (averaging - 1)/2 sampling periods. The output is held for one period,
        of which half has passed on average.
        """
        return 0.5 * self.window

    @property
    def delay_error(self) -> float:
        """Return the s by which a reading may be older or younger, since the clocks differ."""
        return 0.5 * self.sampling_us * 1e-6
