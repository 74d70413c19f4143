"""Units in which quantities are shown to people."""

from __future__ import annotations

import re
from dataclasses import dataclass
from types import MappingProxyType

__all__ = [
    "SHOWN",
    "SHOWN_CHANNELS",
    "Shown",
    "ShownChannel",
    "counted",
    "in_digits",
    "name_and_unit",
    "parameter_key",
    "parameter_unit",
    "readable",
    "runs_text",
]

#: A number of thousands that was rounded to a few digits; no part of a name.
_ROUNDED = re.compile(r"(?<![\w.+/\\-])-?\d(?:\.\d+)?e\+0[1-5](?![\w/\\]|\.\w)")
#: Unit at the end of a key, and the unit as it is printed.
_KEY_UNITS = MappingProxyType({
    "kV_per_s": "kV/s", "MV_per_m": "MV/m", "V_per_us": "V/µs", "V_per_kV": "V/kV",
    "V_per_mA": "V/mA", "V_per_V": "V/V", "mm_per_V": "mm/V", "celsius_per_V": "°C/V",
    "kg_m3": "kg/m³", "kV": "kV", "Hz": "Hz", "kHz": "kHz", "MHz": "MHz", "deg": "°", "mm": "mm",
    "um": "µm", "us": "µs", "ms": "ms", "s": "s", "mA": "mA", "mV": "mV", "mK": "mK", "V": "V",
    "g": "g", "J": "J", "MB": "MB", "ppm": "ppm", "celsius": "°C",
    "kPa": "kPa", "pct": "%",
})  # fmt: skip
_UNCERTAINTY = "_uncertainty"


@dataclass(frozen=True)
class Shown:
    """How one kind of recording is shown: factors from SI, and the names and units they lead to.

    ``suffix`` is the unit of errors as it ends a key in JSON (``rms_um``).
    """

    drive: str
    drive_factor: float
    drive_unit: str
    quantity: str
    factor: float
    unit: str
    error_factor: float
    error_unit: str
    suffix: str

    @property
    def drive_label(self) -> str:
        """Axis label of the drive."""
        return f"{self.drive} ({self.drive_unit})" if self.drive_unit else self.drive

    @property
    def label(self) -> str:
        """Axis label of the measured quantity."""
        return f"{self.quantity} ({self.unit})"

    @property
    def error_label(self) -> str:
        """Axis label of the error."""
        return f"Error ({self.error_unit})"


#: By the kind of recording: actuator (V to m) or film (stretch to Pa).
SHOWN = MappingProxyType(
    {
        "actuator": Shown(
            "Voltage", 1e-3, "kV", "Displacement", 1e3, "mm", 1e6, "\N{MICRO SIGN}m", "um"
        ),
        "film": Shown("Stretch", 1.0, "", "Nominal stress", 1e-3, "kPa", 1e-3, "kPa", "kPa"),
    }
)


@dataclass(frozen=True)
class ShownChannel:
    """How an electrical channel is shown: factors from SI of readings and of errors, and units."""

    title: str
    factor: float
    unit: str
    error_factor: float
    error_unit: str

    @property
    def label(self) -> str:
        """Axis label of readings."""
        return f"{self.title} ({self.unit})"

    @property
    def error_label(self) -> str:
        """Axis label of a residual."""
        return f"Residual ({self.error_unit})"


#: By the name of the channel, as results have it.
SHOWN_CHANNELS = MappingProxyType(
    {
        "voltage_monitor": ShownChannel("Voltage monitor", 1e-3, "kV", 1.0, "V"),
        "current": ShownChannel("Current", 1e6, "\N{MICRO SIGN}A", 1e6, "\N{MICRO SIGN}A"),
    }
)


def parameter_unit(unit: str) -> tuple[float, str]:
    """Return ``(factor, unit)`` in which a parameter of SI ``unit`` is shown."""
    return (1e-3, "kPa") if unit == "Pa" else (1.0, unit)


def parameter_key(name: str, unit: str) -> str:
    """Return a parameter's ``name`` with the unit in which it is shown: ``mu_0_kPa``.

    ``unit`` is its SI unit. That of an effect is ``linear_drag.drag_Pa_s``.
    """
    stem = name.replace(": ", ".").replace(" ", "_")
    _, shown = parameter_unit(unit)
    ending = shown.replace("/", "_per_").replace("²", "2").replace("³", "3").replace(" ", "_")
    return f"{stem}_{ending}" if ending else stem


def in_digits(text: str) -> str:
    """Return ``text`` with numbers like 1.8e+04, up to a million, written as 18000."""
    return _ROUNDED.sub(lambda number: f"{float(number[0]):.0f}", text)


def readable(text: str) -> str:
    """Return ``text`` with um, us, uA and +- written as µm, µs, µA and ±, and numbers in digits."""
    text = in_digits(text)
    text = re.sub(r"(?<=\d) u(?=[msA]\b)", " \N{MICRO SIGN}", text)
    return re.sub(r"\+- ?(?=\d)", "\N{PLUS-MINUS SIGN}", text)


def name_and_unit(key: str) -> tuple[str, str]:
    """Return the name and the unit in a key of a file: ``rest_length_mm`` is rest length in mm.

    A key that is a unit alone, as ``mm_per_V``, is a scale. A standard uncertainty has the unit of
    its quantity: ``length_mm_uncertainty`` is length uncertainty in mm.
    """
    stem = key.removesuffix(_UNCERTAINTY)
    of = " uncertainty" if stem != key else ""
    if stem in _KEY_UNITS and "_" in stem:
        return f"scale{of}", _KEY_UNITS[stem]
    for ending in sorted(_KEY_UNITS, key=len, reverse=True):
        if stem.endswith(f"_{ending}") and stem != "unit_per_V":  # the unit is another key's
            return stem.removesuffix(f"_{ending}").replace("_", " ") + of, _KEY_UNITS[ending]
    return key.replace("_", " "), ""


def counted(count: int, one: str) -> str:
    """Return a number of things, each of which is called ``one``."""
    return f"{count:,} {one}{'' if count == 1 else 's'}"


def runs_text(count: int, state: str = "") -> str:
    """Return a number of runs, or that they are in a ``state`` such as "left"."""
    runs = counted(count, "run")
    return f"{runs} {'is' if count == 1 else 'are'} {state}" if state else runs
