"""Readings of a sensor that is late by a known time."""

from __future__ import annotations

import numpy as np

from model.jit import allocating

__all__ = ["at_sensor"]


@allocating
def at_sensor(
    time: np.ndarray, value: np.ndarray, rate: np.ndarray, lag: float, out: np.ndarray
) -> None:
    """``value`` (N,) as a sensor shows it that is ``lag`` s late, into ``out``: cubic Hermite.

    ``rate`` (N,) becomes that of the delayed value.
    """
    last = time.shape[0] - 1
    if lag == 0.0:
        out[:] = value
        return
    late = np.empty_like(rate)
    j = 0
    for k in range(last + 1):
        t = time[k] - lag
        if t <= time[0]:
            out[k], late[k] = value[0], 0.0  # before the record the film was at rest
            continue
        if t >= time[last]:
            out[k] = value[last] + rate[last] * (t - time[last])
            late[k] = rate[last]
            continue
        while time[j + 1] < t:
            j += 1
        h = time[j + 1] - time[j]
        s = (t - time[j]) / h
        r = 1.0 - s
        out[k] = (
            value[j] * (1.0 + 2.0 * s) * r * r
            + value[j + 1] * (3.0 - 2.0 * s) * s * s
            + h * (rate[j] * s * r * r - rate[j + 1] * s * s * r)
        )
        late[k] = (
            6.0 * s * r * (value[j + 1] - value[j]) / h
            + r * (1.0 - 3.0 * s) * rate[j]
            + s * (3.0 * s - 2.0) * rate[j + 1]
        )
    rate[:] = late
