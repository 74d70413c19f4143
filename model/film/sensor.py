"""Readings of a sensor at other times than those of the film's motion."""

from __future__ import annotations

import numpy as np

from dearig.model.compiled.jit import jit

__all__ = ["at_sensor"]


@jit
def at_sensor(
    time: np.ndarray,
    value: np.ndarray,
    rate: np.ndarray,
    at: np.ndarray,
    shown: np.ndarray,
    shown_rate: np.ndarray,
) -> None:
    """``value`` (N,) and its ``rate`` at the times ``at`` (M,), which increase: cubic Hermite.

    Into ``shown`` and ``shown_rate`` (M,). A sensor with a lag reads an earlier position.
    """
    last = time.shape[0] - 1
    j = 0
    for k in range(at.shape[0]):
        t = at[k]
        if not t > time[0]:
            shown[k], shown_rate[k] = value[0], 0.0  # before the record, or at no time: at rest
            continue
        if t >= time[last]:
            shown[k] = value[last] + rate[last] * (t - time[last])
            shown_rate[k] = rate[last]
            continue
        while time[j + 1] < t:
            j += 1
        if t == time[j + 1]:
            shown[k], shown_rate[k] = value[j + 1], rate[j + 1]
            continue
        h = time[j + 1] - time[j]
        s = (t - time[j]) / h
        r = 1.0 - s
        shown[k] = (
            value[j] * (1.0 + 2.0 * s) * r * r
            + value[j + 1] * (3.0 - 2.0 * s) * s * s
            + h * (rate[j] * s * r * r - rate[j + 1] * s * s * r)
        )
        shown_rate[k] = (
            6.0 * s * r * (value[j + 1] - value[j]) / h
            + r * (1.0 - 3.0 * s) * rate[j]
            + s * (3.0 * s - 2.0) * rate[j + 1]
        )
