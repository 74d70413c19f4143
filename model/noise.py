"""The noise of readings, from the readings themselves.

Only NumPy is imported: a recording tells its noise floor without the solvers of SciPy.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dearig.model.errors import ModelError

__all__ = [
    "DIFFERENCES",
    "LEAD_IN",
    "READINGS_MIN",
    "noise_at_rest",
    "noise_of",
    "require_readings",
]

#: Sources of a noise: readings at rest, or second differences of all of them.
LEAD_IN, DIFFERENCES = "lead-in", "second differences"
#: Fewer readings have no second difference to average.
READINGS_MIN = 4
_READINGS_A_LINE = 4  # samples for each of the three numbers of a periodic line
_SLOWEST_LINE = 15.0  # Hz; slower ones may be drift, or noise that a sensor has averaged
_STANDS_OUT = 30.0  # times the spectrum's median about it: by chance once in a million readings
_LINE_FOUND = 1e-5  # of a frequency bin: moves the sine's end by some 1e-5 of a period


def noise_of(values: np.ndarray, valid: np.ndarray | None = None) -> float:
    """Standard deviation of the noise on a slowly changing quantity ``values`` (N,), N >= 4.

    From second differences, which no drift or slope disturbs: their variance is six times that of
    white noise. Readings that are not ``valid`` (N,) take no part; with too few others it is 0.
    """
    require_readings(values)
    bends = np.diff(values, 2)
    if valid is not None:
        bends = bends[valid[:-2] & valid[1:-1] & valid[2:]]
    return float(np.sqrt(np.mean(bends**2) / 6.0)) if bends.size else 0.0


def noise_at_rest(time: np.ndarray, values: np.ndarray) -> float:
    """Standard deviation of the noise on readings (N,) at ``time`` (N,) of what hangs still.

    N >= 4. About a straight line, and without what is periodic: mains on a cable is no noise, but
    something to be found; taken for noise, it would hide everything that is smaller.
    """
    require_readings(values)
    n = values.size
    t = time - time.mean()
    left = _level(t, values)
    given = 2
    steps = np.diff(time)
    even = float(steps.max()) < 1.01 * float(steps.min())
    while even and given + 3 < n / _READINGS_A_LINE:
        line = _strongest_line(t, left)
        if line is None:
            break
        left = _level(t, left - line)  # a line that ends in mid-period looked like a slope
        given += 3
    return math.sqrt(float(left @ left) / (n - given))


def require_readings(values: np.ndarray) -> None:
    """Raise ``ModelError`` where ``values`` (N,) are too few to read a noise from."""
    if values.size < READINGS_MIN:
        raise ModelError(
            f"{values.size} samples are too few to read a noise from; {READINGS_MIN} are needed"
        )


def _level(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """``values`` (N,) about their straight line, at times ``t`` (N,) about their mean."""
    level = values - values.mean()
    return np.asarray(level - t * (float(t @ level) / float(t @ t)))


def _strongest_line(t: np.ndarray, values: np.ndarray) -> np.ndarray | None:
    """The sine (N,) that stands out most from the spectrum of ``values`` (N,), or None."""
    n = values.size
    power = np.abs(np.fft.rfft(values)) ** 2
    bin_width = 1.0 / (n * float(t[1] - t[0]))
    slowest = math.ceil(_SLOWEST_LINE / bin_width)
    if slowest >= power.size:
        return None
    peak = slowest + int(np.argmax(power[slowest:]))
    half = power.size // 16 + 4
    about = power[np.clip(np.arange(peak - half, peak + half + 1), 0, power.size - 1)]
    if not power[peak] > _STANDS_OUT * float(np.median(about)):
        return None

    def sine(frequency: float) -> np.ndarray:
        turn = 2.0 * np.pi * frequency * t
        waves = np.array([np.cos(turn), np.sin(turn)])
        return np.asarray(np.linalg.solve(waves @ waves.T, waves @ values) @ waves)

    best = _minimum(
        lambda f: float(np.sum((values - sine(f)) ** 2)),
        (peak - 1.0) * bin_width,
        (peak + 1.0) * bin_width,
        _LINE_FOUND * bin_width,
    )
    return sine(best)


def _minimum(function: Callable[[float], float], low: float, high: float, within: float) -> float:
    """Return the place of the minimum of ``function`` from ``low`` to ``high``: golden section."""
    ratio = (math.sqrt(5.0) - 1.0) / 2.0
    left, right = high - ratio * (high - low), low + ratio * (high - low)
    at_left, at_right = function(left), function(right)
    while high - low > within:
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - ratio * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + ratio * (high - low)
            at_right = function(right)
    return (low + high) / 2.0
