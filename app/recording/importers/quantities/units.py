"""Units of imported columns, and their scales to the units of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

__all__ = ["ALIASES", "UNITS", "WIDE_BRACKETS", "Scale", "unit_of"]


@dataclass(frozen=True)
class Scale:
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
UNITS: MappingProxyType[str, dict[str, Scale]] = MappingProxyType(
    {
        "time": {
            "s": Scale(),
            "ms": Scale(1.0, 1e3),
            "us": Scale(1.0, 1e6),
            "ns": Scale(1.0, 1e9),
            "min": Scale(60.0),
            "h": Scale(3600.0),
            "d": Scale(86400.0),
        },
        "voltage": {
            "V": Scale(), "kV": Scale(1e3), "mV": Scale(1.0, 1e3), "uV": Scale(1.0, 1e6),
            "MV": Scale(1e6),
        },
        "length": {
            "m": Scale(),
            "cm": Scale(1.0, 1e2),
            "mm": Scale(1.0, 1e3),
            "um": Scale(1.0, 1e6),
            "nm": Scale(1.0, 1e9),
            "dm": Scale(1.0, 1e1),
            "inch": Scale(_INCH),
            "mil": Scale(_INCH, 1e3),
            "ft": Scale(12.0 * _INCH),
        },
        "force": {
            "N": Scale(),
            "mN": Scale(1.0, 1e3),
            "uN": Scale(1.0, 1e6),
            "cN": Scale(1.0, 1e2),
            "kN": Scale(1e3),
            "gf": Scale(_GRAM),
            "kgf": Scale(_GRAM * 1e3),
            "lbf": Scale(_POUND),
        },
        "stress": {
            "Pa": Scale(), "kPa": Scale(1e3), "MPa": Scale(1e6), "GPa": Scale(1e9),
            "bar": Scale(1e5), "mbar": Scale(1e2), "psi": Scale(_POUND, _INCH**2),
            "ksi": Scale(1e3 * _POUND, _INCH**2),
        },
        "current": {
            "A": Scale(),
            "mA": Scale(1.0, 1e3),
            "uA": Scale(1.0, 1e6),
            "nA": Scale(1.0, 1e9),
            "pA": Scale(1.0, 1e12),
        },
        "temperature": {"C": Scale(), "K": Scale(plus=-273.15), "F": Scale(1.0, 1.8, -32 / 1.8)},
        "strain": {"1": Scale(), "pct": Scale(1.0, 1e2)},
        "stretch": {"1": Scale()},
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
            "1": "- mm/mm m/m",
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


def unit_of(text: str) -> tuple[str, tuple[str, ...]] | None:
    """Return the symbol of a unit that is written as ``text``, and its dimensions; else None."""
    text = text.strip().strip(f"()[]{WIDE_BRACKETS}").strip()
    symbol = ALIASES.get(text) or _WRITTEN_OUT.get(text.lower(), text)
    dimensions = tuple(d for d, units in UNITS.items() if symbol in units)
    return (symbol, dimensions) if dimensions else None
