"""Column names with units: ``voltage_kV`` is a voltage in kV."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from types import MappingProxyType

__all__ = ["QUANTITIES", "TARGETS", "Scale", "misnamed", "names_of", "suggestion"]

#: Factor and divisor; dividing makes 5 mm exactly 0.005 m, to the last bit.
Scale = tuple[float, float]

#: Names that a column may have, by quantity, with the scale to the unit of the recording.
QUANTITIES: MappingProxyType[str, dict[str, Scale]] = MappingProxyType(
    {
        "time": {"time_s": (1.0, 1.0)},
        "voltage": {"voltage_V": (1.0, 1.0), "voltage_kV": (1e3, 1.0)},
        "displacement": {
            "displacement_mm": (1.0, 1e3),
            "displacement_um": (1.0, 1e6),
            "displacement_m": (1.0, 1.0),
        },
        "voltage_monitor": {"voltage_monitor_V": (1.0, 1.0), "voltage_monitor_kV": (1e3, 1.0)},
        "current": {"current_A": (1.0, 1.0)},
        "temperature": {"temperature_C": (1.0, 1.0)},
        "stretch": {"stretch": (1.0, 1.0)},
        "nominal_stress": {
            "nominal_stress_kPa": (1e3, 1.0),
            "nominal_stress_Pa": (1.0, 1.0),
            "nominal_stress_MPa": (1e6, 1.0),
        },
        "force": {"force_N": (1.0, 1.0)},
    }
)

#: The quantity of every name.
TARGETS = MappingProxyType({name: q for q, names in QUANTITIES.items() for name in names})


def names_of(quantity: str) -> str:
    """Return the names that a column of ``quantity`` may have, for a message."""
    return " or ".join(QUANTITIES[quantity])


def misnamed(quantity: str, names: Iterable[str]) -> str:
    """Return a hint about one of ``names`` that seems to be ``quantity`` in another unit, or "".

    For ``voltage_mV`` it is "'voltage_mV' is not a known name: voltage may be in V or kV".
    """
    known = QUANTITIES[quantity]
    units = " or ".join(name.removeprefix(f"{quantity}_") for name in known)
    what = "has no unit" if quantity in known else f"may be in {units}"
    for name in names:
        # units are short: the rest of voltage_monitor is not one
        match = re.fullmatch(rf"{quantity}\s*[_(\[/ ]\s*[^\W\d_]{{1,4}}[)\]]?", name, re.IGNORECASE)
        if match and name.lower() not in {k.lower() for k in known}:
            return f"{name!r} is not a known name: {quantity} {what}"
    return ""


def suggestion(wanted: Iterable[str], there: Iterable[str]) -> str:
    """Return ``; did you mean 'x'?`` for the name ``there`` nearest to one ``wanted``, or ""."""
    listed = list(there)
    lowered = {name.lower(): name for name in reversed(listed)}
    for name in wanted:
        near = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.6)
        if near:
            return f"; did you mean {lowered[near[0]]!r}?"
    return ""
