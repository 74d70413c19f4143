"""Sensor nonlinearity: the reading is a nonlinear function of the position.

``cubic``: A (x/1 mm)^3, from a tilted target on a curved characteristic. ``ripple``: A (sin(2 pi
x/p + phase) - sin(phase)), a periodic error of the sensor's detector. ``soft_clip``: a travel y
beyond x_0 reads y/(1 + y/s), as the spot leaves the detector.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.sampling import either_sign, log_uniform

__all__ = ["cubic", "ripple", "soft_clip"]

_CUBIC = (4e-6, 60e-6)  # m at 1 mm
_RIPPLE = (4e-6, 60e-6)  # m
_PERIOD = (0.25e-3, 1.2e-3)  # m
_CLIP = (6e-6, 350e-6)  # m lost 1 mm beyond the corner
_CORNER = (0.2e-3, 0.6e-3)  # m

_Curve = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def _bent(curve: _Curve, words: str) -> TruthEffect:
    """Return the effect of ``curve``, which maps positions to readings and slopes."""

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:  # noqa: ARG001
        reading, slope = curve(rows[0])
        return np.stack((reading, slope * rows[1])), carry

    return TruthEffect(
        family="sensor_nonlinearity", acts_on="sensor", description=words, on_motion=on_motion
    )


def cubic(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a cubic characteristic."""
    size = either_sign(generator) * log_uniform(generator, *_CUBIC)

    def curve(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u = x * 1e3
        return x + size * u**3, 1.0 + 3e3 * size * u**2

    return _bent(curve, f"the reading has a cubic error of {size * 1e6:.3g} um at 1 mm")


def ripple(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a periodic error."""
    size = log_uniform(generator, *_RIPPLE)
    wave = 2.0 * math.pi / log_uniform(generator, *_PERIOD)
    phase = generator.uniform(0.0, 2.0 * math.pi)

    def curve(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        angle = wave * x + phase
        return (
            x + size * (np.sin(angle) - math.sin(phase)),
            1.0 + size * wave * np.cos(angle),
        )

    text = f"the reading has a periodic error of {size * 1e6:.3g} um with a period of "
    return _bent(curve, text + f"{2e3 * math.pi / wave:.2g} mm")


def soft_clip(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a reading that saturates beyond some travel."""
    lost = log_uniform(generator, *_CLIP)
    corner = log_uniform(generator, *_CORNER)
    scale = 1e-3 * (1e-3 - lost) / lost  # so that 1 mm beyond the corner reads 1 mm - lost

    def curve(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        beyond = np.maximum(x - corner, 0.0)
        return x - beyond + beyond / (1.0 + beyond / scale), 1.0 / (1.0 + beyond / scale) ** 2

    text = f"beyond {corner * 1e3:.2g} mm the reading is too small, "
    return _bent(curve, text + f"by {lost * 1e6:.3g} um after another mm")
