"""Sensors that a program may have at an input: from the voltage to the measured quantity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError

__all__ = ["CUSTOM_RTD", "RTD_COEFFICIENTS", "Sensor", "Usage"]

_INTERNAL = 10200  # DAQmx: source of an excitation within the card
_CELSIUS, _FAHRENHEIT, _KELVIN, _RANKINE = 10143, 10144, 10325, 10145
_ZERO_CELSIUS_K = 273.15
CUSTOM_RTD = 10137  #: DAQmx: a resistance thermometer with coefficients of its own
#: Callendar-Van Dusen coefficients A, B, C of DAQmx's types of resistance thermometers.
RTD_COEFFICIENTS = {
    12481: (3.81e-3, -6.02e-7, -6.0e-12),  # Pt 3750
    10071: (3.9083e-3, -5.775e-7, -4.183e-12),  # Pt 3851
    12482: (3.9692e-3, -5.8495e-7, -4.2325e-12),  # Pt 3911
    10069: (3.9739e-3, -5.870e-7, -4.4e-12),  # Pt 3916
    10053: (3.9787e-3, -5.8686e-7, -4.167e-12),  # Pt 3920
    12483: (3.9888e-3, -5.915e-7, -3.85e-12),  # Pt 3928
}
# voltages at which a sensor is tried to find those of its limits
_TRIED = np.concatenate((-np.logspace(1, -6, 4001), [0.0], np.logspace(-6, 1, 4001)))


class Usage:
    """DAQmx's types of measurements that the card does with a sensor."""

    CURRENT = 10134
    WITH_EXCITATION = 10323
    RESISTANCE = 10278
    THERMISTOR = 10302
    RTD = 10301


@dataclass
class Sensor:
    """Sensor of a ``usage`` with DAQmx's properties of its channel by name, in ``values``.

    The card has no excitation of its own: current and voltage come from outside.
    """

    usage: int
    values: dict[str, Any]
    scaled_units: str
    name: str = field(default="", init=False)  # a sensor is not a custom scale

    def scaled(self, volts: np.ndarray) -> np.ndarray:
        """Return the measured quantity for ``volts`` (n,)."""
        return _CONVERSIONS[self.usage](self.values, np.asarray(volts, dtype=np.float64))

    def limits(self, limits: tuple[float, float]) -> tuple[float, float]:
        """Return the voltages between which the quantity is within ``limits``."""
        low, high = limits
        with np.errstate(all="ignore"):
            measured = self.scaled(_TRIED)
        within = _TRIED[(measured >= low) & (measured <= high)]
        return (float(within.min()), float(within.max())) if within.size else (-0.1, 0.1)

    def pre_scaled(self, values: np.ndarray) -> np.ndarray:
        """Refuse a sensor at an output."""
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, f"Values: {values.size}")

    @property
    def linear(self) -> bool:
        """Return True if the quantity is proportional to the voltage."""
        return self.usage not in (Usage.RTD, Usage.THERMISTOR)

    def check(self) -> None:
        """Refuse an excitation that the card would have to give."""
        if self.values.get("AI_EXCIT_SRC") == _INTERNAL:
            raise DaqmxError(
                Code.INVALID_VALUE,
                "Property: AI_EXCIT_SRC; Requested Value: Internal; You Can Select: External",
            )


def _resistance(values: dict[str, Any], volts: np.ndarray) -> np.ndarray:
    """Return the resistance in Ohm at a known current, or in series with a known resistor."""
    excitation = values["AI_EXCIT_VAL"]
    if "AI_THRMSTR_R1" in values:
        return np.asarray(values["AI_THRMSTR_R1"] * volts / (excitation - volts))
    return np.asarray(volts / excitation)


def _in_units(celsius: np.ndarray, units: int) -> np.ndarray:
    if units == _FAHRENHEIT:
        return celsius * 1.8 + 32.0
    if units == _KELVIN:
        return celsius + _ZERO_CELSIUS_K
    if units == _RANKINE:
        return (celsius + _ZERO_CELSIUS_K) * 1.8
    return celsius


def _rtd(values: dict[str, Any], volts: np.ndarray) -> np.ndarray:
    """Return the temperature of a resistance thermometer by Callendar and Van Dusen."""
    a, b, c = (values[f"AI_RTD_{letter}"] for letter in "ABC")
    ratio = _resistance(values, volts) / values["AI_RTD_R0"]
    with np.errstate(invalid="ignore"):
        root = np.sqrt(np.maximum(a * a - 4.0 * b * (1.0 - ratio), 0.0))
    celsius = (root - a) / (2.0 * b) if b else (ratio - 1.0) / a
    for _ in range(8):  # Newton; below 0 degrees there is one more term
        cold = np.where(celsius < 0.0, c, 0.0)
        value = 1.0 + a * celsius + b * celsius**2 + cold * (celsius - 100.0) * celsius**3
        slope = a + 2.0 * b * celsius + cold * (4.0 * celsius - 300.0) * celsius**2
        celsius = celsius - (value - ratio) / np.where(slope == 0.0, a or 1.0, slope)
    return _in_units(celsius, values["AI_TEMP_UNITS"])


def _thermistor(values: dict[str, Any], volts: np.ndarray) -> np.ndarray:
    """Return the temperature of a thermistor by Steinhart and Hart; NaN without a resistance."""
    with np.errstate(all="ignore"):
        log = np.log(_resistance(values, volts))
        a, b, c = (values[f"AI_THRMSTR_{letter}"] for letter in "ABC")
        kelvin = 1.0 / (a + b * log + c * log**3)
    return _in_units(kelvin - _ZERO_CELSIUS_K, values["AI_TEMP_UNITS"])


def _current(values: dict[str, Any], volts: np.ndarray) -> np.ndarray:
    return np.asarray(volts / values["AI_CURRENT_SHUNT_RESISTANCE"])


def _with_excitation(values: dict[str, Any], volts: np.ndarray) -> np.ndarray:
    return volts / values["AI_EXCIT_VAL"] if values["AI_EXCIT_USE_FOR_SCALING"] else volts


_CONVERSIONS: dict[int, Callable[[dict[str, Any], np.ndarray], np.ndarray]] = {
    Usage.CURRENT: _current,
    Usage.WITH_EXCITATION: _with_excitation,
    Usage.RESISTANCE: _resistance,
    Usage.RTD: _rtd,
    Usage.THERMISTOR: _thermistor,
}
