"""Zero-phase low-pass filters and deconvolution of rows of samples."""

from __future__ import annotations

import math

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

__all__ = ["low_pass", "padded_length", "pass_band"]


def padded_length(samples: int) -> int:
    """Return a length for transforms of ``samples`` that keeps their ends apart."""
    return int(scipy.fft.next_fast_len(2 * samples, real=True))


def pass_band(frequency: np.ndarray, edge: float) -> np.ndarray:
    """Return the gain at each ``frequency`` in Hz: 1 up to ``edge``, 0 from twice that on.

    Between them it is half a period of a cosine. ``edge`` of 0 passes nothing.
    """
    if edge <= 0.0:
        return np.zeros(frequency.size)
    part = np.clip(frequency / edge - 1.0, 0.0, 1.0)
    return 0.5 * (1.0 + np.cos(math.pi * part))


def low_pass(values: np.ndarray, rate: float, edge: float) -> np.ndarray:
    """Return ``values`` (N,) at ``rate`` Hz with what is faster than ``edge`` Hz taken off.

    The filter has no phase: it is ``pass_band``. Beyond the ends the row is mirrored.
    """
    n = values.size
    mirrored = np.concatenate([values, values[::-1]])
    spectrum = np.fft.rfft(mirrored) * pass_band(np.fft.rfftfreq(2 * n, 1.0 / rate), edge)
    return np.fft.irfft(spectrum, 2 * n)[:n]
