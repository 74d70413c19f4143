"""Sensor drift: the reading changes although the film does not move.

``root``: A (sqrt(1 + t/t_0) - 1) over its value after 25 s, a sensor head that settles.
``wander``: five slow cosines with random phases, as of an optical bench that moves with the
building. It differs in each run and cannot be predicted from earlier records.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.sampling import either_sign, log_uniform

__all__ = ["root", "wander"]

_ROOT = (6e-6, 250e-6)  # m after 25 s
_WANDER = (5e-6, 200e-6)  # m, RMS in the long run
_SLOWEST, _FASTEST = 0.01, 0.06  # Hz


def root(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a drift that slows down."""
    size = either_sign(generator) * log_uniform(generator, *_ROOT)
    time = log_uniform(generator, 0.5, 8.0)
    scale = size / (math.sqrt(1.0 + 25.0 / time) - 1.0)

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        grown = np.sqrt(1.0 + t / time)
        rows[0] += scale * (grown - 1.0)
        rows[1] += 0.5 * scale / time / grown
        return rows, carry

    return TruthEffect(
        family="drift",
        acts_on="sensor",
        description=(
            f"the reading drifts by {size * 1e6:.3g} um in 25 s, by the root of time after "
            f"{time:.2g} s"
        ),
        on_motion=on_motion,
    )


def wander(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a smooth random drift, a different one in each run."""
    return _walk(log_uniform(generator, *_WANDER), generator)


def _walk(size: float, generator: np.random.Generator) -> TruthEffect:
    omegas = 2.0 * math.pi * np.geomspace(_SLOWEST, _FASTEST, 5) * generator.uniform(0.85, 1.15, 5)
    phases = generator.uniform(0.0, 2.0 * math.pi, 5)
    amplitudes = 1.0 / omegas
    amplitudes *= size * math.sqrt(2.0) / math.sqrt(float(np.sum(amplitudes**2)))

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        for omega, phase, amplitude in zip(omegas, phases, amplitudes, strict=True):
            rows[0] += amplitude * (np.cos(omega * t + phase) - math.cos(phase))
            rows[1] -= amplitude * omega * np.sin(omega * t + phase)
        return rows, carry

    return TruthEffect(
        family="drift",
        acts_on="sensor",
        description=f"the reading wanders by {size * 1e6:.3g} um RMS between 10 and 60 mHz",
        on_motion=on_motion,
        redrawn=lambda generator: _walk(size, generator),
    )
