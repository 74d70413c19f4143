"""Length, rest and noise of the lead-in of a run, where the film hangs at 0 V."""

from __future__ import annotations

import math

import numpy as np

from dearig.model.noise import noise_at_rest

__all__ = ["MIN_QUIET", "NEGLIGIBLE", "lead_in", "mean_beyond_noise", "noise_floor"]

#: Least number of samples for an estimate of the noise.
MIN_QUIET = 20

#: Part of the largest voltage that counts as 0: the force goes with the square, a millionth.
NEGLIGIBLE = 1e-3


def lead_in(voltage: np.ndarray, step: float = 0.0) -> int:
    """Count the samples of ``voltage`` (N,) V at 0 V before the first one that is not.

    ``step`` V is the resolution of the converter; a measured voltage may differ from 0 by a
    thousandth of its largest value.
    """
    size = np.abs(voltage)
    if size.size == 0:
        return 0
    loud = size > max(step, NEGLIGIBLE * float(size.max()))
    return int(np.argmax(loud)) if loud.any() else int(size.size)


def noise_floor(time: np.ndarray, values: np.ndarray) -> float | None:
    """Return the noise of ``values`` (n,) by ``noise_at_rest``; None below 20 samples."""
    return noise_at_rest(time, values) if values.size >= MIN_QUIET else None


def mean_beyond_noise(values: np.ndarray) -> float:
    """Return the mean of the lead-in ``values`` (n,), or 0 if noise alone could explain it."""
    n = values.size
    if n < MIN_QUIET:
        return 0.0
    mean = float(values.mean())
    return mean if abs(mean) > 3.0 * float(values.std(ddof=1)) / math.sqrt(n) else 0.0
