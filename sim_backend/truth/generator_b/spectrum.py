"""Spectra of relaxation times of laws that are given in time."""

from __future__ import annotations

import math

import numpy as np

__all__ = ["asymmetric", "stretched_exponential"]

_TERMS = 20
_TIMES = (1e-5, 60.0)  # of the law's own time
_INSTANTS = (1e-5, 100.0)  # of the law's own time: where it is met
_POINTS = 100
_BROAD_TERMS = 31
_BROAD = (-16.0, 8.0)  # ln(T_i/T) of the fastest and the slowest term


def stretched_exponential(exponent: float) -> tuple[np.ndarray, np.ndarray]:
    """Return weights (m,) that add up to 1, and times (m,), of exp(-t^exponent).

    The weights are the non-negative least-squares solution on a logarithmic grid of times; the sum
    of their exponentials is within 0.01 of the law. Terms without weight are left out.
    """
    times = np.geomspace(*_TIMES, _TERMS)
    instants = np.geomspace(*_INSTANTS, _POINTS)
    # takes half a second to import, and few truths need it
    from scipy.optimize import nnls

    weights, _ = nnls(np.exp(-instants[:, None] / times), np.exp(-(instants**exponent)))
    weights /= weights.sum()
    kept = weights > 0.0
    return weights[kept], times[kept]


def asymmetric(a: float, b: float) -> tuple[np.ndarray, np.ndarray]:
    """Return weights (m,) that add up to 1, and times (m,), of 1/(1 + (i w)^a)^b.

    The density over ln T is Havriliak and Negami's (Polymer 8, 1967).
    """
    y = np.linspace(*_BROAD, _BROAD_TERMS)
    power = np.exp(a * y)
    angle = np.arctan2(math.sin(math.pi * a), power + math.cos(math.pi * a))
    size = (power**2 + 2.0 * power * math.cos(math.pi * a) + 1.0) ** (-0.5 * b)
    density = power**b * np.sin(b * angle) * size
    return density / density.sum(), np.exp(y)
