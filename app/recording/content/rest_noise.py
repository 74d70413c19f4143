"""Length, rest and noise of the lead-in of a run, where the film hangs at 0 V."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.model.readings.noise import (
    DIFFERENCES,
    FEW_VALUES,
    LEAD_IN,
    READINGS_MIN,
    coarse_noise,
    noise_at_rest,
    noise_of,
)

__all__ = [
    "MIN_QUIET",
    "NEGLIGIBLE",
    "ReadingNoise",
    "lead_in",
    "mean_beyond_noise",
    "noise_floor",
    "noise_of_readings",
    "takes_few_values",
]

#: Least number of samples for an estimate of the noise.
MIN_QUIET = 20

#: Part of the largest voltage that counts as 0: the force goes with the square, a millionth.
NEGLIGIBLE = 1e-3
#: Part of the largest voltage up to which a steady reading is the offset of a monitor at rest, not
#: a voltage that is held: a percent of offset is four times what amplifiers are specified with.
OFFSET_MAX = 1e-2
#: Standard deviations of the noise at rest beyond which the voltage has left its rest: one sample
#: in 5e8 of Gaussian noise.
LEAVES = 6.0
#: Least von Neumann ratio (mean square of successive differences over the variance) of readings
#: that do not drift. It is 2 for white noise, with a standard deviation of 2/sqrt(n), 0.45 for 20.
STEADY = 1.0
#: Samples that are looked at in one step.
PIECE = 2**16


def lead_in(voltage: np.ndarray, step: float = 0.0) -> int:
    """Count the samples of ``voltage`` (N,) V at rest before the first one that is not.

    ``step`` V is the resolution of the converter. A voltage is at rest within a thousandth of its
    largest value around 0 V, or where it is steady in its own noise around the offset of a monitor.
    """
    if voltage.size == 0:
        return 0
    largest = max(float(voltage.max()), -float(voltage.min()))
    quiet = _within(voltage, 0.0, max(step, NEGLIGIBLE * largest))
    return max(quiet, _steady(voltage, largest))


def _within(values: np.ndarray, middle: float, most: float) -> int:
    """Count the first ``values`` (N,) that differ from ``middle`` by ``most`` or less.

    They are read piece by piece: a lead-in is short, and a recording may be long.
    """
    for begin in range(0, values.size, PIECE):
        away = np.abs(values[begin : begin + PIECE] - middle) > most
        if away.any():
            return begin + int(np.argmax(away))
    return int(values.size)


def _steady(voltage: np.ndarray, largest: float) -> int:
    """Count the samples before ``voltage`` leaves the noise of its first ``MIN_QUIET`` ones."""
    first = voltage[:MIN_QUIET]
    if first.size < MIN_QUIET or abs(float(first.mean())) > OFFSET_MAX * largest:
        return 0
    spread = float(first.std(ddof=1))
    if spread > 0.0 and float(np.mean(np.diff(first) ** 2)) < STEADY * spread**2:
        return 0
    return _within(voltage, float(first.mean()), max(LEAVES * spread, NEGLIGIBLE * largest))


@dataclass(frozen=True)
class ReadingNoise:
    """Standard deviation ``value`` of one reading, in its unit, and where it is from.

    ``source`` is ``LEAD_IN`` or ``DIFFERENCES``; ``count`` are the readings at rest. ``step`` is
    that of coarse readings, which are rounded to more than their noise; 0 of others.
    """

    value: float
    source: str
    count: int
    step: float = 0.0

    @property
    def words(self) -> str:
        """Where it is from."""
        if self.source == LEAD_IN:
            return f"over {self.count} samples at 0 V"
        if self.step:
            return "from second differences: the readings come in steps larger than their noise"
        if self.count >= MIN_QUIET:
            return "from second differences: the readings at 0 V at the start do not change"
        if self.count:
            return f"from second differences: only {self.count} samples at 0 V at the start"
        return "from second differences: no rest at 0 V at the start"


def noise_of_readings(
    time: np.ndarray, values: np.ndarray, quiet: int, valid: np.ndarray | None = None
) -> ReadingNoise | None:
    """Return the noise of ``values`` (N,) whose first ``quiet`` are at rest.

    Readings that are not ``valid`` (N,) take no part. Where fewer than 20 are at rest, it is that
    of all second differences, which counts fast motion as noise; and where readings at rest take
    few values, that of second differences in motion, if they are so coarse. None where nothing
    changes.
    """
    at_rest = slice(0, quiet) if valid is None else np.flatnonzero(valid[:quiet])
    time_at_rest, at_rest_values = time[at_rest], values[at_rest]
    count = int(at_rest_values.size)
    if takes_few_values(at_rest_values):
        noise, step = coarse_noise(values, valid)
        if noise > 0.0:
            return ReadingNoise(noise, DIFFERENCES, count, step)
    if count >= MIN_QUIET:
        value = noise_at_rest(time_at_rest, at_rest_values)
        if value > 0.0:
            return ReadingNoise(value, LEAD_IN, count)
    if values.size < READINGS_MIN:
        return None
    value = noise_of(values, valid)
    return ReadingNoise(value, DIFFERENCES, count) if value > 0.0 else None


def takes_few_values(at_rest: np.ndarray) -> bool:
    """Whether readings (n,) ``at_rest`` may be so coarse that they do not tell their noise."""
    return np.unique(at_rest).size <= FEW_VALUES


def noise_floor(time: np.ndarray, values: np.ndarray) -> float | None:
    """Return the noise of ``values`` (n,) by ``noise_at_rest``; None below 20 samples."""
    return noise_at_rest(time, values) if values.size >= MIN_QUIET else None


def mean_beyond_noise(values: np.ndarray) -> float:
    """Return the mean of the lead-in ``values`` (n,), or 0 if noise alone could explain it.

    Readings that are missing, which are NaN, take no part.
    """
    values = values[np.isfinite(values)]
    n = values.size
    if n < MIN_QUIET:
        return 0.0
    mean = float(values.mean())
    return mean if abs(mean) > 3.0 * float(values.std(ddof=1)) / math.sqrt(n) else 0.0
