"""Sensor lag: the controller filters more than the rig file states.

``moving_average``: the mean of the position over a window. ``low_pass``: two equal first-order lags
in series, the controller's low-pass filter.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth import kernels as loops
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.plumbing import looking_back
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["low_pass", "moving_average"]

_LEAST, _MOST = 3.5e-3, 120e-3  # s, mean age of a reading


def moving_average(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a window of equal weights."""
    window = 2.0 * log_uniform(generator, _LEAST, _MOST)

    return TruthEffect(
        family="sensor_lag",
        acts_on="sensor",
        description=f"the reading is the mean over the last {window * 1e3:.3g} ms",
        on_motion=looking_back(window, loops.moving_average),
    )


def low_pass(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw two lags in series."""
    tau = 0.5 * log_uniform(generator, _LEAST, _MOST)

    def on_motion(time: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        before, lags = (
            (rows[0, 0], np.full(2, rows[0, 0]))
            if carry is None
            else cast(tuple[float, np.ndarray], carry)
        )
        last = float(rows[0, -1])
        rows[0, 0] = before
        lags = lags.copy()
        loops.low_pass(time, rows, tau, lags)
        return rows, (last, lags)

    return TruthEffect(
        family="sensor_lag",
        acts_on="sensor",
        description=f"the reading passes two lags of {tau * 1e3:.3g} ms each",
        on_motion=on_motion,
    )
