"""Errors of a model against a measurement: as the thesis prints them, and normalised."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

__all__ = ["Errors", "errors", "root_mean_square"]


@dataclass(frozen=True)
class Errors:
    """Errors of one record, in the unit of the measured quantity (m or Pa), or in per cent.

    ``rms`` root mean square, ``nrmse_pct`` the same over the measured range, ``max`` the largest
    magnitude, ``peak_pct`` the RMS over the largest measured magnitude. ``e_rms_thesis_pct`` and
    ``e_m_thesis_pct`` are the thesis's eq. 50 as printed: the RMS in the displacement's own unit
    (taken as mm) times 100, and the largest error over the *model's* range.
    """

    rms: float
    nrmse_pct: float
    max: float
    peak_pct: float
    e_rms_thesis_pct: float
    e_m_thesis_pct: float
    samples: int


def root_mean_square(values: np.ndarray) -> float:
    """Return the root of the mean square of ``values``, in their unit; NaN where there are none."""
    return math.sqrt(float(np.mean(values**2))) if values.size else math.nan


def errors(measured: np.ndarray, model: np.ndarray) -> Errors:
    """Errors of ``model`` (N,) against ``measured`` (N,), both in m (or both in Pa).

    A range of zero gives infinite percentages, not an exception. Eq. 50's unit reading (mm) has a
    meaning for displacements only.
    """
    difference = np.asarray(measured, dtype=np.float64) - np.asarray(model, dtype=np.float64)
    size = root_mean_square(difference)
    largest = float(np.max(np.abs(difference)))

    def per_cent(value: float, of: float) -> float:
        if of > 0.0:
            return 100.0 * value / of
        return 0.0 if value == 0.0 else float("inf")

    return Errors(
        rms=size,
        nrmse_pct=per_cent(size, float(np.ptp(measured))),
        max=largest,
        peak_pct=per_cent(size, float(np.max(np.abs(measured)))),
        e_rms_thesis_pct=size * 1e3 * 100.0,
        e_m_thesis_pct=per_cent(largest, float(np.ptp(model))),
        samples=difference.size,
    )
