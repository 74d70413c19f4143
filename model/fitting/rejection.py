"""Whether a residual is larger or more coloured than the noise at rest: is the model rejected."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import kolmogorov
from scipy.stats import f as f_distribution

from dearig.model.fitting.intervals import correlation_time, is_flat, spectrum_distance

__all__ = ["misfit_p"]

_REST_MIN = 100  # readings at rest: fewer tell neither size nor colour of the noise


def misfit_p(residual: np.ndarray, rest: np.ndarray, *, averaged: bool = False) -> float | None:
    """Return the probability that noise as that at rest leaves such a residual or a worse one.

    Parameters
    ----------
    residual
        Measured less model (N,), in any unit, NaN where a reading must not be used.
    rest
        Readings before the voltage (M,), in the same unit.
    averaged
        Whether the readings are means of conversions: neighbours then share readings of a sensor
        that averages too, and their noise is not white, even where the few at rest seem to be.

    Returns
    -------
    float or None
        None where the readings at rest are too few.

    Notes
    -----
    Two tests, of which the smaller probability counts twice (Bonferroni). Size: the ratio of both
    mean squares is distributed as F, with the degrees of freedom that a variance from correlated
    readings with the kurtosis of those at rest has, 2 n/((k - 1) tau). Colour: the summed
    periodogram against a straight line where single readings at rest are white (Bartlett), else
    against theirs (Kolmogorov and Smirnov). Noise slower than the readings at rest last is not
    known to either: it is taken for a misfit.
    """
    left, still = residual[np.isfinite(residual)], rest[np.isfinite(rest)]
    if still.size < _REST_MIN or left.size < _REST_MIN or np.ptp(still) == 0.0:
        return None
    still = still - still.mean()
    variance = float(np.mean(still**2))
    kurtosis = max(float(np.mean(still**4)) / variance**2, 1.0)
    apart = max(correlation_time(still), 1.0) * max(kurtosis - 1.0, 2.0) / 2.0
    size = f_distribution.sf(
        float(np.mean(left**2)) / variance, left.size / apart, max(still.size / apart - 1.0, 1.0)
    )
    is_white = not averaged and is_flat(still)
    away, lines = spectrum_distance(left, None if is_white else still)
    colour = kolmogorov(away * math.sqrt(lines))
    return float(min(1.0, 2.0 * min(float(size), float(colour))))
