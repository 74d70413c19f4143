"""Elements side by side that yield: the sum of stops of Prandtl and Ishlinskii.

Element i is a spring that yields at ``c[k + i]`` Pa beyond a threshold of stretch. The thresholds
are a geometric series of some ``ratio`` up to ``c[k + count]``, and ``m[j + i]`` is the element's
stretch at the last step (Visintin, Differential Models of Hysteresis, 1994).
"""

from __future__ import annotations

import numpy as np

from dearig.model.compiled.jit import jit

__all__ = ["carry", "pull", "slope"]


@jit
def pull(
    c: np.ndarray, k: int, m: np.ndarray, j: int, travel: float, count: int, ratio: float
) -> float:
    """Return the stress in Pa after a ``travel`` since the last step."""
    total, threshold = 0.0, c[k + count]
    for i in range(count - 1, -1, -1):
        if c[k + i] > 0.0:
            strain = min(max(m[j + i] + travel, -threshold), threshold)
            total += c[k + i] * strain / threshold
        threshold /= ratio
    return total


@jit
def slope(c: np.ndarray, k: int, count: int, ratio: float) -> float:
    """Return the largest derivative of the stress by the stretch, in Pa."""
    total, threshold = 0.0, c[k + count]
    for i in range(count - 1, -1, -1):
        total += c[k + i] / threshold
        threshold /= ratio
    return total


@jit
def carry(
    c: np.ndarray, k: int, m: np.ndarray, j: int, travel: float, count: int, ratio: float
) -> None:
    """Move the elements by ``travel``."""
    threshold = c[k + count]
    for i in range(count - 1, -1, -1):
        m[j + i] = min(max(m[j + i] + travel, -threshold), threshold)
        threshold /= ratio
