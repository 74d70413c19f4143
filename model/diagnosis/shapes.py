"""Values of an effect's parameters at which the regression tries it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.effects import Effect, Parameter
from dearig.model.readings.records import ActuatorRecord, Record

__all__ = [
    "Extent",
    "amplitudes",
    "extent_of",
    "moved",
    "shape_points",
    "strongest_line",
    "typical_values",
]

_DECADES = 2.0  # about the typical value: how far a logarithmic shape parameter is spread
_PADDING = 8  # of a spectrum: a line between two bins is met to a sixteenth of a bin


@dataclass(frozen=True)
class Extent:
    """Largest displacement in m, largest voltage in V and duration in s of some records.

    ``line(low, high)`` returns the frequency in Hz of the strongest line of the residual.
    """

    displacement: float
    voltage: float
    duration: float
    line: Callable[[float, float], float]

    def scale(self, parameter: Parameter) -> float:
        """Return what the starts of ``parameter`` are fractions of."""
        return float(getattr(self, parameter.relative_to, 1.0)) if parameter.relative_to else 1.0


def extent_of(records: Sequence[Record], line: Callable[[float, float], float]) -> Extent:
    """Return the extent of ``records``; films have neither displacement nor voltage."""
    rigs = [r for r in records if isinstance(r, ActuatorRecord)]
    return Extent(
        max((float(np.max(np.abs(r.displacement))) for r in rigs), default=1.0),
        max((float(np.max(np.abs(r.drive.voltage))) for r in rigs), default=1.0),
        max(float(r.time[-1] - r.time[0]) for r in records),
        line,
    )


def strongest_line(residual: np.ndarray, step: float, low: float, high: float) -> float:
    """Return the frequency in Hz between ``low`` and ``high`` where ``residual`` (N,) is largest.

    Anywhere in the spectrum where the samples, ``step`` s apart, do not reach ``low``.
    """
    n = _PADDING * residual.size
    frequency = np.fft.rfftfreq(n, step)
    power = np.abs(np.fft.rfft(residual, n))
    inside = (frequency >= low) & (frequency <= high)
    if not inside.any():
        inside = frequency > 0.0
    return float(frequency[inside][int(np.argmax(power[inside]))])


def typical_values(effect: Effect) -> tuple[float, ...]:
    """Return the typical value of each parameter, inside the bounds of a fit."""
    return tuple(_inside(p, p.typical) for p in effect.parameters)


def amplitudes(parameter: Parameter, factors: Sequence[float]) -> list[float]:
    """Return amplitudes, ``factors`` of the typical one from the neutral value, inside the bounds.

    Of both signs where both are allowed.
    """
    low, high = parameter.fit_bounds
    neutral = parameter.neutral or 0.0
    signs = (1.0, -1.0) if low < neutral else (1.0,)
    steps = [neutral + sign * f * parameter.typical for sign in signs for f in factors]
    return [s for s in steps if low <= s <= high] or [
        min(max(neutral + parameter.typical, low), high)
    ]


def shape_points(
    effect: Effect, extent: Extent, settings: DiagnosisSettings
) -> list[tuple[float, ...]]:
    """Return values of the shape parameters of ``effect``: its starts, and points all over.

    Instants are spread evenly; other points are a Sobol sequence over the bounds.
    """
    shapes = effect.shape_parameters
    if not shapes:
        return [()]
    points = list(product(*(_starts(p, extent, settings.moments) for p in shapes)))
    if not any(p.relative_to == "duration" for p in shapes):
        from scipy.stats.qmc import Sobol  # takes a second to import

        spread = Sobol(len(shapes), scramble=False).random(settings.shapes)[1:]
        points += [
            tuple(_between(p, extent, u) for p, u in zip(shapes, row, strict=True))
            for row in spread
        ]
    inside = (
        tuple(
            float(min(max(v, p.fit_bounds[0]), p.fit_bounds[1]))
            for p, v in zip(shapes, point, strict=True)
        )
        for point in points
    )
    return list(dict.fromkeys(inside))


def _starts(parameter: Parameter, extent: Extent, moments: int) -> list[float]:
    if parameter.relative_to == "duration":
        return list((np.arange(moments) + 0.5) / moments * extent.duration)
    scale = 1.0 if parameter.relative_to == "spectrum" else extent.scale(parameter)
    found = [s * scale for s in parameter.starts] or [parameter.typical]
    if parameter.relative_to == "spectrum":
        found.insert(0, extent.line(*parameter.fit_bounds))
    return found


def moved(parameter: Parameter, extent: Extent, value: float, part: float) -> float:
    """Return ``value`` moved by ``part`` (-1 to 1) of the range in which ``parameter`` shows."""
    low, high = _range(parameter, extent)
    if parameter.logarithmic:
        value *= math.exp(part * math.log(high / low))
    else:
        value += part * (high - low)
    return _inside(parameter, value)


def _inside(parameter: Parameter, value: float) -> float:
    low, high = parameter.fit_bounds
    return float(min(max(value, low), high))


def _between(parameter: Parameter, extent: Extent, part: float) -> float:
    """Return the value at ``part`` (0 to 1) of the range in which ``parameter`` shows."""
    low, high = _range(parameter, extent)
    if parameter.logarithmic:
        return low * math.exp(part * math.log(high / low))
    return low + part * (high - low)


def _range(parameter: Parameter, extent: Extent) -> tuple[float, float]:
    low, high = parameter.fit_bounds
    if parameter.relative_to in ("displacement", "voltage"):
        # below a fiftieth of the largest value hardly any sample differs, above it none
        scale = extent.scale(parameter)
        return max(low, 0.02 * scale), min(high, 1.2 * scale)
    if parameter.relative_to == "duration":
        return 0.0, extent.duration
    if parameter.logarithmic:
        reach = 10**_DECADES
        return max(low, parameter.typical / reach), min(high, parameter.typical * reach)
    return low, high
