"""Settings of a thermo-hygrometer at a serial port, and of the simulated rig's room."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field, model_validator

from dearig.drivers.settings.section import Action, Section

__all__ = ["RoomSettings", "ThermohygrometerSettings"]


class ThermohygrometerSettings(Section):
    """An optional sensor of the room's temperature and humidity at a serial or USB port."""

    driver: str = Field(
        default="vaisala",
        min_length=1,
        description="name of the driver that reads it; dearig doctor lists them",
    )
    model: str = Field(default="Vaisala HMP110", description="type of the sensor")
    serial: str = Field(default="", description="serial number, kept with every recording")
    port: str = Field(
        default="",
        description="serial port of the sensor, such as COM4 or /dev/ttyUSB1; a simulated rig "
        "needs none",
    )
    baud_rate: Literal[1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200] = Field(
        default=19200, description="baud rate of the serial port, 8 data bits, no parity"
    )
    address: int | None = Field(
        default=None,
        ge=0,
        le=255,
        description="address of a sensor in POLL mode, which shares its line; left out, there is "
        "one sensor",
    )
    interval_s: float = Field(
        default=2.0, ge=0.5, le=3600.0, description="time between two readings"
    )
    stale_s: float = Field(
        default=15.0,
        ge=1.0,
        le=7200.0,
        description="age of a reading from which on the value counts as unknown; above interval_s",
    )
    temperature_min_degC: float | None = Field(
        default=None, ge=-80.0, le=200.0, description="interlock: lowest temperature of the room"
    )
    temperature_max_degC: float | None = Field(
        default=None, ge=-80.0, le=200.0, description="interlock: highest temperature of the room"
    )
    humidity_min_percent: float | None = Field(
        default=None, ge=0.0, le=100.0, description="interlock: lowest relative humidity"
    )
    humidity_max_percent: float | None = Field(
        default=None, ge=0.0, le=100.0, description="interlock: highest relative humidity"
    )
    limit_action: Action = Field(
        default="ramp", description="interlock: how the voltage goes to 0 V"
    )
    on_loss: Literal["go on", "ramp", "at once"] = Field(
        default="go on",
        description="what happens without a value for stale_s: the run goes on and records none, "
        "or the voltage goes to 0 V",
    )

    @property
    def limits(self) -> tuple[tuple[str, str, float, float], ...]:
        """Return name, unit, lowest and highest allowed value of each quantity."""
        return (
            (
                "temperature", "°C", _or(self.temperature_min_degC, -math.inf),
                _or(self.temperature_max_degC, math.inf),
            ),
            (
                "relative humidity", "%", _or(self.humidity_min_percent, -math.inf),
                _or(self.humidity_max_percent, math.inf),
            ),
        )  # fmt: skip

    @model_validator(mode="after")
    def _is_consistent(self) -> ThermohygrometerSettings:
        for name, unit, low, high in self.limits:
            if low >= high:
                raise ValueError(
                    f"thermohygrometer: the lowest {name} of {low:g} {unit} is not below the "
                    f"highest of {high:g} {unit}"
                )
        if self.stale_s <= self.interval_s:
            raise ValueError(
                f"thermohygrometer.stale_s = {self.stale_s:g} is not above interval_s = "
                f"{self.interval_s:g}: every reading would be too old before the next"
            )
        return self


class RoomSettings(Section):
    """The room of a simulated rig; it has no effect on a real one."""

    temperature_degC: float = Field(
        default=22.0, ge=-50.0, le=100.0, description="simulated rig only: mean temperature"
    )
    daily_K: float = Field(
        default=0.0,
        ge=0.0,
        le=50.0,
        description="simulated rig only: how much warmer than the mean it is at 15 h, and colder "
        "at 3 h",
    )
    heating_K: float = Field(
        default=0.0,
        ge=0.0,
        le=20.0,
        description="simulated rig only: from the coldest to the warmest within a cycle of the "
        "heating",
    )
    heating_period_min: float = Field(
        default=30.0, gt=0.0, le=1440.0, description="simulated rig only: length of such a cycle"
    )
    relative_humidity_percent: float = Field(
        default=45.0, ge=0.0, le=100.0, description="simulated rig only: mean relative humidity"
    )
    daily_percent: float = Field(
        default=0.0,
        ge=0.0,
        le=50.0,
        description="simulated rig only: how much drier than the mean it is at 15 h, and moister "
        "at 3 h",
    )
    heating_percent: float = Field(
        default=0.0,
        ge=0.0,
        le=50.0,
        description="simulated rig only: from the moistest to the driest within a cycle of the "
        "heating",
    )
    weather_K: float = Field(
        default=0.0,
        ge=0.0,
        le=20.0,
        description="simulated rig only: RMS of slow changes of the temperature, over half a day "
        "to ten days",
    )
    weather_percent: float = Field(
        default=0.0,
        ge=0.0,
        le=30.0,
        description="simulated rig only: RMS of slow changes of the relative humidity",
    )
    seed: int = Field(
        default=0, ge=0, le=2**53, description="simulated rig only: seed of the slow changes"
    )
    clock: Literal["runs", "computer"] = Field(
        default="runs",
        description="simulated rig only: what the time in the room follows: the number of the run "
        "(its seed), which makes every run repeatable, or the computer's clock",
    )
    start_h: float = Field(
        default=9.0,
        ge=0.0,
        lt=24.0,
        description="simulated rig only: time of day of the run with seed 0, with clock runs",
    )
    hours_per_run: float = Field(
        default=0.5,
        ge=0.0,
        le=1000.0,
        description="simulated rig only: hours from one run (seed) to the next, with clock runs",
    )
    sensor_noise_K: float = Field(
        default=0.02, ge=0.0, le=10.0, description="simulated rig only: RMS noise of a reading"
    )
    sensor_noise_percent: float = Field(
        default=0.1, ge=0.0, le=10.0, description="simulated rig only: RMS noise of a reading"
    )


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value
