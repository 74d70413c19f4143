"""Whether a residual is noise as that at rest: one definition, by its size and its colour."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.fitting.intervals import (
    correlation_end,
    correlation_time,
    is_flat,
    spectrum_distance,
)
from dearig.model.readings.noise import REST_MIN

__all__ = ["ABOVE", "DIAGNOSE", "REJECTED", "NoiseTest", "misfit_p", "noise_test", "with_intervals"]

_LAGS = 20  # of the Ljung-Box test


@dataclass(frozen=True)
class NoiseTest:
    """Probabilities that noise as that at rest leaves such a residual or a worse one.

    By its ``size`` (None where the readings at rest do not tell), by its ``spectrum``, by the
    correlation of neighbours (``ljung_box``), and by how seldom its sign changes (``runs``).
    ``apart`` is the correlation time of the readings at rest in samples, 1 for white ones.
    """

    size: float | None
    spectrum: float
    ljung_box: float
    runs: float
    apart: float = 1.0

    @property
    def p(self) -> float:
        """The probability by all of them: the least counts as often as there are tests."""
        found = [p for p in (self.size, self.spectrum, self.ljung_box, self.runs) if p is not None]
        return min(1.0, len(found) * min(found))


def noise_test(
    residual: np.ndarray, rest: np.ndarray | None = None, *, averaged: bool = False
) -> NoiseTest:
    """Return how probable a residual is by noise alone.

    Parameters
    ----------
    residual
        Measured less model (N,), in any unit, NaN where a reading must not be used.
    rest
        Readings before the voltage (M,), in the same unit. Without, or with fewer than 100, noise
        is taken for white, and of the size nothing is said.
    averaged
        Whether the readings are means of conversions: neighbours then share readings of a sensor
        that averages too, and their noise is not white, even where the few at rest seem to be.

    Notes
    -----
    Size: the ratio of both mean squares is distributed as F, with the degrees of freedom that a
    variance from correlated readings with the kurtosis of those at rest has, 2 n/((k - 1) tau).
    Spectrum: the summed periodogram against a straight line where the readings at rest are white
    (Bartlett), else against theirs (Kolmogorov and Smirnov). Correlation (Ljung and Box) and runs
    of one sign (Wald and Wolfowitz) are those of readings twice as far apart as readings at rest
    are correlated, where those are not white. Noise slower than the readings at rest last is not
    known to any of them: it is taken for a misfit.
    """
    left = residual[np.isfinite(residual)]
    still = np.zeros(0) if rest is None else rest[np.isfinite(rest)]
    if still.size < REST_MIN or np.ptp(still) == 0.0:
        away, lines = spectrum_distance(left)
        spectrum = float(scipy.special.kolmogorov(away * math.sqrt(lines)))
        return NoiseTest(None, spectrum, _ljung_box(left), _runs(left))
    still = still - still.mean()
    variance = float(np.mean(still**2))
    kurtosis = max(float(np.mean(still**4)) / variance**2, 1.0)
    apart = max(correlation_time(still), 1.0) * max(kurtosis - 1.0, 2.0) / 2.0
    size = scipy.special.fdtrc(
        left.size / apart, max(still.size / apart - 1.0, 1.0), float(np.mean(left**2)) / variance
    )
    white = not averaged and is_flat(still)
    away, lines = spectrum_distance(left, None if white else still)
    # twice as far as the readings at rest show it: what is left is below what they would show
    every = 1 if white else 2 * correlation_end(still)
    return NoiseTest(
        float(size),
        float(scipy.special.kolmogorov(away * math.sqrt(lines))),
        _ljung_box(left[::every]),
        _runs(left[::every]),
        1.0 if white else max(correlation_time(still), 1.0),
    )


def misfit_p(residual: np.ndarray, rest: np.ndarray, *, averaged: bool = False) -> float | None:
    """Return the probability of ``noise_test`` by all tests.

    None where too few readings are at rest, or too few are left.
    """
    left, still = residual[np.isfinite(residual)], rest[np.isfinite(rest)]
    if still.size < REST_MIN or left.size < REST_MIN or np.ptp(still) == 0.0:
        return None
    return noise_test(left, still, averaged=averaged).p


def _ljung_box(residual: np.ndarray) -> float:
    """Return the probability that white noise is as correlated over the first lags."""
    n = residual.size
    lags = min(_LAGS, n // 4)
    if lags < 1:
        return 1.0
    centred = residual - residual.mean()
    total = float(centred @ centred)
    if total == 0.0:
        return 1.0
    r = np.array([centred[k:] @ centred[:-k] for k in range(1, lags + 1)]) / total
    statistic = n * (n + 2.0) * float(np.sum(r**2 / (n - np.arange(1, lags + 1))))
    return float(scipy.special.chdtrc(lags, statistic))


def _runs(residual: np.ndarray) -> float:
    """Return the probability that white noise changes sign as rarely (Wald and Wolfowitz)."""
    if residual.size < 4:
        return 1.0
    up = residual > np.median(residual)
    a, b = int(np.count_nonzero(up)), int(np.count_nonzero(~up))
    if a < 2 or b < 2:
        return 1.0
    runs = 1 + int(np.count_nonzero(up[1:] != up[:-1]))
    mean = 1.0 + 2.0 * a * b / (a + b)
    variance = (mean - 1.0) * (mean - 2.0) / (a + b - 1.0)
    return float(scipy.special.ndtr((runs - mean) / math.sqrt(variance)))


#: How the warning of a rejected fit begins and ends, and that of one without a noise floor.
REJECTED = "the model is rejected"
DIAGNOSE = "; run a diagnosis"
ABOVE = "the residual is above the noise: the model lacks something"


def with_intervals(warning: str) -> str:
    """Return a warning of a fit with what it means for intervals, once there are any."""
    if warning.startswith(REJECTED):
        plain = warning.removesuffix(DIAGNOSE)
        return f"{plain}; the intervals hold only if the model were right{DIAGNOSE}"
    if warning == ABOVE:
        widened = "widened by the residual's size and correlation"
        return f"{warning}, and the intervals ({widened}) are a rough guide"
    return warning
