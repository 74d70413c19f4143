"""Remove the noise of a voltage that was read back, and keep its edges.

The film under its load rings at some 70 Hz with hardly any damping, so a few volts of noise on the
drive become a micrometre of simulated displacement. The smoothest voltage that agrees with the
readings is used instead (Lepski's rule): at each sample a parabola over the widest window around it
that the readings follow within their noise.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

__all__ = ["reading_noise", "smoothed"]

_WINDOWS = (81, 41, 21, 11, 7)  # samples
_AGREES = 1.25  # local RMS of the removed part, over the noise
_QUIET_MIN = 20  # samples


def reading_noise(voltage: np.ndarray) -> float:
    """Return the noise in V of readings (N,) that begin at rest; 0 where they begin without any.

    It is read from the start to the last sample before the voltage leaves its initial value.
    """
    start = voltage[:_QUIET_MIN]
    if start.size < _QUIET_MIN:
        return 0.0
    noise = float(np.std(start, ddof=1))
    if noise == 0.0 or noise > 0.02 * float(np.ptp(voltage)):
        return 0.0
    left = np.flatnonzero(np.abs(voltage - start.mean()) > 6.0 * noise)
    quiet = voltage[: left[0]] if left.size else voltage
    return float(np.std(quiet, ddof=1)) if quiet.size >= _QUIET_MIN else noise


def smoothed(voltage: np.ndarray, noise: float) -> np.ndarray:
    """Return ``voltage`` (N,) V without the ``noise`` V of its readings; edges are kept."""
    from scipy.signal import savgol_filter  # takes a second to import; few recordings need it

    out = voltage.copy()
    open_ = np.ones(voltage.size, dtype=bool)
    for window in _WINDOWS:
        if window >= voltage.size:
            continue
        smooth = savgol_filter(voltage, window, 2, mode="interp")
        away = voltage - smooth
        # about the window, so that an edge next to it is not smoothed over either
        # (a running sum, which rounding may leave just below 0)
        square = uniform_filter1d(away**2, window, mode="nearest")
        local = np.sqrt(np.maximum(square, 0.0))
        good = open_ & (local < _AGREES * noise) & (np.abs(away) < 4.5 * noise)
        out[good] = smooth[good]
        open_ &= ~good
    return out
