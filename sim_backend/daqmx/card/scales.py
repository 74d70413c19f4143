"""Custom scales: from what a channel measures to what a program reads, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError

__all__ = ["LINEAR", "MAP", "POLYNOMIAL", "TABLE", "Scale", "reverse_coefficients"]

LINEAR, MAP, POLYNOMIAL, TABLE = 10447, 10448, 10449, 10450  #: DAQmx: types of a scale
_VOLTS = 10348


@dataclass
class Scale:
    """Scale ``name`` of a ``kind``; the other fields are DAQmx's properties of that kind."""

    name: str
    kind: int
    slope: float = 1.0
    y_intercept: float = 0.0
    map_pre_scaled: tuple[float, float] = (0.0, 1.0)
    map_scaled: tuple[float, float] = (0.0, 1.0)
    forward: Sequence[float] = (0.0, 1.0)
    reverse: Sequence[float] = (0.0, 1.0)
    table_pre_scaled: Sequence[float] = ()
    table_scaled: Sequence[float] = ()
    pre_scaled_units: int = _VOLTS
    scaled_units: str = ""
    description: str = ""
    saved: bool = False
    author: str = ""

    def scaled(self, values: np.ndarray) -> np.ndarray:
        """Return what a program reads for ``values`` (n,) in the unit before scaling."""
        if self.kind == POLYNOMIAL:
            return np.asarray(np.polynomial.polynomial.polyval(values, np.array(self.forward)))
        if self.kind == TABLE:
            return _interpolated(values, self.table_pre_scaled, self.table_scaled)
        slope, intercept = self._line()
        return values * slope + intercept

    def pre_scaled(self, values: np.ndarray) -> np.ndarray:
        """Return the value before scaling for what a program writes, ``values`` (n,)."""
        if self.kind == POLYNOMIAL:
            return np.asarray(np.polynomial.polynomial.polyval(values, np.array(self.reverse)))
        if self.kind == TABLE:
            return _interpolated(values, self.table_scaled, self.table_pre_scaled)
        slope, intercept = self._line()
        return (values - intercept) / slope

    def limits(self, limits: tuple[float, float]) -> tuple[float, float]:
        """Return scaled ``limits`` in the unit before scaling, in rising order."""
        low, high = (float(v) for v in self.pre_scaled(np.array(limits)))
        return min(low, high), max(low, high)

    def check(self) -> None:
        """Refuse a scale that maps everything to one value, or has too few points."""
        if self.kind in (LINEAR, MAP):
            if self.map_pre_scaled[0] == self.map_pre_scaled[1] and self.kind == MAP:
                raise DaqmxError(Code.PRE_SCALED_EQUAL, f"Custom Scale Name: {self.name}")
            if self._line()[0] == 0.0:
                raise DaqmxError(Code.ZERO_SLOPE, f"Custom Scale Name: {self.name}")
        if self.kind == TABLE:
            points = len(self.table_pre_scaled)
            if points != len(self.table_scaled):
                raise DaqmxError(Code.TABLE_SIZES_DIFFER, f"Custom Scale Name: {self.name}")
            if points < 2:
                raise DaqmxError(Code.TABLE_TOO_SHORT, f"Custom Scale Name: {self.name}")
        if self.kind == POLYNOMIAL and not (len(self.forward) and len(self.reverse)):
            raise DaqmxError(Code.NO_COEFFICIENTS, f"Custom Scale Name: {self.name}")

    def _line(self) -> tuple[float, float]:
        """Return slope and intercept of a linear scale or a map."""
        if self.kind == LINEAR:
            return self.slope, self.y_intercept
        (x0, x1), (y0, y1) = self.map_pre_scaled, self.map_scaled
        slope = (y1 - y0) / (x1 - x0)
        return slope, y0 - slope * x0


def _interpolated(values: np.ndarray, at: Sequence[float], of: Sequence[float]) -> np.ndarray:
    order = np.argsort(at)
    return np.asarray(np.interp(values, np.array(at)[order], np.array(of)[order]))


def reverse_coefficients(
    forward: Sequence[float], low: float, high: float, points: int, order: int
) -> list[float]:
    """Return the polynomial of ``order`` that inverts ``forward`` from ``low`` to ``high``.

    It is a least-squares fit to ``points`` values; an ``order`` of -1 is that of ``forward``.
    """
    if not forward or points < 2 or low >= high:
        raise DaqmxError(Code.INVALID_VALUE, f"Values: {low:g} to {high:g}; Points: {points}")
    x = np.linspace(low, high, points)
    y = np.polynomial.polynomial.polyval(x, np.array(forward))
    degree = len(forward) - 1 if order < 0 else order
    return [float(c) for c in np.polynomial.polynomial.polyfit(y, x, degree)]
