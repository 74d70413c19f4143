"""Random sizes of effects."""

from __future__ import annotations

import numpy as np

__all__ = ["either_sign", "log_uniform"]


def log_uniform(generator: np.random.Generator, least: float, most: float) -> float:
    """A number from ``least`` to ``most``, every octave equally likely."""
    return float(least * (most / least) ** generator.random())


def either_sign(generator: np.random.Generator) -> float:
    """-1 or 1."""
    return float(generator.choice((-1.0, 1.0)))
