"""Reading of the voltage monitor after the output was set to 0 V."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["ZeroReading"]


@dataclass(frozen=True)
class ZeroReading:
    """Reading of the voltage monitor after 0 V was set: ``voltage`` V at the film.

    ``at`` is its time in s since 1970; ``confirmed`` is True within ``limits.zero_tolerance_kV``.
    """

    voltage: float
    at: float
    confirmed: bool
