"""Units of imported columns, and their scales to the units of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

__all__ = ["ALIASES", "UNITS", "WIDE_BRACKETS", "UnitScale", "unit_of"]


@dataclass(frozen=True)
class UnitScale:
    """Conversion ``values * times / over + plus``; dividing makes 5 mm exactly 0.005 m."""

    times: float = 1.0
    over: float = 1.0
    plus: float = 0.0

    def apply(self, values: np.ndarray) -> np.ndarray:
        """Return ``values`` (n,) in the unit of the recording."""
        if self.times != 1.0:
            values = values * self.times
        if self.over != 1.0:
            values = values / self.over
        return values + self.plus if self.plus else values


_INCH, _POUND, _GRAM = 0.0254, 4.4482216152605, 9.80665e-3  # m, N, N: exact by definition

#: Scale to the unit of a recording, by dimension and by the symbol of the unit.
UNITS: MappingProxyType[str, dict[str, UnitScale]] = MappingProxyType(
    {
        "time": {
            "s": UnitScale(),
            "ms": UnitScale(1.0, 1e3),
            "us": UnitScale(1.0, 1e6),
            "ns": UnitScale(1.0, 1e9),
            "min": UnitScale(60.0),
            "h": UnitScale(3600.0),
            "d": UnitScale(86400.0),
        },
        "voltage": {
            "V": UnitScale(), "kV": UnitScale(1e3), "mV": UnitScale(1.0, 1e3),
            "uV": UnitScale(1.0, 1e6), "MV": UnitScale(1e6),
        },
        "length": {
            "m": UnitScale(),
            "cm": UnitScale(1.0, 1e2),
            "mm": UnitScale(1.0, 1e3),
            "um": UnitScale(1.0, 1e6),
            "nm": UnitScale(1.0, 1e9),
            "dm": UnitScale(1.0, 1e1),
            "inch": UnitScale(_INCH),
            "mil": UnitScale(_INCH, 1e3),
            "ft": UnitScale(12.0 * _INCH),
        },
        "force": {
            "N": UnitScale(),
            "mN": UnitScale(1.0, 1e3),
            "uN": UnitScale(1.0, 1e6),
            "cN": UnitScale(1.0, 1e2),
            "kN": UnitScale(1e3),
            "gf": UnitScale(_GRAM),
            "kgf": UnitScale(_GRAM * 1e3),
            "lbf": UnitScale(_POUND),
        },
        "stress": {
            "Pa": UnitScale(), "kPa": UnitScale(1e3), "MPa": UnitScale(1e6), "GPa": UnitScale(1e9),
            "bar": UnitScale(1e5), "mbar": UnitScale(1e2), "psi": UnitScale(_POUND, _INCH**2),
            "ksi": UnitScale(1e3 * _POUND, _INCH**2),
        },
        "current": {
            "A": UnitScale(),
            "mA": UnitScale(1.0, 1e3),
            "uA": UnitScale(1.0, 1e6),
            "nA": UnitScale(1.0, 1e9),
            "pA": UnitScale(1.0, 1e12),
        },
        "temperature": {
            "C": UnitScale(), "K": UnitScale(plus=-273.15), "F": UnitScale(1.0, 1.8, -32 / 1.8),
        },
        "strain": {"1": UnitScale(), "pct": UnitScale(1.0, 1e2)},
        "stretch": {"1": UnitScale()},
    }
)  # fmt: skip

#: Other spellings of the symbols. Case counts elsewhere: mN is not MN, and ms is not MS.
ALIASES = MappingProxyType(
    {
        alias: symbol
        for symbol, aliases in {
            "s": "sec secs second seconds sek sekunde sekunden seconde secondes S",
            "ms": "msec millisecond milliseconds millisekunden",
            "us": "µs μs usec microsecond microseconds",
            "min": "mins minute minutes minuten Min",
            "h": "hr hrs hour hours std stunden heure heures",
            "d": "day days tag tage jour jours",
            "V": "volt volts Volt Volts v VDC Vdc",
            "kV": "kv KV kilovolt kilovolts Kilovolt",
            "mV": "millivolt millivolts",
            "m": "meter meters metre metres",
            "mm": "MM Mm millimeter millimeters millimetre millimetres",
            "um": "µm μm micron microns micrometer micrometers micrometre",
            "mil": "mils thou",
            "ft": "feet foot",
            "inch": 'in in. inches " zoll Zoll',
            "N": "newton newtons Newton n",
            "mN": "millinewton",
            "uN": "µN μN",
            "kN": "KN kn kilonewton",
            "gf": "g gram-force gramf",
            "kgf": "kg kp kg-force",
            "lbf": "lbs lb pounds",
            "Pa": "pa PA pascal Pascal N/m^2 N/m2 N/m²",
            "kPa": "kpa KPa KPA",
            "psi": "PSI lbf/in^2 lbf/in2 lb/in^2",
            "ksi": "KSI",
            "MPa": "Mpa MPA N/mm^2 N/mm2 N/mm² MN/m^2",
            "A": "amp amps ampere Ampere",
            "mA": "milliampere",
            "uA": "µA μA microampere",
            "C": "°C degC deg_C celsius Celsius ºC grad",
            "K": "kelvin Kelvin",
            "F": "°F degF deg_F fahrenheit Fahrenheit",
            "pct": "% percent Prozent pourcent",
            "1": "- mm/mm m/m in/in dimensionless",
        }.items()
        for alias in aliases.split()
    }
)


#: Words for units, whose case does not count: SEC, Volts, Millimeters.
_WRITTEN_OUT = MappingProxyType(
    {a.lower(): s for a, s in ALIASES.items() if a.isalpha() and a[1:].islower() and len(a) > 2}
)

#: Brackets of Chinese and Japanese texts.
WIDE_BRACKETS = "\N{FULLWIDTH LEFT PARENTHESIS}\N{FULLWIDTH RIGHT PARENTHESIS}"


#: Letters of Russian units, and their prefix for a millionth.
_CYRILLIC = str.maketrans("смкниечгаВНПМАГК", "smkniehgaVNPMAGK")
_MICRO = "мк"


def unit_of(text: str) -> tuple[str, tuple[str, ...]] | None:
    """Return the symbol of a unit that is written as ``text``, and its dimensions; else None."""
    text = text.strip().strip(f"()[]{WIDE_BRACKETS}").strip()
    if not text.isascii():
        text = text.replace(_MICRO, "u").translate(_CYRILLIC)
    symbol = ALIASES.get(text) or _WRITTEN_OUT.get(text.lower(), text)
    dimensions = tuple(d for d, units in UNITS.items() if symbol in units)
    return (symbol, dimensions) if dimensions else None
