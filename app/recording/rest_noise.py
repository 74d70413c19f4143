"""Length, rest and noise of the lead-in of a run, where the film hangs at 0 V."""

from __future__ import annotations

import math

import numpy as np

from dearig.model.noise import noise_at_rest

__all__ = ["MIN_QUIET", "NEGLIGIBLE", "lead_in", "mean_beyond_noise", "noise_floor"]

#: Samples that an estimate of the noise needs, at least.
MIN_QUIET = 20

#: Of the largest voltage: the film's force goes with the square, so this moves it a millionth.
NEGLIGIBLE = 1e-3


def lead_in(voltage: np.ndarray, step: float = 0.0) -> int:
    """How many samples of ``voltage`` (N,) V stand at 0 V before the first that does not.

    ``step`` V is what the converter cannot resolve; a measured voltage may lie a thousandth of its
    largest value off 0.
    """
    size = np.abs(voltage)
    if size.size == 0:
        return 0
    loud = size > max(step, NEGLIGIBLE * float(size.max()))
    return int(np.argmax(loud)) if loud.any() else int(size.size)


def noise_floor(time: np.ndarray, values: np.ndarray) -> float | None:
    """Noise of ``values`` (n,) as ``model.records`` reads it at rest; None below 20 samples."""
    return noise_at_rest(time, values) if values.size >= MIN_QUIET else None


def mean_beyond_noise(values: np.ndarray) -> float:
    """Mean of the lead-in ``values`` (n,), or 0 where its noise alone may have made it."""
    n = values.size
    if n < MIN_QUIET:
        return 0.0
    mean = float(values.mean())
    return mean if abs(mean) > 3.0 * float(values.std(ddof=1)) / math.sqrt(n) else 0.0
