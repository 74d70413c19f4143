"""Settings of further channels: declared ones, thermometer."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field, field_validator, model_validator

from dearig.drivers.channels import HUMIDITY, RESERVED_NAMES
from dearig.drivers.settings.section import Action, AnalogInput, InputRange, Section, Wiring

__all__ = ["ChannelSettings", "ThermometerSettings"]


class ChannelSettings(Section):
    """A further input of the card: a load cell, a second laser, a thermometer, a trigger."""

    name: str = Field(
        pattern=r"^[a-z][a-z0-9_]{0,39}$",
        examples=["load_cell"],
        description="name in recordings and exports, in lower case with underscores",
    )
    label: str = Field(
        default="", max_length=60, description="displayed name; if empty, the name is displayed"
    )
    terminal: AnalogInput = Field(examples=["ai4"], description="terminal of the card's input")
    wiring: Wiring = Field(
        default="DIFF",
        description="wiring of the input: differential, referenced or non-referenced single-ended",
    )
    range_V: InputRange = Field(default=10.0, description="range of the input, plus and minus")
    unit: str = Field(
        pattern=r"^[A-Za-z0-9%µ][A-Za-z0-9%µ*/^.-]{0,15}$",
        examples=["N"],
        description="SI unit of the scaled value, such as N, m, Pa, K or V",
    )
    unit_per_V: float = Field(
        ge=-1e12,
        le=1e12,
        examples=[50.0],
        description="scaling: change of the value per volt at the input; 0 is not allowed",
    )
    value_at_0_V: float = Field(
        default=0.0, ge=-1e12, le=1e12, description="scaling: the value at 0 V"
    )
    delay_ms: float = Field(
        default=0.0, ge=0.0, le=1e5, description="known lag of the instrument, kept with recordings"
    )
    limit_min: float | None = Field(
        default=None,
        description="interlock: lowest value allowed during a run; if left out, there is none",
    )
    limit_max: float | None = Field(
        default=None,
        description="interlock: highest value allowed during a run; if left out, there is none",
    )
    limit_debounce_ms: float = Field(
        default=5.0,
        ge=0.0,
        le=1e4,
        description="interlock: time out of the limits after which it trips",
    )
    limit_action: Action = Field(
        default="ramp", description="interlock: how the voltage goes to 0 V"
    )
    simulated_value: float = Field(
        default=0.0, ge=-1e12, le=1e12, description="simulated rig only: value that it reads"
    )
    simulated_noise: float = Field(
        default=0.0, ge=0.0, le=1e12, description="simulated rig only: RMS noise of a reading"
    )

    @property
    def shown(self) -> str:
        """Return the displayed name."""
        return self.label or self.name.replace("_", " ")

    @property
    def limited(self) -> bool:
        """Return True if the channel has an interlock."""
        return self.limit_min is not None or self.limit_max is not None

    @property
    def limits_shown(self) -> str:
        """Return the allowed values as text; empty where all are allowed."""
        low, high, unit = self.limit_min, self.limit_max, self.unit
        if low is None:
            return "" if high is None else f"{high:.4g} {unit} or less"
        return f"{low:.4g} {unit} or more" if high is None else f"{low:.4g} to {high:.4g} {unit}"

    def allows(self, value: float) -> bool:
        """Return True if ``value`` is within the limits; False for NaN."""
        low = -math.inf if self.limit_min is None else self.limit_min
        high = math.inf if self.limit_max is None else self.limit_max
        return low <= value <= high

    def value(self, volts: float) -> float:
        """Return the value in the channel's unit for ``volts`` at the input."""
        return self.value_at_0_V + self.unit_per_V * volts

    def volts(self, values: np.ndarray) -> np.ndarray:
        """Return the volts at the input for ``values`` in the channel's unit, any shape."""
        return (values - self.value_at_0_V) / self.unit_per_V

    @field_validator("name")
    @classmethod
    def _is_free(cls, value: str) -> str:
        if value in RESERVED_NAMES or value.endswith("_counts"):
            raise ValueError("recordings use this name for something else; choose another one")
        return value

    @model_validator(mode="after")
    def _humidity_is_in_per_cent(self) -> ChannelSettings:
        if self.name == HUMIDITY and self.unit != "%":
            raise ValueError(
                f'channel {HUMIDITY}: unit = "{self.unit}" is not "%": what is known of the room '
                f"is in per cent"
            )
        return self

    @field_validator("unit_per_V")
    @classmethod
    def _scales(cls, value: float) -> float:
        if value == 0.0:
            raise ValueError("with 0 every voltage would read the same")
        return value

    @model_validator(mode="after")
    def _limits_are_within_the_range(self) -> ChannelSettings:
        reach = abs(self.unit_per_V) * self.range_V
        low, high = self.value_at_0_V - reach, self.value_at_0_V + reach
        for key in ("limit_min", "limit_max", "simulated_value"):
            value = getattr(self, key)
            if value is not None and not low <= value <= high:
                raise ValueError(
                    f"channel {self.name}: {key} = {value:g} is not within {low:g} to {high:g} "
                    f"{self.unit}, which range_V, unit_per_V and value_at_0_V can read"
                )
        least, most = self.limit_min, self.limit_max
        if least is not None and most is not None and least >= most:
            raise ValueError(
                f"channel {self.name}: limit_min = {least:g} is not below limit_max = {most:g}"
            )
        return self


class ThermometerSettings(Section):
    """An optional thermometer with a voltage output, near the film."""

    model: str = Field(default="Pt100 transmitter", description="type of the thermometer")
    serial: str = Field(default="", description="serial number, kept with every recording")
    celsius_per_V: float = Field(
        default=10.0, gt=0.0, le=1000.0, description="scaling: degrees Celsius per volt"
    )
    celsius_at_0_V: float = Field(
        default=0.0, ge=-273.15, le=1000.0, description="scaling: temperature at 0 V"
    )
    room_celsius: float = Field(
        default=22.0, ge=-50.0, le=200.0, description="simulated rig only: temperature of the room"
    )
    noise_mK: float = Field(
        default=10.0, ge=0.0, le=1e5, description="simulated rig only: RMS noise of a reading"
    )
