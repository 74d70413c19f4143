"""Spectral density of a signal that is shown on the screen."""

from __future__ import annotations

import numpy as np

__all__ = ["amplitude_density"]

_SEGMENTS = 8  # halves of which overlap: 15 averages, so that the density scatters by a quarter
_LEAST = 64  # samples of a segment; below this, the spectrum has too few frequencies to be read


def amplitude_density(values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequency in Hz and amplitude spectral density, of unit of ``values`` per root Hz.

    ``values`` (n,) are sampled at ``rate`` Hz. Welch's method: Hann windows that overlap by half,
    the mean of each is taken off (Welch, IEEE Trans. Audio Electroacoust. 15, 1967). The integral
    of the squared density over frequency is the variance. Without 64 samples in a row, or with
    gaps, it returns no points. The mean, at 0 Hz, is left out.
    """
    if values.size < _LEAST or not np.isfinite(values).all():
        return np.empty(0), np.empty(0)
    from scipy.signal import welch  # takes a second to import

    # about _SEGMENTS segments of a power of two, which is fast
    size = max(_LEAST, 2 ** int(np.log2(2.0 * values.size / (_SEGMENTS + 1))))
    frequency, power = welch(values, fs=rate, window="hann", nperseg=min(size, values.size))
    return frequency[1:], np.sqrt(power[1:])
