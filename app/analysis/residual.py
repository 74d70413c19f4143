"""Correlations, quantiles and spectrum of a residual, which distinguish it from noise."""

from __future__ import annotations

import numpy as np

__all__ = ["autocorrelation", "cross_correlation", "even", "quantiles", "spectrum"]

_SAMPLES_MAX = 2**20  # a longer transform is slower and shows nothing more


def even(time: np.ndarray, residual: np.ndarray) -> tuple[float, np.ndarray]:
    """Return ``(step, residual)`` on an even grid, interpolated where the sampling is uneven."""
    span = float(time[-1] - time[0])
    step = span / (time.size - 1)
    if time.size <= _SAMPLES_MAX and np.allclose(np.diff(time), step, rtol=1e-2, atol=0.0):
        return step, residual
    count = min(time.size, _SAMPLES_MAX)
    grid = np.linspace(time[0], time[-1], count)
    return span / (count - 1), np.interp(grid, time, residual)


def autocorrelation(step: float, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``(lag, correlation)`` (K,) for lags in s from one sample to a quarter of the record.

    The mean is not removed: a residual with an offset is correlated with itself.
    """
    n = residual.size
    transform = np.fft.rfft(residual, 2 * n)
    product = np.fft.irfft(np.abs(transform) ** 2, 2 * n)[: max(n // 4, 1) + 1]
    product /= product[0] if product[0] > 0.0 else 1.0
    return step * np.arange(1, product.size), product[1:]


def cross_correlation(
    step: float, drive: np.ndarray, residual: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return ``(lag, correlation)`` (K,) of ``residual`` with ``drive``, both without their means.

    Lags in s are up to a tenth of the record on both sides; at a positive lag the residual is later
    than the drive. A model that lacks nothing of the response to the drive leaves no correlation.
    """
    n = residual.size
    centred = [values - float(values.mean()) for values in (drive, residual)]
    size = float(np.linalg.norm(centred[0]) * np.linalg.norm(centred[1]))
    ahead, behind = (np.fft.rfft(values, 2 * n) for values in centred)
    product = np.fft.irfft(np.conj(ahead) * behind, 2 * n) / (size or 1.0)
    reach = max(n // 10, 1)
    lag = np.arange(-reach, reach + 1)
    return step * lag, product[lag]  # negative lags are at the end


def quantiles(residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return quantiles of the normal distribution and those of ``residual``, at most 501.

    Plotting positions are (k - 0.5) / n (Hazen, 1914).
    """
    from scipy.special import ndtri

    ordered = np.sort(residual)
    n = ordered.size
    # evenly in the normal quantile: both tails are seen, whatever the number of samples
    ends = float(ndtri(0.5 / n))
    normal = np.linspace(ends, -ends, min(n, 501))
    place = n * 0.5 * (1.0 + _erf(normal / np.sqrt(2.0))) - 0.5
    return normal, np.interp(place, np.arange(n), ordered)


def _erf(x: np.ndarray) -> np.ndarray:
    from scipy.special import erf

    return np.asarray(erf(x))


def spectrum(step: float, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``(frequency, density)`` (K,): one-sided amplitude density per root Hz (Welch).

    White noise of standard deviation s has the density s sqrt(2 step) at every frequency.
    """
    from scipy.signal import welch

    segment = min(residual.size, max(256, residual.size // 4))
    frequency, power = welch(residual, fs=1.0 / step, nperseg=segment, detrend=False)
    return frequency[1:], np.sqrt(power[1:])
