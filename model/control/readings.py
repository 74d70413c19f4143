"""Mean of readings of which some are wrong."""

from __future__ import annotations

import numpy as np

__all__ = ["mean_without_outliers"]

_OUTLIER = 6.0  # times the median deviation: 4 standard deviations of a normal one


def mean_without_outliers(readings: np.ndarray, least: float) -> float:
    """Return the mean of ``readings`` (n,) without outliers; NaN for none.

    ``least`` is what the spread of the readings is at least, in their unit, such as a step of the
    converter: coarse readings may mostly be the same. Their median would be a whole step, and so
    off by up to half of one.
    """
    if readings.size == 0:
        return float("nan")
    off = np.abs(readings - np.median(readings))
    return float(readings[off <= _OUTLIER * max(float(np.median(off)), least)].mean())
