"""Random draws of effect sizes."""

from __future__ import annotations

import numpy as np

__all__ = ["either_sign", "log_uniform"]


def log_uniform(generator: np.random.Generator, least: float, most: float) -> float:
    """Return a number from ``least`` to ``most``, uniform in its logarithm."""
    return float(least * (most / least) ** generator.random())


def either_sign(generator: np.random.Generator) -> float:
    """Return -1 or 1 with equal probability."""
    return float(generator.choice((-1.0, 1.0)))
